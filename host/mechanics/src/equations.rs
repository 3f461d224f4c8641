//! The paper's equations that more than one calculation uses, in its order. [`crate::design`] has the others.

use crate::unit::AreaRate;
use std::f64::consts::{PI, TAU};
use uom::si::angle::degree;
use uom::si::f64::{
    Angle, AngularVelocity, Force, Frequency, Length, Power, Pressure, Ratio, Torque, Velocity, Volume,
};

/// Coefficient of rolling resistance, Eq. 5. The constant is the wheel's own part, the rest is the soil's.
pub fn rolling_resistance_coefficient(wheel_numeric: f64) -> f64 {
    WHEELS_OWN_RESISTANCE + 1.2 / wheel_numeric
}

/// The wheel's own part of the coefficient of rolling resistance.
pub const WHEELS_OWN_RESISTANCE: f64 = 0.04;

/// Greatest pull of a tyre as a share of its load, at any slip: the limit of the formula by Wismer and Luth. Eq. 5
/// comes from the same formula.
pub const TYRE_TRACTION_LIMIT: f64 = 0.75;

/// Power at the wheels with a factor of safety, Eq. 9; the paper's 3.6 only turns km/h into m/s.
pub fn power(tractive_force: Force, speed: Velocity, safety_factor: f64) -> Power {
    tractive_force * speed * safety_factor
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
    2.0 * (Angle::new::<degree>(90.0) - weed_friction)
}

/// The friction that an apex angle suits: Eq. 13 solved for it.
pub fn weed_friction_for(apex_angle: Angle) -> Angle {
    Angle::new::<degree>(90.0) - apex_angle / 2.0
}

/// Number of sweeps that fit beside each other (above Eq. 13).
pub fn tools_that_fit(working_width: Length, sweep_width: Length) -> u32 {
    // Widths that divide without remainder must not lose a tool to rounding.
    (f64::from(working_width / sweep_width) + 1e-9) as u32
}

/// Greatest bending moment of a shank: the draft of its tool times the shank's length, raised by the factors for impact
/// and safety (above Eq. 15).
pub fn bending_moment(tool_draft: Force, impact_factor: f64, safety_factor: f64, length: Length) -> Torque {
    (tool_draft * impact_factor * safety_factor * length).into()
}

/// Bending stress in a round rod: Eq. 15 with the section modulus of Eq. 16.
pub fn bending_stress(moment: Torque, diameter: Length) -> Pressure {
    moment / (diameter * diameter * diameter * (PI / 32.0))
}

/// Diameter of the round rod in which a moment makes exactly this stress: Eq. 15 and 16 solved for it.
pub fn rod_diameter(moment: Torque, stress: Pressure) -> Length {
    let section_modulus: Volume = moment / stress;
    (section_modulus * (32.0 / PI)).cbrt()
}

/// Speed of rotation of a wheel that rolls at a speed, Eq. 17.
pub fn wheel_speed(speed: Velocity, diameter: Length) -> AngularVelocity {
    (speed / (diameter / 2.0)).into()
}

/// Speed at which a wheel rolls, Eq. 17 solved for it.
pub fn ground_speed(wheel_speed: AngularVelocity, diameter: Length) -> Velocity {
    Frequency::from(wheel_speed) * (diameter / 2.0)
}

/// Turns of the gear box's output shaft for one turn of the wheel (below Eq. 17).
pub fn chain_reduction(engine_speed: AngularVelocity, gear_box_ratio: f64, wheel_speed: AngularVelocity) -> f64 {
    f64::from(engine_speed / gear_box_ratio / wheel_speed)
}

/// Teeth of the sprocket on the wheel's shaft, before rounding (below Eq. 17).
pub fn driven_teeth(drive_teeth: u32, reduction: f64) -> f64 {
    f64::from(drive_teeth) * reduction
}

/// Links of a chain around two sprockets, before rounding, Eq. 18.
pub fn chain_links(drive_teeth: u32, driven_teeth: u32, centre_distance: Length, pitch: Length) -> f64 {
    let (drive, driven) = (f64::from(drive_teeth), f64::from(driven_teeth));
    let pitches = f64::from(centre_distance / pitch);
    (drive + driven) / 2.0 + 2.0 * pitches + ((driven - drive) / TAU).powi(2) / pitches
}

/// The next even number of links: inner and outer links alternate, and an odd number needs a weak offset link.
pub fn even_links(links: f64) -> u32 {
    2 * (links / 2.0).ceil() as u32
}

/// Torque on a wheel that gives the whole tractive force (below Eq. 20).
pub fn wheel_torque(tractive_force: Force, outer_diameter: Length) -> Torque {
    (tractive_force * outer_diameter / 2.0).into()
}

/// Shear stress at the outside of a wheel's rim, Eq. 20 with the polar moment of area of a tube.
pub fn shear_stress(torque: Torque, outer_diameter: Length, thickness: Length) -> Pressure {
    let fourth_power = |length: Length| length * length * length * length;
    let inner_diameter = outer_diameter - 2.0 * thickness;
    let polar_moment = (fourth_power(outer_diameter) - fourth_power(inner_diameter)) * (PI / 32.0);
    torque * (outer_diameter / 2.0) / polar_moment
}

/// Thickness of a rim at which a torque makes exactly this shear stress: Eq. 20 solved for it. If a wheel is too weak
/// even as a solid disc, the result is half of its diameter.
pub fn least_rim_thickness(torque: Torque, outer_diameter: Length, shear_strength: Pressure) -> Length {
    // The share of the outer diameter to the fourth power that the rim needs.
    let solid_stress = shear_stress(torque, outer_diameter, outer_diameter / 2.0);
    let hollow_share = 1.0 - f64::from(solid_stress / shear_strength);
    (outer_diameter - outer_diameter * hollow_share.max(0.0).powf(0.25)) / 2.0
}

/// Effective field capacity of a speed and a working width: Eq. 24 solved for it, with Eq. 25. The paper's 10 only
/// turns km/h times m into ha/h.
pub fn effective_capacity(speed: Velocity, working_width: Length, field_efficiency: Ratio) -> AreaRate {
    speed * working_width * field_efficiency
}
