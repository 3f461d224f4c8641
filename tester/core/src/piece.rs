//! Pieces of a plan: what happens on the lines, and how many cycles after the event before.

use serde::{Deserialize, Serialize};

/// The same action one or several times, each of them a number of cycles after the event before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Piece {
    /// Cycles of the tester's clock of 16 MHz from one event to the next.
    pub wait: u32,
    /// How often, 1 to 255; 0 counts as 1.
    pub count: u8,
    /// What.
    pub action: Action,
}

/// What an event does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// The encoder goes one count forward.
    Forward,
    /// The encoder goes one count back.
    Backward,
    /// The encoder goes one count forward, and the lines of `mask` change.
    Flicker {
        /// Which lines, no channel of the encoder among them.
        mask: u8,
    },
    /// The lines of `mask` take their bits of `levels`.
    Levels {
        /// Which lines, by [`Line::bit`](crate::pins::Line::bit).
        mask: u8,
        /// Their levels.
        levels: u8,
    },
    /// From now on, the lines of `mask` keep the level that they have, also where the plan changes them: a torn or stuck wire. 0 frees all lines, and
    /// they follow the plan again.
    Freeze {
        /// Which lines.
        mask: u8,
    },
    /// Nothing, but the time passes.
    Pause,
    /// The plan ends here.
    End,
}
