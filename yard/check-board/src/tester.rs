//! The PC's end of the tester's serial line.
//!
//! A command without an answer is sent again with the same number. Records are kept in order, and a gap in their
//! numbers is an error. The clock of a simulated line runs only while it is read. So times come from the tester, not
//! from the PC.

use crate::CheckError;
use link::Port;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use tester_core::frame::{self, Receiver};
use tester_core::message::{Command, Done, PIECES, PROTOCOL, Record, STEPS, Step};
use tester_core::player::Piece;
use uno::CYCLES_PER_SECOND;

/// Reads after which a command is sent again: up to 20 ms each, and shorter while the servo's pulses come.
const READS: usize = 30;

/// Tries of a command. A board that was reset by opening its port needs up to 2 s to start.
const TRIES: usize = 8;

/// The result of a plan.
#[derive(Clone, Debug)]
pub struct Played {
    /// Its start, in cycles modulo 2^32.
    pub start: u32,
    /// Counts forward less counts back.
    pub ticks: i32,
    /// All other records of that time.
    pub records: Vec<Record>,
}

/// The tester. Its methods fail as [`Tester::command`].
pub struct Tester {
    port: Box<dyn Port>,
    receiver: Receiver,
    number: u8,
    /// The number of the next record; `None` before the first.
    expected: Option<u8>,
    missing: u32,
    /// Answers to commands, and all other records.
    answers: Vec<Done>,
    records: Vec<Record>,
    interrupt: Arc<AtomicBool>,
}

impl Tester {
    /// The tester at this port, with its lines at rest.
    ///
    /// # Errors
    /// If no tester is at the port.
    pub fn over(port: impl Port + 'static) -> Result<Self, CheckError> {
        let mut tester = Self {
            port: Box::new(port),
            receiver: Receiver::new(),
            number: 0,
            expected: None,
            missing: 0,
            answers: Vec::new(),
            records: Vec::new(),
            interrupt: Arc::default(),
        };
        tester.command(&Command::Hello)?;
        tester.records.clear();
        tester.missing = 0;
        Ok(tester)
    }

    /// Once this is set, the next command fails. Later ones work, because they restore settings.
    pub fn interrupted_by(&mut self, interrupt: Arc<AtomicBool>) {
        self.interrupt = interrupt;
    }

    /// Sends a command to the tester.
    ///
    /// # Errors
    /// If it does not answer, refuses, or records are missing; and [`CheckError::Interrupted`].
    pub fn command(&mut self, command: &Command) -> Result<Done, CheckError> {
        if self.interrupt.swap(false, Ordering::Relaxed) {
            return Err(CheckError::Interrupted);
        }
        self.number = self.number.wrapping_add(1);
        let frame = frame::encode(self.number, command).expect("the longest command fits a frame");
        for _ in 0..TRIES {
            // The zero byte first ends a frame that noise may have begun.
            self.port.write_all(&[0]).map_err(CheckError::TesterGone)?;
            self.port.write_all(&frame).map_err(CheckError::TesterGone)?;
            self.port.flush().map_err(CheckError::TesterGone)?;
            for _ in 0..READS {
                self.hear()?;
                let Some(done) = self.answers.drain(..).find(|done| done.number == self.number) else { continue };
                return match done.refusal {
                    _ if done.protocol != PROTOCOL => Err(CheckError::Protocol(done.protocol)),
                    Some(refusal) => Err(CheckError::Refused(refusal)),
                    // Records from before the greeting may be missing.
                    None if self.missing > 0 && *command != Command::Hello => Err(CheckError::Missing(self.missing)),
                    None => Ok(done),
                };
            }
        }
        Err(CheckError::TesterSilent)
    }

