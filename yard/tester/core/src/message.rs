//! Messages: commands from the computer to the tester, and records from the tester to the computer.
//!
//! The tester answers each command with one [`Record::Done`] that has the command's number. Without an answer, the computer sends
//! the command again with the same number. The tester does not run it twice. Times are cycles of the tester's clock (62.5 ns),
//! modulo 2^32.

use crate::player::Piece;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// The version of the protocol. Both sides need the same.
pub const PROTOCOL: u8 = 2;

/// Most pieces in a command.
pub const PIECES: usize = 4;

/// Most steps of a pattern in a command.
pub const STEPS: usize = 24;

/// Most steps of a pattern.
pub const PATTERN_STEPS: usize = 128;

/// A step of a pattern: it waits 10 cycles and 3 for each `delay`, and then changes the lines of `toggle`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Step {
    /// 1 to 255: the step takes 10 + 3 `delay` cycles. 0 counts as 256.
    pub delay: u8,
    /// The lines that change.
    pub toggle: u8,
}

/// Cycles for each 1 of a step's `delay`.
pub const STEP_CYCLES: u32 = 3;

/// Cycles of a step, for `delay` from 1.
pub const fn step_cycles(delay: u8) -> u32 {
    10 + STEP_CYCLES * delay as u32
}

/// Additional cycles of a pattern's last step, if the pattern is repeated.
pub const REPEAT_CYCLES: u32 = 6;

/// A command of the computer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Restart: stop the plan, drop waiting pieces and records, lines at rest, weeder's reset released.
    Hello,
    /// Append pieces to the plan. All or none of them are taken.
    Pieces(Vec<Piece, PIECES>),
    /// Play the plan.
    Start,
    /// Stop the plan.
    Stop,
    /// Set lines.
    Lines {
        /// Which lines.
        mask: u8,
        /// Their levels.
        levels: u8,
    },
    /// Pull the weeder's reset low, or release it.
    Reset {
        /// Whether it is pulled.
        pulled: bool,
    },
    /// Write steps into the pattern, from an index on.
    Pattern {
        /// The index of the first.
        from: u8,
        /// The steps.
        steps: Vec<Step, STEPS>,
    },
    /// Play the pattern with interrupts off, first with longer delays and then unchanged. No measurement runs meanwhile, and the
    /// clock loses time.
    Burst {
        /// Steps of the pattern, 1 to 128.
        steps: u8,
        /// Repetitions with longer delays.
        run_up: u16,
        /// Additional delay, in units of 3 cycles.
        slower: u8,
        /// Repetitions without it, at least 1.
        repeats: u16,
    },
    /// Make a pulse on the tester's own capture pin, and record it. The weeder must be held in reset.
    CheckCapture {
        /// The pulse's width in cycles, 200 to 60000.
        width: u16,
    },
    /// Return the clock's time.
    Clock,
}

/// Why a command failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The queue has no room for all of the pieces.
    NoRoom,
    /// A plan is being played.
    Playing,
    /// A number is outside its range.
    Range,
}

/// The answer to a command.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Done {
    /// The command's number.
    pub number: u8,
    /// The error, if the command failed.
    pub refusal: Option<Refusal>,
    /// Free places for pieces.
    pub room: u8,
    /// The time of the answer.
    pub time: u32,
    /// Counts forward less counts back since the tester's start, without those of bursts.
    pub position: i32,
    /// The levels of the lines.
    pub levels: u8,
    /// The protocol's version.
    pub protocol: u8,
}

/// A record of the tester.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Record {
    /// The answer to a command.
    Done(Done),
    /// A pulse on the servo's line.
    Pulse {
        /// The time of its rising edge.
        start: u32,
        /// Its width in cycles.
        width: u32,
    },
    /// The weeder's LED changed.
    Led {
        /// The time of the change.
        time: u32,
        /// Whether it is lit.
        lit: bool,
    },
    /// The plan began at this time: the first piece's wait counts from here.
    Started(u32),
    /// The plan ended at this position of the encoder.
    Ended(i32),
    /// The plan stopped, because the next piece came too late.
    Dry,
    /// This many pulses were lost since the last such record, because the serial line was too slow.
    Lost(u16),
}
