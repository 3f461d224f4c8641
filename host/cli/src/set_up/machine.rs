//! The measures of arm, tool and servo, asked or from a machine's file, and what `weeder design` calculates from them.

use super::state::{State, TOOL_WIDTH};
use super::{Guide, yes_or_no};
use anyhow::Result;
use frame::{Messages, Results};
use link::settings::{self, Setting};
use mechanics::design::Design;
use mechanics::machine::{Input, Machine};
use mechanics::swing::Swing;
use mechanics::unit::{MM, SECOND};
use set_up::SetUp;
use set_up::circle::Arm;
use std::collections::BTreeMap;
use std::path::Path;

/// The measures from which `weeder design` calculates the stroke: the key in a machine file, and the question.
const ASKED: [(&str, &str); 12] = [
    (TOOL_WIDTH, "The tool's width"),
    ("intra_row.shank_length", "The arm's length, from the servo's axis to the blade's tip"),
    ("intra_row.shank_diameter", "The arm's diameter, as that of a steel rod of its weight"),
    ("intra_row.blade_base", "The blade's length along the row"),
    ("intra_row.blade_height", "The blade's height"),
    ("intra_row.blade_mass", "The blade's mass, with its clamp"),
    ("intra_row.servo_torque", "The servo's greatest torque"),
    ("swing.servo_time_60", "The servo's time for 60 degrees without load"),
    ("swing.pulse_for_90", "The pulse's change in us for 90 degrees: 1000 for most, 667 for servos of 270 degrees"),
    ("swing.protected", "The width round a stem that no tool may enter"),
    ("swing.stem_off", "How far a stem may stand off the middle of its canopy"),
    ("swing.room", "Room beside the stem zone: plants off the line, a machine that strays, play at the tip"),
];

impl Guide {
    /// The stroke, leads and zone that follow from the user's arm, tool and servo. Empty if the user types them.
    pub(super) fn calculated(&mut self) -> Result<Vec<(Setting, u16)>> {
        let machine = match self.machine {
            Some(machine) => machine,
            None => {
                let question = "Calculate them from your arm, tool and servo, or type them: yes, no";
                if !self.ask_for(question, Some("yes"), yes_or_no)? {
                    return Ok(Vec::new());
                }
                for (name, question) in ASKED {
                    self.measure(name, question)?;
                }
                asked(&self.state)?
            }
        };
        take_arm(&mut self.state.measured, &machine);
        let torque = Design::of(&machine)?.servo_torque;
        let swing = match Swing::fitted(&machine, torque, &settings::read(&mut self.link)?) {
            Ok(swing) => swing,
            Err(problem) => {
                writeln!(Messages, "  The tool cannot swing as it has to: {problem}.");
                return Ok(Vec::new());
            }
        };
        for sentence in swing.sentences(&machine, torque) {
            writeln!(Results, "  {sentence}")?;
        }
        let setting = |(name, value): (&str, u32)| Some((Setting::find(name.as_bytes())?, u16::try_from(value).ok()?));
        Ok(swing.settings().into_iter().filter_map(setting).collect())
    }

    /// Asks for the tool's width, unless the machine's file has it.
    pub(super) fn measure_tool(&mut self) -> Result<()> {
        match self.machine {
            Some(_) => self.go(&format!("The machine's file has {} mm", self.tool_width_mm().unwrap_or_default())),
            None => self.measure(TOOL_WIDTH, ASKED[0].1),
        }
    }

    fn measure(&mut self, name: &str, question: &str) -> Result<()> {
        let Some(input) = input(&Machine::default(), name) else { return Ok(()) };
        let before = self.state.asked.get(name).map(f64::to_string);
        let unit = if input.unit.is_empty() { String::new() } else { format!(", in {}", input.unit) };
        let value = self.ask_for(&format!("{question}{unit}"), before.as_deref(), |typed| {
            let value = typed.parse().ok().filter(|value| (input.least..=input.most).contains(value));
            value.ok_or_else(|| format!("it has to be a number {}", input.range()))
        })?;
        self.state.take_measure(name, value);
        self.keep()
    }

    pub(super) fn tool_width_mm(&self) -> Option<f64> {
        let of_machine = self.machine.and_then(|machine| input(&machine, TOOL_WIDTH));
        of_machine.map(|input| input.value).or_else(|| self.state.asked.get(TOOL_WIDTH).copied())
    }
}

/// A machine's value of this key of its file.
fn input(machine: &Machine, name: &str) -> Option<Input> {
    machine.inputs().into_iter().find(|input| format!("{}.{}", input.section, input.key) == name)
}

/// A measure as a line of a machine file.
fn written(name: &str, value: f64) -> String {
    let input = input(&Machine::default(), name);
    input.map_or_else(String::new, |input| format!("{name} = {}\n", Input { value, ..input }.written()))
}

/// The machine of the measures that were asked. The rest is the paper's, with a blade for which the default leads hold.
pub(super) fn asked(state: &State) -> Result<Machine> {
    let mut measures = BTreeMap::from([("intra_row.blade_height".to_owned(), 2.5)]);
    measures.extend(state.asked.clone());
    let text: String = measures.iter().map(|(key, value)| written(key, *value)).collect();
    Ok(mechanics::file::parse(Path::new("the machine"), &text)?)
}

/// Calculates leads and margin with a machine's arm and blade, and where its stems stand.
pub(super) fn take_arm(measured: &mut SetUp, machine: &Machine) {
    let tool_mm = MM.value(machine.intra_row.width).ceil() as u16;
    measured.trailing_tool_mm = (machine.swing.arm_trails > 0).then_some(tool_mm);
    measured.stem_off_mm = MM.value(machine.swing.stem_off);
    let length_mm = MM.value(machine.intra_row.shank_length);
    let ms_for_90 = 1500.0 * SECOND.value(machine.swing.servo_time_60);
    let blade_length_mm = MM.value(machine.intra_row.blade_base);
    measured.arm = Arm { length_mm, us_for_90: machine.swing.pulse_for_90, ms_for_90, blade_length_mm };
}
