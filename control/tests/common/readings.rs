//! What a machine reads, for tests whether or not they have a classifier of their own.

use control::{
    measure::{
        readings::{Readings, Startup},
        reset::Cause,
    },
    units::{Instant, Interval, Position},
};

/// Waking up at rest, with nothing in the beam.
pub fn woken_up(cause: Cause) -> Startup {
    Startup { readings: readings(0, 0), beam_broken: false, cause }
}

/// Readings of a machine at `count`, `microseconds` after the first moment.
pub fn readings(microseconds: u64, count: i32) -> Readings {
    let now = Instant::default() + Interval::from_steps((microseconds / 4) as u32);
    Readings::new(now, Position::new(count))
}
