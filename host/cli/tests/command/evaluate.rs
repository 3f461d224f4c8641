//! `weeder evaluate` as a user runs it: on the manual's example, on trials that are too small for a model, and on wrong
//! tables.

use crate::common::{self, assert_has, assert_refused, said};
use serde_json::Value;
use std::fs;
use std::path::Path;
use tempfile::TempDir;

const EXAMPLE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/trial-example.csv");

const HEADER: &str =
    "replication,speed_km_h,spacing_cm,weeds_before,weeds_after,plants,damaged,area_m2,time_s,width_m,power_hp\n";

/// A folder with the file `trial.csv`, of these lines below the header.
fn folder_with(lines: &str) -> TempDir {
    common::folder_with("trial.csv", &format!("{HEADER}{lines}"))
}

/// Asserts that the table is refused with this message, and that no report was begun.
#[track_caller]
fn assert_not_judged(folder: &TempDir, message: &str) {
    assert_refused(folder.path(), &["evaluate", "trial.csv", "--out", "report"], message);
    assert!(!folder.path().join("report").exists(), "nothing is done by half");
}

#[test]
fn the_manual_s_example_is_evaluated_in_plain_words_and_tables() {
    let said = said(Path::new("."), &["evaluate", EXAMPLE]);
    let lines = [
        "24 plots of 8 treatments (1, 1.5, 2 and 2.5 km/h; 50 and 60 cm), 3 of each treatment.",
        "13 of 1318 plants were damaged: 0.99 %, two-sided 95 % interval 0.52 to 1.69 %. At most 4.00 % in each of these plots",
        "the odds that a plant is damaged are 4.49 times as high for each km/h more (1.17 to 17.24; p = 0.0306)",
        "Performance index scatters more at some speeds or spacings than at others (p = 0.0192): its p-values are not exact.",
        "Plant damage rises by 1.292 points for each km/h (p = 0.0119) and shows no effect of spacing (p = 0.5347)",
        "- Eq. 29 has -0.2068 a cm, where the text has +0.2068: one sign is wrong.",
    ];
    assert_has(&said, lines);
    assert!(!said.contains("NaN") && !said.contains(" inf"), "{said}");
}

/// The figures are R's: `d <- read.csv("docs/trial-example.csv", comment = "#")`, `d$we <- (1 - d$weeds_after /
/// d$weeds_before) * 100`, `summary(lm(we ~ speed_km_h + spacing_cm, d))`, `anova(lm(we ~ factor(replication) +
/// factor(speed_km_h) * factor(spacing_cm), d))`, `g <- glm(cbind(damaged, plants - damaged) ~ speed_km_h + spacing_cm, d, family =
/// quasibinomial, control = glm.control(epsilon = 1e-300, maxit = 30))`, `summary(g)$coefficients`. The p of `g` is numpy's and
/// scipy's.
#[test]
fn the_json_agrees_with_r_for_the_same_table() {
    let json: Value = serde_json::from_str(&said(Path::new("."), &["evaluate", EXAMPLE, "--json"])).unwrap();
    assert_eq!(json["plots"].as_array().unwrap().len(), 24);
    assert_eq!(json["treatments"].as_array().unwrap().len(), 8);
    let levels = |of: &str, key: &str| -> Vec<f64> {
        json[of].as_array().unwrap().iter().filter_map(|one| one[key].as_f64()).collect()
    };
    let treated = levels("treatments", "speed_km_h");
    assert!(levels("plots", "speed_level_km_h").iter().all(|level| treated.contains(level)), "{treated:?}");
    let weeding = &json["responses"][1];
    assert_eq!(weeding["response"], "weeding_efficiency");
    let close = |value: &Value, r: f64| {
        let value = value.as_f64().unwrap();
        assert!((value / r - 1.0).abs() < 1e-9, "{value} is not {r}");
    };
    let speed = &weeding["model"]["terms"][1];
    close(&speed["estimate"], -4.13734061881);
    close(&speed["standard_error"], 0.331267121866);
    close(&speed["t"], -12.4894393247);
    close(&speed["p"], 3.47153171559e-11);
    close(&weeding["model"]["adjusted_r_squared"], 0.874883842566);
    let [block, interaction] = [0, 3].map(|source| &weeding["variance"]["sources"][source]);
    assert_eq!((&block["degrees_of_freedom"], &interaction["degrees_of_freedom"]), (&2.into(), &3.into()));
    close(&block["f"], 5.30398655487533);
    close(&interaction["f"], 2.22389896551527);
    close(&interaction["p"], 0.130564328444606);
    let odds = &json["responses"][0]["binomial"]["terms"][1];
    close(&odds["estimate"], 1.500865810502617);
    close(&odds["p"], 0.030627507510449358);
}

