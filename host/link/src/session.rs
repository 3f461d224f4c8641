//! A session: a link that is watched for as long as it lasts, and opened again where it broke.
//!
//! [`Session::turn`] is called over and over. It types what was asked of it, one command at a time, asks for the status when
//! nothing else is under way, and tells what happened. It waits no longer than a read does, except for the Uno to start where
//! a port is opened. After every start of the Uno it asks for the settings and the examples and turns the events on. Behind a
//! command that changes either, it asks for them again. [`Session::hold`] does not wait. Where the Uno is lost, so is every
//! command that was not answered.

use super::settings::{self, Settings, SettingsError};
use super::{ConsoleLine, EventLine, Link, LinkError, Status, is_greeting};
use control::say::command::{Command, parse};
use std::collections::{BTreeSet, VecDeque};
use std::time::{Duration, Instant};

/// Time between two questions for the status.
const POLL: Duration = Duration::from_millis(100);

/// Time after which an answer is given up.
const PATIENCE: Duration = Duration::from_secs(3);

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// The command that takes the tool out.
pub const HOLD: &str = "hold";

/// What the session asks for itself.
const STATUS: &str = "status";
const SETTINGS: &str = "get";
const EXAMPLES: &str = "examples";
const EVENTS: &str = "events on";

/// Most lines that are told of in one turn, so that a machine that says much cannot keep it from turning.
const LINES: usize = 64;

