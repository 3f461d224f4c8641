//! The machine: the inputs of its design calculations, each with its range and the paper's value as default.
//!
//! The table below declares every input once: its section and key in a machine file, its kind, the paper's value, the
//! range and the meaning. The structures, their defaults, the check of the ranges and the commented file are made from
//! it.

use crate::equations as eq;
use crate::figure::digits;
use crate::unit::{COUNT, DEGREE, FACTOR, HP, KG, KG_CM, KM_H, KPA, MM, MPA, PERCENT, RPM, SECOND, read};
use serde::{Deserialize, Serialize};
use std::fmt::Write;
use thiserror::Error;
use uom::si::f64::{Angle, AngularVelocity, Length, Mass, Power, Pressure, Ratio, Time, Torque, Velocity};

/// One input of a machine, as in a machine file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Input {
    /// Section of the file.
    pub section: &'static str,
    /// Key within it.
    pub key: &'static str,
    /// Its meaning.
    pub about: &'static str,
    /// Its value in `unit`.
    pub value: f64,
    /// Its unit; empty for plain numbers.
    pub unit: &'static str,
    /// Least value in `unit`.
    pub least: f64,
    /// Greatest value in `unit`.
    pub most: f64,
}

impl Input {
    /// The value as written in a machine file.
    pub fn written(&self) -> String {
        // The conversion of units leaves an error in the last digits. A value far out of range would show too many
        // digits.
        let rounded = (self.value * 1e9).round() / 1e9;
        let value = if rounded.abs() < 1e9 { rounded.to_string() } else { format!("{:e}", self.value) };
        if self.unit.is_empty() { value } else { format!("\"{value} {}\"", self.unit) }
    }

    /// The range in words.
    pub fn range(&self) -> String {
        format!("from {} to {} {}", self.least, self.most, self.unit).trim_end().to_owned()
    }

    /// Whether the value lies in its range, but for the rounding of conversions. NaN does not.
    fn is_in_range(&self) -> bool {
        let rounding = 1e-9 * self.most.abs();
        (self.least - rounding..=self.most + rounding).contains(&self.value)
    }
}

/// Why a machine cannot be calculated.
#[derive(Clone, Debug, PartialEq, Error)]
#[error("{problem}")]
pub struct MachineError {
    /// Section and key of the value to change first.
    pub place: (&'static str, &'static str),
    /// The problem, and what would be right.
    pub problem: String,
}

/// Teeth of the largest accepted sprocket.
const MOST_TEETH: u32 = 1000;

/// Teeth of a common driven sprocket.
const USUAL_TEETH: u32 = 40;

