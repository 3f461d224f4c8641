//! Interprets a design for its machine: each figure gets a line in plain words.

use crate::design::Design;
use crate::equations::{TYRE_TRACTION_LIMIT, WHEELS_OWN_RESISTANCE, bending_stress, weed_friction_for};
use crate::figure::{Figure, digits, written};
use crate::machine::Machine;
use crate::unit::{
    self, CM, COUNT, DEGREE, FACTOR, HECTARE_PER_HOUR, HP, KG_CM, KM_H, KPA, M, MM, MPA, NEWTON, NEWTON_METRE, RPM,
    WATT,
};
use std::f64::consts::TAU;
use std::ops::RangeInclusive;
use uom::si::f64::{Force, Length, Ratio, Torque};

/// Teeth of a good sprocket: fewer wear the chain out quickly, on more a worn chain climbs.
const GOOD_TEETH: RangeInclusive<u32> = 9..=120;

/// Allowed relative deviation of the speed, before a warning.
const SPEED_TOLERANCE: f64 = 0.05;

/// An engine with more than this multiple of the needed power is too large.
const ENGINE_EXCESS: f64 = 2.0;

/// The greatest wheel numerics of soft and of tilled soil. Above them it is firm.
const SOFT_WHEEL_NUMERIC: f64 = 15.0;
const TILLED_WHEEL_NUMERIC: f64 = 25.0;

const BETWEEN_ROWS: [&str; 4] = ["sweep_width", "apex_angle", "inter_row_bending_moment", "inter_row_shank_diameter"];

/// A line of interpretation, and whether it asks for a change.
type Sense = (String, bool);

/// All is well.
fn fine(words: String) -> Sense {
    (words, false)
}

/// The machine should be changed.
fn concern(words: String) -> Sense {
    (words, true)
}

/// Makes the figures of a design, each from the field of its key: `key: name, equation, unit => sense`.
macro_rules! figures {
    ($design:ident; $($key:ident: $name:literal, $equation:literal, $unit:ident => $sense:expr;)+) => {
        vec![$({
            let (sense, concern) = $sense;
            let (key, value) = (stringify!($key), $unit.value($design.$key));
            Figure { key, name: $name, equation: $equation, value, unit: $unit.name, sense, concern }
        }),+]
    };
}

fn percent(share: Ratio) -> String {
    format!("{:.0} %", unit::PERCENT.value(share))
}

impl Design {
    /// Every result with its equation and its interpretation, in the order of the paper. `machine` is the calculated
    /// machine.
    pub fn figures(&self, machine: &Machine) -> Vec<Figure> {
        let parts = [Self::traction, Self::tools, Self::shanks, Self::drive, Self::wheel_and_handle, Self::capacity];
        let mut figures: Vec<Figure> = parts.into_iter().flat_map(|part| part(self, machine)).collect();
        let has_none = machine.inter_row.tools == 0;
        for figure in figures.iter_mut().filter(|figure| has_none && BETWEEN_ROWS.contains(&figure.key)) {
            (figure.sense, figure.concern) = fine("the machine has no tools between the rows".to_owned());
        }
        figures
    }

