//! The PC's end of the console: reads and writes the firmware's serial line.
//!
//! [`Link::open`] opens the port of a real or virtual Uno. It waits for the reset that opening a real port causes, and
//! checks that the weeder's firmware answers. [`Link::ask`] types a command and waits for its answer.
//! [`Link::next_line`] returns the lines that the machine sends by itself. A [`session`] does all of this without input
//! or output, also for a browser's port. A [`connection`] runs a session at a port of this computer, and opens a lost port
//! again. [`rows`] runs several connections at once. [`row_names`] maps boards to rows.
//!
//! [`ConsoleLine`] is a parsed line. [`settings`] and [`settings_file`] transfer all settings, and [`examples`] transfers
//! all taught examples.
//!
//! Input from the port is not trusted: it may be noise, lines without an end, or another firmware. Buffers are bounded,
//! control characters are removed, and every wait has a timeout.
//!
//! This crate knows no plants and no simulator. All except the serial port also compiles for a browser.

pub mod advice;
pub mod completion;
pub mod connection;
mod console_line;
mod error;
mod event_line;
pub mod examples;
mod lines;
pub mod moment;
#[cfg(not(target_arch = "wasm32"))]
mod port;
#[cfg(not(target_arch = "wasm32"))]
pub mod row_names;
#[cfg(not(target_arch = "wasm32"))]
pub mod rows;
pub mod session;
pub mod settings;
pub mod settings_file;
mod wire;

pub use self::console_line::{ANSWERS, ConsoleLine};
pub use self::error::LinkError;
pub use self::event_line::{
    Counts, EVENTS, EventLine, Field, LineDescription, Mode, STATUS, Status, ValueDescription, Values,
};
pub use self::lines::LineReader;
#[cfg(not(target_arch = "wasm32"))]
pub use self::port::{Claim, claim, converter_at, find_uno, is_same, listen, open_other, open_to_flash, try_port};
pub use self::wire::{Port, Wire};
pub use control::{ground::class::Class, say::names};

use self::moment::Moment;
use self::session::Session;
use control::say::command::{Command, ParseError, parse};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Characters that the firmware takes in a line.
pub const COMMAND_LENGTH: usize = control::say::command::LINE_LENGTH;

/// Further answers to a question that needs two of the same.
const SURE_TRIES: usize = 3;

/// Time that a read takes in which nothing comes, and that of another one, on average.
const SILENT_READ: Duration = Duration::from_millis(20);
const BUSY_READ: Duration = Duration::from_millis(10);

/// Silent reads in a row after which the link gives up an answer.
const SILENT_READS: u128 = session::FIRST_PATIENCE.as_millis() / SILENT_READ.as_millis();

/// Silent reads until the greeting must come after a reset.
const BOOT_READS: u128 = session::BOOT.as_millis() / SILENT_READ.as_millis();

/// A link to the firmware's console.
pub struct Link {
    wire: Wire,
    lines: LineReader,
    /// Lines that came before an answer and do not belong to it.
    events: VecDeque<String>,
    version: String,
}

