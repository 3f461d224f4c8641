//! The weeding tools: soil on the blade, torque of the servo, sweeps and their number (Eq. 10 to 14).

use uom::si::angle::degree;
use uom::si::f64::{Angle, Force, Length, Pressure, Torque};

/// Force of the soil on the blade in the row, Eq. 10: the unit draft times the triangle that the blade shows to the
/// soil.
///
/// `base` and `height` are the triangle's.
pub fn soil_force(base: Length, height: Length, unit_draft: Pressure) -> Force {
    0.5 * base * height * unit_draft
}

/// Torque of the servo against a force at the end of the shank (above Eq. 10).
pub fn servo_torque(soil_force: Force, shank_length: Length) -> Torque {
    (soil_force * shank_length).into()
}

/// Width of broken soil allowed between two rows, Eq. 11.
///
/// The protection zone is that of one side of a row. Between two rows there are two.
pub fn failure_zone(row_spacing: Length, protection_zone: Length) -> Length {
    row_spacing - 2.0 * protection_zone
}

/// Width of a sweep, Eq. 12. Soil breaks over more than the sweep's own width, by its angle of internal friction.
pub fn sweep_width(failure_zone: Length, depth: Length, internal_friction: Angle) -> Length {
    failure_zone - 2.0 * depth * internal_friction.tan()
}

/// Apex angle of a sweep: twice the angle of Eq. 13. Weeds slide along edges up to this angle.
pub fn apex_angle(weed_friction: Angle) -> Angle {
    2.0 * (right_angle() - weed_friction)
}

/// The friction that an apex angle suits: Eq. 13 solved for it.
pub fn weed_friction_for(apex_angle: Angle) -> Angle {
    right_angle() - apex_angle / 2.0
}

fn right_angle() -> Angle {
    Angle::new::<degree>(90.0)
}

/// Number of sweeps that fit beside each other (above Eq. 13).
pub fn tools_that_fit(working_width: Length, sweep_width: Length) -> u32 {
    // Widths that divide without remainder must not lose a tool to rounding.
    (f64::from(working_width / sweep_width) + 1e-9) as u32
}

/// Greatest draft of one tool, Eq. 14: the whole tractive force, divided by the number of tools.
pub fn tool_draft(tractive_force: Force, tools: u32) -> Force {
    tractive_force / f64::from(tools)
}