    fn traction(&self, machine: &Machine) -> Vec<Figure> {
        let load = written(self.wheel_load, NEWTON);
        let ground = match self.wheel_numeric {
            ..SOFT_WHEEL_NUMERIC => {
                concern(format!("under {load} the wheels sink in as on soft soil: take wider ones"))
            }
            ..TILLED_WHEEL_NUMERIC => fine(format!("under {load} each, the wheels run as on tilled soil")),
            _ => fine(format!("under {load} each, the wheels run as on firm soil")),
        };
        let coefficient = self.rolling_resistance_coefficient;
        let soil_part = Ratio::from((coefficient - WHEELS_OWN_RESISTANCE) / coefficient);
        let part = |force: Force| fine(format!("{} of the tractive force", percent(force / self.tractive_force)));
        let pull = self.tractive_force / self.weight;
        let (share, limit) = (percent(pull), TYRE_TRACTION_LIMIT * 100.0);
        let grip = if f64::from(pull) > TYRE_TRACTION_LIMIT {
            let remedy = "it needs pegs, less depth or more mass";
            concern(format!("{share} of the weight; a tyre slips above {limit:.0} %: {remedy}"))
        } else {
            fine(format!("{share} of the weight: wheels can pull that"))
        };
        let steady = written(self.power / machine.engine.safety_factor, WATT);
        figures! { self;
            wheel_numeric: "wheel numeric", "Eq. 6", FACTOR => ground;
            rolling_resistance_coefficient: "rolling resistance coefficient", "Eq. 5", FACTOR
                => fine(format!("{} of it is the soil's, the rest the wheel's own", percent(soil_part)));
            rolling_resistance: "rolling resistance", "Eq. 4", NEWTON => part(self.rolling_resistance);
            draft: "draft of all tools", "Eq. 7", NEWTON => part(self.draft);
            acceleration_force: "acceleration force", "Eq. 8", NEWTON => part(self.acceleration_force);
            tractive_force: "tractive force", "below Eq. 8", NEWTON => grip;
            power: "power at the wheels", "Eq. 9", WATT
                => fine(format!("{steady} are used, the rest is the factor of safety"));
            engine_power: "engine", "below Eq. 9", HP => self.engine(machine);
        }
    }

    fn engine(&self, machine: &Machine) -> Sense {
        let ratio = f64::from(machine.engine.power / self.engine_power);
        let (given, share) = (written(machine.engine.power, HP), written(ratio.into(), unit::PERCENT));
        match ratio {
            ..1.0 => concern(format!("the engine's {given} are only {share} of that: too small")),
            ENGINE_EXCESS.. => concern(format!("the engine's {given} are {ratio:.2} times that: too large")),
            _ => fine(format!("the engine's {given} are {ratio:.2} times that: large enough")),
        }
    }

    fn tools(&self, machine: &Machine) -> Vec<Figure> {
        let servo = machine.intra_row.servo_torque;
        let ratio = f64::from(servo / self.servo_torque);
        let (given, share) = (written(servo, KG_CM), written(ratio.into(), unit::PERCENT));
        let servo_sense = match ratio {
            ..1.0 => concern(format!("the servo's {given} are {share} of that: too weak")),
            _ => fine(format!("the servo's {given} are {ratio:.2} times that: strong enough")),
        };
        let at_depth = self.servo_torque_at_depth;
        let depth = written(machine.soil.depth, MM);
        let depth_words = format!("a blade {depth} high, as deep as it weeds, would ask {}", written(at_depth, KG_CM));
        let depth_sense = if at_depth > servo {
            concern(format!("{depth_words}: too much for the servo"))
        } else {
            fine(format!("{depth_words}: the servo bears that too"))
        };

        // Half of the sweeps run between the machine's row and the next one.
        let beside = machine.inter_row.tools.div_ceil(2);
        let width = f64::from(beside) * machine.inter_row.width;
        let sweeps = if beside == 1 { "one sweep".to_owned() } else { format!("{beside} sweeps side by side") };
        let sweep_sense = if width > self.sweep_width {
            concern(format!("{sweeps}, {} wide, would break soil in a protection zone", written(width, MM)))
        } else {
            let left = written(self.sweep_width - width, MM);
            fine(format!("{sweeps}, {} wide: off the crop, and {left} are left", written(width, MM)))
        };
        let apex = machine.inter_row.apex_angle;
        let apex_sense = if apex > self.apex_angle {
            let friction = written(weed_friction_for(apex), DEGREE);
            concern(format!("the sweeps' {} are too blunt: right for a friction of {friction}", written(apex, DEGREE)))
        } else {
            fine(format!("weeds slide along the sweeps' {}", written(apex, DEGREE)))
        };
        let tools = machine.tools();
        let cut = machine.width_of_cut();
        // Widths that fill it exactly must not fail by rounding.
        let fit_sense = if f64::from(cut / machine.weeder.working_width) > 1.0 + 1e-9 {
            let needed = written(cut, MM);
            concern(format!("the machine has {tools}: they do not fit into its working width, and need {needed}"))
        } else {
            fine(format!("the machine has {tools}: they fit into its working width"))
        };
        let draft_alone = written(self.draft / f64::from(tools), NEWTON);
        let rows = written(machine.crop.row_spacing, MM);
        figures! { self;
            soil_force: "soil on the blade in the row", "Eq. 10", NEWTON => depth_sense;
            servo_torque: "servo torque", "above Eq. 10", KG_CM => servo_sense;
            failure_zone: "soil failure zone", "Eq. 11", MM
                => fine(format!("{rows} between rows, less the protection zones"));
            sweep_width: "room for sweeps between rows", "Eq. 12", MM => sweep_sense;
            apex_angle: "bluntest apex angle", "Eq. 13", DEGREE => apex_sense;
            tools: "tools that fit", "above Eq. 13", COUNT => fit_sense;
            tool_draft: "draft of one tool", "Eq. 14", NEWTON
                => fine(format!("of the whole tractive force; the soil alone pulls with {draft_alone}"));
        }
    }

