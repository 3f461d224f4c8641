//! What a receiver's lines say: fixes, and marks of its faults.

use crate::plane::Place;
use crate::sentence::Quality;
use std::fmt;

/// A fix.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fix {
    /// By the record's clock, in milliseconds, less the receiver's own delay.
    pub time_ms: f64,
    /// Milliseconds UTC since its session's midnight, see [`midnights_ms`](super::Receiver::midnights_ms).
    pub utc_ms: i64,
    /// The number of its session, from 0.
    pub session: usize,
    /// Where the antenna was.
    pub place: Place,
    /// How good it is.
    pub quality: Quality,
    /// Its standard deviation to the east and to the north, in metres: of the receiver, and of its digits.
    pub error_m: f64,
    /// The number of its track. Fixes that have jumped for good begin a new one.
    pub track: u32,
}

/// A fix that has jumped.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump {
    /// The antenna's position by the receiver.
    pub place: Place,
    /// By the record's clock.
    pub time_ms: f64,
    /// Metres from the last fix that is used.
    pub far_m: f64,
    /// Metres that the wheel has rolled since.
    pub rolled_m: f64,
}

/// A fault in the receiver's output, or the end of a fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mark {
    /// There is a fix again.
    Found(Quality),
    /// There is no fix any more.
    Lost,
    /// A fix that has jumped, and is not used.
    Jumped(Jump),
    /// The fixes stay at their new position, and are used from there on.
    Stayed,
    /// The receiver's clock has stepped back by these seconds.
    Stepped(f64),
}

impl fmt::Display for Mark {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Found(quality) => write!(formatter, "fix by {quality}"),
            Self::Lost => formatter.write_str("no fix"),
            Self::Jumped(Jump { far_m, rolled_m, .. }) => {
                write!(formatter, "jumped {far_m:.2} m while the wheel rolled {rolled_m:.2} m: not used")
            }
            Self::Stayed => formatter.write_str("stays where it has jumped to: used from here on"),
            Self::Stepped(seconds) => {
                write!(formatter, "the receiver's clock went back by {seconds:.0} s: used as it is now")
            }
        }
    }
}

/// The counts of a receiver.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fixes that are used.
    pub fixes: u64,
    /// How often the fix was lost.
    pub losses: u64,
    /// Fixes that have jumped.
    pub jumps: u64,
    /// Lines that came damaged.
    pub damaged: u64,
}
