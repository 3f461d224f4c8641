//! A session with a machine, without input or output: which line is typed when, which answer belongs to which command,
//! and what has happened.
//!
//! The caller opens a wire, calls [`Session::open`], and then [`Session::turn`] in a loop: with the time and what the
//! wire has received. A turn returns what has happened, and what the wire has to send. A
//! [`Connection`](super::connection::Connection) does this for a serial port of this computer, and `page` for one of the
//! browser.
//!
//! # How it works
//!
//! A session types one command at a time, and polls the status. After every start of the machine it asks for version,
//! settings and examples, and turns the events on. After a command that changes either, it asks for them again.
//! [`Session::hold`] does not wait, neither for an answer nor for the rest of those questions. The value of a `set`
//! is read back, and typed again if it is wrong.
//!
//! Each command has a number, and each number one end: [`Happening::Answered`] or [`Happening::Unanswered`].
//!
//! A command has a deadline: it is typed before that, or not at all. A machine must not start because a command was
//! delayed behind others, by a port that stalled, or by a computer that slept. Such a sleep does not count as silence of
//! the machine.
//!
//! # Limits
//!
//! The console does not say which command an answer belongs to. If a line of an answer is lost, the session may take
//! that of a later command for it, until the end of the wait.

mod changes;
mod happening;
mod holding;
mod introduction;
mod typing;

pub use self::happening::{Happening, Turn, Unanswered};
pub(crate) use self::introduction::silence;

use self::happening::{UNTIL_HOLD, named_warning};
use self::introduction::{INTRODUCTION, Introduction};
use super::moment::Moment;
use super::{ConsoleLine, EventLine, LineReader, LinkError, Mode, Status, is_command};
use control::alarm::Warning;
use std::collections::{BTreeSet, VecDeque};
use std::time::Duration;

/// Time between two polls of the status.
const POLL: Duration = Duration::from_millis(100);

/// Longest wait for an answer.
const PATIENCE: Duration = Duration::from_secs(3);

/// Longest silence during an answer to the first questions. The longest answer, all examples, takes less than a second.
pub(crate) const FIRST_PATIENCE: Duration = Duration::from_secs(2);

/// Longest time of an answer to a first question while bytes keep coming.
pub(crate) const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Most bytes that come during the answer to a first question: six times the longest valid answer.
pub(crate) const ANSWER_BYTES: usize = 40_000;

/// Longest time from a reset to the greeting: the wait of an old bootloader, and a reserve.
pub(crate) const BOOT: Duration = Duration::from_secs(3);

/// How long the line must be silent before the first question, and the longest wait for that.
const QUIET: Duration = Duration::from_millis(40);
const LONGEST_SETTLING: Duration = Duration::from_secs(1);

/// Longest time that counts as waiting between two turns. In a longer one the computer was busy, or has slept.
const LONGEST_TURN: Duration = Duration::from_millis(200);

/// The command that takes the tool out.
pub const HOLD: &str = "hold";

/// The command that the session polls with.
const STATUS: &str = "status";
const VERSION: &str = "version";
const SETTINGS: &str = "get";
const EXAMPLES: &str = "examples";
const EVENTS: &str = "events on";

/// Most commands that may wait.
const WAITING: usize = 256;

/// How far the connection has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    /// There is no wire.
    #[default]
    Closed,
    /// The wire was opened, and the Uno may be starting.
    Starting { since: Duration },
    /// The line has to become silent.
    Settling { since: Duration, heard: Duration },
    /// The machine is asked the question of this number in [`INTRODUCTION`].
    Asking(usize),
    /// The machine is connected.
    Ready,
}

/// A typed line, and when it was typed.
struct Asked {
    line: String,
    /// The number of a caller's command; `None` if the session itself asked.
    number: Option<u64>,
    since: Duration,
    /// The received lines, if the session itself asked.
    answer: Vec<String>,
}

/// A command that is not typed yet.
struct Waiting {
    number: u64,
    line: String,
    deadline: Moment,
}

