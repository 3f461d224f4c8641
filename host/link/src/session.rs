//! A session: polls the machine over a link, and opens the link again if it is lost.
//!
//! The caller calls [`Session::turn`] in a loop. It types one command at a time, polls the status when no command waits,
//! and returns what happened. It waits for one read at most; only opening a port also waits for the Uno to start. Without
//! a link it does not wait, and the caller does. After every start it asks for settings and examples, and turns the
//! events on. After a command that changes either, it asks for them again. [`Session::hold`] does not wait. If the Uno is
//! lost, unanswered commands are lost too.
//!
//! A command has a deadline: it is typed before that, or not at all. A machine must not start because a command was
//! delayed behind others, by a port that stalled, or by a computer that slept. Such a sleep does not count as silence of
//! the machine.

use super::moment::Moment;
use super::settings::{self, Settings, SettingsError, Shown};
use super::{ConsoleLine, EventLine, Link, LinkError, Mode, Status};
use control::say::command::Action;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// Time between two polls of the status.
const POLL: Duration = Duration::from_millis(100);

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// Further tries to ask for everything, if an answer is missing or belongs to another question.
const RETRIES: usize = 2;

/// Pause of a caller between two turns without a link.
pub const PAUSE: Duration = Duration::from_millis(20);

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// Longest time that counts as waiting between two turns. In a longer one the computer was busy, or has slept.
const LONGEST_TURN: Duration = Duration::from_millis(200);

/// The command that takes the tool out.
pub const HOLD: &str = "hold";

/// The command that the session polls with.
const STATUS: &str = "status";
const SETTINGS: &str = "get";
const EXAMPLES: &str = "examples";
const EVENTS: &str = "events on";

/// Most commands that may wait.
const WAITING: usize = 256;

/// Something that happened in a session.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Happening {
    /// The firmware has started. An Uno that starts when its port is opened reports this too.
    Started {
        /// Its greeting, with the cause.
        greeting: String,
        /// The cause, if the machine was at work before: it has not weeded since.
        while_at_work: Option<String>,
    },
    /// The Uno is connected, or has restarted.
    Connected {
        /// The firmware's version.
        version: String,
        /// Its settings, as far as this version knows them: see [`other_version`](super::settings::other_version).
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
    /// The machine sent an event line.
    Event(EventLine, String),
    /// A command was typed.
    Command(String),
    /// A line of the answer to it. The last one is `ok` or begins with `error:`.
    Answer(String),
    /// A command was not typed: its deadline had passed. It was the first of those that waited.
    Late(String),
    /// That was the last line of the answer.
    Answered {
        /// The command.
        command: String,
        /// The line that begins with `error:`, if the firmware refused.
        refusal: Option<String>,
    },
    /// The settings after a command has changed or saved some, and the lines that show them.
    Settings(Settings, Vec<String>),
    /// The examples after a command has changed some, a line each.
    Examples(Vec<String>),
}

/// A typed line, and when it was typed.
struct Asked {
    line: String,
    /// The received lines, if the session itself asked; `None` for the caller's commands.
    own: Option<Vec<String>>,
    /// The waiting time when it was typed.
    since: Duration,
}

/// Opens a link.
type Opener = Box<dyn FnMut() -> Result<Link, LinkError>>;

/// A link that is opened again after a loss.
pub struct Session {
    /// Whether a `hold` without an answer outlasts a loss. It is then the first line that is typed after the loss.
    pub keeps_hold: bool,
    open: Opener,
    link: Option<Link>,
    /// Lines without an answer, in the order of the answers: one command, and each `hold` typed after it.
    asked: VecDeque<Asked>,
    /// Commands and their deadlines.
    waiting: VecDeque<(String, Moment)>,
    /// Whether to type `hold` before anything else.
    is_to_hold: bool,
    /// The session's own questions, typed when no command waits. `hold` does not drop them.
    own: BTreeSet<String>,
    poll_at: Option<Duration>,
    retry_at: Option<Duration>,
    /// The waiting time in all turns so far, and the moment of the last turn.
    waited: Duration,
    turned: Option<Moment>,
    /// Whether the machine was at work, as far as it has told.
    is_at_work: bool,
    /// Whether the reason for the missing Uno was not reported yet.
    is_loss_unreported: bool,
    happened: VecDeque<Happening>,
}

impl Session {
    /// A session without a link: the turns call `open` until it returns one. The first failure is reported.
    pub fn waiting_for(open: impl FnMut() -> Result<Link, LinkError> + 'static) -> Self {
        Self {
            keeps_hold: false,
            open: Box::new(open),
            link: None,
            asked: VecDeque::new(),
            waiting: VecDeque::new(),
            is_to_hold: false,
            own: BTreeSet::new(),
            poll_at: None,
            retry_at: None,
            waited: Duration::ZERO,
            turned: None,
            is_at_work: false,
            is_loss_unreported: true,
            happened: VecDeque::new(),
        }
    }

