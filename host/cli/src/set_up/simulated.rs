//! The effect of each step of the manual in the simulated field.

use anyhow::{Context, Result};
use comfy_table::{CellAlignment, Table};
use field::conditions::{self, Conditions};
use link::settings::{Setting, Settings, name};
use mechanics::design::Design;
use mechanics::machine::Machine;
use mechanics::unit::{MM, SECOND};
use set_up::circle::Arm;
use set_up::{Task, steps};
use study::experiment::{ControllerKind, Engine, Experiment, Total, totals};
use uno_run::by_the_manual::Novice;
use uno_run::report::number_table;

/// Plots of each spacing.
const REPLICATIONS: u32 = 10;

/// Selects the random fields and measurements.
const SEED: u64 = 1;

/// The greatest speed, and the greatest share of the board's top speed. The driver's speed wanders by 8 %, and a wheel
/// slips by 5 %. A tool that is out because of the speed waits until the machine is an eighth slower.
const SPEED_KM_H: f64 = 2.5;
const TOP_SPEED_SHARE: f64 = 0.75;

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
        for total in weeded(conditions, SPEED_KM_H)? {
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
fn weeded(conditions: &Conditions, speed_km_h: f64) -> Result<Vec<Total>> {
    let experiment = Experiment {
        speeds_km_h: vec![speed_km_h],
        replications: REPLICATIONS,
        controllers: vec![ControllerKind::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), SEED)
    };
    Ok(totals(&experiment.run(&Engine::Native, |_| ())?))
}

