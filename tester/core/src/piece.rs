//! Pieces of a plan: an action on the lines, and the cycles since the previous event.

use serde::{Deserialize, Serialize};

/// One action, once or several times. Each is an event, a number of cycles after the previous event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Piece {
    /// Cycles (16 MHz) from one event to the next.
    pub wait: u32,
    /// Repetitions, 1 to 255; 0 counts as 1.
    pub count: u8,
    /// The action.
    pub action: Action,
}

/// The action of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// The encoder moves one count forward.
    Forward,
    /// The encoder moves one count back.
    Backward,
    /// The encoder moves one count forward, and the lines of `mask` change.
    Flicker {
        /// The lines, without the encoder's channels.
        mask: u8,
    },
    /// The lines of `mask` take their bits of `levels`.
    Levels {
        /// The lines, as bits of [`Line::bit`](crate::pins::Line::bit).
        mask: u8,
        /// Their levels.
        levels: u8,
    },
    /// From now on, the lines of `mask` keep their present level and ignore the plan: a torn or stuck wire. 0 releases all lines,
    /// and they follow the plan again.
    Freeze {
        /// The lines.
        mask: u8,
    },
    /// No change.
    Pause,
    /// The plan ends here.
    End,
}
