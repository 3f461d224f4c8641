//! `weeder plan` as a user runs it: its table can be filled in by hand, and `weeder evaluate` evaluates it.

use crate::common::{assert_has, assert_refused, said};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

/// The table with every empty cell filled in. Damage and remaining weeds rise with speed, and blocks differ.
fn filled_in(table: &str) -> String {
    let fill = |line: &str| {
        let cells: Vec<&str> = line.split(',').collect();
        let [plot, block, speed, spacing, "", "", "", "", "", "", width, power] = cells[..] else {
            return line.to_owned();
        };
        let (number, fast): (u32, f64) = (plot.parse().unwrap(), speed.parse().unwrap());
        let after = 10 + (10.0 * fast) as u32 + number % 3 + 2 * block.parse::<u32>().unwrap();
        let damaged = u32::from(fast > 1.8) + number % 2;
        let time_s = 500.0 / fast;
        format!("{plot},{block},{speed},{spacing},200,{after},60,{damaged},12,{time_s},{width},{power}")
    };
    table.lines().map(fill).collect::<Vec<_>>().join("\n")
}

#[test]
fn a_plan_filled_in_by_hand_is_evaluated() {
    let folder = TempDir::new().unwrap();
    let words = said(folder.path(), &["plan", "--width", "0.4", "--power", "2.5", "--out", "trial.csv"]);
    assert_eq!(words, "Written: trial.csv, 24 plots in 3 blocks\n");
    let path = folder.path().join("trial.csv");
    let empty = fs::read_to_string(&path).unwrap();
    fs::write(&path, filled_in(&empty)).unwrap();
    let words = said(folder.path(), &["evaluate", "trial.csv"]);
    let lines = [
        "24 plots of 8 treatments (1, 1.5, 2 and 2.5 km/h; 50 and 60 cm), 3 of each treatment.",
        "Weeding efficiency falls by",
        "│ block",
    ];
    assert_has(&words, lines);
}

#[test]
fn a_plan_is_refused_while_it_is_empty_and_an_empty_cell_is_named() {
    let folder = TempDir::new().unwrap();
    said(folder.path(), &["plan", "--width", "0.4", "--power", "2.5", "--out", "trial.csv", "--sheets", "sheets.html"]);
    assert_eq!(fs::read_to_string(folder.path().join("sheets.html")).unwrap().matches("<section>").count(), 24);
    let none = "trial.csv: 24 of 24 plots are not filled in: enter what was counted";
    assert_refused(folder.path(), &["evaluate", "trial.csv"], none);
    let path = folder.path().join("trial.csv");
    let filled = filled_in(&fs::read_to_string(&path).unwrap());
    // A cell that was forgotten in the evening.
    let (last, _) = filled.rsplit_once(',').unwrap();
    fs::write(&path, format!("{last},\n")).unwrap();
    let words = said(folder.path(), &["evaluate", "trial.csv"]);
    assert_has(&words, ["Plot 24 (no power_hp) takes no part in performance index."]);
}

#[test]
fn the_same_seed_draws_the_same_plan() {
    let plan = |seed: &str| {
        let table = said(Path::new("."), &["plan", "--blocks", "2", "--seed", seed]);
        table.lines().filter(|line| !line.starts_with('#')).map(str::to_owned).collect::<Vec<_>>()
    };
    assert_eq!(plan("7"), plan("7"));
    assert_ne!(plan("7"), plan("8"));
    assert_eq!(plan("7").len(), 1 + 2 * 8);
}
