//! The state of each row, and its changes by events.

use super::command_line::CommandLine;
use super::pager::Pager;
use control::alarm::Warning;
use link::advice;
use link::examples::Heading;
use link::rows::{Heard, Hold, What};
use link::session::Happening;
use link::settings::{self, Setting, Settings};
use link::{Class, EventLine, Mode, Status};
use set_up::{SetUp, Step};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Objects and lines that are remembered.
const OBJECTS: usize = 50;
const LINES: usize = 500;

/// Time after a status in which it counts as the present one.
const FRESH: Duration = Duration::from_secs(1);

#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Connection {
    /// With a firmware of this version.
    Up(String),
    /// Not, and why.
    Down(String),
}

impl Default for Connection {
    fn default() -> Self {
        Self::Down("looking for it".to_owned())
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    pub class: Class,
    pub votes: u8,
    /// The position where the beam broke, in ticks.
    pub leading: i32,
    /// How far the machine rolled while the beam was broken, in ticks.
    pub width: i32,
    /// Distance since the last plant, in ticks.
    pub spacing: i32,
}

/// The state of the last command to a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Answer {
    #[default]
    None,
    Waiting,
    Done,
    /// The machine has refused it, or it was not typed.
    Refused,
}

#[derive(Clone, Debug, Default)]
pub struct RowModel {
    pub name: String,
    pub connection: Connection,
    /// The last status that was understood.
    pub status: Option<Status>,
    /// Whether that is the present state.
    pub is_known: bool,
    /// When it came; `None` if it came since the last turn.
    status_at: Option<Instant>,
    pub settings: Settings,
    /// The last objects, the newest first.
    pub objects: VecDeque<Seen>,
    /// The canopies in keep-out zones: those of `objects` since the zones were last emptied.
    pub zones: VecDeque<Seen>,
    /// Advice for the operator in an alarm.
    advice: Option<String>,
    warned: Option<Warning>,
    /// The message of a restart at work, until the machine works again.
    pub restarted: Option<String>,
    pub answer: Answer,
    /// The measurements since the start, and the last step that was shown.
    set_up: SetUp,
    step: Option<Step>,
    heading: Heading,
    /// The last warning about the margin.
    warning: Option<String>,
}

#[derive(Clone, Debug, Default)]
pub struct Model {
    /// Its rows, at least one.
    pub rows: Vec<RowModel>,
    /// The row that commands go to. `None` for all.
    pub target: Option<usize>,
    /// The last HOLD to all, until the next command.
    pub hold: Option<Hold>,
    /// Typed lines, answers and events, the newest last.
    pub lines: VecDeque<String>,
    pub pager: Pager,
    pub line: CommandLine,
    rings: bool,
}

impl Model {
    /// Rows in unknown state.
    pub fn new(names: Vec<String>) -> Self {
        let row = |name| RowModel { name, ..RowModel::default() };
        Self { rows: names.into_iter().map(row).collect(), ..Self::default() }
    }

    /// Goes on to a time: a status that is too old is no longer the present one.
    pub fn turn(&mut self, now: Instant) {
        for row in &mut self.rows {
            let at = *row.status_at.get_or_insert(now);
            row.is_known &= now.saturating_duration_since(at) <= FRESH;
        }
    }

    /// Whether to ring the bell: since the last call an alarm was latched, or a row was lost or restarted at work.
    pub fn take_ring(&mut self) -> bool {
        std::mem::take(&mut self.rings)
    }

    pub fn are_several(&self) -> bool {
        self.rows.len() > 1
    }

    pub fn names(&self) -> Vec<String> {
        self.rows.iter().map(|row| row.name.clone()).collect()
    }

    /// The numbers of a row, or of all.
    pub fn targets(&self, row: Option<usize>) -> Vec<usize> {
        row.map_or_else(|| (0..self.rows.len()).collect(), |row| vec![row])
    }

    /// Chooses the next or previous row for commands. "All" is before the first.
    pub fn choose(&mut self, forward: bool) {
        let places = self.rows.len() + 1;
        let place = self.target.map_or(0, |row| row + 1);
        let place = (place + if forward { 1 } else { places - 1 }) % places;
        self.target = place.checked_sub(1).filter(|_| self.are_several());
    }