/// Declares the sections of a machine file and their values, and makes the code for them.
macro_rules! sections {
    ($($(#[doc = $title:literal])+ $section:ident: $name:ident {$(
        $(#[doc = $about:literal])+
        $key:ident: $quantity:ty = $value:literal, $unit:ident, $least:literal to $most:literal;
    )+})+) => {
        $(
            $(#[doc = $title])+
            #[derive(Clone, Copy, Debug, PartialEq, Deserialize)]
            #[serde(default, deny_unknown_fields, expecting = "a section with keys below its name in brackets")]
            pub struct $name {
                $($(#[doc = $about])+ #[serde(deserialize_with = "read")] pub $key: $quantity,)+
            }

            impl Default for $name {
                fn default() -> Self {
                    Self { $($key: $unit.of($value)),+ }
                }
            }
        )+

        /// A machine. Its default is the paper's.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Deserialize)]
        #[serde(default, deny_unknown_fields)]
        pub struct Machine {
            $($(#[doc = $title])+ pub $section: $name,)+
        }

        impl Machine {
            /// All inputs, in the order of the file.
            pub fn inputs(&self) -> Vec<Input> {
                vec![$($(
                    Input {
                        section: stringify!($section),
                        key: stringify!($key),
                        about: concat!($($about),+),
                        value: $unit.value(self.$section.$key),
                        unit: $unit.name,
                        least: $least,
                        most: $most,
                    },
                )+)+]
            }
        }

        const TITLES: &[(&str, &str)] = &[$((stringify!($section), concat!($($title),+))),+];
    };
}

sections! {
    /// The weeder as a whole, and the pace of its work.
    weeder: Weeder {
        /// Mass, ready for work (Table 1, no. 5).
        mass: Mass = 65.0, KG, 1.0 to 5000.0;
        /// Speed of work.
        speed: Velocity = 2.5, KM_H, 0.1 to 15.0;
        /// Time from rest to that speed.
        acceleration_time: Time = 2.0, SECOND, 0.1 to 60.0;
        /// Width that all tools weed together.
        working_width: Length = 400.0, MM, 50.0 to 10000.0;
        /// Share of the theoretical capacity that is reached, turns and stops included.
        field_efficiency: Ratio = 86.25, PERCENT, 1.0 to 100.0;
    }
    /// The soil, and how deep it is weeded.
    soil: Soil {
        /// Cone index: how firm the soil is; 500 kPa is wet stubble.
        cone_index: Pressure = 500.0, KPA, 50.0 to 5000.0;
        /// Unit draft: resistance of the soil against an area that is pulled through it.
        unit_draft: Pressure = 49.05, KPA, 1.0 to 500.0;
        /// Angle of the soil's internal friction.
        internal_friction: Angle = 30.0, DEGREE, 0.0 to 60.0;
        /// Depth of weeding.
        depth: Length = 25.0, MM, 1.0 to 300.0;
    }
    /// The crop's rows.
    crop: Crop {
        /// Distance from row to row.
        row_spacing: Length = 300.0, MM, 50.0 to 3000.0;
        /// Ground that is left alone on each side of a row.
        protection_zone: Length = 50.0, MM, 0.0 to 500.0;
        /// Angle of friction between weeds and a cutting edge; 30 to 50 degrees are usual.
        weed_friction: Angle = 50.0, DEGREE, 5.0 to 85.0;
    }
    /// The tools between the rows.
    inter_row: InterRow {
        /// Number of tools.
        tools: u32 = 4.0, COUNT, 0.0 to 50.0;
        /// Width of a sweep (Table 1, no. 9).
        width: Length = 80.0, MM, 5.0 to 1000.0;
        /// Apex angle of a sweep: the angle between its two edges.
        apex_angle: Angle = 120.0, DEGREE, 10.0 to 170.0;
        /// Length of a shank from its holder to the tip; the rod of Table 1 is longer.
        shank_length: Length = 400.0, MM, 20.0 to 2000.0;
        /// Diameter of a shank (Table 1, no. 9).
        shank_diameter: Length = 16.0, MM, 2.0 to 200.0;
    }
    /// The tool in the row and its servo. There is one of each.
    intra_row: IntraRow {
        /// Width of cut; Eq. 7 takes 50 mm, though the sweep of Table 1 has 55 mm.
        width: Length = 50.0, MM, 5.0 to 1000.0;
        /// Length of the blade along the row, which a swing pushes through the soil: base of the triangle (b in Eq. 10). X is to its middle.
        blade_base: Length = 45.0, MM, 1.0 to 500.0;
        /// Height of that triangle (h in Eq. 10).
        blade_height: Length = 10.0, MM, 1.0 to 300.0;
        /// Mass of the blade with its clamp, at the end of the shank.
        blade_mass: Mass = 0.2, KG, 0.01 to 20.0;
        /// Length of the shank, the arm on which the servo turns the blade (Table 1, no. 9).
        shank_length: Length = 350.0, MM, 20.0 to 2000.0;
        /// Diameter of the shank (Table 1, no. 9).
        shank_diameter: Length = 14.0, MM, 2.0 to 200.0;
        /// Torque that the servo holds.
        servo_torque: Torque = 60.0, KG_CM, 0.1 to 5000.0;
    }
    /// The swing of the tool in the row, out of the crop's way.
    swing: SwingInputs {
        /// Widest canopy that the tool has to clear.
        widest_canopy: Length = 190.0, MM, 5.0 to 1000.0;
        /// Width round a stem that no tool may enter; 0 where whole canopies are kept.
        protected: Length = 0.0, MM, 0.0 to 200.0;
        /// How far a stem stands off the middle of its canopy, along the row.
        stem_off: Length = 10.0, MM, 0.0 to 100.0;
        /// Room between the tool that is out and that canopy or zone: plants off the row's line, a machine that strays, and play at the tip.
        room: Length = 10.0, MM, 0.0 to 300.0;
        /// How the arm hangs: 0 as a pendulum across the row, 1 if it trails along the row behind its pivot.
        arm_trails: u32 = 0.0, COUNT, 0.0 to 1.0;
        /// From the row's line to the nearest sweep's edge.
        sweep_from: Length = 50.0, MM, 5.0 to 1000.0;
        /// Time that the servo takes for 60 degrees without load, as its data sheet has it.
        servo_time_60: Time = 0.16, SECOND, 0.01 to 5.0;
        /// Shortest time from a pulse until the servo moves; hobby servos: 0.05 s.
        least_dead_time: Time = 0.05, SECOND, 0.0 to 0.5;
        /// Longest such time, under load; hobby servos: 0.08 s.
        most_dead_time: Time = 0.08, SECOND, 0.0 to 0.5;
        /// Change of the pulse that turns the servo by 90 degrees, in microseconds.
        pulse_for_90: f64 = 1000.0, FACTOR, 200.0 to 2500.0;
        /// Pulse with the tool in the row, in microseconds.
        pulse_in: f64 = 1500.0, FACTOR, 500.0 to 2500.0;
    }
    /// The steel of the shanks, and their load.
    shank: Shank {
        /// Bending stress that the steel may see; 56 MPa is the paper's for mild steel.
        allowed_stress: Pressure = 56.0, MPA, 1.0 to 2000.0;
        /// Factor of safety.
        safety_factor: f64 = 2.0, FACTOR, 1.0 to 10.0;
        /// Times the steady draft that a stone or root hits with.
        impact_factor: f64 = 2.0, FACTOR, 1.0 to 10.0;
    }
    /// The engine, and its drive to the wheels.
    engine: Engine {
        /// Rated power (Table 1, no. 3).
        power: Power = 2.5, HP, 0.01 to 200.0;
        /// Rated speed.
        speed: AngularVelocity = 3600.0, RPM, 10.0 to 20000.0;
        /// Turns of the engine for one of the gear box's output shaft.
        gear_box_ratio: f64 = 40.0, FACTOR, 1.0 to 1000.0;
        /// Share of the engine's power that reaches the wheels.
        transmission_efficiency: Ratio = 90.0, PERCENT, 10.0 to 100.0;
        /// Factor of safety of the power (Eq. 9).
        safety_factor: f64 = 2.0, FACTOR, 1.0 to 10.0;
    }
    /// The roller chain from the gear box to the wheels; the default is an 08B.
    chain: Chain {
        /// Pitch.
        pitch: Length = 12.7, MM, 3.0 to 80.0;
        /// Teeth of the sprocket on the gear box.
        drive_teeth: u32 = 14.0, COUNT, 6.0 to 150.0;
        /// Distance of the shafts in pitches; 30 to 50 is good practice.
        centre_distance_pitches: f64 = 30.0, FACTOR, 10.0 to 100.0;
        /// By how much the shafts are set closer, so that the chain sags a little.
        sag: Length = 2.0, MM, 0.0 to 20.0;
    }
    /// The driven ground wheels.
    wheel: Wheel {
        /// Number of wheels that carry the weight.
        number: u32 = 2.0, COUNT, 1.0 to 8.0;
        /// Outer diameter (Table 1, no. 7).
        diameter: Length = 400.0, MM, 50.0 to 3000.0;
        /// Thickness of the rim (Table 1, no. 7).
        rim_thickness: Length = 3.0, MM, 0.1 to 100.0;
        /// Width (Table 1, no. 7).
        width: Length = 35.0, MM, 5.0 to 1000.0;
        /// Allowable shear stress of the rim's steel.
        shear_strength: Pressure = 80.0, MPA, 1.0 to 2000.0;
    }
    /// The handle.
    handle: Handle {
        /// Height of the operator's elbow above the wheel's centre.
        elbow_height: Length = 800.0, MM, 100.0 to 2000.0;
        /// Horizontal distance from the wheel's centre to the operator.
        operator_distance: Length = 400.0, MM, 50.0 to 3000.0;
    }
}

impl Machine {
    /// Number of tools: those between the rows, and one in the row.
    pub fn tools(&self) -> u32 {
        self.inter_row.tools + 1
    }

    /// Width that all tools cut together.
    pub fn width_of_cut(&self) -> Length {
        f64::from(self.inter_row.tools) * self.inter_row.width + self.intra_row.width
    }

    /// Checks every value against its range, and values that depend on each other.
    ///
    /// # Errors
    /// The first value out of range, or the first contradiction, with what would be right.
    pub fn check(&self) -> Result<(), MachineError> {
        let error = |section, key, problem| Err(MachineError { place: (section, key), problem });
        if let Some(input) = self.inputs().into_iter().find(|input| !input.is_in_range()) {
            let (Input { section, key, .. }, written) = (input, input.written().replace('"', ""));
            return error(section, key, format!("{section}.{key} is {written}: it has to be {}", input.range()));
        }
        // The crop's protection zones and the broken soil beside a sweep may take the whole row spacing.
        let failure_zone = eq::failure_zone(self.crop.row_spacing, self.crop.protection_zone);
        let sweep = eq::sweep_width(failure_zone, self.soil.depth, self.soil.internal_friction);
        if MM.value(sweep) <= 0.0 {
            let problem = format!(
                "crop.row_spacing leaves no room for a sweep: the protection zones leave {:.0} mm, and soil breaks over \
                 {:.0} mm beside a sweep; widen crop.row_spacing, or lessen crop.protection_zone or soil.depth",
                MM.value(failure_zone).max(0.0),
                MM.value(failure_zone - sweep)
            );
            return error("crop", "row_spacing", problem);
        }
        let (thickness_mm, diameter_mm) = (MM.value(self.wheel.rim_thickness), MM.value(self.wheel.diameter));
        if 2.0 * thickness_mm >= diameter_mm {
            let problem = format!(
                "wheel.rim_thickness is {} mm: it has to be less than half of wheel.diameter, {} mm",
                digits(thickness_mm),
                digits(diameter_mm)
            );
            return error("wheel", "rim_thickness", problem);
        }
        let ratio = self.engine.gear_box_ratio;
        let wheel_speed = eq::wheel_speed(self.weeder.speed, self.wheel.diameter);
        let reduction = eq::chain_reduction(self.engine.speed, ratio, wheel_speed);
        let teeth = eq::driven_teeth(self.chain.drive_teeth, reduction);
        if !(1.0..=f64::from(MOST_TEETH)).contains(&teeth) {
            let gear_box_ratio = ratio * teeth / f64::from(USUAL_TEETH);
            let right = Self { engine: Engine { gear_box_ratio, ..self.engine }, ..*self };
            let (key, advice) = match right.check() {
                Ok(()) => ("gear_box_ratio", format!("at these speeds a ratio near {} makes", digits(gear_box_ratio))),
                Err(_) => ("speed", "change engine.speed, weeder.speed or wheel.diameter: no ratio makes".to_owned()),
            };
            let problem = format!(
                "engine.gear_box_ratio is {}: the driven sprocket would need {} teeth and can have 1 to {MOST_TEETH}; \
                 {advice} it {USUAL_TEETH} teeth",
                digits(ratio),
                digits(teeth)
            );
            return error("engine", key, problem);
        }
        Ok(())
    }

    /// The machine as a machine file, with a comment of meaning and range above each value.
    pub fn to_toml(&self) -> String {
        let mut file = String::from(
            "# A machine for `weeder design --machine FILE.toml`.\n\
             # Omitted values are those of the paper's machine. Units may be changed with their values:\n\
             # \"0.4 m\" is \"400 mm\".\n",
        );
        let inputs = self.inputs();
        for (section, title) in TITLES {
            // Writing to a String cannot fail.
            let _ = write!(file, "\n#{title}\n[{section}]\n");
            for input in inputs.iter().filter(|input| input.section == *section) {
                let _ = writeln!(file, "#{} {}.", input.about, capitalised(&input.range()));
                let _ = writeln!(file, "{} = {}", input.key, input.written());
            }
        }
        file
    }
}

fn capitalised(words: &str) -> String {
    let mut letters = words.chars();
    letters.next().map(|first| first.to_uppercase().chain(letters).collect()).unwrap_or_default()
}
