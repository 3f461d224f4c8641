//! Readings for all tests.

use control::{
    measure::{
        readings::{Readings, Startup},
        reset::Cause,
    },
    units::{Instant, Interval, Position},
};

/// Start-up at rest, with a clear beam.
pub fn woken_up(cause: Cause) -> Startup {
    Startup { readings: readings(0, 0), beam_broken: false, cause }
}

/// Readings at `count`, `microseconds` after power-up.
pub fn readings(microseconds: u64, count: i32) -> Readings {
    let now = Instant::default() + Interval::from_steps((microseconds / 4) as u32);
    Readings::new(now, Position::new(count))
}
