//! The driven wheel's rim, calculated as a tube in torsion (Eq. 20 and the equations below it).

use std::f64::consts::PI;
use uom::si::f64::{Force, Length, Pressure, Torque};

/// Thickness of a rim from its diameters (below Eq. 20).
pub fn thickness(outer_diameter: Length, inner_diameter: Length) -> Length {
    (outer_diameter - inner_diameter) / 2.0
}

/// Inner diameter of a rim: the thickness' equation solved for it.
pub fn inner_diameter(outer_diameter: Length, thickness: Length) -> Length {
    outer_diameter - 2.0 * thickness
}

/// Thickness at which a torque makes exactly this shear stress: Eq. 20 solved for it. If a wheel is too weak even as a
/// solid disc, the result is half of its diameter.
pub fn least_thickness(torque: Torque, outer_diameter: Length, shear_strength: Pressure) -> Length {
    // The share of the outer diameter to the fourth power that the rim needs.
    let solid_stress = shear_stress(torque, outer_diameter, outer_diameter * 0.0);
    let hollow_share = 1.0 - f64::from(solid_stress / shear_strength);
    thickness(outer_diameter, outer_diameter * hollow_share.max(0.0).powf(0.25))
}

/// Torque on a wheel that gives the whole tractive force (below Eq. 20).
pub fn torque(tractive_force: Force, outer_diameter: Length) -> Torque {
    (tractive_force * outer_diameter / 2.0).into()
}

/// Shear stress at the rim's outside, Eq. 20 with the polar moment of area of a tube.
pub fn shear_stress(torque: Torque, outer_diameter: Length, inner_diameter: Length) -> Pressure {
    let fourth_power = |length: Length| length * length * length * length;
    let polar_moment = (fourth_power(outer_diameter) - fourth_power(inner_diameter)) * (PI / 32.0);
    torque * (outer_diameter / 2.0) / polar_moment
}
