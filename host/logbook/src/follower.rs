//! Follows a machine by the lines of its log: settings in use, answered commands, and the distance that it has rolled.
//!
//! [`Follower::take`] gets the lines in order and returns what each means. Settings follow from the lines that show
//! them, and from commands that the machine has carried out, as the firmware does it (`control::operate`). After
//! `revert` the values may be missing from the log: they are then unknown until the machine shows them.
//!
//! Distances are millimetres by the wheel since the first position of a stretch. A stretch ends with the link, where the
//! position jumps, and where the wheel is unknown. With another wheel the distance goes on.

use crate::log::{Entry, Kind};
use control::say::command::{Action, Command};
use link::session::HOLD;
use link::settings::{Setting, Settings, shown};
use link::{ConsoleLine, EventLine, Status};
use std::collections::VecDeque;
use std::f64::consts::PI;

/// The longest distance between two statuses in ticks, some hundred metres.
const LONGEST_TICKS: u32 = 1_000_000;

/// A longer time without a status of the wheel is a gap, in ms. Statuses come ten times a second.
pub const WHEEL_GAP_MS: f64 = 2000.0;

/// The wheel stands while it rolls less than this, in metres.
pub const STANDING_M: f64 = 0.005;

/// No machine rolls faster, in metres per second.
pub const FASTEST_M_S: f64 = 5.0;

/// A machine rolls at most this far between two statuses, in metres, and by [`FASTEST_M_S`]. The clocks of some computers stand
/// still during their sleep.
const AWAKE_M: f64 = 1.0;

/// Whether the wheel has rolled this far between two statuses, and it is not known when. The work there is unknown.
pub fn is_gap(time_ms: f64, rolled_m: f64) -> bool {
    let rolled_m = rolled_m.abs();
    let has_slept = rolled_m > AWAKE_M + FASTEST_M_S * time_ms / 1000.0;
    has_slept || (time_ms > WHEEL_GAP_MS && rolled_m > STANDING_M)
}

/// Millimetres in a tick of the encoder.
pub fn tick_mm(settings: &Settings) -> f64 {
    let value = |setting| f64::from(settings.get(setting));
    match value(Setting::TicksPerM) {
        0.0 => PI * value(Setting::WheelMm) / value(Setting::TicksPerRev).max(1.0),
        ticks_per_m => 1000.0 / ticks_per_m,
    }
}

/// The settings in use, as far as the machine has shown them.
#[derive(Clone, Debug)]
pub struct InUse {
    settings: Settings,
    unknown: Vec<Setting>,
    /// The saved settings, if they are known.
    saved: Option<Settings>,
}

impl Default for InUse {
    /// Nothing is known.
    fn default() -> Self {
        Self { settings: Settings::new(), unknown: Setting::all().collect(), saved: None }
    }
}

impl InUse {
    /// The settings of a new machine.
    pub fn factory() -> Self {
        Self { unknown: Vec::new(), ..Self::default() }
    }

    /// Whether all values are known.
    pub fn is_known(&self) -> bool {
        self.unknown.is_empty()
    }

    /// The settings. Unknown ones have their last or their default value.
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Whether the values of these are known.
    pub fn knows(&self, settings: &[Setting]) -> bool {
        !self.unknown.iter().any(|unknown| settings.contains(unknown))
    }

    /// The values are no longer known.
    pub fn forget(&mut self) {
        self.unknown = Setting::all().collect();
    }

    /// Takes a line of the machine. Returns false if it shows no setting, or a value that this version does not accept:
    /// that setting is unknown then.
    pub fn show(&mut self, line: &str) -> bool {
        shown(line).is_some_and(|(setting, value)| {
            let is_taken = self.settings.set(setting, value).is_ok();
            self.know(setting, is_taken);
            is_taken
        })
    }

    fn know(&mut self, setting: Setting, is_known: bool) {
        self.unknown.retain(|&unknown| unknown != setting);
        self.unknown.extend((!is_known).then_some(setting));
    }

    /// Takes a command whose answer is missing.
    fn doubt(&mut self, line: &str) {
        match link::command(line) {
            Ok(Command { action: Action::Set, setting, .. }) => {
                self.know(setting, false);
                if setting.is_of_the_wheel() {
                    self.know(Setting::TicksPerM, false);
                }
            }
            Ok(Command { action: Action::Defaults | Action::Revert, .. }) => self.forget(),
            _ => {}
        }
    }

    /// Takes a command that the machine has carried out.
    pub fn carry_out(&mut self, &Command { action, setting, number, .. }: &Command) {
        match action {
            Action::Set => {
                let is_taken = self.settings.change(setting, number).is_ok();
                self.know(setting, is_taken);
                if setting.is_of_the_wheel() {
                    self.know(Setting::TicksPerM, is_taken);
                }
            }
            Action::Save => self.saved = self.is_known().then(|| self.settings.clone()),
            Action::Defaults => (self.settings, self.unknown) = (Settings::new(), Vec::new()),
            Action::Revert => match &self.saved {
                Some(saved) => (self.settings, self.unknown) = (saved.clone(), Vec::new()),
                None => self.forget(),
            },
            _ => {}
        }
    }
}

/// The distance by the encoder's count, which may wrap.
#[derive(Clone, Copy, Debug, Default)]
pub struct Distance {
    /// The last count, and the distance in mm.
    last: Option<(i32, f64)>,
}

