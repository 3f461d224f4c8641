//! The swing in sentences, for `weeder design` and `weeder set-up`.

use super::{Swing, kept_mm};
use crate::figure::written;
use crate::machine::Machine;
use crate::unit::{KG_CM, KM_H, MM};
use link::settings::Settings;
use uom::si::f64::Torque;

impl Swing {
    /// Its description, in sentences. `torque` is the one used in the calculation.
    pub fn sentences(&self, machine: &Machine, torque: Torque) -> Vec<String> {
        let mut said = vec![
            format!(
                "The tool clears a {} of {:.0} mm at {:.1} degrees, {:.0} mm aside, {} us of the pulse away from the row.",
                if self.stem_zone_mm > 0 { "stem's protected circle" } else { "canopy" },
                kept_mm(machine),
                self.angle_degrees,
                MM.value(machine.intra_row.shank_length) * self.angle_degrees.to_radians().sin(),
                self.servo_out_us.abs_diff(self.servo_in_us)
            ),
            format!(
                "That takes {:.0} ms without load. From rest, with {:.1} kg to move and {:.0} % of the servo's torque for the \
                 soil, it takes {:.0} ms: time the servo on your machine.",
                self.unloaded_ms,
                self.swung_kg,
                100.0 * self.load,
                self.loaded_ms
            ),
        ];
        said.extend(self.top_speed_mm_s.map(|mm_s| {
            format!(
                "With this lead, a beam {} mm ahead of the tool is far enough up to {mm_s} mm/s. One farther ahead allows more.",
                self.beam_to_tool_mm
            )
        }));
        said.extend(self.working_mm_s.map(|mm_s| {
            format!("With the second beam the tool works up to {mm_s} mm/s, and stays out of the row above it.")
        }));
        let speed = machine.weeder.speed;
        let speed_mm_s = KM_H.value(speed) / 0.0036;
        if speed_mm_s > f64::from(self.highest_mm_s) {
            said.push(format!(
                "The machine's {} are {speed_mm_s:.0} mm/s. Above {} mm/s, alarm 3-1 ends the work.",
                written(speed, KM_H),
                self.highest_mm_s
            ));
        }
        said.push(if self.arm_margin_mm > 0 {
            format!(
                "The trailing arm carries the tool towards the plant, so the margin is {} mm wider.",
                self.arm_margin_mm
            )
        } else {
            format!(
                "Over the stroke the pendulum lifts the blade's middle by {:.0} mm, and its edge beside the row by {:.0} mm, \
                 from a depth of {:.0} mm.",
                self.lift_mm,
                self.edge_lift_mm,
                MM.value(machine.soil.depth)
            )
        });
        let excess = match self.blade_margin_mm {
            0 => String::new(),
            mm => format!(", and needs {mm} mm more than the default margin"),
        };
        said.push(format!(
            "Half of the blade's {:.0} mm along the row is a part of the measured margin, {:.0} mm{excess}.",
            2.0 * self.blade_mm,
            self.blade_mm.ceil()
        ));
        if self.stem_margin_mm > 0 {
            said.push(format!(
                "Stems {:.0} mm off the middle of their canopies need {} mm more than the default margin.",
                MM.value(machine.swing.stem_off),
                self.stem_margin_mm
            ));
        }
        if machine.swing.arm_trails == 0 {
            let most_kg_cm = KG_CM.value(machine.intra_row.servo_torque) / 3.0;
            let remedy = "Take a lighter arm or a stronger servo";
            said.push(format!(
                "Its weight pulls it back into the row with {:.1} kg cm at the outer stop. The spring has to hold more, and at most a \
                 third of the servo's torque, {most_kg_cm:.1} kg cm{}.",
                self.weight_kg_cm,
                if self.weight_kg_cm >= most_kg_cm { format!(": no spring can. {remedy}") } else { String::new() }
            ));
            said.push(format!(
                "Plants of up to {:.0} mm pass beside the arm, also where they use the whole room of {:.0} mm. Above that height, \
                 its shank can stand inside their {} though the tool is out.",
                self.clear_height_mm,
                MM.value(machine.swing.room),
                if self.stem_zone_mm > 0 { "stem's protected circle" } else { "canopy" }
            ));
        }
        if machine.inter_row.tools == 0 {
            return said;
        }
        let (zone, half) = if self.stem_zone_mm > 0 {
            ("stem's protected circle", machine.swing.protected / 2.0)
        } else {
            ("protection zone", machine.crop.protection_zone)
        };
        let beside_mm = MM.value(machine.swing.sweep_from - half);
        if beside_mm < 0.0 {
            said.push(format!("The sweeps run {:.0} mm inside the {zone}: start them farther out.", -beside_mm));
        } else if self.stem_zone_mm > 0 {
            said.push(format!(
                "The sweeps start {beside_mm:.0} mm beside the {zone}. They cut plants if machine and plants \
                 stray farther in all."
            ));
        }
        if self.unweeded_strip_mm <= 0.0 {
            said.push("Tool and sweeps leave no strip between them.".to_owned());
            return said;
        }
        let (in_us, is_longer) = (f64::from(self.servo_in_us), self.servo_in_us <= self.servo_out_us);
        let wider = Self::with_tool(machine, torque, &Settings::new(), self.filling_tool_mm, in_us, is_longer);
        said.push(format!(
            "Between tool and sweeps {:.1} mm on either side of the row are not weeded: a tool of {:.0} mm would fill that{}.",
            self.unweeded_strip_mm,
            self.filling_tool_mm,
            wider.map_or_else(
                |problem| format!(", but {problem}"),
                |wider| format!(", and swing out to {:.1} degrees. Write its width, and set all its lines", wider.angle_degrees)
            )
        ));
        said
    }
}
