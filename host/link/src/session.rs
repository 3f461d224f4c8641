//! A session: a link that is watched for as long as it lasts, and opened again where it broke.
//!
//! [`Session::turn`] is called over and over. It types what was asked of it, one command at a time, asks for the status when
//! nothing else is under way, and tells what happened. It waits no longer than a read does, except for the Uno to start where
//! a port is opened. After every start of the Uno it asks for the settings and the examples and turns the events on; after every
//! command that changes settings it asks for them anew.

use super::settings::{self, Settings, SettingsError};
use super::{EventLine, Link, LinkError, Said, Status, is_greeting};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Time between two questions for the status.
const POLL: Duration = Duration::from_millis(100);

/// Time after which an answer is given up.
const PATIENCE: Duration = Duration::from_secs(3);

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// Most lines that are told of in one turn, so that a machine that says much cannot keep it from turning.
const LINES: usize = 64;

/// Commands that wait at the most.
const WAITING: usize = 256;

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Happening {
    /// The Uno is there, or has started anew.
    Connected {
        /// The firmware's version.
        version: String,
        /// Its settings.
        settings: Settings,
        /// Its examples, a line each.
        examples: Vec<String>,
    },
    /// The Uno is gone, and why.
    Lost(String),
    /// The machine's status.
    Status(Status, String),
    /// The machine told something by itself.
    Event(EventLine, String),
    /// A command was typed.
    Command(String),
    /// A line of the answer to it, the last of which is `ok` or begins with `error:`.
    Answer(String),
    /// The settings as they are behind a command that has changed some.
    Settings(Settings),
}

/// What the firmware is answering.
enum Question {
    Status,
    Command,
    /// The settings, with the lines that have come.
    Settings(Vec<String>),
}

/// A way to a link.
type Opener = Box<dyn FnMut() -> Result<Link, LinkError>>;

/// A link that is opened again where it broke.
pub struct Session {
    open: Opener,
    link: Option<Link>,
    asked: Option<(Question, Instant)>,
    /// The command that is being answered.
    asked_for: String,
    waiting: VecDeque<String>,
    /// Whether settings have changed since they were asked for.
    settings_changed: bool,
    poll_at: Option<Instant>,
    retry_at: Option<Instant>,
    happened: VecDeque<Happening>,
}

impl Session {
    /// Opens a link by `open`, which is called again whenever it is lost.
    ///
    /// # Errors
    /// Where the first link fails.
    pub fn open(mut open: impl FnMut() -> Result<Link, LinkError> + 'static) -> Result<Self, SettingsError> {
        let link = open()?;
        let mut session = Self {
            open: Box::new(open),
            link: None,
            asked: None,
            asked_for: String::new(),
            waiting: VecDeque::new(),
            settings_changed: false,
            poll_at: None,
            retry_at: None,
            happened: VecDeque::new(),
        };
        session.connect(link)?;
        Ok(session)
    }

    /// Types a command as soon as those before it have been answered; whether it can be one and found a place to wait.
    pub fn command(&mut self, command: &str) -> bool {
        let fits = super::is_command(command) && self.waiting.len() < WAITING;
        if fits {
            self.waiting.push_back(command.to_owned());
        }
        fits
    }

