//! The handle: its slope and length from the operator's elbow and position (Eq. 21).

use uom::si::f64::{Angle, Length};

/// Slope of the handle against the ground, Eq. 21.
pub fn angle(elbow_height: Length, operator_distance: Length) -> Angle {
    elbow_height.atan2(operator_distance)
}

/// Length of the handle from the wheel's centre (below Eq. 21).
pub fn length(elbow_height: Length, operator_distance: Length) -> Length {
    elbow_height.hypot(operator_distance)
}
