//! The firmware's console, as a patient operator uses it: one command, then its whole answer.
//!
//! The firmware answers a command by its lines and then exactly one `ok` or `error: ...` (the README's console
//! chapter). [`link`] does the same over a serial port, by the PC's clock and without trust in its input. This module
//! uses the virtual Uno's clock, so the same commands always come at the same cycles. [`UnoPort`] makes a virtual Uno a
//! port of the link.

use field::native::Refused;
use link::{Counts, LineReader, advice};
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use thiserror::Error;
use uno::{Uno, UnoError};

/// Longest time of an answer. `help` and `get` write some thousand characters in a tenth of a second.
const TIMEOUT_MS: u64 = 1000;

/// Why a command had no good answer.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum ConsoleError {
    #[error(transparent)]
    Uno(#[from] UnoError),
    #[error(transparent)]
    Refused(#[from] Refused),
    #[error("the firmware does not finish its answer to `{command}`: it sent {received:?}")]
    Silent { command: String, received: String },
    #[error("the firmware's status cannot be read: {0:?}")]
    Status(Vec<String>),
}

/// A part of the time that a character takes on the line, which is 1390 cycles.
const CHARACTER_CYCLES: u64 = 500;

/// Types a command and returns the lines of its answer, the `ok` left out.
///
/// The Uno's clock runs until the answer is complete. What the firmware had sent before is dropped.
///
/// # Errors
/// If the firmware refuses, goes silent or stops.
pub fn ask(uno: &mut Uno, command: &str) -> Result<Vec<String>, ConsoleError> {
    uno.received();
    uno.send(format!("{command}\n").as_bytes());
    let (mut lines, mut answer) = (LineReader::default(), Vec::new());
    for _ in 0..TIMEOUT_MS {
        uno.run_for_ms(1)?;
        let mut received = uno.received();
        lines.take(received.as_bytes());
        while let Some(line) = lines.next_line() {
            if line == "ok" {
                // The line end belongs to the line. Bytes behind it are left for the next read.
                while received.ends_with('\r') {
                    uno.run_until(uno.cycle() + CHARACTER_CYCLES)?;
                    received += &uno.received();
                }
                return Ok(answer);
            }
            if line.starts_with("error:") {
                return Err(Refused { command: command.to_owned(), answer: line }.into());
            }
            answer.push(line);
        }
    }
    answer.push(lines.partial().to_owned());
    Err(ConsoleError::Silent { command: command.to_owned(), received: answer.join("\n") })
}

/// The firmware's answer to `status`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Status {
    /// `hold`, `work` or `alarm`.
    pub state: String,
    /// Its alarm, as `3-1 too_fast`.
    pub alarm: Option<String>,
    /// Net encoder counts since power-up.
    pub position_ticks: i64,
    /// Encoder counts that the firmware knows to have lost.
    pub lost_ticks: u64,
}

impl Status {
    /// Asks for the status.
    ///
    /// # Errors
    /// As [`ask`], and if the answer is no status.
    pub fn ask(uno: &mut Uno) -> Result<Self, ConsoleError> {
        let lines = ask(uno, "status")?;
        let parsed = match lines.as_slice() {
            [status, counts, ..] => link::Status::parse(status).zip(Counts::parse(counts)),
            _ => None,
        };
        let (status, counts) = parsed.ok_or(ConsoleError::Status(lines))?;
        Ok(Self {
            state: status.mode.name().to_owned(),
            alarm: status.alarm.map(advice::name),
            position_ticks: status.position.into(),
            lost_ticks: counts.lost.into(),
        })
    }
}

/// Longest time that a read waits for a byte, by the Uno's clock.
const READ_MS: u64 = 20;

/// A virtual Uno as a port, without a pseudo terminal. Its clock runs while it is read, as fast as possible.
pub struct UnoPort {
    uno: Uno,
    received: VecDeque<u8>,
}

impl UnoPort {
    /// A port at which this Uno is.
    pub fn new(uno: Uno) -> Self {
        Self { uno, received: VecDeque::new() }
    }

    /// The Uno, to drive its inputs.
    pub fn uno(&mut self) -> &mut Uno {
        &mut self.uno
    }
}

impl Read for UnoPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for _ in 0..READ_MS {
            if !self.received.is_empty() {
                return self.received.read(buffer);
            }
            self.uno.run_for_ms(1).map_err(io::Error::other)?;
            self.received.extend(self.uno.received_bytes().into_iter().map(|received| received.byte));
        }
        Err(io::ErrorKind::TimedOut.into())
    }
}

impl Write for UnoPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.uno.send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
