//! What the `weeder` command says to input that is wrong. None of these runs the firmware.

use std::process::{Command, Output};

/// Runs `weeder` with these arguments.
fn weeder(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_weeder")).args(arguments).output().expect("cargo has built the command")
}

/// Asserts status 2 and a message that contains `words`.
#[track_caller]
fn assert_refused(arguments: &[&str], words: &str) {
    let output = weeder(arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(words), "{message}");
}

#[test]
fn a_speed_that_no_machine_walks_is_refused_with_its_range() {
    assert_refused(&["sim", "--speed", "11"], "it has to be a number from 0.1 to 10");
    assert_refused(&["sim", "--speed", "fast"], "it has to be a number from 0.1 to 10");
    assert_refused(&["sim", "--speed", "NaN"], "it has to be a number from 0.1 to 10");
}

#[test]
fn canopies_wider_than_their_spacing_are_refused() {
    assert_refused(&["sim", "--spacing", "100", "--canopy", "150"], "--spacing has to exceed --canopy");
}

#[test]
fn more_weeds_than_there_is_room_for_are_refused() {
    assert_refused(&["sim", "--plants", "2", "--weeds", "50"], "there is no room for 50 tall weeds between the plants");
}

#[test]
fn a_row_and_a_recording_that_do_not_exist_are_named() {
    assert_refused(&["sim", "--row", "no-such-row.csv"], "no-such-row.csv");
    let recording = ["sim", "--capture", "no-such.vcd", "--channel-a", "A", "--channel-b", "B"];
    assert_refused(&recording, "no-such.vcd");
}

#[test]
fn a_recording_without_its_channels_is_refused() {
    assert_refused(&["sim", "--capture", "some.vcd"], "--channel-a");
}

#[test]
fn a_port_that_does_not_exist_is_named() {
    assert_refused(&["flash", "--port", "/dev/no-such-port"], "/dev/no-such-port");
}