    /// Reads the input, or waits up to 20 ms for it.
    fn hear(&mut self) -> Result<(), CheckError> {
        let mut bytes = [0; 256];
        let count = match self.port.read(&mut bytes) {
            Ok(0) => return Err(CheckError::TesterGone(io::ErrorKind::UnexpectedEof.into())),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::Interrupted) => 0,
            Err(error) => return Err(CheckError::TesterGone(error)),
        };
        for &byte in &bytes[..count] {
            // A damaged record is missed by its number.
            let Some((number, record)) = self.receiver.take::<Record>(byte) else { continue };
            let gap = self.expected.map_or(0, |expected| number.wrapping_sub(expected));
            self.missing += u32::from(gap);
            self.expected = Some(number.wrapping_add(1));
            match record {
                Record::Done(done) => self.answers.push(done),
                Record::Lost(pulses) => self.missing += u32::from(pulses),
                record => self.records.push(record),
            }
        }
        Ok(())
    }

    /// All new records, oldest first.
    pub fn take_records(&mut self) -> Vec<Record> {
        std::mem::take(&mut self.records)
    }

    /// Sets lines, by their bits.
    pub fn set(&mut self, mask: u8, levels: u8) -> Result<Done, CheckError> {
        self.command(&Command::Lines { mask, levels })
    }

    /// Waits by the tester's clock, in milliseconds up to 60,000. Returns the records since the last call.
    pub fn record_for_ms(&mut self, time_ms: u32) -> Result<Vec<Record>, CheckError> {
        let begin = self.command(&Command::Clock)?.time;
        while self.command(&Command::Clock)?.time.wrapping_sub(begin) < ms(time_ms) {
            self.hear()?;
        }
        Ok(self.take_records())
    }

    /// Starts a plan that has room in the tester as a whole, and returns at once.
    pub fn begin(&mut self, plan: &[Piece]) -> Result<(), CheckError> {
        self.command(&Command::Stop)?;
        self.take_records();
        for pieces in plan.chunks(PIECES) {
            self.command(&Command::Pieces(pieces.iter().copied().collect()))?;
        }
        self.command(&Command::Start).map(drop)
    }

    /// Plays a plan to its end. `meanwhile` is called some times a second.
    ///
    /// # Errors
    /// As [`Tester::command`], and if the plan reached the tester too late.
    pub fn play(
        &mut self,
        plan: &[Piece],
        mut meanwhile: impl FnMut() -> Result<(), CheckError>,
    ) -> Result<Played, CheckError> {
        self.command(&Command::Stop)?;
        self.take_records();
        let mut pieces = plan.chunks(PIECES).peekable();
        let Done { mut room, position: before, .. } = self.command(&Command::Clock)?;
        let mut is_started = false;
        let (mut start, mut records) = (0, Vec::new());
        loop {
            match pieces.next_if(|next| next.len() <= usize::from(room)) {
                Some(next) => room = self.command(&Command::Pieces(next.iter().copied().collect()))?.room,
                None => {
                    if !is_started {
                        self.command(&Command::Start)?;
                        is_started = true;
                    }
                    self.hear()?;
                    meanwhile()?;
                    room = self.command(&Command::Clock)?.room;
                }
            }
            for record in self.take_records() {
                match record {
                    Record::Started(time) => start = time,
                    Record::Ended(position) => {
                        return Ok(Played { start, ticks: position.wrapping_sub(before), records });
                    }
                    Record::Dry => return Err(CheckError::Dry),
                    record => records.push(record),
                }
            }
        }
    }

    /// Loads steps into the tester's pattern.
    pub fn load(&mut self, steps: &[Step]) -> Result<(), CheckError> {
        for (number, part) in steps.chunks(STEPS).enumerate() {
            let from = (number * STEPS) as u8;
            self.command(&Command::Pattern { from, steps: part.iter().copied().collect() })?;
        }
        Ok(())
    }
}

/// Milliseconds in cycles.
pub const fn ms(time_ms: u32) -> u32 {
    time_ms * (CYCLES_PER_SECOND / 1000) as u32
}