    fn shanks(&self, machine: &Machine) -> Vec<Figure> {
        let Machine { inter_row, intra_row, shank, .. } = machine;
        let times = digits(shank.impact_factor * shank.safety_factor);
        let moment = |length: Length| fine(format!("{times} times the draft, on {}", written(length, MM)));
        let bend = |moment: Torque, diameter: Length| {
            let stress = bending_stress(moment, diameter);
            let (given, ratio) = (written(diameter, MM), f64::from(stress / shank.allowed_stress));
            let stress = written(stress, MPA);
            let share = percent(ratio.into());
            match ratio {
                ..=1.0 => fine(format!("the shank's {given} bear {stress}, {share} of the allowed stress")),
                _ => concern(format!(
                    "the shank's {given} would bear {stress}, {} times the allowed stress: it bends",
                    digits(ratio)
                )),
            }
        };
        figures! { self;
            inter_row_bending_moment: "bending moment, between rows", "above Eq. 15", NEWTON_METRE
                => moment(inter_row.shank_length);
            intra_row_bending_moment: "bending moment, in the row", "above Eq. 15", NEWTON_METRE
                => moment(intra_row.shank_length);
            inter_row_shank_diameter: "shank, between rows", "Eq. 15, 16", MM
                => bend(self.inter_row_bending_moment, inter_row.shank_diameter);
            intra_row_shank_diameter: "shank, in the row", "Eq. 15, 16", MM
                => bend(self.intra_row_bending_moment, intra_row.shank_diameter);
        }
    }

