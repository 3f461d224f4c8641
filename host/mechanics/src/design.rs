//! The design of a machine: every equation, with the results of earlier ones as inputs.
//!
//! [`crate::sense`] interprets the results.

use crate::machine::{Handle, Machine, MachineError, Wheel};
use crate::unit::AreaRate;
use crate::{capacity, drive, handle, shank, tool, traction, wheel};
use uom::si::f64::{Angle, AngularVelocity, Force, Length, Power, Pressure, Ratio, Torque, Velocity};

/// The required values of a machine, and the loads of the given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Design {
    /// Weight of the machine.
    pub weight: Force,
    /// Load on each of the wheels that carry it.
    pub wheel_load: Force,
    /// Wheel numeric, Eq. 6.
    pub wheel_numeric: Ratio,
    /// Coefficient of rolling resistance, Eq. 5.
    pub rolling_resistance_coefficient: Ratio,
    /// Rolling resistance, Eq. 4.
    pub rolling_resistance: Force,
    /// Draft of all tools, Eq. 7.
    pub draft: Force,
    /// Acceleration force, Eq. 8.
    pub acceleration_force: Force,
    /// Tractive force, below Eq. 8.
    pub tractive_force: Force,
    /// Power at the wheels with its factor of safety, Eq. 9.
    pub power: Power,
    /// Power of the engine, below Eq. 9.
    pub engine_power: Power,
    /// Force of the soil on the blade in the row, Eq. 10.
    pub soil_force: Force,
    /// The same, were the blade's triangle as high as the weeding is deep.
    pub soil_force_at_depth: Force,
    /// Torque of the servo, above Eq. 10.
    pub servo_torque: Torque,
    /// Width of broken soil allowed between two rows, Eq. 11.
    pub failure_zone: Length,
    /// Greatest width of a sweep, Eq. 12.
    pub sweep_width: Length,
    /// Greatest apex angle, Eq. 13.
    pub apex_angle: Angle,
    /// Sweeps of the machine's width that fit in its working width, above Eq. 13.
    pub tools_that_fit: u32,
    /// Tools of the machine.
    pub tools: u32,
    /// Draft of one tool, Eq. 14.
    pub tool_draft: Force,
    /// The shanks between the rows, Eq. 15 and 16.
    pub inter_row_shank: ShankDesign,
    /// The shank in the row, Eq. 15 and 16.
    pub intra_row_shank: ShankDesign,
    /// Speed of rotation of the wheels, Eq. 17.
    pub wheel_speed: AngularVelocity,
    /// Speed of rotation of the gear box's output shaft.
    pub gear_box_speed: AngularVelocity,
    /// Turns of the gear box's output shaft for one turn of the wheels.
    pub chain_reduction: f64,
    /// Teeth of the sprocket on the wheels' shaft, before rounding.
    pub exact_driven_teeth: f64,
    /// The same, rounded.
    pub driven_teeth: u32,
    /// Speed of the machine with these teeth, its engine at the rated speed.
    pub ground_speed: Velocity,
    /// Distance of the two shafts, above Eq. 18.
    pub centre_distance: Length,
    /// Links of the chain before rounding, Eq. 18.
    pub exact_chain_links: f64,
    /// The next even number of links.
    pub chain_links: u32,
    /// Length of the chain, Eq. 19.
    pub chain_length: Length,
    /// Thickness of the wheel's rim.
    pub rim_thickness: Length,
    /// Its least required thickness, below Eq. 20.
    pub least_rim_thickness: Length,
    /// Torque on one wheel that gives the whole tractive force, below Eq. 20.
    pub wheel_torque: Torque,
    /// Shear stress in the rim, Eq. 20.
    pub shear_stress: Pressure,
    /// Slope of the handle, Eq. 21.
    pub handle_angle: Angle,
    /// Length of the handle, below Eq. 21.
    pub handle_length: Length,
    /// Theoretical field capacity, Eq. 25.
    pub theoretical_capacity: AreaRate,
    /// Effective field capacity, Eq. 24.
    pub effective_capacity: AreaRate,
}

/// The required values of a shank, and the load of the given one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShankDesign {
    /// Greatest bending moment, above Eq. 15.
    pub bending_moment: Torque,
    /// Least diameter, Eq. 15 and 16.
    pub diameter: Length,
    /// Bending stress in the given shank.
    pub stress: Pressure,
}

