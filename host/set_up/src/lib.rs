//! Setting up a machine: the steps of the manual's page, the next measurement, and the least margin.
//!
//! [`SetUp`] reads the lines of a session, live or afterwards. It counts the measurements and returns the next
//! [`Step`]: to measure once more, to set the worst measured lead, or to set the least margin. It begins with the first
//! `calibrate`, so it asks for nothing on a machine that is already set up. It sets nothing itself.
//!
//! Around whole canopies the leads are the worst measured times. The margin is a sum of three parts. The first is the
//! scatter of slip over the distance from the last detection of the plant to the tool. The second is the distance
//! travelled in the servo's scatter, at the paper's fastest speed. The third is the firmware's own worst error.
//!
//! Beside a stem zone the leads are shorter by what the zone's [`circle`] allows at the highest speed, and by the servo's
//! scatter. The margin pays for that scatter. It is calculated for 1 km/h, where speed gives no slack, and has a fourth
//! part: stems stand beyond the zone's middle. For a trailing arm it has a further part, what the arm carries the tool
//! along the row. For a blade with a length along the row, half of that length is a part.
//!
//! The margin covers only measured values: if one is missing there is no sum, and the default margin stays. A few measurements do not show the
//! worst case, so each scatter has a least value. Times that were measured over another stroke or gap do not count.

pub mod circle;
mod leads;
mod margin;
mod next_step;
mod steps;

pub use self::leads::saved_ms;
pub use self::margin::Margin;
pub use self::next_step::Step;
pub use self::steps::{ManualStep, Task, steps};

use self::circle::Arm;
use self::leads::{TimedServo, by_eye, extremes, leads, travel_ms};

use control::say::command::{Action, Command};
use control::settings::{Setting, Settings};
use link::EventLine;
use link::session::Happening;
use link::settings::shown;
use std::collections::VecDeque;

/// Required timings of the servo, each with six swings out and six in.
const TIMINGS: usize = 2;

/// The newest plants that count for the scatter of slip, as measured by a second beam.
const PLANTS: usize = 12;

/// The servo's least scatter, in milliseconds. By eye it is two frames of a phone's slow motion, and as much for the
/// servo. By an end switch, twelve swings out miss up to 12 ms of the default servo's slowest swing, and the pulse on the
/// line adds 2.
const SERVO_MS: u16 = 15;

/// The least scatter of a wheel's slip within some metres, as a share. Stretches of 10 m average it out. Assumed as for
/// the simulated field (`ground.slip_scatter_percent`).
const SLIP: f64 = 0.03;

/// The paper's fastest speed, 2.5 km/h.
const SPEED_M_S: f64 = 2.5 / 3.6;

/// The firmware's own worst error of a swing, in millimetres: measured by `weeder bench-uno`, rounded up.
const FIRMWARE_MM: f64 = 5.0;

/// Beside a stem zone the margin is calculated for this speed, 1 km/h.
const SLOW_M_S: f64 = 1.0 / 3.6;

/// How far a stem's protected ground reaches beyond its zone, as a share of the stem's distance from the middle of its
/// canopy. The zone has room for half of the distance on each side, so the other half is left. Hardly any stem stands at the
/// full distance. In the field `walked` no plant is damaged with this share (below 0.014 %), and 0.03 % where stems stand 40
/// or 50 mm off: `weeder trial --field FILE --speeds 1 --spacings 50,60 --replications 100`.
const STEM_REACH: f64 = 0.484;

/// The least of these distances that is assumed, as a share of the zone: 20 of 110 mm in the field `walked`.
const STEM_OFF: f64 = 2.0 / 11.0;

/// How far the protected ground of stems that stand up to this far off their canopies' middle, mm, reaches beyond the
/// zone, mm: as much as the margin has to cover.
fn stems_mm(stem_off_mm: f64) -> f64 {
    STEM_REACH * stem_off_mm
}

/// What blade and stems may need, mm, for which the default margin is enough: half of the paper's blade of 45 mm, and the stems
/// of the field `walked`.
const BLADE_IN_DEFAULT_MM: f64 = 23.0;
const STEMS_IN_DEFAULT_MM: f64 = 10.0;