/// Commands that wait at the most.
const WAITING: usize = 256;

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Happening {
    /// The Uno is connected, or has restarted.
    Connected {
        /// The firmware's version.
        version: String,
        /// Its settings.
        settings: Settings,
        /// The lines that show them.
        shown: Vec<String>,
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
    /// A line of the answer to it. The last one is `ok` or begins with `error:`.
    Answer(String),
    /// The settings behind a command that has changed or saved some, and the lines that show them.
    Settings(Settings, Vec<String>),
    /// The examples behind a command that has changed some, a line each.
    Examples(Vec<String>),
}

/// A line that was typed, and when.
struct Asked {
    line: String,
    /// Whether the session asks for itself; the lines that have come, then.
    own: Option<Vec<String>>,
    since: Instant,
}

/// A way to a link.
type Opener = Box<dyn FnMut() -> Result<Link, LinkError>>;

/// A link that is opened again where it broke.
pub struct Session {
    open: Opener,
    link: Option<Link>,
    /// What is not answered yet, in the order of the answers: one question, and every `hold` that came behind it.
    asked: VecDeque<Asked>,
    waiting: VecDeque<String>,
    /// Whether the machine is to hold before anything else is typed.
    is_to_hold: bool,
    /// What the session asks for itself when nothing else waits. `hold` does not drop it.
    own: BTreeSet<String>,
    poll_at: Option<Instant>,
    retry_at: Option<Instant>,
    /// Whether the reason for the missing Uno was not reported yet.
    is_lost_untold: bool,
    happened: VecDeque<Happening>,
}

impl Session {
    /// Opens a link by `open`, which is called again each time that the link is lost.
    ///
    /// # Errors
    /// Where the first link fails.
    pub fn open(open: impl FnMut() -> Result<Link, LinkError> + 'static) -> Result<Self, SettingsError> {
        let mut session = Self::waiting_for(open);
        session.try_now(Instant::now())?;
        Ok(session)
    }

    /// Opens the link now, where there is none. Why it fails is said here, and not told again; the turns try on.
    ///
    /// # Errors
    /// Where the link fails.
    pub fn try_now(&mut self, now: Instant) -> Result<(), SettingsError> {
        if self.link.is_some() {
            return Ok(());
        }
        let opened = (self.open)().map_err(SettingsError::from).and_then(|link| self.connect(link));
        if opened.is_err() {
            (self.retry_at, self.is_lost_untold) = (Some(now + RETRY), false);
        }
        opened
    }

    /// A session without a link: `open` is called by the turns, over and over until there is an Uno. Why there is none at first is told.
    pub fn waiting_for(open: impl FnMut() -> Result<Link, LinkError> + 'static) -> Self {
        Self {
            open: Box::new(open),
            link: None,
            asked: VecDeque::new(),
            waiting: VecDeque::new(),
            is_to_hold: false,
            own: BTreeSet::new(),
            poll_at: None,
            retry_at: None,
            is_lost_untold: true,
            happened: VecDeque::new(),
        }
    }

    /// Types a command as soon as those before it have been answered; whether it can be one and found a place to wait.
    pub fn command(&mut self, command: &str) -> bool {
        let fits = super::is_command(command) && self.waiting.len() < WAITING;
        if fits {
            self.waiting.push_back(command.to_owned());
        }
        fits
    }

    /// Has the machine hold in the next turn, before all that waits, which is dropped: how many commands that were, the last ones.
    /// What is being answered is answered to its end, and then the `hold`; one that is last of that already counts for this one too.
    pub fn hold(&mut self) -> usize {
        // The chip has room for few characters: one that is under way already is not typed again.
        self.is_to_hold |= self.asked.back().is_none_or(|asked| asked.line != HOLD);
        self.waiting.drain(..).count()
    }

    /// Turns the events on, behind all that waits.
    pub fn turn_events_on(&mut self) {
        self.own.insert(EVENTS.to_owned());
    }

    /// Whether no command waits for its answer.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && !self.is_to_hold && self.asked.iter().all(|asked| asked.own.is_some())
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
                let opened = (self.open)().map_err(SettingsError::from).and_then(|link| self.connect(link));
                // The reason was reported when it was lost.
                if self.is_lost_untold { opened } else { Ok(()) }
            }
            None => {
                std::thread::sleep(Duration::from_millis(20));
                Ok(())
            }
        };
        if let Err(error) = result {
            self.retry_at = Some(now + RETRY);
            self.lose(error.to_string());
        }
        self.happened.drain(..).collect()
    }

    /// The Uno is gone, or has restarted: pending commands will not be answered.
    fn lose(&mut self, why: String) {
        self.asked.clear();
        self.waiting.clear();
        self.own.clear();
        (self.is_to_hold, self.is_lost_untold) = (false, false);
        self.happened.push_back(Happening::Lost(why));
    }

    /// Takes a link whose firmware has just started.
    fn connect(&mut self, mut link: Link) -> Result<(), SettingsError> {
        let shown = link.ask(SETTINGS)?;
        let settings = settings::shown_by(&shown)?;
        let examples = link.ask(EXAMPLES)?;
        link.ask(EVENTS)?;
        self.happened.push_back(Happening::Connected { version: link.version().to_owned(), settings, shown, examples });
        // Before anything is typed: how the machine was when all began.
        self.happened.extend(told(STATUS, link.ask(STATUS)?)?);
        self.link = Some(link);
        (self.poll_at, self.is_lost_untold) = (None, false);
        Ok(())
    }

    fn listen(&mut self, mut link: Link, now: Instant) -> Result<(), SettingsError> {
        for _ in 0..LINES {
            let Some(line) = link.next_line()? else { break };
            if is_greeting(&line) {
                self.lose("the Uno was reset".to_owned());
                return self.connect(link);
            }
            self.take(line);
        }
        let is_old = |asked: &&Asked| now.saturating_duration_since(asked.since) > PATIENCE;
        if let Some(Asked { line, .. }) = self.asked.front().filter(is_old) {
            return Err(LinkError::Silent { command: line.clone(), received: String::new() }.into());
        }
        let next = if std::mem::take(&mut self.is_to_hold) {
            Some((HOLD.to_owned(), None))
        } else if !self.asked.is_empty() {
            None
        } else if let Some(command) = self.waiting.pop_front() {
            Some((command, None))
        } else if self.poll_at.is_none_or(|at| now >= at) {
            self.poll_at = Some(now + POLL);
            Some((STATUS.to_owned(), Some(Vec::new())))
        } else {
            self.own.pop_first().map(|own| (own, Some(Vec::new())))
        };
        if let Some((line, own)) = next {
            if own.is_none() {
                self.happened.push_back(Happening::Command(line.clone()));
            }
            link.send(&line)?;
            self.asked.push_back(Asked { line, own, since: now });
        }
        self.link = Some(link);
        Ok(())
    }

    /// Takes a line, and knows whose it is.
    fn take(&mut self, line: String) {
        let said = ConsoleLine::parse(&line);
        if let ConsoleLine::Event(event) = said {
            if let EventLine::CalibratedBySwitch { is_set: true, .. } = event {
                self.own.insert(SETTINGS.to_owned());
            }
            self.happened.push_back(Happening::Event(event, line));
            return;
        }
        let is_end = matches!(said, ConsoleLine::End { .. });
        let is_done = said == ConsoleLine::End { error: None };
        // The end of an abandoned answer is ignored.
        let Some(asked) = self.asked.front_mut() else { return };
        match &mut asked.own {
            Some(lines) if is_end => match told(&asked.line, std::mem::take(lines)) {
                Ok(happening) if is_done => self.happened.extend(happening),
                // Noise has spoiled a line: once more.
                _ => drop(self.own.insert(asked.line.clone())),
            },
            // At once, not at the answer's end: a log and a map take the machine's position from it.
            Some(_) if let ConsoleLine::Status(status) = said => {
                self.happened.push_back(Happening::Status(status, line))
            }
            Some(lines) => lines.push(line),
            None => {
                if is_done {
                    self.own.extend(changed_by(&asked.line));
                }
                self.happened.push_back(Happening::Answer(line));
            }
        }
        if is_end {
            self.asked.pop_front();
        }
    }
}

/// What the answer to a question of the session's own tells.
fn told(question: &str, answer: Vec<String>) -> Result<Option<Happening>, SettingsError> {
    Ok(match question {
        STATUS => answer.into_iter().find_map(|line| Some(Happening::Status(Status::parse(&line)?, line))),
        SETTINGS => Some(Happening::Settings(settings::shown_by(&answer)?, answer)),
        EXAMPLES => Some(Happening::Examples(answer)),
        _ => None,
    })
}

/// What has to be asked for again behind a command that is answered by `ok`.
fn changed_by(command: &str) -> Option<String> {
    Some(
        match parse(command.as_bytes()).ok()? {
            Command::Set(..) | Command::Save | Command::Revert | Command::Defaults | Command::Calibrate { .. } => {
                SETTINGS
            }
            Command::Label { .. } | Command::Teach(_) | Command::Forget(_) | Command::ForgetAll => EXAMPLES,
            _ => return None,
        }
        .to_owned(),
    )
}

#[cfg(test)]
mod tests;
