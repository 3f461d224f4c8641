//! From the gear box to the wheels: speeds, sprockets and the chain (Eq. 17 to 19).

use std::f64::consts::TAU;
use uom::si::f64::{AngularVelocity, Frequency, Length, Velocity};

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

/// Distance of the two shafts: a number of pitches, less the length that lets the chain sag (above Eq. 18).
pub fn centre_distance(pitch: Length, pitches: f64, sag: Length) -> Length {
    pitch * pitches - sag
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

/// Length of a chain, Eq. 19.
pub fn chain_length(links: u32, pitch: Length) -> Length {
    f64::from(links) * pitch
}