/// How much wider than the default the margin has to be for a blade of this length along the row, mm; 0 if the default is enough.
pub fn blade_excess_mm(blade_length_mm: f64) -> f64 {
    (blade_length_mm / 2.0 - BLADE_IN_DEFAULT_MM).max(0.0).ceil()
}

/// The same for stems up to this far off the middle of their canopies, mm, beside a stem zone.
pub fn stem_excess_mm(stem_off_mm: f64) -> f64 {
    (stems_mm(stem_off_mm) - STEMS_IN_DEFAULT_MM).max(0.0).ceil()
}

/// What to do if the servo's times need too great a margin.
pub const SEE_TO_SERVO: &str = "see to the servo, its times differ too much";

/// The measurements of a machine in a session.
#[derive(Clone, Debug, Default)]
pub struct SetUp {
    /// Whether the line that is being answered measures the wheel.
    measures_the_wheel: bool,
    /// Whether the margin was set in this session.
    sets_margin: bool,
    /// The width of a tool on a trailing arm, mm. `None` for a pendulum.
    pub trailing_tool_mm: Option<u16>,
    /// How far a stem may stand off the middle of its canopy, mm; 0 if it is not known.
    pub stem_off_mm: f64,
    /// The arm, which swings the tool aside.
    pub arm: Arm,
    /// The settings in use, as far as the session shows them.
    pub settings: Settings,
    timings: Vec<TimedServo>,
    /// The measurements of the wheel.
    pub ticks_per_m: Vec<u16>,
    slip_permille: VecDeque<i32>,
}

/// The settings over which a timing counts: the pulse widths of the stroke, and the gap that a command waits for.
const OVER: [Setting; 3] = [Setting::ServoInUs, Setting::ServoOutUs, Setting::ServoGapMs];

/// The leads, out and in.
const LEADS: [Setting; 2] = [Setting::LeadOutMs, Setting::LeadInMs];

/// The values of [`OVER`].
fn over(settings: &Settings) -> [u16; 3] {
    OVER.map(|setting| settings.get(setting))
}

/// The length of the stroke, as a pulse width.
fn stroke_us(settings: &Settings) -> u16 {
    let [in_us, out_us, _] = over(settings);
    in_us.abs_diff(out_us)
}

impl SetUp {
    /// Required measurements of the wheel. Few stretches do not show the slip.
    pub const STRETCHES: usize = 3;

