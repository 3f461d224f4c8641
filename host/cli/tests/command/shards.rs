//! `--shard` and `weeder merge`: the merged parts of a study equal the undivided study byte by byte. Incomplete studies
//! are refused.

use crate::common::{Running, SMALL, assert_refused, command, folder_with, said, told, typed, weeder};
use model_test::is_thorough;
use std::fs;
use std::path::Path;
use std::thread;
use std::time::Duration;
use tempfile::TempDir;

const TRIAL: [&str; 5] = ["trial", "--field", "small.toml", "--seed", "7"];

fn folder() -> TempDir {
    folder_with("small.toml", SMALL)
}

/// Computes a study in `of` shards, each to the part `I.part`, the last one first.
#[track_caller]
fn compute_parts(folder: &Path, study: &[&str], of: u32) {
    for number in (1..=of).rev() {
        let (shard, out) = (format!("{number}/{of}"), format!("{number}.part"));
        said(folder, &[study, &["--shard", &shard, "--out", &out]].concat());
    }
}

/// Asserts that four parts of a study give the same output, status and files as the undivided study.
#[track_caller]
fn assert_same(study: &[&str], shown: &[&str], files: &[&str]) {
    let (single, merged) = (folder(), folder());
    let expected = thread::scope(|scope| {
        let undivided = scope.spawn(|| weeder(single.path(), &[study, shown].concat()));
        compute_parts(merged.path(), study, 4);
        undivided.join().expect("it runs")
    });
    let parts = ["merge", "3.part", "1.part", "4.part", "2.part"];
    let output = weeder(merged.path(), &[&parts[..], shown].concat());
    assert_eq!(output.status.code(), expected.status.code(), "{}", told(&output));
    assert!(!output.stdout.is_empty());
    assert_eq!(String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&expected.stdout));
    for file in files {
        let [single, merged] = [&single, &merged].map(|folder| fs::read(folder.path().join(file)).unwrap());
        assert!(single == merged, "{file} differs");
    }
}

#[test]
fn a_trial_in_four_shards_is_the_undivided_trial_to_the_byte() {
    assert_same(&TRIAL, &["--out", "report"], &["report/report.html", "report/trial.csv", "report/controllers.csv"]);
    assert_same(&TRIAL, &["--json"], &[]);
    assert_same(&[&TRIAL[..], &["--baselines", "paper", "--speeds", "7"]].concat(), &["--brief"], &[]);
}

#[test]
fn a_sweep_in_four_shards_is_the_undivided_sweep_to_the_byte() {
    let sweep = ["sweep", "--field", "small.toml", "--x", "lead_out_ms=0..180:60", "--y", "speed=1..7:3"];
    assert_same(&sweep, &["--result", "in_row_weeding", "--out", "points.csv"], &["points.csv"]);
    assert_same(&sweep, &["--json"], &[]);
    assert_same(&["sweep", "--field", "small.toml", "--x", "k=1..3:1"], &[], &[]);
}

#[test]
fn a_soak_in_four_shards_is_the_undivided_soak_to_the_byte() {
    // A minute of the firmware takes two cores five seconds.
    let uno_minutes = if is_thorough() { "1" } else { "0" };
    let soak = ["soak", "--hours", "1", "--uno-minutes", uno_minutes, "--faults", "900"];
    assert_same(&soak, &[], &[]);
    assert_same(&["soak", "--hours", "1", "--uno-minutes", "0"], &["--json"], &[]);
}

#[test]
fn a_part_that_comes_through_a_pipe_is_merged() {
    let folder = folder();
    let trial = [&TRIAL[..], &["--speeds", "1", "--spacings", "50"]].concat();
    compute_parts(folder.path(), &trial, 2);
    let part = fs::read(folder.path().join("1.part")).unwrap();
    let merged = typed(command(&["merge", "/dev/stdin", "2.part"]).current_dir(folder.path()), part);
    assert_eq!(merged.stdout, weeder(folder.path(), &trial).stdout, "{}", told(&merged));
}

#[test]
fn more_shards_than_plots_are_a_whole_study_too() {
    let folder = folder();
    let trial = [&TRIAL[..], &["--speeds", "1", "--spacings", "50", "--replications", "2"]].concat();
    compute_parts(folder.path(), &trial, 3);
    let merged = weeder(folder.path(), &["merge", "1.part", "2.part", "3.part"]);
    assert_eq!(merged.stdout, weeder(folder.path(), &trial).stdout);
}

/// Asserts that the command fails with these words, and that no report was written.
#[track_caller]
fn assert_reports_nothing(folder: &Path, arguments: &[&str], words: &str) {
    assert_refused(folder, arguments, words);
    assert!(!folder.join("report").exists());
}

