//! The pull on the machine: rolling resistance, draft, acceleration, tractive force and power (Eq. 4 to 9).

use uom::si::acceleration::meter_per_second_squared;
use uom::si::f64::{Acceleration, Force, Length, Mass, Power, Pressure, Ratio, Time, Velocity};

/// Acceleration of free fall, with the paper's value.
fn gravity() -> Acceleration {
    Acceleration::new::<meter_per_second_squared>(9.81)
}

/// Weight of a mass.
pub fn weight(mass: Mass) -> Force {
    mass * gravity()
}

/// Wheel numeric, Eq. 6: how well the soil carries a wheel; the larger, the firmer.
///
/// `cone_index` is that of the soil, `width` and `diameter` are the wheel's, `load` is the weight on this one wheel.
pub fn wheel_numeric(cone_index: Pressure, width: Length, diameter: Length, load: Force) -> Ratio {
    cone_index * width * diameter / load
}

/// Coefficient of rolling resistance, Eq. 5. The constant is the wheel's own part, the rest is the soil's.
pub fn rolling_resistance_coefficient(wheel_numeric: Ratio) -> Ratio {
    Ratio::from(0.04) + 1.2 / wheel_numeric
}

/// Rolling resistance of the whole machine, Eq. 4.
pub fn rolling_resistance(coefficient: Ratio, weight: Force) -> Force {
    coefficient * weight
}

/// Draft of all tools, Eq. 7: the unit draft times the area that they pull through the soil.
///
/// `width` is that of all tools together.
pub fn draft(unit_draft: Pressure, depth: Length, width: Length) -> Force {
    unit_draft * depth * width
}

/// Force that brings the machine from rest to its speed in a time, Eq. 8.
pub fn acceleration_force(mass: Mass, speed: Velocity, time: Time) -> Force {
    mass * (speed / time)
}

/// Tractive force: the sum of rolling resistance, draft and acceleration force (in the text below Eq. 8).
pub fn tractive_force(rolling_resistance: Force, draft: Force, acceleration_force: Force) -> Force {
    rolling_resistance + draft + acceleration_force
}

/// Power at the wheels with a factor of safety, Eq. 9; the paper's 3.6 only turns km/h into m/s.
pub fn power(tractive_force: Force, speed: Velocity, safety_factor: f64) -> Power {
    tractive_force * speed * safety_factor
}

/// Power of the engine that leaves `power` at the wheels (in the text below Eq. 9).
pub fn engine_power(power: Power, transmission_efficiency: Ratio) -> Power {
    power / transmission_efficiency
}

/// Greatest pull of a tyre as a share of its load, at any slip: the limit of the formula by Wismer and Luth. Eq. 5
/// comes from the same formula.
pub const TYRE_TRACTION_LIMIT: f64 = 0.75;
