//! The design of a machine: every equation, with the results of earlier ones as inputs.
//!
//! [`crate::sense`] interprets the results.

use crate::equations as eq;
use crate::machine::{Machine, MachineError};
use crate::unit::AreaRate;
use uom::si::acceleration::meter_per_second_squared;
use uom::si::f64::{Acceleration, Angle, AngularVelocity, Force, Length, Power, Pressure, Torque, Velocity};

/// The required values of a machine, and the loads of the given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// Weight of the machine.
    pub weight: Force,
    /// Load on each of the wheels that carry it.
    pub wheel_load: Force,
    /// Wheel numeric, Eq. 6: how well the soil carries a wheel; the larger, the firmer.
    pub wheel_numeric: f64,
    /// Coefficient of rolling resistance, Eq. 5.
    pub rolling_resistance_coefficient: f64,
    /// Rolling resistance, Eq. 4.
    pub rolling_resistance: Force,
    /// Draft of all tools, Eq. 7: the unit draft times the area that they pull through the soil.
    pub draft: Force,
    /// Force that brings the machine from rest to its speed, Eq. 8.
    pub acceleration_force: Force,
    /// Tractive force: the sum of the three forces (below Eq. 8).
    pub tractive_force: Force,
    /// Power at the wheels with its factor of safety, Eq. 9.
    pub power: Power,
    /// Power of the engine, below Eq. 9.
    pub engine_power: Power,
    /// Force of the soil on the blade in the row, Eq. 10: the unit draft times the triangle that the blade shows.
    pub soil_force: Force,
    /// Torque of the servo, above Eq. 10.
    pub servo_torque: Torque,
    /// The same, were the blade's triangle as high as the weeding is deep.
    pub servo_torque_at_depth: Torque,
    /// Width of broken soil allowed between two rows, Eq. 11.
    pub failure_zone: Length,
    /// Greatest width of a sweep, Eq. 12.
    pub sweep_width: Length,
    /// Greatest apex angle, Eq. 13.
    pub apex_angle: Angle,
    /// Sweeps of the machine's width that fit in its working width, above Eq. 13.
    pub tools: u32,
    /// Draft of one tool, Eq. 14: the whole tractive force, divided by the number of tools.
    pub tool_draft: Force,
    /// Greatest bending moment of the shanks between the rows, above Eq. 15.
    pub inter_row_bending_moment: Torque,
    /// The same in the row.
    pub intra_row_bending_moment: Torque,
    /// Least diameter of the shanks between the rows, Eq. 15 and 16.
    pub inter_row_shank_diameter: Length,
    /// The same in the row.
    pub intra_row_shank_diameter: Length,
    /// Speed of rotation of the wheels, Eq. 17.
    pub wheel_speed: AngularVelocity,
    /// Speed of rotation of the gear box's output shaft.
    pub gear_box_speed: AngularVelocity,
    /// Turns of the gear box's output shaft for one turn of the wheels.
    pub chain_reduction: f64,
    /// Teeth of the sprocket on the wheels' shaft, before rounding.
    pub driven_teeth: f64,
    /// Speed of the machine with these teeth rounded, its engine at the rated speed.
    pub ground_speed: Velocity,
    /// Distance of the two shafts, above Eq. 18: a number of pitches, less the length that lets the chain sag.
    pub centre_distance: Length,
    /// Links of the chain before rounding, Eq. 18.
    pub exact_chain_links: f64,
    /// The next even number of links.
    pub chain_links: u32,
    /// Length of the chain, Eq. 19.
    pub chain_length: Length,
    /// Least required thickness of the wheel's rim, below Eq. 20.
    pub least_rim_thickness: Length,
    /// Torque on one wheel that gives the whole tractive force, below Eq. 20.
    pub wheel_torque: Torque,
    /// Shear stress in the rim, Eq. 20.
    pub shear_stress: Pressure,
    /// Slope of the handle against the ground, Eq. 21.
    pub handle_angle: Angle,
    /// Length of the handle from the wheel's centre, below Eq. 21.
    pub handle_length: Length,
    /// Theoretical field capacity, Eq. 25.
    pub theoretical_capacity: AreaRate,
    /// Effective field capacity, Eq. 24.
    pub effective_capacity: AreaRate,
}