#[test]
fn the_report_is_one_page_in_a_folder_of_its_own() {
    let folder = TempDir::new().unwrap();
    let said = said(folder.path(), &["evaluate", EXAMPLE, "--out", "trials/may"]);
    assert!(said.ends_with("Report      trials/may/report.html\n"), "{said}");
    let files: Vec<_> = fs::read_dir(folder.path().join("trials/may")).unwrap().collect();
    assert_eq!(files.len(), 1, "{files:?}");
    let page = fs::read_to_string(folder.path().join("trials/may/report.html")).unwrap();
    assert!(page.contains("Field trial: trial-example.csv") && page.contains("<svg"), "{page}");
    assert!(page.trim_end().ends_with("</html>"), "it is whole");
}

#[test]
fn a_log_gives_each_plot_its_speed_and_what_the_table_leaves_empty() {
    // Plots 1 and 2: 30 m in 60 s and in 30 s, by a wheel with a tick a millimetre.
    let folder = folder_with("1,1.8,50,100,12,,0,,,0.4,2.5\n1,3.6,50,100,18,,1,,,0.4,2.5\n");
    let mut log =
        "time_ms,kind,line\n0,connected,0.2.0\n0,setting,ticks_per_m=1000\n0,setting,beam_to_tool_mm=400\n".to_owned();
    let mut now_ms = 0;
    for (plot, speed_mm_s) in [(0, 500), (1, 1000)] {
        let from = 30_000 * plot;
        log.push_str(&format!("{now_ms},event,state is=work\n"));
        for rolled in (0..=30_000).step_by(500) {
            let mut line = |kind: &str, line: String| log.push_str(&format!("{now_ms},{kind},{line}\n"));
            let position = from + rolled;
            let status = format!("state=work tool=in pos={position} speed_mm_s={speed_mm_s} windows=0 unseen_mm=0");
            line("status", status);
            if rolled < 30_000 {
                let plant = position + 250;
                line("event", format!("plant pos={plant} votes=3 spacing=500 delay=0 hold=100 actuation=0"));
                now_ms += 500 * 1000 / speed_mm_s;
            }
        }
        log.push_str(&format!("{now_ms},event,state is=hold\n"));
        now_ms += 60_000;
    }
    fs::write(folder.path().join("row.csv"), &log).unwrap();
    let words = said(folder.path(), &["evaluate", "trial.csv", "--log", "row.csv", "--out", "report"]);
    let page = fs::read_to_string(folder.path().join("report/report.html")).unwrap();
    let table: Vec<Vec<&str>> = words.lines().map(|line| line.split_whitespace().collect()).collect();
    for row in [
        ["1", "5", "to", "127", "60.0", "30.00", "1.80", "59"],
        ["2", "128", "to", "250", "30.0", "30.00", "3.60", "60"],
    ] {
        assert!(table.iter().any(|cells| cells.get(1..9) == Some(&row[..])), "{row:?} is not in\n{words}");
    }
    assert!(page.contains("lines of the log") && page.contains("row.csv"), "the report has the log's table");
    // In the morning the counts are not in yet, and with a log there is something to judge.
    let empty = format!("{HEADER}1,1.8,50,,,,,,,0.4,2.5\n1,3.6,50,,,,,,,0.4,2.5\n");
    fs::write(folder.path().join("empty.csv"), empty).unwrap();
    let efficiency = said(folder.path(), &["evaluate", "empty.csv", "--log", "row.csv"]);
    assert!(efficiency.contains("FIELD EFFICIENCY, %"), "{efficiency}");
    let none = "empty.csv: 2 of 2 plots are not filled in: enter what was counted";
    assert_refused(folder.path(), &["evaluate", "empty.csv"], none);
    let one = ["evaluate", "trial.csv", "--log", "row.csv", "--plots", "1"];
    assert_refused(folder.path(), &one, "stretches of work in the log: 2, plots: 1. Say which plot each stretch is");
    let labelled = format!("plot,{HEADER}P1,1,1.8,50,100,12,,0,,,0.4,2.5\nP2,1,3.6,50,100,18,,1,,,0.4,2.5\n");
    fs::write(folder.path().join("trial.csv"), labelled).unwrap();
    assert_refused(folder.path(), &one[..4], "replication 1 of 1.8 km/h and 50 cm has no number of its own");
    assert_has(&said(folder.path(), &one[..2]), ["each plot once: plots are numbered in the order of the lines"]);
}