impl Distance {
    /// The distance at a count near the last one, in mm. `None` before the first count.
    pub fn at(&self, count: i32, tick_mm: f64) -> Option<f64> {
        self.last.map(|(last, mm)| mm + f64::from(count.wrapping_sub(last)) * tick_mm)
    }

    /// Takes the next count. Returns false if the distance begins again at 0: it is the first, or too far from the last.
    pub fn take(&mut self, count: i32, tick_mm: f64) -> bool {
        let is_near = |last: i32| count.wrapping_sub(last).unsigned_abs() <= LONGEST_TICKS;
        let goes_on = self.last.is_some_and(|(last, _)| is_near(last));
        self.last = Some((count, self.at(count, tick_mm).filter(|_| goes_on).unwrap_or(0.0)));
        goes_on
    }
}

/// What a line means.
#[derive(Clone, Debug)]
pub enum Followed {
    /// The link begins or ends. Unanswered commands and the distance are lost.
    Linked,
    /// A status, and whether the distance goes on from the one before.
    Status(Status, bool),
    /// An event.
    Event(EventLine),
    /// A command was answered: its line, and whether the machine has carried it out.
    Answered(Entry, bool),
    /// Another line.
    Other,
    /// A line of the machine that this version cannot read.
    Unread,
}

impl Followed {
    /// Whether it is a line of the machine that this version cannot read: damaged, or of another firmware.
    pub fn is_unread(&self) -> bool {
        matches!(self, Self::Unread | Self::Event(EventLine::Newer { .. }))
    }
}

/// The number of such lines in a log.
pub fn unread(log: &[Entry]) -> usize {
    let mut follower = Follower::default();
    log.iter().filter(|entry| follower.take(entry).is_unread()).count()
}

fn position(event: &EventLine) -> Option<i32> {
    match *event {
        EventLine::Detection { position, .. }
        | EventLine::Guarded { position }
        | EventLine::Swing { position, .. }
        | EventLine::Alarm { position, .. } => Some(position),
        _ => None,
    }
}

/// Follows a machine, see the module's words.
#[derive(Clone, Debug, Default)]
pub struct Follower {
    in_use: InUse,
    /// Commands without an answer so far.
    unanswered: VecDeque<Entry>,
    distance: Distance,
}

impl Follower {
    /// Takes the next line of the log.
    pub fn take(&mut self, entry: &Entry) -> Followed {
        let followed = match entry.kind {
            Kind::Connected | Kind::Lost => {
                (self.unanswered, self.distance) = (VecDeque::new(), Distance::default());
                if entry.kind == Kind::Connected {
                    // The settings follow. A log of an earlier version lacks those that came later, but has the wheel.
                    self.in_use = InUse::factory();
                    self.in_use.unknown.extend(Setting::all().filter(|setting| setting.is_of_the_wheel()));
                }
                Followed::Linked
            }
            Kind::Setting if self.in_use.show(&entry.text) => Followed::Other,
            Kind::Setting => Followed::Unread,
            Kind::Status => Status::parse(&entry.text).map_or(Followed::Unread, |status| {
                let goes_on = self.knows_wheel() && self.distance.take(status.position, self.tick_mm());
                Followed::Status(status, goes_on)
            }),
            Kind::Event => EventLine::parse(&entry.text).map_or(Followed::Unread, |event| {
                // A stretch may begin with an event.
                if let (Some(position), None) = (position(&event), self.distance.last) {
                    self.distance.take(position, self.tick_mm());
                }
                Followed::Event(event)
            }),
            Kind::Command => {
                if entry.text != HOLD {
                    // It is typed after the answers before it: this log lacks them.
                    self.unanswered.drain(..).for_each(|lost| self.in_use.doubt(&lost.text));
                }
                self.unanswered.push_back(entry.clone());
                Followed::Other
            }
            Kind::Answer => match ConsoleLine::parse(&entry.text) {
                ConsoleLine::End { error } => match self.unanswered.pop_front() {
                    Some(command) => {
                        if let (None, Ok(command)) = (&error, link::command(&command.text)) {
                            self.in_use.carry_out(&command);
                        }
                        Followed::Answered(command, error.is_none())
                    }
                    None => Followed::Other,
                },
                _ => {
                    self.in_use.show(&entry.text);
                    Followed::Other
                }
            },
            _ => Followed::Other,
        };
        if !self.knows_wheel() {
            self.distance = Distance::default();
        }
        followed
    }

    /// The settings in use.
    pub fn in_use(&self) -> &InUse {
        &self.in_use
    }

    /// Whether the wheel's distance is known.
    pub fn knows_wheel(&self) -> bool {
        let is_calibrated = self.in_use.settings().get(Setting::TicksPerM) > 0;
        let nominal = [Setting::TicksPerRev, Setting::WheelMm];
        self.in_use.knows(&[Setting::TicksPerM]) && (is_calibrated || self.in_use.knows(&nominal))
    }

    /// Millimetres in a tick.
    pub fn tick_mm(&self) -> f64 {
        tick_mm(self.in_use.settings())
    }

    /// The distance at a position near the last status, in mm. `None` if it is unknown.
    pub fn mm(&self, position: i32) -> Option<f64> {
        self.distance.at(position, self.tick_mm())
    }

    /// The width in mm of a detection whose tool stays out for `hold` ticks: a margin lies at either edge.
    pub fn width_mm(&self, hold: i32) -> f64 {
        let margin_mm = f64::from(self.in_use.settings().get(Setting::MarginMm));
        (f64::from(hold) * self.tick_mm() - 2.0 * margin_mm).max(0.0)
    }
}