impl Design {
    /// Calculates the design of a machine.
    ///
    /// # Errors
    /// If a value of the machine is out of its range, or values do not go together.
    pub fn of(machine: &Machine) -> Result<Self, MachineError> {
        machine.check()?;
        let Machine { weeder, soil, crop, inter_row, intra_row, shank, engine, chain, wheel, handle, .. } = *machine;

        // The paper's value of free fall.
        let weight = weeder.mass * Acceleration::new::<meter_per_second_squared>(9.81);
        let wheel_load = weight / f64::from(wheel.number);
        let wheel_numeric = f64::from(soil.cone_index * wheel.width * wheel.diameter / wheel_load);
        let rolling_resistance_coefficient = eq::rolling_resistance_coefficient(wheel_numeric);
        let rolling_resistance = rolling_resistance_coefficient * weight;
        let draft = soil.unit_draft * soil.depth * machine.width_of_cut();
        let acceleration_force = weeder.mass * (weeder.speed / weeder.acceleration_time);
        let tractive_force = rolling_resistance + draft + acceleration_force;
        let power = eq::power(tractive_force, weeder.speed, engine.safety_factor);

        let soil_force = |height: Length| 0.5 * intra_row.blade_base * height * soil.unit_draft;
        let servo_torque = |height: Length| (soil_force(height) * intra_row.shank_length).into();
        let failure_zone = eq::failure_zone(crop.row_spacing, crop.protection_zone);
        let tool_draft = tractive_force / f64::from(machine.tools());
        let bending_moment = |length| eq::bending_moment(tool_draft, shank.impact_factor, shank.safety_factor, length);
        let inter_row_bending_moment = bending_moment(inter_row.shank_length);
        let intra_row_bending_moment = bending_moment(intra_row.shank_length);

        let wheel_speed = eq::wheel_speed(weeder.speed, wheel.diameter);
        let gear_box_speed = engine.speed / engine.gear_box_ratio;
        let chain_reduction = eq::chain_reduction(engine.speed, engine.gear_box_ratio, wheel_speed);
        let driven_teeth = eq::driven_teeth(chain.drive_teeth, chain_reduction);
        let wheel_speed_with_teeth = gear_box_speed * f64::from(chain.drive_teeth) / driven_teeth.round();
        let centre_distance = chain.pitch * chain.centre_distance_pitches - chain.sag;
        let exact_chain_links =
            eq::chain_links(chain.drive_teeth, driven_teeth.round() as u32, centre_distance, chain.pitch);
        let chain_links = eq::even_links(exact_chain_links);
        let wheel_torque = eq::wheel_torque(tractive_force, wheel.diameter);

        Ok(Self {
            weight,
            wheel_load,
            wheel_numeric,
            rolling_resistance_coefficient,
            rolling_resistance,
            draft,
            acceleration_force,
            tractive_force,
            power,
            engine_power: power / engine.transmission_efficiency,
            soil_force: soil_force(intra_row.blade_height),
            servo_torque: servo_torque(intra_row.blade_height),
            servo_torque_at_depth: servo_torque(soil.depth),
            failure_zone,
            sweep_width: eq::sweep_width(failure_zone, soil.depth, soil.internal_friction),
            apex_angle: eq::apex_angle(crop.weed_friction),
            tools: eq::tools_that_fit(weeder.working_width, inter_row.width),
            tool_draft,
            inter_row_bending_moment,
            intra_row_bending_moment,
            inter_row_shank_diameter: eq::rod_diameter(inter_row_bending_moment, shank.allowed_stress),
            intra_row_shank_diameter: eq::rod_diameter(intra_row_bending_moment, shank.allowed_stress),
            wheel_speed,
            gear_box_speed,
            chain_reduction,
            driven_teeth,
            ground_speed: eq::ground_speed(wheel_speed_with_teeth, wheel.diameter),
            centre_distance,
            exact_chain_links,
            chain_links,
            chain_length: f64::from(chain_links) * chain.pitch,
            least_rim_thickness: eq::least_rim_thickness(wheel_torque, wheel.diameter, wheel.shear_strength),
            wheel_torque,
            shear_stress: eq::shear_stress(wheel_torque, wheel.diameter, wheel.rim_thickness),
            handle_angle: handle.elbow_height.atan2(handle.operator_distance),
            handle_length: handle.elbow_height.hypot(handle.operator_distance),
            theoretical_capacity: weeder.speed * weeder.working_width,
            effective_capacity: eq::effective_capacity(weeder.speed, weeder.working_width, weeder.field_efficiency),
        })
    }
}
