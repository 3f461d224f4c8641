//! The station: obeys commands and sends records, on a board.
//!
//! It keeps the number of the last command that it obeyed, and answers a repeated one without obeying it again. Records wait in a queue
//! for the line. A record without room is dropped, but it takes its number, so the computer sees the gap.

use crate::frame::{self, Frame, Receiver};
use crate::message::{Command, PATTERN_STEPS, PROTOCOL, Record, Refusal, Step};
use crate::piece::Piece;
use heapless::Deque;

/// Records that can wait for the line.
const RECORDS: usize = 12;

/// The widths that [`Command::CheckCapture`] takes, in cycles.
const CHECKED_WIDTHS: core::ops::RangeInclusive<u16> = 200..=60_000;

/// What the station works on.
pub trait Board {
    /// The time in cycles, modulo 2^32.
    fn now(&mut self) -> u32;
    /// The position.
    fn position(&mut self) -> i32;
    /// Pieces that have room.
    fn room(&mut self) -> u8;
    /// Queues a piece; only if there is room.
    fn push(&mut self, piece: Piece);
    /// Whether a plan is being played.
    fn is_playing(&mut self) -> bool;
    /// Starts the plan. Returns when.
    fn start(&mut self) -> u32;
    /// Gives up the plan, and drops its pieces.
    fn stop(&mut self);
    /// Sets lines.
    fn set(&mut self, mask: u8, levels: u8);
    /// Pulls the weeder's reset, or releases it.
    fn reset(&mut self, pulled: bool);
    /// Plays these steps `run_up` times with delays that are longer by `slower`, and then `repeats` times.
    fn burst(&mut self, steps: &[Step], run_up: u16, repeats: u16, slower: u8);
    /// The levels that the lines have.
    fn levels(&mut self) -> u8;
    /// Makes a pulse on the capture pin.
    fn check_capture(&mut self, width: u16);
}

/// Obeys and records.
#[derive(Debug)]
pub struct Station {
    receiver: Receiver,
    /// The number of the last command, and why it was refused.
    last: Option<(u8, Option<Refusal>)>,
    records: Deque<(u8, Record), RECORDS>,
    next_number: u8,
    pattern: [Step; PATTERN_STEPS],
}

impl Default for Station {
    fn default() -> Self {
        Self::new()
    }
}

impl Station {
    /// A station that was told nothing.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            last: None,
            records: Deque::new(),
            next_number: 0,
            pattern: [Step { delay: 0, toggle: 0 }; PATTERN_STEPS],
        }
    }

    /// Takes a byte from the computer, and obeys the command that it completes. A damaged frame gets no answer.
    pub fn take(&mut self, byte: u8, board: &mut impl Board) {
        let Some(Ok((number, command))) = self.receiver.take(byte) else { return };
        let is_repeated = command != Command::Hello && self.last.is_some_and(|(last, _)| last == number);
        let refusal = match self.last {
            Some((_, refusal)) if is_repeated => refusal,
            _ => self.obey(command, board).err(),
        };
        self.last = Some((number, refusal));
        let (room, time, position, levels) = (board.room(), board.now(), board.position(), board.levels());
        self.record(Record::Done { number, refusal, room, time, position, levels, protocol: PROTOCOL });
    }

    fn obey(&mut self, command: Command, board: &mut impl Board) -> Result<(), Refusal> {
        let idle = |board: &mut dyn FnMut() -> bool| if board() { Err(Refusal::Playing) } else { Ok(()) };
        match command {
            Command::Hello => {
                board.stop();
                board.reset(false);
                board.set(crate::pins::ALL_LINES, crate::pins::AT_REST);
                self.records.clear();
            }
            Command::Pieces(pieces) => {
                if usize::from(board.room()) < pieces.len() {
                    return Err(Refusal::NoRoom);
                }
                pieces.into_iter().for_each(|piece| board.push(piece));
            }
            Command::Start => {
                idle(&mut || board.is_playing())?;
                let time = board.start();
                self.record(Record::Started { time });
            }
            Command::Stop => board.stop(),
            Command::Lines { mask, levels } => board.set(mask, levels),
            Command::Reset { pulled } => board.reset(pulled),
            Command::Pattern { from, steps } => {
                let place = self.pattern.get_mut(usize::from(from)..).ok_or(Refusal::Range)?;
                place.get_mut(..steps.len()).ok_or(Refusal::Range)?.copy_from_slice(&steps);
            }
            Command::Burst { steps, run_up, slower, repeats } => {
                idle(&mut || board.is_playing())?;
                let steps = self.pattern.get(..steps.into()).filter(|steps| !steps.is_empty()).ok_or(Refusal::Range)?;
                if repeats == 0 {
                    return Err(Refusal::Range);
                }
                board.burst(steps, run_up, repeats, slower);
            }
            Command::CheckCapture { width } => {
                if !CHECKED_WIDTHS.contains(&width) {
                    return Err(Refusal::Range);
                }
                board.check_capture(width);
            }
            Command::Clock => {}
        }
        Ok(())
    }

    /// Queues a record for the computer.
    pub fn record(&mut self, record: Record) {
        let number = self.next_number;
        self.next_number = number.wrapping_add(1);
        // One that has no room is missed by its number.
        let _ = self.records.push_back((number, record));
    }

    /// The frame of the oldest record that waits.
    pub fn next_frame(&mut self) -> Option<Frame> {
        let (number, record) = self.records.pop_front()?;
        frame::encode(number, &record)
    }
}