/// A session with a machine; by default one without a wire.
#[derive(Default)]
pub struct Session {
    /// Whether a `hold` without an answer outlasts a loss. It is then the first line that is typed after the loss.
    pub keeps_hold: bool,
    /// Whether the events are turned on again after a command has turned them off.
    pub keeps_events: bool,
    /// Whether it asks only for the version, and does not poll.
    is_bare: bool,
    state: State,
    introduction: Introduction,
    pub(crate) lines: LineReader,
    version: String,
    /// Lines without an answer, in the order of the answers: one command, and each `hold` typed after it.
    asked: VecDeque<Asked>,
    waiting: VecDeque<Waiting>,
    /// The `set` whose value is read back before the next command.
    accepted: Option<changes::Accepted>,
    /// The last answer to `get`, unless it is believed.
    doubted: Option<Vec<String>>,
    /// The number of the `hold` to type before anything else.
    to_hold: Option<u64>,
    /// The last typed `hold`.
    held: holding::Typed,
    /// The session's own questions, typed when no command waits. `hold` does not drop them.
    own: BTreeSet<String>,
    /// When the next one may be typed.
    own_at: Duration,
    numbers: u64,
    poll_at: Duration,
    /// Whether the last typed line was the session's `status`.
    is_polled: bool,
    /// The waiting time in all turns so far, and the moment of the last turn.
    waited: Duration,
    turned: Option<Moment>,
    /// Whether nothing was received since the last turn.
    is_silent: bool,
    /// Whether the machine was at work, as far as it has told.
    is_at_work: bool,
    /// The present warning.
    warning: Option<Warning>,
    /// Whether the reason for the missing machine was reported.
    is_loss_told: bool,
    failure: Option<LinkError>,
    turn: Turn,
}

impl Session {
    /// A session that only makes sure that the weeder's firmware answers. It types nothing after that by itself.
    pub(crate) fn bare() -> Self {
        Self { is_bare: true, ..Self::default() }
    }

    /// A wire was opened; `resets` says whether that has reset the Uno.
    pub fn open(&mut self, resets: bool) {
        (self.lines, self.introduction, self.version) = Default::default();
        if resets {
            self.state = State::Starting { since: self.waited };
        } else {
            self.settle();
        }
    }

    /// The wire is gone, or cannot be opened. The next turn reports it, the first time after a connection.
    pub fn lose(&mut self, error: LinkError) {
        self.close(error.to_string());
        self.failure = Some(error);
    }

    /// The wire is closed, and why. The next turn reports it, and the ends of all commands.
    pub fn close(&mut self, why: String) {
        self.give_up(why);
        self.state = State::Closed;
    }

    /// Why there is no machine, once.
    pub fn take_failure(&mut self) -> Option<LinkError> {
        self.failure.take()
    }

    /// Types a command after the commands before it have been answered, or not at all if that is after the deadline.
    /// Returns its number, or `None` if it is no command or too many wait.
    pub fn command(&mut self, line: &str, deadline: Moment) -> Option<u64> {
        (is_command(line) && self.waiting.len() < WAITING).then(|| {
            let number = self.next_number();
            self.waiting.push_back(Waiting { number, line: line.to_owned(), deadline });
            number
        })
    }

    /// Whether no command waits for its answer.
    pub fn is_idle(&self) -> bool {
        let waits = !self.waiting.is_empty() || self.to_hold.is_some() || self.accepted.is_some();
        !waits && self.asked.iter().all(|asked| asked.number.is_none())
    }

    /// Whether there is a wire.
    pub fn is_open(&self) -> bool {
        self.state != State::Closed
    }

    /// Whether the machine has answered all first questions.
    pub fn is_connected(&self) -> bool {
        self.state == State::Ready
    }

    /// The firmware's version; empty before it has answered over this wire.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Takes what the wire has received, and returns what happened. Types nothing: the next turn does. For a caller that
    /// has to know the moment.
    pub fn listen(&mut self, received: &[u8]) -> Vec<Happening> {
        self.is_silent &= received.is_empty();
        self.introduction.bytes += received.len();
        // In pieces, because the reader stores a limited number of lines.
        for piece in received.chunks(256) {
            self.lines.take(piece);
            while let Some(line) = self.lines.next_line() {
                self.take(line);
            }
        }
        std::mem::take(&mut self.turn.happened)
    }