    /// Records that a command was sent to a row, or to all.
    pub fn sent(&mut self, row: Option<usize>, command: &str) {
        self.hold = None;
        for row in self.targets(row) {
            self.rows[row].answer = Answer::Waiting;
        }
        if self.are_several() {
            let to = row.map_or("all", |row| self.rows[row].name.as_str());
            self.say(format!("> {to}: {command}"));
        }
    }

    pub fn held(&mut self, hold: Hold) {
        self.sent(None, "hold");
        self.hold = Some(hold);
    }

    pub fn take(&mut self, heard: Heard) {
        if let Some(hold) = &mut self.hold {
            hold.take(&heard);
        }
        match heard.what {
            What::Happened(happening) => self.update(heard.row, happening),
            What::NotTyped { command, why } => {
                self.rows[heard.row].answer = Answer::Refused;
                self.say_of(heard.row, &format!("-- `{command}` was not typed: {why}"));
            }
        }
    }

    pub fn update(&mut self, number: usize, happening: Happening) {
        use EventLine::{Alarm, Newer, Plot, State, Warning};
        // Plants and swings of several rows are too many lines to read.
        let is_alone = !self.are_several();
        let row = &mut self.rows[number];
        let mut said = Vec::new();
        match &happening {
            Happening::Connected { version, shown, .. } => {
                said.push(format!("-- connected to weeder {version}"));
                said.extend(settings::other_version(version, shown).map(|other| format!("-- {other}")));
            }
            Happening::Lost(why) => said.push(format!("-- {why}")),
            Happening::Started { while_at_work: Some(cause), .. } => {
                said.push(format!("-- {}", advice::restarted(cause)));
            }
            Happening::Event(Plot, _) => {}
            Happening::Event(Alarm { .. } | Warning { .. } | State { .. } | Newer { .. }, line) => {
                said.push(line.clone());
            }
            Happening::Event(_, line) if is_alone => said.push(line.clone()),
            Happening::Command(line) if is_alone => said.push(format!("> {line}")),
            Happening::Answer(line) => {
                said.extend(row.heading.before(line).map(|head| format!("-- {head}")));
                said.push(line.clone());
            }
            _ => {}
        }
        self.rings |= match &happening {
            Happening::Event(Alarm { .. } | Newer { is_alarm: true }, _)
            | Happening::Started { while_at_work: Some(_), .. } => true,
            Happening::Lost(_) => row.is_there(),
            _ => false,
        };
        row.update(happening);
        said.extend(row.take_step().map(|step| format!("-- next, {step}")));
        said.extend(row.take_warning().map(|warning| format!("-- warning: {warning}")));
        said.iter().for_each(|line| self.say_of(number, line));
    }

    pub fn say(&mut self, line: String) {
        if self.lines.len() == LINES {
            self.lines.pop_front();
            self.pager.dropped();
        }
        self.lines.push_back(line);
    }

    /// Adds a line of a row, with its name if there are several.
    fn say_of(&mut self, number: usize, line: &str) {
        match self.are_several() {
            true => self.say(format!("{}: {line}", self.rows[number].name)),
            false => self.say(line.to_owned()),
        }
    }
}

impl RowModel {
    /// The warning about the margin, if it has changed.
    fn take_warning(&mut self) -> Option<String> {
        let warning = self.set_up.warning(&self.settings);
        let before = std::mem::replace(&mut self.warning, warning.clone());
        warning.filter(|_| before != self.warning)
    }

    /// The next step of the set-up, if it has changed.
    fn take_step(&mut self) -> Option<Step> {
        let step = self.set_up.next(&self.settings);
        let before = std::mem::replace(&mut self.step, step.clone());
        // Each plant counts, and not each is worth a line.
        let goes_on = matches!((&before, &step), (Some(Step::PassPlants(_)), Some(Step::PassPlants(_))));
        step.filter(|_| before != self.step && !goes_on)
    }

