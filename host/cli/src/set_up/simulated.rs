//! The effect of each step of the manual in the simulated field.

use anyhow::{Context, Result, ensure};
use comfy_table::{CellAlignment, Table};
use field::conditions::{self, Conditions};
use field::servo::OUT_DEGREES;
use link::settings::{Setting, Settings, name};
use mechanics::arm::turn_ms;
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

const SEED: u64 = 1;

/// The greatest speed, and the greatest share of the board's top speed. The driver's speed wanders by 8 %, and a wheel
/// slips by 5 %. A tool that is out because of the speed waits until the machine is an eighth slower.
const SPEED_KM_H: f64 = 2.5;
const TOP_SPEED_SHARE: f64 = 0.75;

/// The least time for 45 degrees that the field takes.
const LEAST_TRAVEL_MS: f64 = 10.0;

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

fn weeded(conditions: &Conditions, speed_km_h: f64) -> Result<Vec<Total>> {
    let experiment = Experiment {
        speeds_km_h: vec![speed_km_h],
        replications: REPLICATIONS,
        controllers: vec![ControllerKind::Firmware],
        ..Experiment::as_in_the_paper(conditions.clone(), SEED)
    };
    Ok(totals(&experiment.run(&Engine::Native, |_| ())?))
}

/// What this machine is expected to weed with these settings. Its stroke takes the measured time, `stroke_ms`, or else the
/// calculated one, with the arm's mass. Wheel, ground and straying are those of the field, and it has no sweeps. In words,
/// and the plants damaged of those that the beam sees, percent. Fails if the simulated machine cannot have these values.
pub fn expected(settings: &Settings, machine: &Machine, stroke_ms: Option<f64>) -> Result<(String, f64)> {
    let Machine { intra_row, swing, .. } = machine;
    let mut conditions = Conditions::load(conditions::DEFAULT)?.from_the_box();
    // A calibrated wheel: 2010 ticks a metre with this field's slip.
    if settings.get(Setting::TicksPerM) > 0 {
        conditions.set("wheel_mm", 380.0)?;
    }
    let tool_width_mm = MM.value(intra_row.width);
    let [least_ms, most_ms] = [swing.least_dead_time, swing.most_dead_time].map(|time| 1000.0 * SECOND.value(time));
    let load = f64::from(Design::of(machine)?.servo_torque / intra_row.servo_torque);
    ensure!(load < 1.0, "the servo stalls in this soil");
    let stroke_us = f64::from(settings.get(Setting::ServoInUs).abs_diff(settings.get(Setting::ServoOutUs)));
    let degrees = 90.0 * stroke_us / swing.pulse_for_90;
    // Against the soil's greatest load the simulated stroke takes that time, and less without a load.
    let loaded_ms = stroke_ms.unwrap_or_else(|| turn_ms(machine, degrees, load));
    let travel_ms = (loaded_ms * (1.0 - load) * OUT_DEGREES / degrees).max(LEAST_TRAVEL_MS);
    let protected_mm = MM.value(swing.protected);
    let stem_off_mm = (MM.value(swing.stem_off) - conditions.crop.sway_mm).max(0.0);
    let mut parts = vec![
        ("machine.sweeps_a_side", 0.0),
        ("machine.tool_width_mm", tool_width_mm),
        ("machine.tool_length_mm", MM.value(intra_row.blade_base)),
        ("machine.arm_mm", MM.value(intra_row.shank_length)),
        ("machine.arm", f64::from(swing.arm_trails)),
        ("machine.beam_to_tool_mm", f64::from(settings.get(Setting::BeamToToolMm))),
        ("machine.second_beam_mm", f64::from(settings.get(Setting::SecondBeamMm))),
        ("machine.travel_ms", travel_ms),
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
    let simulated_us = (stroke_us * Arm::default().us_for_90 / swing.pulse_for_90).round();
    let in_us = f64::from(Setting::ServoInUs.default());
    conditions.set(&name(Setting::ServoOutUs), in_us + simulated_us)?;
    let allowed_km_h = 0.0036 * TOP_SPEED_SHARE * f64::from(settings.get(Setting::TopSpeedMmS));
    let speed_km_h = SPEED_KM_H.min((10.0 * allowed_km_h).floor() / 10.0);
    let totals = weeded(&conditions, speed_km_h)?;
    let total = totals.first().context("no row was weeded")?;
    let said = format!(
        "{:.1} % of the row's ground weeded, and {} % of the plants that the beam sees damaged, in the simulated \
         field {} at {speed_km_h} km/h, with a tool of {tool_width_mm:.0} mm and no \
         sweeps",
        100.0 * total.plots.weeded_share,
        total.damage_of_seen().shown(),
        conditions::DEFAULT,
    );
    Ok((said, total.damage_of_seen().percent().unwrap_or(0.0)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn simulated_damage_stays_low_with_another_arm_servo_or_zone() {
        let zone = |stroke_us: u16, zone_mm, out_ms, in_ms| {
            let pulse = [(Setting::ServoOutUs, 1500 + stroke_us), (Setting::StemZoneMm, zone_mm)];
            [&pulse[..], &[(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, in_ms)]].concat()
        };
        let measured = [(Setting::SecondBeamMm, 200), (Setting::TicksPerM, 2010), (Setting::MarginMm, 45)];
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
            let text = format!("{LIGHT}intra_row.width = \"{width_mm} mm\"\n{own}");
            let machine = mechanics::file::parse(Path::new("my.toml"), &text).expect("it is right");
            let (expected, _) = expected(&rig::settings(&settings), &machine, None).expect("it can be simulated");
            let percent = expected.split_once("and ").and_then(|(_, damage)| damage.split(' ').next());
            let percent: f64 = percent.and_then(|percent| percent.parse().ok()).expect("the damage is a number");
            // At most 1 plant of 2,000.
            assert!(percent < 0.05, "{text}{expected}");
        }
    }

    /// An arm of little mass, with a low and short blade.
    const LIGHT: &str = "intra_row.blade_height = \"2.5 mm\"\nintra_row.blade_base = \"10 mm\"\nintra_row.shank_diameter = \"2 mm\"\n\
        intra_row.blade_mass = \"0.01 kg\"\n";

    #[test]
    fn expected_damage_allows_for_arm_blade_and_measured_time() {
        let pulse_and_zone = [(Setting::ServoOutUs, 1750), (Setting::StemZoneMm, 110), (Setting::SecondBeamMm, 200)];
        // As timed and measured on the field's own machine, without the blade's part of the margin.
        let leads = [(Setting::LeadOutMs, 116), (Setting::LeadInMs, 78)];
        let measured = [(Setting::TicksPerM, 2010), (Setting::MarginMm, 22)];
        let settings = rig::settings(&[&pulse_and_zone[..], &leads, &measured].concat());
        let has_damage = |shank_mm: f64, length_mm: f64, stroke_ms: Option<f64>| {
            let text = format!(
                "intra_row.width = \"130 mm\"\nintra_row.blade_height = \"2.5 mm\"\nintra_row.blade_mass = \"0.01 kg\"\n\
                 intra_row.shank_diameter = \"{shank_mm} mm\"\nintra_row.blade_base = \"{length_mm} mm\"\n\
                 swing.protected = \"90 mm\"\nswing.stem_off = \"20 mm\"\n"
            );
            let machine = mechanics::file::parse(Path::new("my.toml"), &text).expect("it is right");
            let (expected, _) = expected(&settings, &machine, stroke_ms).expect("it can be simulated");
            !expected.contains("and 0.0 % of the plants")
        };
        assert!(!has_damage(2.0, 1.0, None));
        assert!(has_damage(2.0, 45.0, None));
        assert!(has_damage(32.0, 1.0, None));
        assert!(!has_damage(32.0, 1.0, Some(66.0)));
    }

    #[test]
    fn a_machine_with_a_low_top_speed_is_simulated_below_it_and_weeds() {
        let text = "swing.servo_time_60 = \"0.35 s\"\nswing.protected = \"40 mm\"\nswing.stem_off = \"5 mm\"\n";
        let machine = mechanics::file::parse(Path::new("my.toml"), text).expect("it is right");
        let pulse_and_zone = [(Setting::ServoOutUs, 1675), (Setting::StemZoneMm, 45)];
        let slow = [(Setting::TopSpeedMmS, 620), (Setting::LeadOutMs, 461), (Setting::LeadInMs, 50)];
        let settings = rig::settings(&[&pulse_and_zone[..], &slow].concat());
        assert_eq!(settings.contradiction(), None);
        let (expected, _) = expected(&settings, &machine, None).expect("it can be simulated");
        assert!(expected.contains(" at 1.6 km/h") && !expected.starts_with("0.0 %"), "{expected}");
    }
}
