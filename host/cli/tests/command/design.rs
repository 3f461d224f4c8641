//! `weeder design` as a user runs it.

use crate::common::{self, assert_has, assert_refused, said};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The page of the manual that shows a machine file.
const MANUAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/building-your-own.md");

fn folder_with(machine: &str) -> TempDir {
    common::folder_with("my.toml", machine)
}

#[track_caller]
fn printed(machine: &str, arguments: &[&str]) -> String {
    said(folder_with(machine).path(), &[&["design", "--machine", "my.toml"], arguments].concat())
}

/// The cells of the table's line that begins with `name`.
#[track_caller]
fn line<'a>(table: &'a str, name: &str) -> Vec<&'a str> {
    let mut lines = table.lines().map(|line| line.trim_matches(['│', ' ']));
    let line = lines.find(|line| line.starts_with(name)).unwrap_or_else(|| panic!("no {name} in {table}"));
    line.split("  ").map(str::trim).filter(|cell| !cell.is_empty()).collect()
}

#[track_caller]
fn figure<'a>(printed: &'a Value, key: &str) -> &'a Value {
    let figures = printed["figures"].as_array().expect("figures are a list");
    figures.iter().find(|figure| figure["key"] == key).unwrap_or_else(|| panic!("no {key} in {printed}"))
}

#[test]
fn without_a_file_the_papers_machine_is_calculated() {
    let table = said(Path::new("."), &["design"]);
    assert_eq!(line(&table, "rolling resistance  ")[..4], ["rolling resistance", "Eq. 4", "60.36", "N"]);
    assert_eq!(line(&table, "engine")[..5], ["engine", "below Eq. 9", "1.111", "hp", "!"]);
    assert!(table.starts_with("0 of the machine's"), "{table}");
    let lines = || table.lines().filter(|line| line.starts_with(['│', '┌']));
    assert!(lines().count() > 30 && lines().all(|line| line.chars().count() <= 100), "{table}");
}

#[test]
fn the_printed_machine_is_the_papers_and_can_be_read() {
    let machine = said(Path::new("."), &["design", "--print-machine"]);
    assert_has(&machine, ["# Outer diameter (Table 1, no. 7). From 50 to 3000 mm.\ndiameter = \"400 mm\""]);
    let paper = said(Path::new("."), &["design"]);
    assert_eq!(printed(&machine, &[]), paper);
}

#[test]
fn json_holds_inputs_and_figures_with_their_units() {
    let printed: Value = serde_json::from_str(&printed("weeder.mass = \"130 kg\"", &["--json"])).unwrap();
    assert_eq!(printed["inputs"][0]["key"], "mass");
    assert_eq!(printed["inputs"][0]["value"], 130.0);
    let force = figure(&printed, "acceleration_force");
    assert_eq!((force["equation"].as_str(), force["unit"].as_str()), (Some("Eq. 8"), Some("N")));
    assert!((force["value"].as_f64().unwrap() - 45.14).abs() < 0.01, "{force}");
    assert_eq!(figure(&printed, "engine_power")["concern"], false);
}

#[test]
fn the_papers_figures_stand_beside_ours_and_those_of_ones_own() {
    let paper = said(Path::new("."), &["design", "--against-paper"]);
    let tractive_force = ["tractive force", "below Eq. 8", "1082.4", "1082.5", "536.6", "N", "follows"];
    assert_eq!(line(&paper, "tractive force")[..7], tractive_force);
    assert!(paper.contains("13 are right, 8 follow from an error before them, and 8 are wrong"), "{paper}");
    let own = printed("soil.depth = \"20 mm\"", &["--against-paper"]);
    assert_eq!(line(&own, "draft ")[..6], ["draft", "Eq. 7", "453.7", "453.7", "453.7", "363"]);
    assert!([paper, own].iter().all(|table| table.lines().all(|line| line.chars().count() <= 100)));
}