    /// Takes what the wire has received since the last turn, and says what it has to send.
    pub fn turn(&mut self, now: Moment, received: &[u8]) -> Turn {
        let turned = self.turned.replace(now).unwrap_or(now);
        self.waited += now.ticking.saturating_sub(turned.ticking).min(LONGEST_TURN);
        self.turn.happened = self.listen(received);
        self.wait();
        let late: VecDeque<Waiting>;
        (late, self.waiting) = self.waiting.drain(..).partition(|one| now.is_after(one.deadline));
        for Waiting { number, line, .. } in late {
            self.end(number, line, Unanswered::Late);
        }
        self.accepted.iter_mut().for_each(|set| set.expire(now));
        self.type_next();
        std::mem::take(&mut self.turn)
    }

    fn next_number(&mut self) -> u64 {
        self.numbers += 1;
        self.numbers
    }

    fn end(&mut self, number: u64, command: String, why: Unanswered) {
        self.turn.happened.push(Happening::Unanswered { number, command, why });
    }

    /// The machine is lost or has restarted: pending commands will not be answered.
    fn give_up(&mut self, why: String) {
        self.turn.is_given_up = true;
        if !std::mem::replace(&mut self.is_loss_told, true) || self.state == State::Ready {
            self.turn.happened.push(Happening::Lost(why.clone()));
        }
        let mut is_to_hold = self.to_hold.is_some();
        for Asked { line, number, .. } in std::mem::take(&mut self.asked) {
            is_to_hold |= line == HOLD;
            if let Some(number) = number {
                self.end(number, line, Unanswered::Unknown(why.clone()));
            }
        }
        if let Some(set) = self.accepted.take() {
            self.end(set.number, set.line, Unanswered::Unknown(why.clone()));
        }
        for Waiting { number, line, .. } in std::mem::take(&mut self.waiting) {
            self.end(number, line, Unanswered::NotTyped(why.clone()));
        }
        // Without a wire, it waits for the next one.
        let stays = self.keeps_hold && self.state == State::Closed;
        if let Some(number) = self.to_hold.take_if(|_| !stays) {
            let end = if self.introduction.has_held { Unanswered::Unknown } else { Unanswered::NotTyped };
            self.end(number, HOLD.to_owned(), end(why));
        }
        if !stays {
            self.to_hold = (is_to_hold && self.keeps_hold).then(|| self.next_number());
        }
        self.own.clear();
    }

    /// Goes on after a time, or gives an answer up.
    fn wait(&mut self) {
        let (waited, is_silent) = (self.waited, std::mem::replace(&mut self.is_silent, true));
        let is_over = |since: Duration, patience: Duration| waited.saturating_sub(since) > patience;
        match &mut self.state {
            State::Starting { since } if is_over(*since, BOOT) => self.settle(),
            State::Closed | State::Starting { .. } => {}
            State::Settling { since, heard } => {
                if !is_silent {
                    *heard = waited;
                }
                if waited.saturating_sub(*heard) >= QUIET || is_over(*since, LONGEST_SETTLING) {
                    self.lines = LineReader::default();
                    self.state = State::Asking(0);
                }
            }
            State::Asking(_) => {
                let Some(asked) = self.asked.front() else { return };
                let patience = if is_silent { FIRST_PATIENCE } else { ANSWER_TIME };
                if self.introduction.bytes > ANSWER_BYTES || is_over(asked.since, patience) {
                    let silence = || silence(&asked.line, &asked.answer, self.lines.partial());
                    let error = self.introduction.wrong.take().unwrap_or_else(silence);
                    self.ask_again(error);
                }
            }
            // The answer may be behind lines that came while the computer was busy.
            State::Ready => {
                if is_silent && is_over(self.held.at, holding::PATIENCE) && self.waits_for_hold() {
                    self.hold_again();
                }
                if let Some(asked) = self.asked.front().filter(|asked| is_silent && is_over(asked.since, PATIENCE)) {
                    let error = LinkError::Unanswered { command: asked.line.clone(), seconds: PATIENCE.as_secs() };
                    let late = self.asked.len() + self.held.again;
                    self.give_up(error.to_string());
                    self.introduction = Introduction { late, ..Introduction::default() };
                    self.settle();
                }
            }
        }
    }