#[test]
fn parts_that_are_no_whole_study_are_refused_by_name() {
    let folder = folder();
    let path = folder.path();
    compute_parts(path, &TRIAL, 3);
    let merge = |parts: &[&'static str]| [&["merge", "--out", "report"], parts].concat();
    assert_reports_nothing(path, &merge(&["1.part", "3.part"]), "part 2/3 is missing");
    assert_reports_nothing(
        path,
        &merge(&["1.part", "2.part", "3.part", "2.part"]),
        "2.part and 2.part are both part 2/3",
    );
    let other = ["trial", "--field", "small.toml", "--seed", "8", "--shard", "2/3", "--out", "other.part"];
    said(path, &other);
    let seed = "other.part belongs to another study than 1.part: its experiment.seed is 8, not 7";
    assert_reports_nothing(path, &merge(&["1.part", "other.part", "3.part"]), seed);
    let sweep = ["sweep", "--field", "small.toml", "--x", "k=1..9:1", "--shard", "2/3", "--out", "sweep.part"];
    said(path, &sweep);
    let command = "sweep.part belongs to another study than 1.part: its command is \"sweep\", not \"trial\"";
    assert_reports_nothing(path, &merge(&["1.part", "sweep.part", "3.part"]), command);

    let text = fs::read_to_string(path.join("2.part")).unwrap();
    let change = |name: &str, from: &str, to: &str| {
        assert!(text.contains(from));
        fs::write(path.join(name), text.replacen(from, to, 1)).unwrap();
    };
    let version = concat!("\"version\":\"", env!("CARGO_PKG_VERSION"));
    change("older.part", version, "\"version\":\"0.0.9");
    assert_reports_nothing(path, &merge(&["1.part", "older.part", "3.part"]), "older.part is of weeder 0.0.9");
    change("built.part", "\"build\":\"", "\"build\":\"0");
    assert_reports_nothing(path, &merge(&["1.part", "built.part", "3.part"]), "built.part is of weeder ");
    fs::write(path.join("cut.part"), &text[..text.len() / 2]).unwrap();
    assert_reports_nothing(path, &merge(&["1.part", "cut.part", "3.part"]), "cut.part, line ");
    assert_reports_nothing(path, &merge(&["1.part", "small.toml", "3.part"]), "small.toml is no part of a study");
    fs::write(path.join("empty.csv"), "").unwrap();
    let empty =
        "empty.csv is no part of a study, as `weeder trial --shard 1/4 --out empty.csv` would write it: it is empty";
    assert_reports_nothing(path, &merge(&["1.part", "empty.csv", "3.part"]), empty);
    assert_reports_nothing(path, &merge(&["1.part", "no.part", "3.part"]), "no.part cannot be read: No such file");
}

#[test]
fn options_that_contradict_parts_are_refused() {
    let folder = folder();
    let path = folder.path();
    for shard in ["0/4", "5/4", "2", "x/y"] {
        assert_reports_nothing(
            path,
            &[&TRIAL[..], &["--shard", shard, "--out", "p"]].concat(),
            "it has to be I/N, such as 2/4",
        );
    }
    assert_reports_nothing(path, &[&TRIAL[..], &["--shard", "1/4"]].concat(), "--out <FOLDER>");
    assert_reports_nothing(path, &["soak", "--out", "p"], "--shard <I/N>");
    let soak = ["soak", "--hours", "1", "--uno-minutes", "0", "--shard", "1/1", "--out", "soak.part"];
    said(path, &soak);
    assert_reports_nothing(path, &["merge", "soak.part", "--out", "report"], "a soak, which writes no file");
    assert_reports_nothing(path, &["merge", "soak.part", "--brief"], "--brief is for parts of a trial");
    assert_reports_nothing(path, &["merge", "soak.part", "--result", "alarms"], "--result is for parts of a sweep");
    let nowhere = [&TRIAL[..], &["--shard", "1/4", "--out", "no/such/folder/p"]].concat();
    assert_reports_nothing(path, &nowhere, "no/such/folder/p cannot be written");
}

#[test]
fn a_killed_shard_leaves_no_file_and_can_be_restarted() {
    let folder = folder();
    let path = folder.path();
    let endless = ["soak", "--hours", "10000", "--uno-minutes", "0", "--shard", "1/2", "--out", "1.part"];
    let mut shard = Running::start(command(&endless).current_dir(path));
    // At any progress: it would take hours.
    thread::sleep(Duration::from_millis(500));
    assert!(shard.0.try_wait().unwrap().is_none(), "it computes");
    drop(shard);
    let left: Vec<_> = fs::read_dir(path).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert_eq!(left, ["small.toml"]);

    compute_parts(path, &TRIAL, 1);
    let first = fs::read(path.join("1.part")).unwrap();
    let again = [&TRIAL[..], &["--shard", "1/1", "--out", "1.part"]].concat();
    assert_refused(path, &again, "1.part is there already");
    said(path, &[&again[..], &["--force"]].concat());
    assert!(first == fs::read(path.join("1.part")).unwrap(), "the same part, in the place of the first");
}

#[test]
fn a_trial_of_more_plants_than_can_be_counted_is_refused() {
    let folder = folder();
    fs::write(folder.path().join("huge.toml"), "[plot]\nrows = 1000\nrow_m = 1000\n").unwrap();
    let trial = ["trial", "--field", "huge.toml", "--replications", "1000"];
    assert_reports_nothing(folder.path(), &trial, "has to have at most 2000000000");
}
