//! What is known of the machine, and how that changes with what happens.

use super::command_line::CommandLine;
use link::advice;
use link::session::Happening;
use link::settings::{Setting, Settings};
use link::{Class, EventLine, Mode, Status};
use std::collections::VecDeque;

/// Objects and lines that are remembered.
const OBJECTS: usize = 50;
const LINES: usize = 500;

/// Whether the Uno is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Connection {
    /// With a firmware of this version.
    Up(String),
    /// Not, and why.
    Down(String),
}

/// An object that the beam has seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// What it was taken for.
    pub class: Class,
    /// Votes for that.
    pub votes: u8,
    /// Where the beam broke, in ticks.
    pub leading: i32,
    /// How far the machine rolled while the beam was broken, in ticks.
    pub width: i32,
    /// Distance since the last plant, in ticks.
    pub spacing: i32,
}

/// What is known of the machine.
#[derive(Clone, Debug)]
pub struct Model {
    /// Whether it is there.
    pub connection: Connection,
    /// Its last status.
    pub status: Status,
    /// Its settings.
    pub settings: Settings,
    /// The last objects, the newest first.
    pub objects: VecDeque<Seen>,
    /// The canopies that the tool leaves alone: those of `objects` since the schedule was last emptied.
    pub windows: VecDeque<Seen>,
    /// What the operator has to see to.
    pub advice: Option<String>,
    /// What was typed, answered and told, the newest last.
    pub lines: VecDeque<String>,
    /// What is being typed.
    pub line: CommandLine,
}

impl Model {
    /// A machine of which nothing is known yet.
    pub fn new() -> Self {
        Self {
            connection: Connection::Down("looking for it".to_owned()),
            // As every machine starts.
            status: Status { tool_out: true, ..Status::default() },
            settings: Settings::new(),
            objects: VecDeque::new(),
            windows: VecDeque::new(),
            advice: None,
            lines: VecDeque::new(),
            line: CommandLine::default(),
        }
    }

    /// Takes what happened.
    pub fn update(&mut self, happening: Happening) {
        match happening {
            Happening::Connected { version, settings, .. } => {
                self.say(format!("-- connected to weeder {version}"));
                self.settings = settings;
                self.connection = Connection::Up(version);
                self.windows.clear();
            }
            Happening::Lost(why) => {
                self.say(format!("-- {why}"));
                self.connection = Connection::Down(why);
            }
            Happening::Status(status, _) => self.take_status(status),
            Happening::Event(event, line) => self.take_event(event, line),
            Happening::Command(line) => self.say(format!("> {line}")),
            Happening::Answer(line) => self.say(line),
            Happening::Settings(settings) => self.settings = settings,
        }
    }

    /// Adds a line to what was said.
    pub fn say(&mut self, line: String) {
        if self.lines.len() == LINES {
            self.lines.pop_front();
        }
        self.lines.push_back(line);
    }

    /// A distance in millimetres, of the machine's own wheel.
    pub fn millimetres(&self, ticks: i32) -> f64 {
        f64::from(ticks) * 100.0 / f64::from(self.settings.wheel().ticks(100).0.max(1))
    }

    fn take_status(&mut self, status: Status) {
        if let Some(alarm) = status.alarm {
            self.advice = Some(format!("alarm {}: {}", name_of(alarm.text().bytes()), advice::alarm(alarm)));
        } else if self.status.mode == Mode::Alarm {
            self.advice = None;
        }
        let tool = status.position.wrapping_sub(self.settings.ticks(Setting::BeamToToolMm).0);
        let behind = self.settings.ticks(Setting::BeamToToolMm).0;
        self.windows.retain(|seen| seen.leading.wrapping_add(seen.width).wrapping_sub(tool) > -behind);
        self.status = status;
    }

    fn take_event(&mut self, event: EventLine, line: String) {
        match event {
            EventLine::Object { class, position, votes, spacing, hold, .. } => {
                // The hold is the canopy and both margins.
                let margins = self.settings.wheel().ticks(2 * self.settings.get(Setting::MarginMm)).0;
                let width = hold.wrapping_sub(margins);
                let seen = Seen { class, votes, leading: position, width, spacing };
                self.objects.push_front(seen);
                self.objects.truncate(OBJECTS);
                self.windows.push_front(seen);
                self.windows.truncate(OBJECTS);
            }
            EventLine::Alarm { .. } => self.windows.clear(),
            EventLine::Warning(warning) => {
                self.advice =
                    Some(format!("warning {}: {}", name_of(warning.text().bytes()), advice::warning(warning)));
            }
            EventLine::Plot => return,
            EventLine::Swing { .. }
            | EventLine::Guarded { .. }
            | EventLine::Slip { .. }
            | EventLine::State(_)
            | EventLine::Calibrated { .. } => {}
        }
        self.say(line);
    }
}

fn name_of(bytes: impl Iterator<Item = u8>) -> String {
    bytes.map(char::from).collect()
}