    /// Opens the missing link now. The turns then try again, without reporting this error a second time.
    ///
    /// # Errors
    /// If the link fails.
    pub fn try_now(&mut self) -> Result<(), SettingsError> {
        (self.retry_at, self.is_loss_unreported) = (Some(self.waited + RETRY), false);
        (self.open)().map_err(SettingsError::from).and_then(|link| self.connect(link))
    }

    /// Types a command after the commands before it have been answered, or not at all if that is after the deadline.
    /// False if it is no command or too many wait.
    pub fn command(&mut self, command: &str, deadline: Moment) -> bool {
        let fits = super::is_command(command) && self.waiting.len() < WAITING;
        if fits {
            self.waiting.push_back((command.to_owned(), deadline));
        }
        fits
    }

    /// Types `hold` in the next turn and drops all waiting commands. Returns how many were dropped. Answers in progress
    /// still come, before that of `hold`. A `hold` that is already typed and is the last line counts for this one too.
    pub fn hold(&mut self) -> usize {
        // The chip's receive queue is short, so a `hold` in progress is not typed again.
        self.is_to_hold |= self.asked.back().is_none_or(|asked| asked.line != HOLD);
        self.waiting.drain(..).count()
    }

    /// Turns the events on, after all waiting commands.
    pub fn turn_events_on(&mut self) {
        self.own.insert(EVENTS.to_owned());
    }

    /// Whether no command waits for its answer.
    pub fn is_idle(&self) -> bool {
        self.waiting.is_empty() && !self.is_to_hold && self.asked.iter().all(|asked| asked.own.is_some())
    }

    /// Whether the link is open.
    pub fn is_connected(&self) -> bool {
        self.link.is_some()
    }

    /// Types, reads, and returns what happened since the last turn.
    pub fn turn(&mut self, now: Moment) -> Vec<Happening> {
        let turned = self.turned.replace(now).unwrap_or(now);
        self.waited += now.ticking.saturating_sub(turned.ticking).min(LONGEST_TURN);
        let result = match self.link.take() {
            Some(link) => self.listen(link, now),
            None if self.retry_at.is_none_or(|at| self.waited >= at) => {
                let is_loss_reported = !self.is_loss_unreported;
                let opened = self.try_now();
                // The reason was reported when it was lost.
                if is_loss_reported { Ok(()) } else { opened }
            }
            None => Ok(()),
        };
        if let Err(error) = result {
            self.retry_at = Some(self.waited + RETRY);
            self.lose(error.to_string());
        }
        self.happened.drain(..).collect()
    }

    /// The Uno is gone, or has restarted: pending commands will not be answered.
    fn lose(&mut self, why: String) {
        self.is_to_hold |= self.asked.drain(..).any(|asked| asked.line == HOLD);
        self.is_to_hold &= self.keeps_hold;
        self.waiting.clear();
        self.own.clear();
        self.is_loss_unreported = false;
        self.happened.push_back(Happening::Lost(why));
    }

    /// Reports a start of the firmware.
    fn start(&mut self, greeting: String) {
        let ConsoleLine::Greeting { cause, was_at_work, .. } = ConsoleLine::parse(&greeting) else { return };
        // The machine may have been at work before this session, whose opening of the port has reset it.
        let while_at_work = (std::mem::take(&mut self.is_at_work) | was_at_work).then_some(cause);
        self.happened.push_back(Happening::Started { greeting, while_at_work });
    }

    /// Takes a link whose firmware has just started. Asks again if an answer belongs to another question, because the
    /// firmware may have restarted in the middle of one.
    fn connect(&mut self, mut link: Link) -> Result<(), SettingsError> {
        let mut introduced = introduce(&mut link);
        for _ in 0..RETRIES {
            if introduced.as_ref().err().is_none_or(|error| !error.is_of_an_answer()) {
                break;
            }
            introduced = link.check_firmware().map_err(SettingsError::from).and_then(|()| introduce(&mut link));
        }
        if let Some(greeting) = link.take_greeting() {
            self.start(greeting);
        }
        let (connected, status) = introduced?;
        self.happened.push_back(connected);
        // Before the first command, so that a log begins with the machine's state.
        status.into_iter().for_each(|status| self.report(status));
        self.link = Some(link);
        (self.poll_at, self.is_loss_unreported) = (None, false);
        Ok(())
    }

    /// Reports an event, and stores whether the machine is at work.
    fn report(&mut self, happening: Happening) {
        match &happening {
            Happening::Status(Status { mode, .. }, _) | Happening::Event(EventLine::State { mode }, _) => {
                self.is_at_work = *mode == Mode::Work;
            }
            Happening::Event(EventLine::Alarm { .. }, _) => self.is_at_work = false,
            _ => {}
        }
        self.happened.push_back(happening);
    }

