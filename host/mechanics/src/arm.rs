//! The arm of the tool in the row as a load of its servo: its mass, its inertia, and the time of a turn from rest.

use crate::machine::{IntraRow, Machine};
use crate::unit::{KG, M};
use std::f64::consts::{FRAC_PI_3, FRAC_PI_4};
use uom::si::time::second;
use uom::si::torque::newton_meter;

/// Density of the arm's steel.
const STEEL_KG_M3: f64 = 7850.0;

/// What the servo turns: a round steel rod with the blade at its end.
pub struct SwungArm {
    /// Its mass.
    pub mass_kg: f64,
    /// Moment of inertia about the servo's axis.
    pub inertia_kg_m2: f64,
    /// Torque of its weight on the axis if it lies level.
    pub weight_kg_cm: f64,
}

impl SwungArm {
    /// That of a machine.
    pub fn of(machine: &Machine) -> Self {
        let IntraRow { shank_length, shank_diameter, blade_mass, .. } = machine.intra_row;
        let [length_m, diameter_m] = [shank_length, shank_diameter].map(|length| M.value(length));
        let rod_kg = STEEL_KG_M3 * FRAC_PI_4 * diameter_m * diameter_m * length_m;
        let blade_kg = KG.value(blade_mass);
        Self {
            mass_kg: rod_kg + blade_kg,
            inertia_kg_m2: (rod_kg / 3.0 + blade_kg) * length_m * length_m,
            weight_kg_cm: (rod_kg / 2.0 + blade_kg) * 100.0 * length_m,
        }
    }
}

/// Time of a turn by these degrees from rest, ms, with the arm's inertia and against the soil. `load` is the share of the
/// servo's torque that the soil takes, from 0 to below 1.
pub fn turn_ms(machine: &Machine, degrees: f64, load: f64) -> f64 {
    let servo_time_60_s = machine.swing.servo_time_60.get::<second>();
    // The speed of rotation without load is 60 degrees in the data sheet's time.
    let constant_s = SwungArm::of(machine).inertia_kg_m2 * FRAC_PI_3
        / (servo_time_60_s * machine.intra_row.servo_torque.get::<newton_meter>());
    from_rest(1000.0 * servo_time_60_s * degrees / 60.0 / (1.0 - load), 1000.0 * constant_s)
}

/// Time of a turn from rest, by a motor whose torque falls in a straight line to zero at its greatest speed. `steady` is the turn's
/// time at the speed that it reaches in the end, and `constant` the motor's time constant, above 0, in the same unit.
pub fn from_rest(steady: f64, constant: f64) -> f64 {
    // Newton's steps from above. The curve is convex, so they stay above.
    (0..40).fold(steady + constant, |time, _| {
        let left = (-time / constant).exp();
        time - (time - constant * (1.0 - left) - steady) / (1.0 - left)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_from_rest_takes_what_a_motor_with_a_straight_line_needs() {
        // With the time constant 1 the angle after 1 is 1 / e of that at full speed, and after 3 it is 2 + 1 / e^3.
        let e = std::f64::consts::E;
        for (steady, time) in [(1.0 / e, 1.0), (2.0 + e.powi(-3), 3.0)] {
            assert!((from_rest(steady, 1.0) - time).abs() < 1e-9);
            assert!((from_rest(5.0 * steady, 5.0) - 5.0 * time).abs() < 1e-8);
        }
        // Nearly without inertia, and nearly nothing else: half of the square of the time, over the constant.
        assert!((from_rest(3.0, 1e-6) - 3.0).abs() < 1e-5);
        assert!((from_rest(0.5e-6, 1.0) - 1e-3).abs() < 1e-6);
    }
}
