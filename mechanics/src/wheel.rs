//! The driven wheel's rim, taken as a tube in torsion (Eq. 20 and the equations below it).

use std::f64::consts::PI;
use uom::si::f64::{Force, Length, Pressure, Torque};

/// Thickness of the rim (below Eq. 20).
pub fn thickness(outer_diameter: Length, inner_diameter: Length) -> Length {
    (outer_diameter - inner_diameter) / 2.0
}

/// Torque on a wheel that gives all of the tractive force (below Eq. 20).
pub fn torque(tractive_force: Force, outer_diameter: Length) -> Torque {
    (tractive_force * outer_diameter / 2.0).into()
}

/// Shear stress at the rim's outside, Eq. 20 with the polar moment of area of a tube.
pub fn shear_stress(torque: Torque, outer_diameter: Length, inner_diameter: Length) -> Pressure {
    let fourth_power = |length: Length| length * length * length * length;
    let polar_moment = (fourth_power(outer_diameter) - fourth_power(inner_diameter)) * (PI / 32.0);
    torque * (outer_diameter / 2.0) / polar_moment
}
