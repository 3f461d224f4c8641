//! `weeder train` and `weeder classify`, as they are called.

use crate::common::{self, assert_has, assert_refused, printed, said, told, weeder};
use std::fs;
use study::training::MOST_EXAMPLES;
use tempfile::TempDir;

const BUILT_IN: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../control/src/ground/examples/table.rs");

const HEADER: &str = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n";

/// A folder with the file `objects.csv`, of these lines below the header.
fn folder_with(lines: &str) -> TempDir {
    common::folder_with("objects.csv", &format!("{HEADER}{lines}"))
}

/// Asserts that these objects and arguments are refused with these words.
#[track_caller]
fn assert_not_taken(lines: &str, arguments: &[&str], words: &str) {
    assert_refused(folder_with(lines).path(), arguments, words);
}

#[test]
fn the_built_in_table_is_the_command_s_output() {
    let folder = TempDir::new().unwrap();
    let said = said(folder.path(), &["train", "--synthetic", "--out", "table.rs", "--picture", "regions.svg"]);
    let written = fs::read_to_string(folder.path().join("table.rs")).unwrap();
    let built_in = fs::read_to_string(BUILT_IN).unwrap();
    assert!(
        written == built_in,
        "the table is out of date: run `cargo run --release -p weeder-cli -- train --synthetic --force --out {BUILT_IN}`"
    );
    assert_eq!(said.matches("Plants classified as weeds   0 of ").count(), 3, "{said}");
    assert!(fs::read_to_string(folder.path().join("regions.svg")).unwrap().starts_with("<svg"));
}

#[test]
fn examples_written_as_csv_are_known_to_the_firmware() {
    let folder = TempDir::new().unwrap();
    said(folder.path(), &["train", "--synthetic", "--out", "examples.csv"]);
    assert_has(&said(folder.path(), &["classify", "examples.csv"]), ["Treated as they should       100.00 % of all"]);
}

#[test]
fn a_table_of_no_examples_says_why() {
    let folder = TempDir::new().unwrap();
    let output = weeder(folder.path(), &["train", "--synthetic", "--beside", "--out", "none.csv"]);
    assert_has(&printed(&output, 0), ["none.csv has no example: none improves the built-in table"]);
    assert_eq!(fs::read_to_string(folder.path().join("none.csv")).unwrap(), HEADER);
}

#[test]
fn a_plant_that_would_be_cut_ends_with_status_1() {
    // A plant as narrow as a weed.
    let folder = folder_with("694,300,226,116,439,plant\n694,500,226,250,573,plant\n");
    let said = printed(&weeder(folder.path(), &["classify", "objects.csv"]), 1);
    assert_has(&said, ["Plants classified as weeds   1 of 2, 50.00 %"]);
}

#[test]
fn answers_are_printed_as_json_for_scripts() {
    let folder = folder_with("694,300,226,116,439,plant\n694,500,226,250,573,\n");
    let output = weeder(folder.path(), &["classify", "objects.csv", "--json"]);
    assert_eq!(output.status.code(), Some(1));
    let rows: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((&rows[0]["answer"], &rows[0]["label"]), (&"weed".into(), &"plant".into()));
    assert_eq!(rows[1]["detection"], 2);
    assert_eq!((&rows[1]["answer"], &rows[1]["label"]), (&"plant".into(), &serde_json::Value::Null));
    assert!(rows[1]["votes_plant"].as_u64() > rows[1]["votes_weed"].as_u64(), "{rows}");
}

#[test]
fn objects_without_labels_are_classified_without_a_score() {
    let folder = folder_with("694,300,226,116,439,\n");
    let said = said(folder.path(), &["classify", "objects.csv"]);
    assert_has(&said, ["weed", "known"]);
    assert!(!said.contains("classified as"), "{said}");
}

#[test]
fn a_table_larger_than_the_flash_budget_is_refused_by_name() {
    let above = MOST_EXAMPLES + 1;
    let room = format!("it has to be a whole number from 0 to {MOST_EXAMPLES}");
    assert_not_taken("", &["train", "--synthetic", "--max", &above.to_string()], &room);
    assert_not_taken("", &["train", "--synthetic", "--max", "9"], "too many examples: ");
}

#[test]
fn detections_that_need_too_many_examples_are_refused() {
    // Plants and weeds in a chessboard pattern, 80 of each; four detections a square, so that none is noise.
    let square = |place: i32| {
        let (spacing_mm, hold_mm) = (100 + place / 20 * 50, 100 + place % 20 * 10);
        let label = if (place / 20 + place) % 2 == 0 { "plant" } else { "weed" };
        let line = |aside_mm: i32| format!("694,{},226,{hold_mm},500,{label}\n", spacing_mm + aside_mm);
        (0..4).map(line).collect::<String>()
    };
    let chessboard: String = (0..160).map(square).collect();
    for (most, other) in [(64, ", or choose a larger --max"), (MOST_EXAMPLES, "\n")] {
        let room =
            format!("there is room for {most}: remove detections with a wrong label, or unlike all others{other}");
        assert_not_taken(&chessboard, &["train", "objects.csv", "--max", &most.to_string()], &room);
    }
}

