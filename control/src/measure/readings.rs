//! What the machine reads of itself: once a turn of the loop, an edge of the beam whenever one comes, and when it wakes up.

use super::reset::Cause;
use crate::units::{Instant, Position};

/// What the main loop reads from the machine for a turn.
#[derive(Clone, Copy, Debug)]
pub struct Readings {
    /// The time of the reading.
    pub now: Instant,
    /// The encoder's position.
    pub position: Position,
    /// Whether the work switch is at work.
    pub switch_on: bool,
    /// Encoder ticks known to be lost since power-up, modulo 65,536.
    pub lost: u16,
    /// Times that both of the encoder's channels had changed at once, modulo 65,536.
    pub jumps: u16,
    /// Whether the end switch, if there is one, says that the tool is out.
    pub end_switch_on: bool,
    /// Bytes of the stack that were never used.
    pub stack_free: u16,
}

impl Readings {
    /// Readings of a machine with its switches off and nothing wrong.
    pub const fn new(now: Instant, position: Position) -> Self {
        Self { now, position, switch_on: false, lost: 0, jumps: 0, end_switch_on: false, stack_free: u16::MAX }
    }
}

/// What came from the beam since the last turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// The beam broke or cleared, or the second one did.
    Seen {
        /// What the encoder showed when it came.
        position: Position,
        /// Whether the beam is broken from here on.
        broken: bool,
        /// Whether the second beam is; nobody looks at it where there is none.
        second_broken: bool,
    },
    /// Edges found no room to wait in: what stood there is not known, and neither is the beam's level until then.
    Lost {
        /// Whether the beam is broken now.
        broken: bool,
    },
}

/// How the machine woke up.
#[derive(Clone, Copy, Debug)]
pub struct Startup {
    /// The first readings.
    pub readings: Readings,
    /// Whether something is in the beam.
    pub beam_broken: bool,
    /// Why the machine was reset.
    pub cause: Cause,
}
