//! The effect of each step of the manual in the simulated field.

use anyhow::{Context, Result};
use comfy_table::{CellAlignment, Table};
use field::conditions::{self, Conditions};
use link::settings::{Setting, Settings, name};
use set_up::circle::Arm;
use set_up::{SetUp, Task, steps};
use study::experiment::{Engine, Experiment, Total, Treatment, totals};
use uno_run::by_the_manual::Novice;
use uno_run::report::number_table;

/// Plots of each spacing.
const REPLICATIONS: u32 = 10;

/// Selects the random fields and measurements.
const SEED: u64 = 1;

const SPEED_KM_H: f64 = 2.5;

/// The field, seed and speed.
pub fn about() -> String {
    format!(
        "Field {}, seed {SEED}, {SPEED_KM_H} km/h, {REPLICATIONS} replications at 50 and 60 cm.",
        conditions::DEFAULT
    )
}

/// A line for the machine from the box, and one after each step. The steps add up.
pub fn table() -> Result<Table> {
    let header = ["step", "", "ground of the\nrow weeded, %", "seen plants\ndamaged, %", "zones\nreached, %"];
    let mut table = number_table(header, 0);
    table.column_iter_mut().skip(1).take(1).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    let field = Conditions::load(conditions::DEFAULT)?;
    let mut novice = Novice::new(field.from_the_box(), SEED);
    let mut line = |number: String, title: &str, conditions: &Conditions| {
        for total in weeded(conditions)? {
            table.add_row([
                number.clone(),
                title.to_owned(),
                format!("{:.1}", 100.0 * total.plots.weeded_share),
                total.damage_of_seen().shown(),
                total.zones_reached().shown(),
            ]);
        }
        anyhow::Ok(())
    };
    line(String::new(), "straight from the box", &novice.conditions)?;
    for step in steps() {
        novice.follow(&step)?;
        line(step.number.to_string(), step.title, &novice.conditions)?;
    }
    Ok(table)
}

/// The field's rows, weeded.
fn weeded(conditions: &Conditions) -> Result<Vec<Total>> {
    let experiment = Experiment {
        speeds_km_h: vec![SPEED_KM_H],
        replications: REPLICATIONS,
        controllers: vec![Treatment::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), SEED)
    };
    Ok(totals(&experiment.run(&Engine::Native, |_| ())?))
}

/// What a machine with these settings, a tool of this width and the arm of the measurements is expected to weed. The
/// servo's times, wheel and ground are those of the field. Fails if the simulated machine cannot have these values.
pub fn expected(settings: &Settings, tool_width_mm: f64, measured: &SetUp) -> Result<String> {
    let mut conditions = Conditions::load(conditions::DEFAULT)?.from_the_box();
    // A calibrated wheel: 2010 ticks a metre with this field's slip.
    if settings.get(Setting::TicksPerM) > 0 {
        conditions.set("wheel_mm", 380.0)?;
    }
    conditions.set("machine.tool_width_mm", tool_width_mm)?;
    conditions.set("machine.arm_mm", measured.arm.length_mm)?;
    conditions.set("machine.arm", measured.trailing_tool_mm.map_or(0.0, |_| 1.0))?;
    conditions.set("machine.beam_to_tool_mm", settings.get(Setting::BeamToToolMm).into())?;
    conditions.set("machine.second_beam_mm", settings.get(Setting::SecondBeamMm).into())?;
    let set = steps().into_iter().flat_map(|step| step.tasks).filter_map(|task| match task {
        Task::Set(Setting::WheelMm | Setting::ServoInUs | Setting::ServoOutUs, _) => None,
        Task::Set(setting, _) => Some(setting),
        Task::SetMargin => Some(Setting::MarginMm),
        _ => None,
    });
    for setting in set {
        conditions.set(&name(setting), settings.get(setting).into())?;
    }
    // The simulated servo turns by the same angle, by its own pulses.
    let stroke_us = f64::from(settings.get(Setting::ServoInUs).abs_diff(settings.get(Setting::ServoOutUs)));
    let simulated_us = (stroke_us * Arm::default().us_for_90 / measured.arm.us_for_90).round();
    let in_us = f64::from(Setting::ServoInUs.description().default);
    conditions.set(&name(Setting::ServoOutUs), in_us + simulated_us)?;
    let totals = weeded(&conditions)?;
    let total = totals.first().context("no row was weeded")?;
    Ok(format!(
        "{:.1} % of the row's ground weeded, and {} % of the plants that the beam sees damaged, in the simulated \
         field {} at {SPEED_KM_H} km/h, with a tool of {tool_width_mm} mm",
        100.0 * total.plots.weeded_share,
        total.damage_of_seen().shown(),
        conditions::DEFAULT,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn with_another_arm_or_servo_the_simulated_tool_clears_the_stem_zone_too() {
        // 133 mm aside, in steps of 5 us.
        for (length_mm, us_for_90, stroke_us) in [(350.0, 667.0, 170), (600.0, 1000.0, 145)] {
            let leads = [(Setting::LeadOutMs, 121), (Setting::LeadInMs, 76)];
            let zone = [(Setting::ServoOutUs, 1500 + stroke_us), (Setting::StemZoneMm, 110)];
            let settings = rig::settings(&[leads, zone].concat());
            let mut measured = SetUp::default();
            measured.arm = Arm { length_mm, us_for_90 };
            let expected = expected(&settings, 130.0, &measured).expect("it can be simulated");
            assert!(expected.contains("and 0.0 % of the plants"), "{expected}");
        }
    }
}