#[test]
fn a_k_that_is_not_the_machine_s_default_is_told() {
    let detection = |n: i32| format!("556,50{n},250,250,578,plant\n556,30{n},250,116,444,weed\n");
    let folder = folder_with(&[0, 1, 2].map(detection).concat());
    for (k, is_told) in [("1", true), ("3", false)] {
        let said = printed(&weeder(folder.path(), &["train", "objects.csv", "--k", k]), 0);
        assert_eq!(said.contains("`set k 1`, then `save`"), is_told, "{said}");
    }
    let output = weeder(folder.path(), &["train", "objects.csv", "--json"]);
    let trained: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let counted = &trained["before_condensing"];
    assert_eq!((&counted["plants_as"]["plant"], &counted["weeds_as"]["weed"]), (&3.into(), &3.into()), "{trained}");
    assert_eq!(counted["plants_taken_for_weeds_share"]["of"], 3);
}

#[test]
fn detections_that_dumps_repeat_count_once() {
    // Four plants and four weeds, saved by dumps that overlap: each is there three times.
    let detection = |number: i32| match number % 2 {
        0 => format!("694,{},226,{},500,plant\n", 400 + number, 250 - number),
        _ => format!("694,{},226,{},500,weed\n", 200 + number, 110 + number),
    };
    let dump = |from: i32| (from..from + 6).map(|number| detection(number % 8)).collect::<String>();
    let folder = folder_with(&[dump(0), dump(2), dump(4), dump(6)].concat());
    let said = printed(&weeder(folder.path(), &["train", "objects.csv"]), 0);
    assert!(said.starts_with("Detections  8\n") && !said.contains("both labels"), "{said}");
    assert_has(&said, ["Passed over 16 that repeat another line"]);
    fs::write(folder.path().join("relabelled.csv"), HEADER.to_owned() + &detection(2).replace("plant", "weed"))
        .unwrap();
    let output = weeder(folder.path(), &["train", "objects.csv", "relabelled.csv"]);
    let said = "Learned 1 with both labels, such as relabelled.csv, line 2: an earlier line has it as a plant";
    assert_has(&told(&output), [said]);
}

#[test]
fn training_reports_newly_unknown_plants_and_changed_answers() {
    // Weeds and plants of nearly the same widths: few plants have room beside the weeds.
    let detection = |n: i32| {
        let (label, narrowest_mm) = if n % 2 == 0 { ("weed", 104) } else { ("plant", 112) };
        let hold_mm = narrowest_mm + 19 * n % 17;
        format!("278,{},300,{hold_mm},{},weed,{label}\n", 60 + 41 * n % 160, 339 + hold_mm)
    };
    let folder = TempDir::new().unwrap();
    let lines: String = (0..24).map(detection).collect();
    fs::write(folder.path().join("objects.csv"), HEADER.replace("label", "answer,label") + &lines).unwrap();
    let said = printed(&weeder(folder.path(), &["train", "objects.csv", "--k", "3", "--max", "5"]), 0);
    assert_has(&said, ["With the table, 12 more plants are unknown", "The machine classified 12 of 24 otherwise"]);
}

#[test]
fn a_training_that_takes_long_is_told() {
    let line = |number: usize| format!("694,{number},226,250,573,{}\n", ["plant", "weed"][number % 2]);
    let lines: String = (0..5001).map(line).collect();
    let table = ["train", "objects.csv", "--beside", "--out", "table.rs"];
    assert_not_taken(&lines, &table, "Learning from 5001 detections takes long");
}

#[test]
fn a_class_that_no_detection_has_gets_no_share() {
    let folder = folder_with("694,300,226,116,439,weed\n");
    let said = said(folder.path(), &["classify", "objects.csv"]);
    assert_has(&said, ["Plants classified as weeds   0 of 0, \u{2013}", "Weeds left standing          0 of 1, 0.00 %"]);
}

#[test]
fn wrong_options_of_a_training_are_refused() {
    for (words, why) in [
        ("train --synthetic --k 16", "it has to be auto or a number from 1 to 15"),
        ("classify objects.csv --k 0", "it has to be a whole number from 1 to 15"),
        ("train --synthetic --out table.txt", "a table is written as Rust (.rs) or as CSV (.csv)"),
        ("train", "<FILE.csv|--synthetic>"),
        ("train objects.csv --synthetic", "cannot be used with"),
    ] {
        assert_not_taken("", &words.split(' ').collect::<Vec<_>>(), why);
    }
}
