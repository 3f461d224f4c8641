//! Runs `weeder` in a folder as a user does, and returns its output.

use std::path::Path;
use std::process::{Command, Output};

/// A small field, so that a trial takes a moment.
pub const SMALL: &str = "[plot]\nrows = 1\nrow_m = 6\n";

/// Runs `weeder` with these arguments in a folder.
pub fn weeder(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
    command.current_dir(folder).args(arguments).output().expect("cargo has built the command")
}

/// The output of a command that must succeed.
#[track_caller]
pub fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = weeder(folder, arguments);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("it prints text")
}

/// Asserts status 2, a message that contains `words`, and no result.
#[track_caller]
pub fn assert_refused(folder: &Path, arguments: &[&str], words: &str) {
    let output = weeder(folder, arguments);
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert!(message.contains(words), "{words:?} is not in\n{message}");
    assert!(output.stdout.is_empty(), "nothing is done by half");
}