#[test]
fn a_trial_without_damage_or_replications_is_evaluated_partly() {
    let folder = folder_with(
        "1,1,50,100,12,60,0,12,127,0.4,2.5\n1,1,60,100,10,50,0,12,126,0.4,2.5\n\
         1,2,50,100,18,60,0,12,65,0.4,2.5\n1,2,60,100,17,50,0,12,64,0.4,2.5\n",
    );
    let said = said(folder.path(), &["evaluate", "trial.csv"]);
    let lines = [
        "None of 220 plants was damaged: below 1.36 % (one-sided 95 % bound).",
        "Plant damage has no model: it is 0 in every plot",
        "No analysis of variance: it is 0 in every plot",
        "No analysis of variance: plots: 4, parameters: 3: this model takes at least 6 plots.",
    ];
    assert_has(&said, lines);
    assert!(!said.contains("NaN"), "{said}");
}

#[test]
fn a_single_plot_has_its_measures_and_no_model() {
    let folder = folder_with("1,1.5,50,200,30,50,1,24,180,0.4,2.5\n");
    assert_has(&said(folder.path(), &["evaluate", "trial.csv"]), ["159.94", "Weeding efficiency has no model"]);
}

#[test]
fn ground_covered_faster_than_the_machine_drives_is_pointed_out() {
    let folder = folder_with("1,1,50,100,12,60,0,12,127,0.4,2.5\n2,1,50,100,10,50,0,12,12,0.4,2.5\n");
    let said = said(folder.path(), &["evaluate", "trial.csv"]);
    assert_has(&said, ["Plot 2: more ground was covered than speed and width allow"]);
}

#[test]
fn a_wrong_table_is_named_and_nothing_is_written() {
    let line = "1,1.5,50,200,30,50,1,24,180,0.4,2.5\n";
    let twice = "trial.csv, line 3: replication 1 of 1.5 km/h and 50 cm is already in line 2";
    assert_not_judged(&folder_with(&line.repeat(2)), twice);
    let missing = "trial.csv, line 1: the column `spacing_cm` is missing: the header has to name replication,";
    assert_not_judged(&common::folder_with("trial.csv", "replication,speed_km_h\n1,1\n"), missing);
    assert_not_judged(&TempDir::new().unwrap(), "trial.csv cannot be read");
}

#[test]
fn measured_speeds_are_evaluated_at_the_nominal_ones_that_are_offered() {
    let table = concat!(env!("CARGO_MANIFEST_DIR"), "/../study/tests/tables/speeds-as-measured.csv");
    let words = said(Path::new("."), &["evaluate", table]);
    let (_, offer) = words.split_once("add --speeds ").unwrap();
    let (speeds, _) = offer.split_once(':').unwrap();
    assert!(!words.contains("speed × spacing"), "{words}");
    let nominal = said(Path::new("."), &["evaluate", table, "--speeds", speeds]);
    assert!(nominal.contains("speed × spacing") && !nominal.contains("add --speeds"), "{nominal}");
}
