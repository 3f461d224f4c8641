//! `weeder trial` and `weeder sweep`, as they are called.

use crate::common::{SMALL, assert_fails, assert_has, assert_refused, folder_with, said, told, weeder};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Command;
use tempfile::TempDir;

fn folder() -> TempDir {
    folder_with("small.toml", SMALL)
}

/// Asserts that the command fails with these words, and that nothing was written.
#[track_caller]
fn assert_writes_nothing(words: &str, why: &str) {
    let folder = folder();
    assert_refused(folder.path(), &words.split(' ').collect::<Vec<_>>(), why);
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn a_trial_prints_each_controller_s_damage_and_writes_its_report() {
    let folder = folder();
    let words = said(folder.path(), &["trial", "--field", "small.toml", "--out", "report"]);
    assert_has(&words, ["Plants damaged by this firmware: none of ", "Loss budget of the row's ground"]);
    assert!(!words.contains("contradict"), "{words}");
    let page = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    let parts = [
        "weeder trial --field small.toml --out report",
        "a queue without look-ahead",
        // What contradicts the paper.
        "s program at 1 to 2.5 km/h, on this report",
        "this firmware, SIMULATED",
        "10.25165/j.ijabe.20211406.6542",
    ];
    assert_has(&page, parts);
    let controllers = fs::read_to_string(folder.path().join("report/controllers.csv")).unwrap();
    // Four controllers, eight treatments, three replications, and the header.
    assert_eq!(controllers.lines().count(), 4 * 8 * 3 + 1);
}

#[test]
fn the_largest_loss_is_rounded_as_in_the_loss_budget() {
    let folder = folder();
    let field = ["trial", "--field", "small.toml", "--speeds", "1,2.5", "--spacings", "50", "--replications", "2"];
    let words = said(folder.path(), &field);
    let (tables, budget) = words.split_once("Loss budget").unwrap();
    let mut found = 0;
    for line in tables.lines().filter(|line| line.contains("this firmware")) {
        let mut cells = line.split_whitespace().skip_while(|cell| !["plants", "margins", "swings"].contains(cell));
        if let Some(largest) = cells.nth(1) {
            assert!(budget.split_whitespace().any(|cell| cell == largest), "{line}\n{budget}");
            found += 1;
        }
    }
    assert_eq!(found, 2, "{tables}");
}

#[test]
fn a_trial_s_table_can_be_evaluated_like_a_real_one() {
    let folder = folder();
    said(folder.path(), &["trial", "--field", "small.toml", "--out", "."]);
    assert_has(&said(folder.path(), &["evaluate", "trial.csv"]), ["Weeding efficiency"]);
}

#[test]
fn the_same_seed_gives_the_same_files_and_another_seed_others() {
    let folder = folder();
    for (seed, out) in [("7", "a"), ("7", "b"), ("8", "c")] {
        said(folder.path(), &["trial", "--field", "small.toml", "--seed", seed, "--out", out]);
    }
    let read = |out: &str| fs::read_to_string(folder.path().join(out).join("trial.csv")).unwrap();
    assert_eq!(read("a"), read("b"));
    assert_ne!(read("a"), read("c"));
}

#[test]
fn a_trial_gives_programs_its_plots() {
    let folder = folder();
    let words =
        said(folder.path(), &["trial", "--field", "small.toml", "--speeds", "2", "--replications", "1", "--json"]);
    let value: Value = serde_json::from_str(&words).unwrap();
    assert_eq!(value["plots"].as_array().unwrap().len(), 2 * 4);
    assert_eq!(value["plots"][0]["record"]["damaged"], 0);
    assert_eq!((&value["field"], &value["seed"]), (&"small.toml".into(), &1.into()));
    for plot in value["plots"].as_array().unwrap() {
        let budget = plot["loss_budget_percent"].as_object().unwrap();
        let sum: f64 = budget.values().map(|percent| percent.as_f64().unwrap()).sum();
        assert!(budget.len() == 7 && (sum - 100.0).abs() < 1e-6, "{plot}");
        assert_eq!(budget["weeded"], plot["in_row_weeded_percent"]);
        assert!(plot["plot_weeds_before"].as_u64() >= plot["in_row_weeds_before"].as_u64(), "{plot}");
    }
}

#[test]
fn an_error_in_a_trial_is_named_and_nothing_is_written() {
    for (words, why) in [
        ("--field wet", "wet is none of the presets (transplanted, even-stand"),
        ("--speeds 1,fast --out r", "it has to be a number from 0.1 to 8"),
        ("--spacings 1 --out r", "it has to be a number from 5 to 500"),
        ("--replications 0 --out r", "it has to be a whole number from 1 to 1000"),
        ("--spacings 10 --field small.toml", "plants 10 cm apart grow together"),
        ("--spacings 10 --field small.toml --out r", "ask for a larger spacing or narrower canopies"),
    ] {
        assert_writes_nothing(&format!("trial {words}"), why);
    }
}

#[test]
fn a_machine_that_outruns_its_beam_is_reported_and_is_no_success() {
    let folder = folder();
    let output = weeder(folder.path(), &["trial", "--field", "small.toml", "--speeds", "7", "--replications", "1"]);
    let words = String::from_utf8_lossy(&output.stdout).into_owned();
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("an alarm took the firmware's tool out"), "{words}");
    let words = said(folder.path(), &["sweep", "--field", "small.toml", "--x", "speed=2..7:5"]);
    assert_has(&words, [" ! ", "--result alarms shows in how many"]);
}