impl Design {
    /// Calculates the design of a machine.
    ///
    /// # Errors
    /// If a value of the machine is out of its range, or values do not go together.
    pub fn of(machine: &Machine) -> Result<Self, MachineError> {
        machine.check()?;
        let Machine { weeder, soil, crop, inter_row, intra_row, engine, chain, .. } = machine;

        let weight = traction::weight(weeder.mass);
        let wheel_load = weight / f64::from(machine.wheel.number);
        let Wheel { diameter: wheel_diameter, rim_thickness, .. } = machine.wheel;
        let wheel_numeric = traction::wheel_numeric(soil.cone_index, machine.wheel.width, wheel_diameter, wheel_load);
        let rolling_resistance_coefficient = traction::rolling_resistance_coefficient(wheel_numeric);
        let rolling_resistance = traction::rolling_resistance(rolling_resistance_coefficient, weight);
        let width_of_cut = f64::from(inter_row.tools) * inter_row.width + intra_row.width;
        let draft = traction::draft(soil.unit_draft, soil.depth, width_of_cut);
        let acceleration_force = traction::acceleration_force(weeder.mass, weeder.speed, weeder.acceleration_time);
        let tractive_force = traction::tractive_force(rolling_resistance, draft, acceleration_force);
        let power = traction::power(tractive_force, weeder.speed, engine.safety_factor);

        let soil_force = tool::soil_force(intra_row.blade_base, intra_row.blade_height, soil.unit_draft);
        let failure_zone = tool::failure_zone(crop.row_spacing, crop.protection_zone);
        let tools = inter_row.tools + 1;
        let tool_draft = tool::tool_draft(tractive_force, tools);
        let shank_of = |length, diameter| {
            let factors = machine.shank;
            let bending_moment =
                shank::bending_moment(tool_draft, factors.impact_factor, factors.safety_factor, length);
            ShankDesign {
                bending_moment,
                diameter: shank::diameter(bending_moment, factors.allowed_stress),
                stress: shank::bending_stress(bending_moment, diameter),
            }
        };

        let wheel_speed = drive::wheel_speed(weeder.speed, wheel_diameter);
        let gear_box_speed = engine.speed / engine.gear_box_ratio;
        let chain_reduction = drive::chain_reduction(engine.speed, engine.gear_box_ratio, wheel_speed);
        let exact_driven_teeth = drive::driven_teeth(chain.drive_teeth, chain_reduction);
        let driven_teeth = exact_driven_teeth.round() as u32;
        let wheel_speed_with_teeth = gear_box_speed * f64::from(chain.drive_teeth) / f64::from(driven_teeth);
        let centre_distance = drive::centre_distance(chain.pitch, chain.centre_distance_pitches, chain.sag);
        let exact_chain_links = drive::chain_links(chain.drive_teeth, driven_teeth, centre_distance, chain.pitch);
        let chain_links = drive::even_links(exact_chain_links);

        let inner_diameter = wheel::inner_diameter(wheel_diameter, rim_thickness);
        let wheel_torque = wheel::torque(tractive_force, wheel_diameter);
        let theoretical_capacity = capacity::theoretical(weeder.speed, weeder.working_width);
        let Handle { elbow_height, operator_distance } = machine.handle;

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
            engine_power: traction::engine_power(power, engine.transmission_efficiency),
            soil_force,
            soil_force_at_depth: tool::soil_force(intra_row.blade_base, soil.depth, soil.unit_draft),
            servo_torque: tool::servo_torque(soil_force, intra_row.shank_length),
            failure_zone,
            sweep_width: tool::sweep_width(failure_zone, soil.depth, soil.internal_friction),
            apex_angle: tool::apex_angle(crop.weed_friction),
            tools_that_fit: tool::tools_that_fit(weeder.working_width, inter_row.width),
            tools,
            tool_draft,
            inter_row_shank: shank_of(inter_row.shank_length, inter_row.shank_diameter),
            intra_row_shank: shank_of(intra_row.shank_length, intra_row.shank_diameter),
            wheel_speed,
            gear_box_speed,
            chain_reduction,
            exact_driven_teeth,
            driven_teeth,
            ground_speed: drive::ground_speed(wheel_speed_with_teeth, wheel_diameter),
            centre_distance,
            exact_chain_links,
            chain_links,
            chain_length: drive::chain_length(chain_links, chain.pitch),
            rim_thickness,
            least_rim_thickness: wheel::least_thickness(wheel_torque, wheel_diameter, machine.wheel.shear_strength),
            wheel_torque,
            shear_stress: wheel::shear_stress(wheel_torque, wheel_diameter, inner_diameter),
            handle_angle: handle::angle(elbow_height, operator_distance),
            handle_length: handle::length(elbow_height, operator_distance),
            theoretical_capacity,
            effective_capacity: capacity::effective(theoretical_capacity, weeder.field_efficiency),
        })
    }
}