    pub fn is_there(&self) -> bool {
        matches!(self.connection, Connection::Up(_))
    }

    /// The present status; `None` if it is unknown.
    pub fn present(&self) -> Option<&Status> {
        self.status.as_ref().filter(|_| self.is_known)
    }

    /// What the operator must notice: a restart at work, and the advice for an alarm or a warning.
    pub fn advice(&self) -> Option<String> {
        let warned = self.warned.map(|warning| format!("warning {}: {}", warning.text(), advice::warning(warning)));
        let parts = [self.restarted.as_ref(), self.advice.as_ref().or(warned.as_ref())];
        let parts: Vec<&str> = parts.into_iter().flatten().map(String::as_str).collect();
        (!parts.is_empty()).then(|| parts.join("; "))
    }

    /// Whether it has restarted at work, and the operator has not acted since.
    pub fn has_restarted(&self) -> bool {
        self.restarted.is_some()
    }

    fn update(&mut self, happening: Happening) {
        self.set_up.take(&happening);
        match happening {
            Happening::Connected { version, settings, .. } => {
                self.settings = settings;
                self.connection = Connection::Up(version);
                self.is_known = false;
                self.warned = None;
                self.zones.clear();
            }
            Happening::Lost(why) => {
                self.connection = Connection::Down(why);
                self.is_known = false;
                // It rolls on unseen.
                self.zones.clear();
                // A command that is unanswered now stays unanswered.
                if self.answer == Answer::Waiting {
                    self.answer = Answer::Refused;
                }
            }
            Happening::Status(status, _) => self.take_status(status),
            Happening::Event(EventLine::Newer { is_alarm: true }, line) => {
                self.advice = Some(format!("{line}: this program is older than the firmware"));
                self.zones.clear();
            }
            Happening::Event(event, _) => self.take_event(event),
            Happening::Warning(warning) => self.warned = warning,
            Happening::Settings(settings, _) => self.settings = settings,
            Happening::Answered { refusal, .. } => {
                self.answer = if refusal.is_some() { Answer::Refused } else { Answer::Done };
            }
            Happening::Started { while_at_work: Some(cause), .. } => self.restarted = Some(advice::restarted(&cause)),
            Happening::Started { .. }
            | Happening::Unanswered { .. }
            | Happening::Command(_)
            | Happening::Answer(_)
            | Happening::Examples(_) => {}
        }
    }

    /// A distance in millimetres, of the machine's own wheel.
    pub fn millimetres(&self, ticks: i32) -> f64 {
        f64::from(ticks) * 100.0 / f64::from(self.settings.wheel().ticks(100).0.max(1))
    }

    fn take_status(&mut self, status: Status) {
        if let Some(alarm) = status.alarm {
            self.advice = Some(format!("alarm {}: {}", advice::name(alarm), advice::alarm(alarm)));
        } else if self.status.as_ref().is_some_and(|last| last.mode == Mode::Alarm) {
            self.advice = None;
        }
        if status.mode == Mode::Work {
            self.restarted = None;
        }
        let behind = self.settings.ticks(Setting::BeamToToolMm).0;
        let tool = status.position.wrapping_sub(behind);
        self.zones.retain(|seen| seen.leading.wrapping_add(seen.width).wrapping_sub(tool) > -behind);
        (self.status, self.is_known, self.status_at) = (Some(status), true, None);
    }

    fn take_event(&mut self, event: EventLine) {
        match event {
            EventLine::Detection { class, position, votes, spacing, hold, .. } => {
                // The hold includes both margins.
                let margins = self.settings.wheel().ticks(2 * self.settings.get(Setting::MarginMm)).0;
                let width = hold.wrapping_sub(margins);
                let seen = Seen { class, votes, leading: position, width, spacing };
                self.objects.push_front(seen);
                self.objects.truncate(OBJECTS);
                self.zones.push_front(seen);
                self.zones.truncate(OBJECTS);
            }
            EventLine::Alarm { .. } => self.zones.clear(),
            EventLine::State { mode: Mode::Work } => self.restarted = None,
            _ => {}
        }
    }
}