#[test]
fn maize_is_spared_with_its_examples_and_stops_the_machine_without_them() {
    let folder = folder();
    said(folder.path(), &["train", "--synthetic", "--crop", "maize", "--beside", "--out", "maize.csv"]);
    let trial = ["trial", "--field", "maize", "--speeds", "1", "--spacings", "20,25", "--replications", "1", "--json"];
    let [without, with] = [&[][..], &["--examples", "maize.csv"]].map(|examples| {
        let output = weeder(folder.path(), &[&trial[..], examples].concat());
        let said: Value = serde_json::from_slice(&output.stdout).expect("it is JSON");
        let of_firmware = |plot: &&Value| plot["controller"] == "this firmware";
        let plots: Vec<Value> = said["plots"].as_array().unwrap().iter().filter(of_firmware).cloned().collect();
        (output.status.code(), plots)
    });
    let sum = |plots: &[Value], key: &str| plots.iter().map(|plot| plot[key].as_f64().unwrap()).sum::<f64>();
    assert_eq!(with.0, Some(0), "{:?}", with.1);
    assert_eq!((sum(&with.1, "damaged_by_tool"), sum(&with.1, "alarms")), (0.0, 0.0));
    assert!(sum(&with.1, "zones") > 400.0, "{:?}", with.1);
    assert_eq!((without.0, sum(&without.1, "alarms")), (Some(1), 6.0), "each row ends in an alarm: {:?}", without.1);
}

#[test]
fn maize_is_spared_by_the_real_firmware_that_was_taught_its_examples() {
    let folder = folder();
    let small = format!("{SMALL}{}", include_str!("../../../field/presets/maize.toml"));
    fs::write(folder.path().join("maize.toml"), small).unwrap();
    said(folder.path(), &["train", "--synthetic", "--crop", "maize", "--beside", "--out", "maize.csv"]);
    let field =
        ["trial", "--engine", "uno", "--field", "maize.toml", "--speeds", "1", "--spacings", "20", "--replications"];
    said(folder.path(), &[&field[..], &["1", "--examples", "maize.csv"]].concat());
    assert_eq!(weeder(folder.path(), &[&field[..], &["1"]].concat()).status.code(), Some(1));
}

#[test]
fn a_firmware_whose_leads_are_set_to_nothing_is_no_success() {
    let folder = folder();
    fs::write(folder.path().join("led.toml"), format!("{SMALL}[settings]\nlead_out_ms = 0\nlead_in_ms = 0\n")).unwrap();
    let output = weeder(folder.path(), &["trial", "--field", "led.toml", "--speeds", "1,4"]);
    let words = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1), "{words}");
    assert!(words.contains("two-sided 95 % interval). The share is highest at 4 km/h: "), "{words}");
}

#[test]
fn a_reader_that_closes_the_pipe_ends_it_well() {
    let folder = folder();
    let line = format!("'{}' sweep --field small.toml --x k=1..9:1 | head -n 1", env!("CARGO_BIN_EXE_weeder"));
    let mut bash = Command::new("bash");
    let output = bash.current_dir(folder.path()).args(["-o", "pipefail", "-c", &line]).output().unwrap();
    assert!(output.status.success(), "{}", told(&output));
}

