//! Tests of output: a reader that closes the pipe, a full disk, and an interrupted terminal.

use crate::common::{Running, SMALL, assert_fails, assert_has, command, told, typed};
use std::fs::{File, OpenOptions};
use std::io;
use std::process::{Output, Stdio};
use std::thread::sleep;
use std::time::Duration;
use uno::pty::Pty;

/// Detections. The tool cuts none of them.
const OBJECTS: &str = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n694,500,226,250,573,plant\n";

const TRIAL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/trial-example.csv");

/// Commands of each kind that need no firmware, with a part of their output.
const COMMANDS: [&[&str]; 10] = [
    &["design"],
    &["design", "--json"],
    &["design", "--print-machine"],
    &["design", "--against-paper"],
    &["classify", "objects.csv"],
    &["classify", "objects.csv", "--json"],
    &["evaluate", TRIAL],
    &["plan"],
    &["sweep", "--field", "small.toml", "--x", "k=1..3:2"],
    &["completions", "bash"],
];

fn weeder(arguments: &[&str], stdout: impl Into<Stdio>) -> Output {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("objects.csv"), OBJECTS).unwrap();
    std::fs::write(folder.path().join("small.toml"), SMALL).unwrap();
    command(arguments).current_dir(folder.path()).stdout(stdout).output().expect("cargo has built the command")
}

/// The result of `weeder` with these arguments. It must succeed.
#[track_caller]
fn said(arguments: &[&str]) -> String {
    let output = weeder(arguments, Stdio::piped());
    assert!(output.status.success(), "{}", told(&output));
    String::from_utf8(output.stdout).expect("it prints text")
}

#[test]
fn a_pipe_that_is_closed_early_makes_no_command_fail() {
    for arguments in COMMANDS {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let output = weeder(arguments, writer);
        assert_eq!((output.status.code(), &*told(&output)), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn a_full_disk_is_an_error_with_its_cause() {
    for arguments in COMMANDS {
        let output = weeder(arguments, OpenOptions::new().write(true).open("/dev/full").unwrap());
        assert_fails(&output, "error: the result cannot be printed: No space left on device");
    }
}

#[test]
fn lost_messages_beside_the_result_do_no_harm() {
    let full = File::options().write(true).open("/dev/full").unwrap();
    let status = command(&["design", "--machine", "no-such.toml"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn ctrl_c_takes_the_progress_bar_away() {
    let mut terminal = Pty::open().unwrap();
    let other_side = OpenOptions::new().read(true).write(true).open(terminal.path()).unwrap();
    let mut soak = command(&["soak", "--hours", "10000", "--uno-minutes", "0"]);
    let mut soak = Running::start(soak.env("TERM", "xterm").stdout(Stdio::null()).stderr(other_side));
    let mut shown = Vec::new();
    let mut read = |until: &dyn Fn(&str) -> bool| {
        // The test runner has the time limit.
        loop {
            let mut buffer = [0; 4096];
            let count = terminal.read(&mut buffer).unwrap();
            shown.extend(&buffer[..count]);
            let text = String::from_utf8_lossy(&shown).into_owned();
            if until(&text) {
                return text;
            }
            sleep(Duration::from_millis(20));
        }
    };
    read(&|text| text.contains("to go"));
    soak.signal("-INT");
    assert_eq!(soak.0.wait().expect("it ends").code(), Some(130));
    let text = read(&|_| true);
    let end = text.rsplit("to go").next().unwrap_or_default();
    assert!(end.contains("\u{1b}[2K"), "the line is cleared: {end:?}");
}

#[test]
fn dash_is_standard_input_wherever_a_file_is_read() {
    let trial = std::fs::read_to_string(TRIAL).unwrap();
    for (arguments, text) in [
        (&["classify", "-"][..], OBJECTS),
        (&["evaluate", "-"], &trial),
        (&["design", "--machine", "-"], "weeder.mass = \"130 kg\""),
    ] {
        let output = typed(&mut command(arguments), text);
        assert!(output.status.success(), "{arguments:?}: {}", told(&output));
    }
    // These are read, and refused for their content.
    for (arguments, wrong) in [
        (&["sim", "--row", "-"][..], "the column `position_mm` is missing"),
        (&["train", "-"], "the column `speed_mm_s` is missing"),
        (&["replay", "-"], "the column `time_ms` is missing"),
        (&["map", "-", "-", "--out", "map.geojson"], "name - once"),
        (&["evaluate", "-", "--log", "-"], "name - once"),
        (&["trial", "--field", "-"], "line 1"),
        (&["sweep", "--x", "k=1..2:1", "--field", "-"], "line 1"),
        (&["settings", "push", "-"], "line 1"),
        (&["settings", "diff", "-"], "line 1"),
        (&["sim", "--capture", "-", "--channel-a", "A", "--channel-b", "B"], "cannot be read"),
    ] {
        assert_fails(&typed(&mut command(arguments), "nonsense\n1\n"), wrong);
    }
}

#[test]
fn help_knows_the_commands_and_an_unknown_command_lists_them() {
    assert_has(&said(&["help", "trial"]), ["--replications"]);
    for (words, known) in [
        (&["trail"][..], "the commands are sim, flash, hex, virtual-uno"),
        (&["settings", "show"], "the commands are pull, push, diff"),
    ] {
        assert_fails(&weeder(words, Stdio::piped()), known);
    }
}

#[test]
fn results_are_printed_as_json_for_scripts() {
    let json = |arguments: &[&str]| -> serde_json::Value {
        serde_json::from_str(&said(arguments)).unwrap_or_else(|error| panic!("{arguments:?}: {error}"))
    };
    let sim = json(&["sim", "--plants", "2", "--speed", "3", "--json"]);
    assert_eq!((&sim["damaged"], sim["plants"].as_array().unwrap().len()), (&0.into(), 2));
    assert_eq!(sim["plants"][0]["verdict"], "kept");
    let sweep = json(&["sweep", "--field", "small.toml", "--x", "k=1..3:2", "--json"]);
    assert_eq!((&sweep["points"][1]["k"], &sweep["points"][1]["plant_damage"]), (&3.0.into(), &0.0.into()));
    let soak = json(&["soak", "--hours", "1", "--uno-minutes", "0", "--json"]);
    assert_eq!((&soak["parts"][0]["part"], &soak["parts"][0]["harmed"]), (&"decisions".into(), &0.into()));
}

#[test]
fn a_row_of_few_plants_has_the_weeds_that_there_is_room_for() {
    let one = said(&["sim", "--plants", "1", "--speed", "4"]);
    assert!(one.starts_with("1 plant and 0 tall weeds"), "{one}");
    // A result without its field and its seed cannot be repeated.
    assert!(one.contains(" at 4 km/h\nField walked, seed 1\n"), "{one}");
    let two = said(&["sim", "--plants", "2", "--speed", "4"]);
    assert!(two.starts_with("2 plants and 2 tall weeds"), "{two}");
}

#[test]
fn the_printed_bound_is_named_for_kept_margins() {
    let said =
        String::from_utf8(weeder(&["sim", "--plants", "3", "--paper", "--speed", "2"], Stdio::piped()).stdout).unwrap();
    assert!(said.contains("with every canopy and its margin kept, this servo allows "), "{said}");
    assert!(!said.contains("is the most"), "{said}");
}

/// Standard input by its own name is a file like others.
#[test]
fn a_folder_is_no_file_to_read() {
    assert_fails(&weeder(&["classify", "/"], Stdio::piped()), "/ is a folder, and a file is needed");
}
