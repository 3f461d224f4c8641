//! The PC's end of the console: reads and writes the firmware's serial line.
//!
//! [`Link::open`] opens the port of a real or virtual Uno. It waits for the reset that opening a real port causes, and
//! checks that the weeder's firmware answers. [`Link::ask`] types a command and waits for its answer.
//! [`Link::next_line`] returns the lines that the machine sends by itself. A [`session`] does both, and runs until the
//! caller ends it. [`ConsoleLine`] is a parsed line. [`settings`] and [`settings_file`] transfer all settings, and
//! [`examples`] transfers all taught examples.
//!
//! Input from the port is not trusted: it may be noise, lines without an end, or another firmware. Buffers are bounded,
//! control characters are removed, and every wait has a timeout.
//!
//! A link does not reconnect. If its port is gone, it returns an error, and the session opens a new link. [`rows`] runs
//! several sessions at once. [`row_names`] maps boards to rows. This crate knows no plants and no simulator. All except
//! the serial port also compiles for a browser.

pub mod advice;
pub mod completion;
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

pub use self::console_line::{ANSWERS, ConsoleLine};
pub use self::error::LinkError;
pub use self::event_line::{
    Counts, EVENTS, EventLine, Field, LineDescription, Mode, STATUS, Status, ValueDescription, Values,
};
pub use self::lines::LineReader;
#[cfg(not(target_arch = "wasm32"))]
pub use self::port::{Claim, claim, converter_at, find_uno, is_same, listen, open_other, open_to_flash, try_port};
pub use control::{ground::class::Class, say::names};

use control::say::command::{Command, ParseError, parse};
use std::collections::VecDeque;
use std::io::{self, ErrorKind, Read, Write};
use std::time::{Duration, Instant};

/// Characters that the firmware takes in a line.
pub const COMMAND_LENGTH: usize = control::say::command::LINE_LENGTH;

/// Backspaces, which delete a line of any length.
const ERASE: &str = {
    const BACKSPACES: [u8; COMMAND_LENGTH] = [0x08; COMMAND_LENGTH];
    match str::from_utf8(&BACKSPACES) {
        Ok(text) => text,
        Err(_) => panic!("a backspace is ASCII"),
    }
};

/// Silent reads in a row after which the link gives up an answer: two seconds.
const SILENT_READS: usize = 100;

/// Longest time of an answer while lines keep coming. The longest valid answer, all examples, takes less than a second.
const ANSWER_TIME: Duration = Duration::from_secs(10);

/// Greatest length of an answer in bytes: six times the longest valid one.
const ANSWER_BYTES: usize = 40_000;

/// Silent reads until the greeting must come after a reset: the longest wait of an old bootloader, and a reserve.
const BOOT_READS: usize = 150;

/// Times that the version is asked for again.
const RETRIES: usize = 2;

/// A connection that carries bytes both ways.
///
/// A read waits some hundredths of a second at most, and then fails with [`io::ErrorKind::TimedOut`]. A read of zero
/// bytes, and any other error, means that the port is gone.
pub trait Port: Read + Write {}

impl<T: Read + Write + ?Sized> Port for T {}

/// Something from the port.
enum Received {
    Line(String),
    Bytes(usize),
    Nothing,
}

/// A link to the firmware's console.
pub struct Link {
    port: Box<dyn Port>,
    lines: LineReader,
    /// Lines that came before an answer and do not belong to it.
    events: VecDeque<String>,
    version: String,
    /// The greeting of the last restart, until a caller takes it.
    greeting: Option<String>,
    /// The serial port again, to discard what it has not sent.
    #[cfg(not(target_arch = "wasm32"))]
    serial: Option<Box<dyn serialport::SerialPort>>,
}

