//! The machine's readings: once a turn of the loop, at each beam edge, and at start-up.

use super::reset::Cause;
use crate::units::{Instant, Position};

/// The readings of one turn.
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
    /// Times that both channels changed at once since power-up, modulo 65,536.
    pub jumps: u16,
    /// Whether the end switch reports "tool out".
    pub end_switch_on: bool,
    /// Bytes of the stack never used so far.
    pub stack_free: u16,
}

impl Readings {
    /// Readings with the switches off and no fault.
    pub const fn new(now: Instant, position: Position) -> Self {
        Self { now, position, switch_on: false, lost: 0, jumps: 0, end_switch_on: false, stack_free: u16::MAX }
    }
}

/// A beam event since the last turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Edge {
    /// The level of the first or the second beam changed.
    Seen {
        /// The encoder's position at the edge.
        position: Position,
        /// The first beam's level after the edge.
        broken: bool,
        /// The second beam's level; ignored without a second beam.
        second_broken: bool,
    },
    /// The queue was full and edges were lost. The ground until now is unknown.
    Lost {
        /// The first beam's present level.
        broken: bool,
        /// The second beam's; ignored without a second beam.
        second_broken: bool,
    },
}

/// The state at start-up.
#[derive(Clone, Copy, Debug)]
pub struct Startup {
    /// The first readings.
    pub readings: Readings,
    /// Whether the beam is broken.
    pub beam_broken: bool,
    /// Why the machine was reset.
    pub cause: Cause,
    /// Whether it was at work then. Ignored at power-on.
    pub was_working: bool,
}