#[test]
fn the_comparison_is_printed_as_json_too() {
    let json: Value = serde_json::from_str(&said(Path::new("."), &["design", "--against-paper", "--json"])).unwrap();
    let apex = json["comparisons"].as_array().unwrap().iter().find(|row| row["name"] == "apex angle").unwrap();
    assert_eq!(apex["printed"], 120.0);
    assert_eq!(apex["verdict"], "wrong");
    assert!((apex["calculated"].as_f64().unwrap() - 80.0).abs() < 1e-9);
}

#[test]
fn nothing_has_to_be_changed_on_the_manuals_machine() {
    let manual = fs::read_to_string(MANUAL).unwrap();
    let machine = manual.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let printed: Value = serde_json::from_str(&printed(machine, &["--json"])).unwrap();
    let concerns = printed["figures"].as_array().unwrap().iter().filter(|figure| figure["concern"] == true);
    assert_eq!(concerns.collect::<Vec<_>>(), Vec::<&Value>::new());
}

#[test]
fn a_wrong_machine_is_refused_with_file_line_and_what_would_be_right() {
    for (machine, why) in [
        ("[wheel]\ndiametre = \"400 mm\"\n", "my.toml, line 2: wheel.diametre: unknown field `diametre`"),
        ("[wheel]\nwidth = \"-35 mm\"\n", "my.toml, line 2: wheel.width is -35 mm: it has to be from 5 to 1000 mm"),
        (
            "[crop]\nweed_friction = \"90 degrees\"\n",
            "line 2: crop.weed_friction is 90 degrees: it has to be from 5 to 85",
        ),
        ("[engine]\ngear_box_ratio = 1\n", "a ratio near 38 makes it 40 teeth"),
        ("[engine]\nspeed = \"10 rpm\"\n", "my.toml, line 2: engine.gear_box_ratio is 40"),
        ("[engine]\nspeed = \"10 rpm\"\n", "change engine.speed, weeder.speed or wheel.diameter"),
    ] {
        assert_refused(folder_with(machine).path(), &["design", "--machine", "my.toml"], why);
    }
}

#[test]
fn the_swing_comes_as_settings_for_the_firmware() {
    let machine = "[intra_row]\nwidth = \"55 mm\"\nblade_height = \"5 mm\"\n";
    let words = printed(machine, &[]);
    // 95 + 10 + 27.5 mm of an arm of 350 are 22.2 degrees or 247 us, rounded to 250: 22.5 degrees, half of the pulse
    // for 45. The soil takes 19.7 of 60 kg cm, which leaves two thirds of the speed: 89 ms. Arm and blade have a time
    // constant of 46 ms.
    let lines = [
        "The tool clears a canopy of 190 mm at 22.5 degrees, 134 mm aside, 250 us of the pulse away from the row.",
        "From rest, with 0.6 kg to move and 33 % of the servo's torque for the soil, it takes 133 ms: time the servo",
        "Between tool and sweeps 22.5 mm on either side of the row are not weeded: a tool of 100 mm would fill that",
        "\nset servo_in_us 1500\nset servo_out_us 1750\nset lead_out_ms 220\nset lead_in_ms 50\n",
    ];
    assert_has(&words, lines);
    let json: Value = serde_json::from_str(&printed(machine, &["--json"])).unwrap();
    assert_eq!((&json["swing"]["servo_out_us"], &json["set"][1]), (&1750.into(), &"set servo_out_us 1750".into()));
}

#[test]
fn an_impossible_swing_is_explained() {
    for (machine, why) in [
        ("shank_length = \"120 mm\"", "an arm of 120 mm cannot bring the tool 130 mm aside"),
        ("servo_torque = \"20 kg cm\"", "the soil takes 39.4 of the servo's 20.0 kg cm: it stalls"),
    ] {
        assert_has(&printed(&format!("intra_row.{machine}"), &[]), [why]);
    }
}
