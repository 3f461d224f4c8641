//! Messages: commands from the computer to the tester, and records from the tester to the computer.
//!
//! The tester answers each command by one [`Record::Done`] with the command's number. A computer that gets no answer sends the command again
//! with the same number, and the tester does not obey it a second time. Times are cycles of the tester's clock (62.5 ns), modulo 2^32.

use crate::piece::Piece;
use heapless::Vec;
use serde::{Deserialize, Serialize};

/// The version of the protocol. Both sides have to have the same.
pub const PROTOCOL: u8 = 1;

/// Pieces in a command at most.
pub const PIECES: usize = 4;

/// Steps of a pattern in a command at most.
pub const STEPS: usize = 24;

/// Steps of a pattern at most.
pub const PATTERN_STEPS: usize = 128;

/// Pieces that can wait in the tester.
pub const QUEUE_PIECES: usize = 64;

/// A step of a pattern: it waits 10 cycles and 3 for each `delay`, and then changes the lines of `toggle`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Step {
    /// 1 to 255: the step takes 10 + 3 `delay` cycles. 0 counts as 256.
    pub delay: u8,
    /// The lines that change.
    pub toggle: u8,
}

/// Cycles by which a step is longer for each 1 of its `delay`.
pub const STEP_CYCLES: u32 = 3;

/// Cycles of a step, for `delay` from 1.
pub const fn step_cycles(delay: u8) -> u32 {
    10 + STEP_CYCLES * delay as u32
}

/// Cycles that the last step of a pattern takes longer, if the pattern is repeated.
pub const REPEAT_CYCLES: u32 = 6;

/// What the computer wants.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Command {
    /// Start afresh: stop the plan, drop what waits, lines at rest, weeder's reset released.
    Hello,
    /// Append pieces to the plan. Refused as a whole if they have no room.
    Pieces(Vec<Piece, PIECES>),
    /// Play the plan.
    Start,
    /// Give up the plan.
    Stop,
    /// Set lines.
    Lines {
        /// Which lines.
        mask: u8,
        /// Their levels.
        levels: u8,
    },
    /// Pull the weeder's reset, or release it.
    Reset {
        /// Whether it is pulled.
        pulled: bool,
    },
    /// Put steps into the pattern, from a place on.
    Pattern {
        /// The place of the first.
        from: u8,
        /// The steps.
        steps: Vec<Step, STEPS>,
    },
    /// Play the pattern with interrupts off, slowly first and then as it is. Nothing else is measured meanwhile, and the clock loses time.
    Burst {
        /// Steps of the pattern, 1 to 128.
        steps: u8,
        /// How often the pattern is played with longer delays.
        run_up: u16,
        /// By how much they are longer, in units of 3 cycles.
        slower: u8,
        /// How often the pattern is played then, from 1.
        repeats: u16,
    },
    /// Make a pulse on the tester's own capture pin, and record it. The weeder must be held in reset.
    CheckCapture {
        /// The pulse's width in cycles, 200 to 60000.
        width: u16,
    },
    /// The clock's time.
    Clock,
}

/// Why a command was refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Refusal {
    /// The queue has no room for all of the pieces.
    NoRoom,
    /// A plan is being played.
    Playing,
    /// A number is outside its range.
    Range,
}

/// What the tester says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Record {
    /// The answer to a command.
    Done {
        /// The command's number.
        number: u8,
        /// Why it was refused, if it was.
        refusal: Option<Refusal>,
        /// Pieces that have room now.
        room: u8,
        /// The time.
        time: u32,
        /// The position.
        position: i32,
        /// The levels that the lines have.
        levels: u8,
        /// The protocol's version.
        protocol: u8,
    },
    /// A pulse on the servo's line.
    Pulse {
        /// When it began.
        start: u32,
        /// How long it lasted.
        width: u32,
        /// The position at its beginning.
        position: i32,
    },
    /// The weeder's LED changed.
    Led {
        /// When.
        time: u32,
        /// Whether it is lit.
        lit: bool,
    },
    /// The plan began.
    Started {
        /// When: the first piece's wait counts from here.
        time: u32,
    },
    /// The plan ended.
    Ended {
        /// When.
        time: u32,
        /// The position.
        position: i32,
        /// Events that came more than 10 us late.
        late: u16,
    },
    /// The plan stopped, because the next piece was not there in time.
    Dry {
        /// When.
        time: u32,
        /// The position.
        position: i32,
    },
    /// Pulses were lost, because the line to the computer was too slow.
    Lost {
        /// How many since the start.
        pulses: u16,
    },
}