    fn listen(&mut self, mut link: Link, now: Moment) -> Result<(), SettingsError> {
        // One read at most waits, so that `hold` does not.
        let mut line = link.next_line()?;
        let is_more_to_read = line.is_some();
        while let Some(read) = line {
            if let ConsoleLine::Greeting { cause, .. } = ConsoleLine::parse(&read) {
                self.start(read);
                self.lose(format!("the Uno was reset ({cause})"));
                return self.connect(link);
            }
            self.take(read);
            line = link.buffered_line();
        }
        // The answer may be behind lines that came while the computer was busy.
        let is_old = |asked: &&Asked| !is_more_to_read && self.waited.saturating_sub(asked.since) > PATIENCE;
        if let Some(Asked { line, .. }) = self.asked.front().filter(is_old) {
            link.discard_unsent();
            return Err(LinkError::Unanswered { command: line.clone(), seconds: PATIENCE.as_secs() }.into());
        }
        let next = if std::mem::take(&mut self.is_to_hold) {
            Some((HOLD.to_owned(), None))
        } else if !self.asked.is_empty() {
            None
        } else if let Some((command, deadline)) = self.waiting.pop_front() {
            if now.is_after(deadline) {
                self.happened.push_back(Happening::Late(command));
                self.link = Some(link);
                return Ok(());
            }
            Some((command, None))
        } else if self.poll_at.is_none_or(|at| self.waited >= at) {
            self.poll_at = Some(self.waited + POLL);
            Some((STATUS.to_owned(), Some(Vec::new())))
        } else {
            self.own.pop_first().map(|own| (own, Some(Vec::new())))
        };
        if let Some((line, own)) = next {
            if own.is_none() {
                self.happened.push_back(Happening::Command(line.clone()));
            }
            link.send(&line).inspect_err(|_| link.discard_unsent())?;
            self.asked.push_back(Asked { line, own, since: self.waited });
        }
        self.link = Some(link);
        Ok(())
    }

    /// Takes a received line: an event, or a line of an answer.
    fn take(&mut self, line: String) {
        let said = ConsoleLine::parse(&line);
        if let ConsoleLine::Event(event) = said {
            if let EventLine::CalibratedBySwitch { is_set: true, .. } = event {
                self.own.insert(SETTINGS.to_owned());
            }
            self.report(Happening::Event(event, line));
            return;
        }
        let is_end = matches!(said, ConsoleLine::End { .. });
        let is_done = said == ConsoleLine::End { error: None };
        // The end of an abandoned answer is ignored.
        let Some(asked) = self.asked.front_mut() else { return };
        match &mut asked.own {
            Some(lines) if is_end => match parse_answer(&asked.line, std::mem::take(lines)) {
                Ok(happening) if is_done => self.happened.extend(happening),
                // Noise has damaged a line: ask again.
                _ => drop(self.own.insert(asked.line.clone())),
            },
            // At once, not at the answer's end: a log and a map take the machine's position from it.
            Some(_) if let ConsoleLine::Status(status) = said => self.report(Happening::Status(status, line)),
            Some(lines) => lines.push(line),
            None => {
                if is_done {
                    self.own.extend(changed_by(&asked.line));
                }
                let refusal = (is_end && !is_done).then(|| line.clone());
                self.happened.push_back(Happening::Answer(line));
                if is_end {
                    self.happened.push_back(Happening::Answered { command: asked.line.clone(), refusal });
                }
            }
        }
        if is_end {
            self.asked.pop_front();
        }
    }
}

/// Asks a machine for all that a session reports at its connection. The second is its status, if it is understood.
fn introduce(link: &mut Link) -> Result<(Happening, Option<Happening>), SettingsError> {
    let shown = link.ask(SETTINGS)?;
    if !shown.iter().any(|line| settings::shown(line).is_some()) {
        return Err(LinkError::Refused { command: SETTINGS.to_owned(), answer: shown.join(" ") }.into());
    }
    let settings = Shown::by(&shown).settings;
    let examples = link.ask(EXAMPLES)?;
    link.ask(EVENTS)?;
    let status = link.ask(STATUS)?;
    let connected = Happening::Connected { version: link.version().to_owned(), settings, shown, examples };
    // A newer firmware's status may be unknown here.
    Ok((connected, parse_answer(STATUS, status)?))
}

/// Parses the answer to one of the session's own questions.
fn parse_answer(question: &str, answer: Vec<String>) -> Result<Option<Happening>, SettingsError> {
    Ok(match question {
        STATUS => answer.into_iter().find_map(|line| Some(Happening::Status(Status::parse(&line)?, line))),
        SETTINGS => Some(Happening::Settings(Shown::by(&answer).settings, answer)),
        EXAMPLES => Some(Happening::Examples(answer)),
        _ => None,
    })
}

/// The question to ask again after this command was answered by `ok`; `None` if it changes nothing.
fn changed_by(command: &str) -> Option<String> {
    Some(
        match crate::command(command).ok()?.action {
            Action::Set | Action::Save | Action::Revert | Action::Defaults | Action::Calibrate => SETTINGS,
            Action::LabelPlant
            | Action::LabelWeed
            | Action::TeachPlant
            | Action::TeachWeed
            | Action::Forget
            | Action::ForgetAll => EXAMPLES,
            _ => return None,
        }
        .to_owned(),
    )
}

#[cfg(test)]
mod tests;