    /// Whether no command waits for its answer.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && !matches!(self.asked, Some((Question::Command, _)))
    }

    /// Whether the Uno is there.
    pub fn is_connected(&self) -> bool {
        self.link.is_some()
    }

    /// Goes on for a moment, and returns what happened since the last turn.
    pub fn turn(&mut self, now: Instant) -> Vec<Happening> {
        let result = match self.link.take() {
            Some(link) => self.listen(link, now),
            None if self.retry_at.is_none_or(|at| now >= at) => {
                self.retry_at = Some(now + RETRY);
                // Whatever is wrong with it now was said when it was lost.
                let _ = (self.open)().map_err(SettingsError::from).and_then(|link| self.connect(link));
                Ok(())
            }
            None => {
                std::thread::sleep(Duration::from_millis(20));
                Ok(())
            }
        };
        if let Err(error) = result {
            self.asked = None;
            self.waiting.clear();
            self.retry_at = Some(now + RETRY);
            self.happened.push_back(Happening::Lost(error.to_string()));
        }
        self.happened.drain(..).collect()
    }

    /// Takes a link whose firmware has just started.
    fn connect(&mut self, mut link: Link) -> Result<(), SettingsError> {
        let settings = settings::read(&mut link)?;
        let examples = link.ask("examples")?;
        link.ask("events on")?;
        self.happened.push_back(Happening::Connected { version: link.version().to_owned(), settings, examples });
        // Before anything is typed: how the machine was when all began.
        let status = link.ask("status")?;
        let status = status.into_iter().find_map(|line| Some((Status::parse(&line)?, line)));
        self.happened.extend(status.map(|(status, line)| Happening::Status(status, line)));
        self.link = Some(link);
        (self.asked, self.poll_at, self.settings_changed) = (None, None, false);
        Ok(())
    }

    fn listen(&mut self, mut link: Link, now: Instant) -> Result<(), SettingsError> {
        for _ in 0..LINES {
            let Some(line) = link.next_line()? else { break };
            if is_greeting(&line) {
                self.happened.push_back(Happening::Lost("the Uno was reset".to_owned()));
                return self.connect(link);
            }
            self.take(line);
        }
        if self.asked.as_ref().is_some_and(|&(_, since)| now.saturating_duration_since(since) > PATIENCE) {
            return Err(LinkError::Silent { command: self.asked_for.clone(), received: String::new() }.into());
        }
        if self.asked.is_none() {
            let question = if let Some(command) = self.waiting.pop_front() {
                self.happened.push_back(Happening::Command(command.clone()));
                Some((Question::Command, command))
            } else if self.poll_at.is_none_or(|at| now >= at) {
                self.poll_at = Some(now + POLL);
                Some((Question::Status, "status".to_owned()))
            } else if std::mem::take(&mut self.settings_changed) {
                Some((Question::Settings(Vec::new()), "get".to_owned()))
            } else {
                None
            };
            if let Some((question, line)) = question {
                link.send(&line)?;
                self.asked = Some((question, now));
                self.asked_for = line;
            }
        }
        self.link = Some(link);
        Ok(())
    }

    /// Takes a line, and knows whose it is.
    fn take(&mut self, line: String) {
        let said = Said::parse(&line);
        if let Said::Event(event) = said {
            self.settings_changed |= matches!(event, EventLine::Calibrated { .. });
            self.happened.push_back(Happening::Event(event, line));
            return;
        }
        let is_end = matches!(said, Said::Done | Said::Refused(_));
        match &mut self.asked {
            Some((Question::Status, _)) => {
                if let Said::Status(status) = said {
                    self.happened.push_back(Happening::Status(status, line));
                }
            }
            Some((Question::Command, _)) => {
                self.settings_changed |= said == Said::Done && changes_settings(&self.asked_for);
                self.happened.push_back(Happening::Answer(line));
            }
            Some((Question::Settings(lines), _)) if is_end => match settings::shown_by(lines) {
                Ok(settings) => self.happened.push_back(Happening::Settings(settings)),
                // Noise has spoiled a line: once more.
                Err(_) => self.settings_changed = true,
            },
            Some((Question::Settings(lines), _)) => lines.push(line),
            // The end of an answer that was given up.
            None => {}
        }
        if is_end {
            self.asked = None;
        }
    }
}

/// Whether a command changes settings where it is answered by `ok`.
fn changes_settings(command: &str) -> bool {
    matches!(command.split_whitespace().next(), Some("set" | "defaults" | "revert" | "calibrate"))
}

#[cfg(test)]
mod tests;
