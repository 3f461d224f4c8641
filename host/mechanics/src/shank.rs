//! The shanks, round rods that bend under the draft at their tip (Eq. 15 and 16).

use std::f64::consts::PI;
use uom::si::f64::{Force, Length, Pressure, Torque, Volume};

/// Greatest bending moment of a shank: the draft of its tool times the shank's length, raised by the factors for impact
/// and safety (above Eq. 15).
pub fn bending_moment(tool_draft: Force, impact_factor: f64, safety_factor: f64, length: Length) -> Torque {
    (tool_draft * impact_factor * safety_factor * length).into()
}

/// Section modulus of a round rod, Eq. 16.
pub fn section_modulus(diameter: Length) -> Volume {
    diameter * diameter * diameter * (PI / 32.0)
}

/// Bending stress in a round rod, Eq. 15 and 16.
pub fn bending_stress(moment: Torque, diameter: Length) -> Pressure {
    moment / section_modulus(diameter)
}

/// Diameter of the round rod in which a moment makes exactly this stress: Eq. 15 and 16 solved for it.
pub fn diameter(moment: Torque, stress: Pressure) -> Length {
    let section_modulus: Volume = moment / stress;
    (section_modulus * (32.0 / PI)).cbrt()
}