/// What this machine is expected to weed with these settings. Wheel, ground and straying are those of the field, and it
/// has no sweeps. Fails if the simulated machine cannot have these values.
pub fn expected(settings: &Settings, machine: &Machine) -> Result<String> {
    let Machine { intra_row, swing, .. } = machine;
    let mut conditions = Conditions::load(conditions::DEFAULT)?.from_the_box();
    // A calibrated wheel: 2010 ticks a metre with this field's slip.
    if settings.get(Setting::TicksPerM) > 0 {
        conditions.set("wheel_mm", 380.0)?;
    }
    let tool_width_mm = MM.value(intra_row.width);
    let [least_ms, most_ms] = [swing.least_dead_time, swing.most_dead_time].map(|time| 1000.0 * SECOND.value(time));
    let load = f64::from(Design::of(machine)?.servo_torque / intra_row.servo_torque);
    let protected_mm = MM.value(swing.protected);
    let stem_off_mm = (MM.value(swing.stem_off) - conditions.crop.sway_mm).max(0.0);
    let mut parts = vec![
        ("machine.sweeps_a_side", 0.0),
        ("machine.tool_width_mm", tool_width_mm),
        ("machine.arm_mm", MM.value(intra_row.shank_length)),
        ("machine.arm", f64::from(swing.arm_trails)),
        ("machine.beam_to_tool_mm", f64::from(settings.get(Setting::BeamToToolMm))),
        ("machine.second_beam_mm", f64::from(settings.get(Setting::SecondBeamMm))),
        ("machine.travel_ms", 750.0 * SECOND.value(swing.servo_time_60)),
        ("machine.dead_time_ms", (least_ms + most_ms) / 2.0),
        ("machine.dead_time_scatter_ms", (most_ms - least_ms).abs() / 2.0),
        ("machine.load_kg_cm", load * conditions.machine.stall_kg_cm),
    ];
    if protected_mm > 0.0 {
        parts.extend([("crop.protected_mm", protected_mm), ("crop.stem_off_mm", stem_off_mm)]);
    }
    parts.into_iter().try_for_each(|(part, value)| conditions.set(part, value))?;
    let set = steps().into_iter().flat_map(|step| step.tasks).filter_map(|task| match task {
        Task::Set(Setting::TicksPerRev | Setting::WheelMm | Setting::ServoInUs | Setting::ServoOutUs, _) => None,
        Task::Set(setting, _) => Some(setting),
        Task::SetMargin => Some(Setting::MarginMm),
        _ => None,
    });
    for setting in set.chain([Setting::TopSpeedMmS]) {
        conditions.set(&name(setting), settings.get(setting).into())?;
    }
    // The simulated servo turns by the same angle, by its own pulses.
    let stroke_us = f64::from(settings.get(Setting::ServoInUs).abs_diff(settings.get(Setting::ServoOutUs)));
    let simulated_us = (stroke_us * Arm::default().us_for_90 / swing.pulse_for_90).round();
    let in_us = f64::from(Setting::ServoInUs.default());
    conditions.set(&name(Setting::ServoOutUs), in_us + simulated_us)?;
    let allowed_km_h = 0.0036 * TOP_SPEED_SHARE * f64::from(settings.get(Setting::TopSpeedMmS));
    let speed_km_h = SPEED_KM_H.min((10.0 * allowed_km_h).floor() / 10.0);
    let totals = weeded(&conditions, speed_km_h)?;
    let total = totals.first().context("no row was weeded")?;
    Ok(format!(
        "{:.1} % of the row's ground weeded, and {} % of the plants that the beam sees damaged, in the simulated \
         field {} at {speed_km_h} km/h, with a tool of {tool_width_mm:.0} mm and no \
         sweeps",
        100.0 * total.plots.weeded_share,
        total.damage_of_seen().shown(),
        conditions::DEFAULT,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn with_another_arm_servo_or_stem_zone_the_simulated_machine_damages_no_plant_either() {
        let zone = |stroke_us: u16, zone_mm, out_ms, in_ms| {
            let pulse = [(Setting::ServoOutUs, 1500 + stroke_us), (Setting::StemZoneMm, zone_mm)];
            [&pulse[..], &[(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, in_ms)]].concat()
        };
        let measured = [(Setting::SecondBeamMm, 200), (Setting::TicksPerM, 2010), (Setting::MarginMm, 22)];
        let protected = "swing.protected = \"90 mm\"\nswing.stem_off = \"20 mm\"\n";
        let narrow = "swing.protected = \"40 mm\"\nswing.stem_off = \"5 mm\"\n";
        let quick = "swing.servo_time_60 = \"60 ms\"\nswing.least_dead_time = \"10 ms\"\n\
            swing.most_dead_time = \"15 ms\"\n";
        // 133 mm aside, in steps of 5 us.
        for (width_mm, own, settings) in [
            (130, format!("{protected}swing.pulse_for_90 = 667\n"), zone(170, 110, 121, 76)),
            (130, format!("{protected}intra_row.shank_length = \"600 mm\"\n"), zone(145, 110, 121, 76)),
            (100, narrow.to_owned(), zone(175, 45, 116, 63)),
            (130, format!("{protected}{quick}"), [&zone(250, 110, 48, 10)[..], &measured].concat()),
        ] {
            let of_all = "intra_row.blade_height = \"2.5 mm\"\nintra_row.width";
            let text = format!("{of_all} = \"{width_mm} mm\"\n{own}");
            let machine = mechanics::file::parse(Path::new("my.toml"), &text).expect("it is right");
            let expected = expected(&rig::settings(&settings), &machine).expect("it can be simulated");
            assert!(expected.contains("and 0.0 % of the plants"), "{text}{expected}");
        }
    }

    #[test]
    fn a_machine_with_a_low_top_speed_is_simulated_below_it_and_weeds() {
        let text = "swing.servo_time_60 = \"0.35 s\"\nswing.protected = \"40 mm\"\nswing.stem_off = \"5 mm\"\n";
        let machine = mechanics::file::parse(Path::new("my.toml"), text).expect("it is right");
        let pulse_and_zone = [(Setting::ServoOutUs, 1675), (Setting::StemZoneMm, 45)];
        let slow = [(Setting::TopSpeedMmS, 650), (Setting::LeadOutMs, 461), (Setting::LeadInMs, 50)];
        let settings = rig::settings(&[&pulse_and_zone[..], &slow].concat());
        assert_eq!(settings.contradiction(), None);
        let expected = expected(&settings, &machine).expect("it can be simulated");
        assert!(expected.contains(" at 1.7 km/h") && !expected.starts_with("0.0 %"), "{expected}");
    }
}