    fn drive(&self, machine: &Machine) -> Vec<Figure> {
        let speed = written(self.ground_speed, KM_H);
        let miss = f64::from(self.ground_speed / machine.weeder.speed) - 1.0;
        let teeth = self.driven_teeth.round() as u32;
        let teeth_sense = if machine.chain.drive_teeth < *GOOD_TEETH.start() {
            concern(format!("the drive sprocket's {} teeth are too few for a chain", machine.chain.drive_teeth))
        } else if teeth < *GOOD_TEETH.start() {
            concern(format!("{teeth} teeth are too few for a chain: take a smaller gear box ratio"))
        } else if teeth > *GOOD_TEETH.end() {
            concern(format!("{teeth} teeth are too many for a chain: take a larger gear box ratio"))
        } else if miss.abs() > SPEED_TOLERANCE {
            concern(format!("{teeth} teeth give {speed}, {:+.0} % off: take more drive teeth", miss * 100.0))
        } else {
            fine(format!("{teeth} teeth give {speed}"))
        };
        let turn_s = digits(60.0 / RPM.value(self.wheel_speed));
        let shaft = written(self.gear_box_speed, RPM);
        let links = digits(self.exact_chain_links);
        // The sprockets' radii, and half a pitch for the teeth of each.
        let clear = machine.chain.pitch * (f64::from(machine.chain.drive_teeth + teeth) / TAU + 1.0);
        let chain_sense = if self.centre_distance < clear {
            concern(format!("the sprockets need shafts {} apart: take more pitches of distance", written(clear, MM)))
        } else {
            fine(format!("{links} links, rounded up to an even number"))
        };
        let spare = (f64::from(self.chain_links) - self.exact_chain_links) / 2.0 * machine.chain.pitch;
        let (taut, longer) = (written(self.centre_distance + spare, MM), written(spare, MM));
        figures! { self;
            wheel_speed: "wheel speed", "Eq. 17", RPM => fine(format!("a turn every {turn_s} s"));
            chain_reduction: "reduction by the chain", "below Eq. 17", FACTOR
                => fine(format!("from the {shaft} of the gear box's shaft"));
            driven_teeth: "driven sprocket", "below Eq. 17", FACTOR => teeth_sense;
            chain_links: "chain links", "Eq. 18", COUNT => chain_sense;
            chain_length: "chain length", "Eq. 19", MM
                => fine(format!("taut with the shafts {taut} apart: {longer} more than planned"));
        }
    }

    fn wheel_and_handle(&self, machine: &Machine) -> Vec<Figure> {
        let strength = machine.wheel.shear_strength;
        let ratio = f64::from(strength / self.shear_stress);
        let (given, times) = (written(strength, MPA), digits(ratio));
        let safe = match ratio {
            ..1.0 => concern(format!("more than the steel's {given}: the wheel fails")),
            _ => fine(format!("the steel's {given} are {times} times that: the wheel is safe")),
        };
        let rim = written(machine.wheel.rim_thickness, MM);
        let rim_sense = if machine.wheel.rim_thickness < self.least_rim_thickness {
            concern(format!("the rim's {rim} are too thin"))
        } else {
            fine(format!("by shear alone; the rim's {rim} are enough"))
        };
        let rise = written(M.of(f64::from(self.handle_angle.tan())), M);
        let hands = written(machine.handle.elbow_height + machine.wheel.diameter / 2.0, CM);
        figures! { self;
            least_rim_thickness: "least wheel thickness", "below Eq. 20", MM => rim_sense;
            wheel_torque: "torque on a wheel", "below Eq. 20", NEWTON_METRE
                => fine("as if one wheel gave the whole tractive force".into());
            shear_stress: "shear stress in the wheel", "Eq. 20", KPA => safe;
            handle_angle: "slope of the handle", "Eq. 21", DEGREE
                => fine(format!("it rises {rise} on each metre"));
            handle_length: "length of the handle", "below Eq. 21", CM
                => fine(format!("from the wheel's centre to hands {hands} above the ground"));
        }
    }

    fn capacity(&self, machine: &Machine) -> Vec<Figure> {
        let hours = |rate| digits(1.0 / HECTARE_PER_HOUR.value(rate));
        let (theoretical_h, effective_h) = (hours(self.theoretical_capacity), hours(self.effective_capacity));
        let efficiency = written(machine.weeder.field_efficiency, unit::PERCENT);
        figures! { self;
            theoretical_capacity: "theoretical field capacity", "Eq. 25", HECTARE_PER_HOUR
                => fine(format!("{theoretical_h} h a hectare without a turn or stop"));
            effective_capacity: "effective field capacity", "Eq. 24", HECTARE_PER_HOUR
                => fine(format!("{effective_h} h a hectare at {efficiency} field efficiency"));
        }
    }
}
