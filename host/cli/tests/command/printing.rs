//! Tests of output: a reader that closes the pipe, a full disk, and an interrupted terminal.

use crate::common::SMALL;
use std::fs::{File, OpenOptions};
use std::io;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::thread::sleep;
use std::time::Duration;
use uno::pty::Pty;

/// Detections. The tool cuts none of them.
const OBJECTS: &str = "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,label\n694,500,226,250,573,plant\n";

/// The manual's example of a trial.
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

/// Runs `weeder` with these arguments and this standard output.
fn weeder(arguments: &[&str], stdout: impl Into<Stdio>) -> Output {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("objects.csv"), OBJECTS).unwrap();
    std::fs::write(folder.path().join("small.toml"), SMALL).unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
    command.args(arguments).current_dir(folder.path()).stdout(stdout).output().expect("cargo has built the command")
}

#[test]
fn a_pipe_that_is_closed_early_makes_no_command_fail() {
    for arguments in COMMANDS {
        let (reader, writer) = io::pipe().unwrap();
        drop(reader);
        let output = weeder(arguments, writer);
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!((output.status.code(), &*message), (Some(0), ""), "{arguments:?}");
    }
}

#[test]
fn a_full_disk_is_an_error_with_its_cause() {
    for arguments in COMMANDS {
        let output = weeder(arguments, OpenOptions::new().write(true).open("/dev/full").unwrap());
        let message = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(message.starts_with("error: the result cannot be printed: No space left on device"), "{message}");
    }
}

#[test]
fn lost_messages_beside_the_result_do_no_harm() {
    let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
    let full = File::options().write(true).open("/dev/full").unwrap();
    let status = command.args(["design", "--machine", "no-such.toml"]).stderr(full).status().unwrap();
    assert_eq!(status.code(), Some(2));
}

#[test]
fn ctrl_c_takes_the_progress_bar_away() {
    let mut terminal = Pty::open().unwrap();
    let other_side = OpenOptions::new().read(true).write(true).open(terminal.path()).unwrap();
    let mut soak = Command::new(env!("CARGO_BIN_EXE_weeder"))
        .args(["soak", "--hours", "10000", "--uno-minutes", "0"])
        .env("TERM", "xterm")
        .stdout(Stdio::null())
        .stderr(other_side)
        .spawn()
        .expect("cargo has built the command");
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
    Command::new("kill").args(["-INT", &soak.id().to_string()]).status().expect("there is a kill");
    assert_eq!(soak.wait().expect("it ends").code(), Some(130));
    let text = read(&|_| true);
    let end = text.rsplit("to go").next().unwrap_or_default();
    assert!(end.contains("\u{1b}[2K"), "the line is cleared: {end:?}");
}

#[test]
fn dash_is_standard_input_wherever_a_file_is_read() {
    let run = |arguments: &[&str], text: &str| {
        let (reader, mut writer) = io::pipe().unwrap();
        io::Write::write_all(&mut writer, text.as_bytes()).unwrap();
        drop(writer);
        let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
        let output = command.args(arguments).stdin(reader).output().unwrap();
        (
            output.status.code(),
            String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr),
        )
    };
    assert_eq!(run(&["classify", "-"], OBJECTS).0, Some(0));
    assert_eq!(run(&["evaluate", "-"], &std::fs::read_to_string(TRIAL).unwrap()).0, Some(0));
    assert_eq!(run(&["design", "--machine", "-"], "weeder.mass = \"130 kg\"").0, Some(0));
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
        let (status, said) = run(arguments, "nonsense\n1\n");
        assert_eq!(status, Some(2), "{arguments:?}: {said}");
        assert!(said.contains(wrong), "{arguments:?}: {said}");
    }
}

#[test]
fn help_knows_the_commands_and_an_unknown_command_lists_them() {
    let run = |arguments: &[&str]| weeder(arguments, Stdio::piped());
    let help = run(&["help", "trial"]);
    assert!(help.status.success() && String::from_utf8_lossy(&help.stdout).contains("--replications"));
    let unknown = run(&["trail"]);
    let message = String::from_utf8_lossy(&unknown.stderr);
    assert_eq!(unknown.status.code(), Some(2));
    assert!(message.contains("the commands are sim, flash, hex, virtual-uno"), "{message}");
    let unknown = run(&["settings", "show"]);
    let message = String::from_utf8_lossy(&unknown.stderr);
    assert!(message.contains("the commands are pull, push, diff"), "{message}");
}

#[test]
fn results_are_printed_as_json_for_scripts() {
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = weeder(arguments, Stdio::piped());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).unwrap_or_else(|error| panic!("{arguments:?}: {error}"))
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
    let plants = |arguments: &[&str]| {
        let output = weeder(arguments, Stdio::piped());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    let one = plants(&["sim", "--plants", "1", "--speed", "4"]);
    assert!(one.starts_with("1 plant and 0 tall weeds"), "{one}");
    // A result without its field and its seed cannot be repeated.
    assert!(one.contains(" at 4 km/h\nField walked, seed 1\n"), "{one}");
    let two = plants(&["sim", "--plants", "2", "--speed", "4"]);
    assert!(two.starts_with("2 plants and 2 tall weeds"), "{two}");
}

#[test]
fn the_printed_bound_is_named_for_kept_margins() {
    let output = weeder(&["sim", "--plants", "3", "--paper", "--speed", "2"], Stdio::piped());
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(said.contains("with every canopy and its margin kept, this servo allows "), "{said}");
    assert!(!said.contains("is the most"), "{said}");
}

/// Standard input by its own name is a file like others.
#[test]
fn a_folder_is_no_file_to_read() {
    let output = weeder(&["classify", Path::new("/").to_str().unwrap()], Stdio::piped());
    assert_eq!(output.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&output.stderr).contains("/ is a folder, and a file is needed"));
}