#[test]
fn a_sweep_shows_each_result_along_one_axis_and_one_result_along_two() {
    let folder = folder();
    let words = said(folder.path(), &["sweep", "--field", "small.toml", "--x", "lead_out_ms=0..180:90"]);
    assert_has(&words, ["damage", "bound", "ha %²/(h hp)"]);
    let axes = ["--x", "lead_out_ms=0..180:90", "--y", "speed=1..3:1"];
    let words =
        said(folder.path(), &[["sweep", "--field", "small.toml", "--out", "sweep.csv"].as_slice(), &axes].concat());
    assert!(words.starts_with("plant damage, %, lead_out_ms across, speed, km/h down"), "{words}");
    let table = fs::read_to_string(folder.path().join("sweep.csv")).unwrap();
    assert!(table.starts_with("lead_out_ms,speed,plant_damage,weeding_efficiency"), "{table}");
    assert_eq!(table.lines().count(), 3 * 3 + 1);
}

#[test]
fn a_field_without_plants_has_no_share_of_zones_reached() {
    let folder = folder();
    let none = format!("{SMALL}[crop]\nmissing_percent = 90\ndouble_percent = 0\n[weeds]\ntall_per_m = 5\n");
    fs::write(folder.path().join("none.toml"), none).unwrap();
    let field = ["--field", "none.toml", "--spacing", "500", "--json"];
    let words = said(folder.path(), &[&["sweep", "--x", "plot.row_m=2..2:1"][..], &field].concat());
    let value: Value = serde_json::from_str(&words).unwrap();
    assert_eq!((&value["field"], &value["spacing_cm"]), (&"none.toml".into(), &500.0.into()));
    let point = &value["points"][0];
    assert_eq!((&point["plant_damage"], &point["zones_reached"]), (&Value::Null, &Value::Null), "{point}");
}

#[test]
fn sensitivity_has_a_column_for_each_speed_once_and_in_order() {
    let folder = folder();
    let table = |speeds: &str| {
        let field = ["--field", "small.toml", "--replications", "1", "--speeds", speeds, "crop.sway_mm=15"];
        said(folder.path(), &[&["sensitivity"][..], &field].concat())
    };
    assert_eq!(table("4,1,4"), table("1,4"));
}

#[test]
fn the_help_of_a_sweep_lists_the_axes_with_their_ranges() {
    let help = said(Path::new("."), &["sweep", "--help"]);
    for (name, range) in [
        ("speed", "0.1 to 8"),
        ("ground.slip_percent", "-30 to 30"),
        ("driving.speed_scatter_percent", "0 to 50"),
        ("lead_out_ms", "0 to 500"),
    ] {
        let mut lines = help.lines().map(str::trim_start);
        let line = lines.find_map(|line| line.strip_prefix(name)?.strip_prefix("  "));
        assert!(line.is_some_and(|line| line.trim_start().starts_with(range)), "{name}: {help}");
    }
}

#[test]
fn an_error_in_a_field_is_one_line_with_what_would_be_right() {
    for (text, wrong) in [
        (
            "[plot]\nrows = \"many\"\n",
            "wrong.toml, line 2: plot.rows is \"many\", but has to be a whole number from 1 to 1000, without a point: \
             rows of a plot",
        ),
        ("[plot]\nrows = -3\n", "wrong.toml, line 2: plot.rows is -3, but has to be a whole number from 1 to 1000"),
        ("[plot\n", "wrong.toml, line 1: "),
    ] {
        let output = weeder(folder_with("wrong.toml", text).path(), &["trial", "--field", "wrong.toml"]);
        assert_fails(&output, &format!("error: {wrong}"));
        assert_eq!(told(&output).lines().count(), 1, "{output:?}");
    }
}

#[test]
fn an_error_in_a_sweep_is_named_and_nothing_is_written() {
    for (words, why) in [
        ("lead_out_ms --out s.csv", "NAME=FROM..TO:STEP"),
        ("lead=1..2:1 --out s.csv", "lead is neither a parameter of the field nor"),
        ("speed=1..2:0 --out s.csv", "in steps of 0.001 or more"),
        ("k=1..3:1 --result money", "plant_damage"),
        ("speed=1..2:1 --y speed=2..3:1 --out s.csv", "both axes are `speed`"),
        ("k=1..3:1 --speed -1", "it has to be a number from 0.1 to 8"),
    ] {
        assert_writes_nothing(&format!("sweep --x {words}"), why);
    }
}