impl Link {
    /// Opens a port by its name, or that of the only Uno, and makes sure that the weeder's firmware answers.
    ///
    /// # Errors
    /// If the port is absent, busy or forbidden, or something else than the weeder's firmware is at its other end.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn open(port: Option<&str>) -> Result<Self, LinkError> {
        Self::over(Wire::open(port)?)
    }

    /// A link over a wire.
    ///
    /// # Errors
    /// If the port is gone, or something else than the weeder's firmware is at its other end.
    pub fn over(mut wire: Wire) -> Result<Self, LinkError> {
        let mut session = Session::bare();
        session.open(wire.resets);
        // A port's reads are its clock: a simulated one has no other.
        let mut now = Moment::default();
        while !session.is_connected() {
            let received = wire.read()?;
            now = now.after(if received.is_empty() { SILENT_READ } else { BUSY_READ });
            let turn = session.turn(now, &received);
            wire.write(&turn.to_send)?;
            session.take_failure().map_or(Ok(()), Err)?;
        }
        let version = session.version().to_owned();
        Ok(Self { wire, lines: session.lines, events: VecDeque::new(), version })
    }

    /// The firmware's version.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Types a command and returns the lines of its answer, the `ok` left out.
    ///
    /// # Errors
    /// If it is no command, the firmware refuses, or no whole answer comes.
    pub fn ask(&mut self, command: &str) -> Result<Vec<String>, LinkError> {
        self.send(command)?;
        self.answer(command)
    }

    /// Asks for what does not change, until two answers in a row are the same: noise may damage a digit, or lose a line.
    ///
    /// # Errors
    /// As [`ask`](Self::ask) has them, and [`LinkError::Unsteady`].
    pub fn ask_surely(&mut self, question: &str) -> Result<Vec<String>, LinkError> {
        let mut before = self.ask(question)?;
        for _ in 0..SURE_TRIES {
            let answer = self.ask(question)?;
            if answer == before {
                return Ok(answer);
            }
            before = answer;
        }
        Err(LinkError::Unsteady(question.to_owned()))
    }

    /// Waits for the answer to a command that was typed.
    fn answer(&mut self, command: &str) -> Result<Vec<String>, LinkError> {
        // A computer that stood still finds the answer there: of each read only its usual time counts.
        let mut waited = Duration::ZERO;
        let (mut silent_reads, mut bytes) = (0, 0);
        let mut answer: Vec<String> = Vec::new();
        while silent_reads < SILENT_READS && bytes < session::ANSWER_BYTES && waited < session::ANSWER_TIME {
            let Some(line) = self.lines.next_line() else {
                let began = Instant::now();
                let received = self.receive()?;
                waited += began.elapsed().min(SILENT_READ);
                silent_reads = if received == 0 { silent_reads + 1 } else { 0 };
                bytes += received;
                continue;
            };
            match ConsoleLine::parse(&line) {
                ConsoleLine::End { error: None } => return Ok(answer),
                ConsoleLine::End { error: Some(_) } => {
                    return Err(LinkError::Refused { command: command.to_owned(), answer: line });
                }
                ConsoleLine::Greeting { .. } => return Err(LinkError::Restarted(command.to_owned())),
                // The form of an event is no answer's. A newer firmware may send one at any time.
                ConsoleLine::Event(_) => self.events.push_back(line),
                _ => answer.push(line),
            }
        }
        Err(session::silence(command, &answer, self.lines.partial()))
    }

    /// Types a command and does not wait for its answer, which comes by [`next_line`](Self::next_line).
    ///
    /// # Errors
    /// If it is no command, or the port is gone.
    pub fn send(&mut self, command: &str) -> Result<(), LinkError> {
        if !is_command(command) {
            return Err(LinkError::NoCommand(command.to_owned()));
        }
        self.wire.write(format!("{command}\n").as_bytes())
    }

    /// The next line that the machine says; none where no line was complete within a fiftieth of a second.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn next_line(&mut self) -> Result<Option<String>, LinkError> {
        let buffered = self.events.pop_front().or_else(|| self.lines.next_line());
        if buffered.is_none() {
            self.receive()?;
        }
        Ok(buffered.or_else(|| self.lines.next_line()))
    }

    /// Waits for the greeting of a firmware that starts. Returns whether it has come.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn greeting(&mut self) -> Result<bool, LinkError> {
        for _ in 0..BOOT_READS {
            let line = self.next_line()?.unwrap_or_default();
            if let ConsoleLine::Greeting { .. } = ConsoleLine::parse(&line) {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Closes the port, so that it can be opened again. The link behaves as if the port were gone.
    pub fn close(&mut self) {
        self.wire = Wire::over(std::io::empty(), false);
    }

    /// Reads from the port. Returns the number of bytes.
    fn receive(&mut self) -> Result<usize, LinkError> {
        let bytes = self.wire.read()?;
        self.lines.take(&bytes);
        Ok(bytes.len())
    }
}

/// Whether this text can be typed into the console: one line of printable ASCII, and short enough.
pub fn is_command(line: &str) -> bool {
    line.len() <= COMMAND_LENGTH && line.bytes().all(|byte| matches!(byte, b' '..=b'~'))
}

/// The command that the firmware reads from a typed line, in small or capital letters.
///
/// # Errors
/// A [`ParseError`] where the firmware answers with an error.
pub fn command(line: &str) -> Result<Command, ParseError> {
    parse(line.to_ascii_lowercase().as_bytes())
}

/// Whether a line means `hold`: in any case, with any punctuation at its end. An operator in a hurry types it.
pub fn is_hold(line: &str) -> bool {
    line.trim().trim_end_matches(|last: char| last.is_ascii_punctuation()).trim_end().eq_ignore_ascii_case("hold")
}

#[cfg(test)]
mod tests;