    /// Reads the lines of a session. Typed lines begin with `> `.
    pub fn of_lines<'a>(lines: impl IntoIterator<Item = &'a str>) -> Self {
        let mut set_up = Self::default();
        lines.into_iter().for_each(|line| set_up.take_line(line));
        set_up
    }

    /// Reads a line of a session. Typed lines begin with `> `.
    pub fn take_line(&mut self, line: &str) {
        match (line.strip_prefix("> "), EventLine::parse(line)) {
            (Some(typed), _) => self.take_command(typed),
            (None, Some(event)) => self.take_event(&event),
            (None, None) => self.take_answer(line),
        }
    }

    /// The lines from which [`SetUp::of_lines`] makes the same measurements.
    pub fn lines(&self) -> Vec<String> {
        let mut lines = Vec::new();
        for TimedServo { leads, by_eye, over } in &self.timings {
            lines.extend(OVER.into_iter().zip(over).map(|(setting, value)| format!("{}={value}", setting.text())));
            if let ([Some(out_ms), Some(in_ms)], false) = (leads, by_eye) {
                lines.push(format!("calibrated lead_out_ms={out_ms} lead_in_ms={in_ms} set=yes"));
                continue;
            }
            lines.push("calibrated by=eye, as seen".to_owned());
            let seen = LEADS.into_iter().zip(leads);
            lines.extend(seen.filter_map(|(lead, ms)| ms.map(|ms| format!("> set {} {ms}", lead.text()))));
        }
        for ticks in &self.ticks_per_m {
            lines.extend(["> calibrate 10000".to_owned(), format!("ticks_per_m={ticks}")]);
        }
        lines.extend(self.slip_permille.iter().rev().map(|permille| format!("slip permille={permille}")));
        if self.sets_margin {
            let margin = Setting::MarginMm;
            lines.push(format!("> set {} {}", margin.text(), self.settings.get(margin)));
        }
        lines
    }

    /// Forgets how long the servo took.
    pub fn forget_timings(&mut self) {
        self.timings.clear();
    }

    /// Listens to what happened.
    pub fn take(&mut self, happening: &Happening) {
        match happening {
            Happening::Connected { settings, .. } | Happening::Settings(settings, _) => {
                self.settings = settings.clone();
            }
            Happening::Command(line) => self.take_command(line),
            Happening::Answer(line) => self.take_answer(line),
            Happening::Event(event, _) => self.take_event(event),
            _ => {}
        }
    }

    fn take_command(&mut self, line: &str) {
        self.measures_the_wheel = false;
        match link::command(line) {
            Ok(Command { action: Action::Calibrate, .. }) => self.measures_the_wheel = true,
            Ok(Command { action: Action::Set, setting: Setting::MarginMm, .. }) => self.sets_margin = true,
            // The measurements begin again.
            Ok(Command { action: Action::Set, setting: Setting::TicksPerM, number, .. })
                if !self.is_measured(number) =>
            {
                self.ticks_per_m.clear();
            }
            Ok(Command { action: Action::Set, setting, number, .. }) => self.take_seen(setting, number),
            _ => {}
        }
    }

    /// Takes a lead that is set after a timing by eye. Only the first is what was seen: a later one may follow advice.
    fn take_seen(&mut self, lead: Setting, ms: u16) {
        if let Some(way) = LEADS.iter().position(|&known| known == lead)
            && let Some(TimedServo { leads, by_eye: true, .. }) = self.timings.last_mut()
            && lead.allows(ms)
        {
            leads[way].get_or_insert(ms);
        }
    }

    fn take_answer(&mut self, line: &str) {
        let Some((setting, value)) = shown(line) else { return };
        if setting == Setting::TicksPerM && self.measures_the_wheel {
            if !self.is_measured(self.settings.get(setting)) {
                // They were of another wheel.
                self.ticks_per_m.clear();
            }
            self.ticks_per_m.push(value);
        }
        // A value out of range is noise.
        let _ = self.settings.set(setting, value);
    }

    fn take_event(&mut self, event: &EventLine) {
        let over = over(&self.settings);
        match *event {
            EventLine::CalibratedBySwitch { out_ms, in_ms, .. } => {
                self.timings.push(TimedServo { leads: [Some(out_ms), Some(in_ms)], by_eye: false, over });
            }
            EventLine::CalibratedByEye {} => self.timings.push(TimedServo { leads: [None; 2], by_eye: true, over }),
            EventLine::Slip { permille } => {
                self.slip_permille.push_front(permille);
                self.slip_permille.truncate(PLANTS);
            }
            _ => {}
        }
    }

    /// Whether this value lies among the measured ones. Otherwise they were of another wheel.
    fn is_measured(&self, ticks_per_m: u16) -> bool {
        let (least, greatest) = (self.ticks_per_m.iter().min(), self.ticks_per_m.iter().max());
        least <= Some(&ticks_per_m) && Some(&ticks_per_m) <= greatest
    }

    /// The servo's timings over the present stroke and gap.
    fn timed(&self, settings: &Settings) -> Vec<TimedServo> {
        self.timings.iter().copied().filter(|timing| timing.over == over(settings)).collect()
    }

    /// The time of the present stroke in the soil, ms, as an end switch measured it. `None` if none did.
    pub fn stroke_ms(&self, settings: &Settings) -> Option<f64> {
        Some(travel_ms(&self.timed(settings))).filter(|&ms| ms > 0.0)
    }

    /// The steps that are missing until the margin can be lowered, in the best order.
    pub fn missing(&self, settings: &Settings) -> Vec<Step> {
        let mut missing = Vec::new();
        let timings = self.timed(settings);
        if timings.len() < TIMINGS {
            missing.push(Step::TimeServo(timings.len()));
        } else {
            for (lead, lead_ms) in leads(&timings, settings, self.arm) {
                let set_ms = settings.get(lead);
                let is_unsafe = if lead == Setting::LeadOutMs { set_ms < lead_ms } else { set_ms > lead_ms };
                // Around whole canopies and by eye, safer leads are the operator's.
                if is_unsafe || keeps_stems(settings) && !by_eye(&timings) && set_ms != lead_ms {
                    missing.push(Step::SetLead(lead, lead_ms));
                }
            }
        }
        // Until two plants have measured the slip, only the wheel counts, also with a second beam.
        let is_in_use = self.is_measured(settings.get(Setting::TicksPerM));
        let stretches = if is_in_use { self.ticks_per_m.len() } else { 0 };
        if stretches < Self::STRETCHES {
            missing.push(Step::MeasureWheel(stretches));
        }
        if settings.get(Setting::SecondBeamMm) > 0 && self.slip_permille.len() < PLANTS {
            missing.push(Step::PassPlants(self.slip_permille.len()));
        }
        missing
    }

    /// The parts of the margin.
    ///
    /// # Errors
    /// The missing steps, if not everything was measured. [`Step::MeasureAgain`], if no margin covers the measurements.
    pub fn margin(&self, settings: &Settings) -> Result<Margin, Vec<Step>> {
        let missing = self.missing(settings);
        if !missing.is_empty() {
            return Err(missing);
        }
        let [beam_to_tool_mm, second_beam_mm, zone_mm] =
            [Setting::BeamToToolMm, Setting::SecondBeamMm, Setting::StemZoneMm]
                .map(|setting| f64::from(settings.get(setting)));
        let slip_mm = if second_beam_mm > 0.0 {
            // The firmware corrects each zone by the slip of the plants just before it. Only a change since then is left.
            let changes = self.slip_permille.iter().zip(self.slip_permille.iter().skip(1));
            let change = changes.map(|(after, before)| after.abs_diff(*before)).max().unwrap_or(0);
            (f64::from(change) / 1000.0).max(SLIP) * (beam_to_tool_mm - second_beam_mm)
        } else {
            let in_use = settings.get(Setting::TicksPerM);
            let farthest = self.ticks_per_m.iter().map(|ticks| ticks.abs_diff(in_use)).max().unwrap_or(0);
            (f64::from(farthest) / f64::from(in_use.max(1)) + SLIP) * beam_to_tool_mm
        };
        let timings = self.timed(settings);
        let scatters_ms =
            extremes(&timings).into_iter().flatten().map(|(least_ms, greatest_ms)| greatest_ms - least_ms);
        let scatter_ms = scatters_ms.fold(SERVO_MS, u16::max);
        let speed_m_s = if keeps_stems(settings) { SLOW_M_S } else { SPEED_M_S };
        let arm_mm = self.arm_mm(settings);
        let blade_mm = self.arm.blade_length_mm / 2.0;
        let margin = Margin {
            slip_mm,
            servo_mm: f64::from(scatter_ms) * speed_m_s,
            firmware_mm: FIRMWARE_MM * speed_m_s / SPEED_M_S,
            stems_mm: keeps_stems(settings).then_some(stems_mm(self.stem_off_mm.max(STEM_OFF * zone_mm))),
            arm_mm,
            blade_mm,
            in_use_mm: settings.get(Setting::MarginMm),
        };
        let least_mm = margin.least_mm();
        if Setting::MarginMm.allows(least_mm) {
            return Ok(margin);
        }
        Err(vec![Step::MeasureAgain(
            least_mm,
            match margin {
                Margin { servo_mm, .. } if servo_mm > slip_mm.max(arm_mm).max(blade_mm) => SEE_TO_SERVO,
                _ if blade_mm > slip_mm.max(arm_mm) => "take a blade that is shorter along the row",
                _ if arm_mm > slip_mm => "shorten the trailing arm's stroke",
                Margin { stems_mm: Some(stems_mm), .. } if stems_mm > slip_mm => {
                    "set `stem_zone_mm 0`, and keep whole canopies"
                }
                _ if second_beam_mm > 0.0 => "roll past more plants",
                _ => "`set ticks_per_m 0`, and measure the wheel again",
            },
        )])
    }

    /// A trailing arm's part of the margin, mm; 0 for a pendulum.
    fn arm_mm(&self, settings: &Settings) -> f64 {
        let Some(tool_mm) = self.trailing_tool_mm else { return 0.0 };
        let [zone_mm, top_mm_s] =
            [Setting::StemZoneMm, Setting::TopSpeedMmS].map(|setting| f64::from(settings.get(setting)));
        let (pulse_us, stroke_ms) = (stroke_us(settings), travel_ms(&self.timed(settings)));
        let rolled_mm = circle::rolled_mm(top_mm_s, stroke_ms, zone_mm, self.arm.aside_mm(pulse_us));
        self.arm.carried_by_stroke_mm(pulse_us, tool_mm.into(), zone_mm, rolled_mm)
    }

    /// A margin that is enough before everything was measured, mm.
    fn safe_mm(&self, settings: &Settings) -> u16 {
        let stems_mm = if keeps_stems(settings) { stem_excess_mm(self.stem_off_mm) } else { 0.0 };
        let excess_mm = self.arm_mm(settings).ceil() + blade_excess_mm(self.arm.blade_length_mm) + stems_mm;
        Setting::MarginMm.default() + excess_mm as u16
    }

    /// Why the tasks of a step are not done with these settings. `None` if they are, or if no setting and no
    /// measurement shows it.
    pub fn open(&self, tasks: &[Task], settings: &Settings) -> Option<String> {
        let first_missing =
            |is_it: fn(&Step) -> bool| self.missing(settings).into_iter().find(is_it).map(|step| step.to_string());
        tasks.iter().find_map(|task| match *task {
            Task::Set(setting @ (Setting::SecondBeamMm | Setting::StemZoneMm), _) => {
                (settings.get(setting) == 0).then(|| format!("{} is 0", setting.text()))
            }
            Task::TimeServo => first_missing(|step| matches!(step, Step::TimeServo(_) | Step::SetLead(..))),
            Task::MeasureWheel(_) => first_missing(|step| matches!(step, Step::MeasureWheel(_))),
            Task::SetMargin => match self.margin(settings) {
                Err(missing) => missing.first().map(Step::to_string),
                Ok(margin) => {
                    let default_mm = Setting::MarginMm.default();
                    let is_done = margin.in_use_mm == margin.least_mm()
                        || (margin.least_mm()..default_mm).contains(&margin.in_use_mm);
                    (!is_done).then(|| Step::SetMargin(margin).to_string())
                }
            },
            Task::Fit(..) | Task::Set(..) => None,
        })
    }

    /// The next step with these settings. `None` before the first `calibrate`.
    pub fn next(&self, settings: &Settings) -> Option<Step> {
        if self.timings.is_empty() && self.ticks_per_m.is_empty() {
            return None;
        }
        Some(match self.margin(settings) {
            Err(missing) => missing.into_iter().next()?,
            Ok(margin) if margin.in_use_mm == margin.least_mm() => Step::Ready(margin),
            Ok(margin) => Step::SetMargin(margin),
        })
    }

    /// A warning if this session has set a margin that does not cover the measured values.
    pub fn warning(&self, settings: &Settings) -> Option<String> {
        self.sets_margin.then(|| self.margin_warning(settings)).flatten()
    }

    /// A warning if the margin does not cover the measured values, also if another session has set it.
    pub fn margin_warning(&self, settings: &Settings) -> Option<String> {
        let in_use_mm = settings.get(Setting::MarginMm);
        let safe_mm = self.safe_mm(settings);
        match self.margin(settings) {
            Ok(margin) => (in_use_mm < margin.least_mm())
                .then(|| format!("margin_mm {in_use_mm} is too small: the measurements need {}", margin.least_mm())),
            Err(missing) => match &missing[..] {
                [again @ Step::MeasureAgain(..)] => Some(format!("margin_mm {in_use_mm} is too small: {again}")),
                _ => (in_use_mm < safe_mm).then(|| {
                    let mut missing: Vec<&str> = missing.iter().map(Step::name).collect();
                    missing.dedup();
                    format!("margin_mm {in_use_mm} is not measured: {} first; {safe_mm} is safe", missing.join(" and "))
                }),
            },
        }
    }
}

/// Whether the firmware keeps stem zones, not whole canopies.
fn keeps_stems(settings: &Settings) -> bool {
    settings.get(Setting::StemZoneMm) > 0
}

#[cfg(test)]
mod tests;