    /// Takes a received line: a greeting, an event, or a line of an answer.
    fn take(&mut self, line: String) {
        match ConsoleLine::parse(&line) {
            ConsoleLine::Greeting { cause, was_at_work, .. } => self.restart(line, cause, was_at_work),
            ConsoleLine::Event(event) => {
                if let EventLine::CalibratedBySwitch { is_set: true, .. } = event {
                    self.own.insert(SETTINGS.to_owned());
                }
                self.report(Happening::Event(event, line));
            }
            said => self.take_answer(said, line),
        }
    }

    /// The firmware has started. It may have been at work before this session, whose opening of the port has reset it.
    fn restart(&mut self, greeting: String, cause: String, was_at_work: bool) {
        let why = format!("the Uno was reset ({cause})");
        let while_at_work = (std::mem::take(&mut self.is_at_work) | was_at_work).then_some(cause);
        self.turn.happened.push(Happening::Started { greeting, while_at_work });
        match self.state {
            State::Closed | State::Settling { .. } => {}
            State::Starting { .. } => self.settle(),
            State::Asking(question) => self.ask_again(LinkError::Restarted(INTRODUCTION[question].to_owned())),
            State::Ready => {
                self.give_up(why);
                self.introduction = Introduction::default();
                self.state = State::Asking(0);
            }
        }
    }

    /// Reports an event or a status, and stores whether the machine is at work. A log begins with the machine's state,
    /// so that comes before events during the first questions.
    fn report(&mut self, happening: Happening) {
        match &happening {
            Happening::Status(Status { mode, .. }, _) | Happening::Event(EventLine::State { mode }, _) => {
                self.is_at_work = *mode == Mode::Work;
            }
            Happening::Event(EventLine::Alarm { .. }, _) => self.is_at_work = false,
            _ => {}
        }
        match self.state {
            State::Ready => {
                let warning = happening.warning_after(self.warning);
                self.turn.happened.push(happening);
                self.warn(warning);
            }
            State::Asking(_) => self.introduction.early.push(happening),
            State::Closed | State::Starting { .. } | State::Settling { .. } => {}
        }
    }

    fn take_named(&mut self, named: Option<Warning>) {
        self.warn(self.warning.filter(|warning| UNTIL_HOLD.contains(warning)).or(named));
    }

    fn warn(&mut self, warning: Option<Warning>) {
        if std::mem::replace(&mut self.warning, warning) != warning {
            self.turn.happened.push(Happening::Warning(warning));
        }
    }

    fn take_answer(&mut self, said: ConsoleLine, line: String) {
        // The end of an abandoned answer is ignored.
        let Some(asked) = self.asked.front_mut() else { return };
        let is_own = asked.number.is_none();
        let is_ok = matches!(said, ConsoleLine::End { error: None });
        let set = if is_ok && !is_own { changes::set_by(&asked.line) } else { None };
        if !is_own && set.is_none() {
            self.turn.happened.push(Happening::Answer(line.clone()));
        }
        let refusal = match said {
            ConsoleLine::End { error } => error.map(|_| line),
            // At once, not at the answer's end: a log and a map take the machine's position from it.
            ConsoleLine::Status(status) if is_own && self.state == State::Ready => {
                asked.answer.push(line.clone());
                return self.report(Happening::Status(status, line));
            }
            // The counts, which earlier versions have fewer of.
            _ if is_own && self.state == State::Ready && line.starts_with("lost=") => {
                asked.answer.push(line.clone());
                return self.take_named(named_warning(&line));
            }
            _ => return asked.answer.extend(is_own.then_some(line)),
        };
        if self.is_of_a_hold(refusal.is_some()) {
            return;
        }
        let Some(Asked { line: command, number, answer, .. }) = self.asked.pop_front() else { return };
        if let (Some(number), Some(set)) = (number, set) {
            self.accept(number, command, set);
        } else if let Some(number) = number {
            if refusal.is_none() {
                self.own.extend(self.changed_by(&command).map(str::to_owned));
            }
            self.turn.happened.push(Happening::Answered { number, command, refusal });
        } else if let State::Asking(question) = self.state {
            self.take_first_answer(question, answer, refusal);
        } else {
            self.take_own_answer(command, answer, refusal);
        }
    }
}

#[cfg(test)]
mod tests;