impl Link {
    /// Opens a port by its name, or that of the only Uno, and makes sure that the weeder's firmware answers.
    ///
    /// # Errors
    /// If the port is absent, busy or forbidden, or something else than the weeder's firmware is at its other end.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn open(port: Option<&str>) -> Result<Self, LinkError> {
        let name = port.map_or_else(|| find_uno(None), |port| Ok(port.to_owned()))?;
        let (port, resets) = port::open(&name)?;
        // Without a second handle, a stalled port may send its bytes later.
        let serial = port.try_clone().ok();
        Ok(Self { serial, ..Self::over(port, resets)? })
    }

    /// A link over a port that is open already; `resets` says whether opening it has reset the Uno.
    ///
    /// # Errors
    /// If the port is gone, or something else than the weeder's firmware is at its other end.
    pub fn over(port: impl Port + 'static, resets: bool) -> Result<Self, LinkError> {
        let mut link = Self {
            port: Box::new(port),
            lines: LineReader::default(),
            events: VecDeque::new(),
            version: String::new(),
            greeting: None,
            #[cfg(not(target_arch = "wasm32"))]
            serial: None,
        };
        if resets {
            link.greeting()?;
        }
        link.check_firmware()?;
        Ok(link)
    }

    /// Empties the line, and makes sure that the weeder's firmware answers. Asks again if another answer came: it may
    /// belong to an earlier question, or its beginning may be lost.
    pub(crate) fn check_firmware(&mut self) -> Result<(), LinkError> {
        let mut retries = 0;
        loop {
            // Deletes the beginning of a line that could not be typed whole: ended now, it would be a late command.
            self.type_line(ERASE)?;
            self.wait_until_quiet()?;
            let error = match self.ask("version") {
                Ok(answer) => match answer.last().map(|line| ConsoleLine::parse(line)) {
                    Some(ConsoleLine::Version { version }) => {
                        self.version = version;
                        break;
                    }
                    _ => LinkError::NotTheWeeder(answer.join(" ")),
                },
                // The Uno may be starting right now for another reason than this opening.
                Err(error) if error.is_of_an_answer() => error,
                Err(error) => return Err(error),
            };
            if retries == RETRIES {
                return Err(error);
            }
            retries += 1;
        }
        if retries > 0 { self.drop_late_answers(retries) } else { Ok(()) }
    }

    /// The greeting of the last restart since the last call.
    pub(crate) fn take_greeting(&mut self) -> Option<String> {
        self.greeting.take()
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

    /// Waits for the answer to a command that was typed.
    fn answer(&mut self, command: &str) -> Result<Vec<String>, LinkError> {
        let deadline = Instant::now() + ANSWER_TIME;
        let (mut silent_reads, mut bytes) = (0, 0);
        let mut answer: Vec<String> = Vec::new();
        while silent_reads < SILENT_READS && bytes < ANSWER_BYTES && Instant::now() < deadline {
            let line = match self.hear()? {
                Received::Nothing => {
                    silent_reads += 1;
                    continue;
                }
                Received::Bytes(count) => {
                    bytes += count;
                    silent_reads = 0;
                    continue;
                }
                Received::Line(line) => line,
            };
            match ConsoleLine::parse(&line) {
                ConsoleLine::End { error: None } => return Ok(answer),
                ConsoleLine::End { error: Some(_) } => {
                    return Err(LinkError::Refused { command: command.to_owned(), answer: line });
                }
                ConsoleLine::Greeting { .. } => {
                    self.greeting = Some(line);
                    return Err(LinkError::Restarted(command.to_owned()));
                }
                // The form of an event is no answer's. A newer firmware may send one at any time.
                ConsoleLine::Event(_) => self.events.push_back(line),
                _ => answer.push(line),
            }
        }
        answer.push(self.lines.partial().to_owned());
        let received = answer.join("\n");
        let strange = received.matches(lines::STRANGE).count();
        if 4 * strange > received.chars().count() {
            return Err(LinkError::Noise);
        }
        let tail = received.char_indices().rev().nth(200).map_or(0, |(at, _)| at);
        Err(LinkError::Silent { command: command.to_owned(), received: received[tail..].trim().to_owned() })
    }

    /// Asks for the status, and drops up to `count` answers before it. A virtual Uno on a busy computer may answer an
    /// earlier question at any time.
    fn drop_late_answers(&mut self, count: usize) -> Result<(), LinkError> {
        self.send("status")?;
        for _ in 0..=count {
            if self.answer("status")?.iter().any(|line| Status::parse(line).is_some()) {
                break;
            }
        }
        Ok(())
    }

    /// Types a command and does not wait for its answer, which comes by [`next_line`](Self::next_line).
    ///
    /// # Errors
    /// If it is no command, or the port is gone.
    pub fn send(&mut self, command: &str) -> Result<(), LinkError> {
        if !is_command(command) {
            return Err(LinkError::NoCommand(command.to_owned()));
        }
        self.type_line(command)
    }

    /// The next line that the machine says; none where no line was complete within a fiftieth of a second.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn next_line(&mut self) -> Result<Option<String>, LinkError> {
        if let Some(line) = self.events.pop_front() {
            return Ok(Some(line));
        }
        match self.hear()? {
            Received::Line(line) => Ok(Some(line)),
            // The line that these bytes complete is there at once.
            Received::Bytes(_) => Ok(self.lines.next_line()),
            Received::Nothing => Ok(None),
        }
    }

    /// The next of the lines that have come with earlier ones.
    pub(crate) fn buffered_line(&mut self) -> Option<String> {
        self.events.pop_front().or_else(|| self.lines.next_line())
    }

    /// Waits for the greeting of a firmware that starts. Returns whether it has come.
    ///
    /// # Errors
    /// If the port is gone.
    pub fn greeting(&mut self) -> Result<bool, LinkError> {
        for _ in 0..BOOT_READS {
            if let Some(line) = self.next_line()?.filter(|line| is_greeting(line)) {
                self.greeting = Some(line);
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// Discards what the port has not sent yet: the machine must not get a command after its sender has given it up.
    pub(crate) fn discard_unsent(&self) {
        #[cfg(not(target_arch = "wasm32"))]
        if let Some(serial) = &self.serial {
            // The port is given up in any case.
            let _ = serial.clear(serialport::ClearBuffer::Output);
        }
    }

    /// Closes the port, so that it can be opened again. The link behaves as if the port were gone.
    pub fn close(&mut self) {
        self.port = Box::new(io::empty());
        #[cfg(not(target_arch = "wasm32"))]
        {
            self.serial = None;
        }
    }

    fn type_line(&mut self, line: &str) -> Result<(), LinkError> {
        let written = self.port.write_all(format!("{line}\n").as_bytes()).and_then(|()| self.port.flush());
        written.map_err(LinkError::Gone)
    }

    /// Returns a buffered line, or reads one.
    fn hear(&mut self) -> Result<Received, LinkError> {
        if let Some(line) = self.lines.next_line() {
            return Ok(Received::Line(line));
        }
        let mut bytes = [0; 256];
        match self.port.read(&mut bytes) {
            Ok(0) => Err(LinkError::Gone(ErrorKind::UnexpectedEof.into())),
            Ok(count) => {
                self.lines.take(&bytes[..count]);
                Ok(Received::Bytes(count))
            }
            Err(error) => match error.kind() {
                ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted => Ok(Received::Nothing),
                _ => Err(LinkError::Gone(error)),
            },
        }
    }

    /// Discards input until the line is silent, for a second at most.
    fn wait_until_quiet(&mut self) -> Result<(), LinkError> {
        let deadline = Instant::now() + Duration::from_secs(1);
        let mut quiet_reads = 0;
        while quiet_reads < 2 && Instant::now() < deadline {
            quiet_reads = match self.hear()? {
                Received::Nothing => quiet_reads + 1,
                Received::Line(line) if is_greeting(&line) => {
                    self.greeting = Some(line);
                    0
                }
                _ => 0,
            };
        }
        self.lines = LineReader::default();
        Ok(())
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

/// Whether a line is the firmware's greeting after a start.
pub fn is_greeting(line: &str) -> bool {
    matches!(ConsoleLine::parse(line), ConsoleLine::Greeting { .. })
}

#[cfg(test)]
mod tests;
