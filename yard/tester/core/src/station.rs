//! The station: runs commands on a board, and sends records.
//!
//! It keeps the number of the last command, and answers a repeated command without running it again. Records wait in a queue for
//! the line. A record without room is dropped, but uses up its number, so the computer sees the gap.

use crate::frame::{self, Frame, Receiver};
use crate::message::{Command, Done, PATTERN_STEPS, PROTOCOL, Record, Refusal, Step};
use crate::player::Player;
use heapless::Deque;

/// Most records in the queue.
const RECORDS: usize = 12;

/// The widths for [`Command::CheckCapture`], in cycles.
const CHECKED_WIDTHS: core::ops::RangeInclusive<u16> = 200..=60_000;

/// The hardware below the station.
pub trait Board {
    /// The time in cycles, modulo 2^32.
    fn now(&mut self) -> u32;
    /// Accesses the plan's player, between two events.
    fn player<R>(&mut self, access: impl FnOnce(&mut Player) -> R) -> R;
    /// Starts the plan. Returns the start time.
    fn start(&mut self) -> u32;
    /// Sets lines.
    fn set(&mut self, mask: u8, levels: u8);
    /// Pulls the weeder's reset low, or releases it.
    fn reset(&mut self, pulled: bool);
    /// Plays these steps `run_up` times with delays longer by `slower`, and then `repeats` times as they are.
    fn burst(&mut self, steps: &[Step], run_up: u16, repeats: u16, slower: u8);
    /// Makes a pulse on the capture pin.
    fn check_capture(&mut self, width: u16);
}

/// Runs commands and queues records.
#[derive(Debug)]
pub struct Station {
    receiver: Receiver,
    /// The number of the last command, and its error.
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
    /// A station before its first command.
    pub const fn new() -> Self {
        Self {
            receiver: Receiver::new(),
            last: None,
            records: Deque::new(),
            next_number: 0,
            pattern: [Step { delay: 0, toggle: 0 }; PATTERN_STEPS],
        }
    }

    /// Takes a byte from the computer, and runs the command that it completes. A damaged frame gets no answer.
    pub fn take(&mut self, byte: u8, board: &mut impl Board) {
        let Some((number, command)) = self.receiver.take(byte) else { return };
        let is_repeated = command != Command::Hello && self.last.is_some_and(|(last, _)| last == number);
        let refusal = match self.last {
            Some((_, refusal)) if is_repeated => refusal,
            _ => self.obey(command, board).err(),
        };
        self.last = Some((number, refusal));
        let time = board.now();
        let (room, position, levels) = board.player(|player| (player.room() as u8, player.position(), player.levels()));
        self.record(Record::Done(Done { number, refusal, room, time, position, levels, protocol: PROTOCOL }));
    }

    fn obey(&mut self, command: Command, board: &mut impl Board) -> Result<(), Refusal> {
        match command {
            Command::Start | Command::Burst { .. } if board.player(|player| player.is_playing()) => {
                return Err(Refusal::Playing);
            }
            Command::Hello => {
                board.player(Player::stop);
                board.reset(false);
                board.set(crate::pins::ALL_LINES, crate::pins::AT_REST);
                self.records.clear();
            }
            Command::Pieces(pieces) => {
                if board.player(|player| player.room()) < pieces.len() {
                    return Err(Refusal::NoRoom);
                }
                pieces.into_iter().for_each(|piece| board.player(|player| player.push(piece)));
            }
            Command::Start => {
                let time = board.start();
                self.record(Record::Started(time));
            }
            Command::Stop => board.player(Player::stop),
            Command::Lines { mask, levels } => board.set(mask, levels),
            Command::Reset { pulled } => board.reset(pulled),
            Command::Pattern { from, steps } => {
                let place = self.pattern.get_mut(usize::from(from)..).ok_or(Refusal::Range)?;
                place.get_mut(..steps.len()).ok_or(Refusal::Range)?.copy_from_slice(&steps);
            }
            Command::Burst { steps, run_up, slower, repeats } => {
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
        // The gap in the numbers reports a dropped record.
        let _ = self.records.push_back((number, record));
    }

    /// The frame of the oldest record.
    pub fn next_frame(&mut self) -> Option<Frame> {
        let (number, record) = self.records.pop_front()?;
        frame::encode(number, &record)
    }
}
