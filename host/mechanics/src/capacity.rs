//! The area that the machine weeds in a time (Eq. 24 and 25).

use crate::unit::AreaRate;
use uom::si::f64::{Length, Ratio, Velocity};

/// Theoretical field capacity, Eq. 25; the paper's 10 only turns km/h times m into ha/h.
pub fn theoretical(speed: Velocity, working_width: Length) -> AreaRate {
    speed * working_width
}

/// Effective field capacity: Eq. 24 solved for it.
pub fn effective(theoretical: AreaRate, field_efficiency: Ratio) -> AreaRate {
    theoretical * field_efficiency
}
