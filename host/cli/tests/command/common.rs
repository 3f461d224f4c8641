//! Runs `weeder` as a user does, and returns its output.

use std::io::{BufRead, BufReader, Write};
#[cfg(target_os = "linux")]
use std::io::{PipeReader, PipeWriter};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use tempfile::TempDir;

/// A small field, so that a trial takes a moment.
pub const SMALL: &str = "[plot]\nrows = 1\nrow_m = 6\n";

pub fn folder_with(name: &str, text: &str) -> TempDir {
    let folder = TempDir::new().expect("there is room for a folder");
    std::fs::write(folder.path().join(name), text).expect("there is room for a file");
    folder
}

pub fn command(arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_weeder"));
    command.args(arguments);
    command
}

pub fn weeder(folder: &Path, arguments: &[&str]) -> Output {
    command(arguments).current_dir(folder).output().expect("cargo has built the command")
}

/// The result of a command that must succeed.
#[track_caller]
pub fn said(folder: &Path, arguments: &[&str]) -> String {
    let output = weeder(folder, arguments);
    assert!(output.status.success(), "{}", told(&output));
    String::from_utf8(output.stdout).expect("it prints text")
}

/// The messages beside a result.
pub fn told(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Asserts status 2, and a message that contains `words`.
#[track_caller]
pub fn assert_fails(output: &Output, words: &str) {
    let message = told(output);
    assert_eq!(output.status.code(), Some(2), "{message}");
    assert_has(&message, [words]);
}

/// Asserts status 2, a message that contains `words`, and no result.
#[track_caller]
pub fn assert_refused(folder: &Path, arguments: &[&str], words: &str) {
    let output = weeder(folder, arguments);
    assert_fails(&output, words);
    assert!(output.stdout.is_empty(), "nothing is done by half");
}

#[track_caller]
pub fn assert_has<'a>(text: &str, parts: impl IntoIterator<Item = &'a str>) {
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in\n{text}");
    }
}

pub fn typed(weeder: &mut Command, input: impl AsRef<[u8]>) -> Output {
    let weeder = weeder.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut weeder = weeder.spawn().expect("cargo has built the command");
    // A command that fails at once reads no input.
    let _ = weeder.stdin.take().expect("it is piped").write_all(input.as_ref());
    weeder.wait_with_output().expect("it ends")
}

/// A pipe that no program reads, as full as a stopped terminal: its two ends.
#[cfg(target_os = "linux")]
pub fn full_pipe() -> (PipeReader, PipeWriter) {
    let (unread, full) = std::io::pipe().expect("there are pipes");
    let fill = ["if=/dev/zero", "of=/dev/stdout", "bs=4096", "oflag=nonblock"];
    let filled =
        Command::new("dd").args(fill).env("LC_ALL", "C").stdout(full.try_clone().expect("it is open")).output();
    let said = String::from_utf8_lossy(&filled.expect("there is dd").stderr).into_owned();
    assert!(said.contains("temporarily unavailable"), "it is not full: {said}");
    (unread, full)
}

/// All output, if it ended with this status.
#[track_caller]
pub fn printed(output: &Output, status: i32) -> String {
    let out = String::from_utf8_lossy(&output.stdout).into_owned() + &told(output);
    assert_eq!(output.status.code(), Some(status), "{out}");
    out
}

/// A process that is ended with its test.
pub struct Running(pub Child);

impl Running {
    pub fn start(command: &mut Command) -> Self {
        Self(command.spawn().expect("cargo has built the command"))
    }

    /// Starts it, and waits for its first line: the port of a virtual Uno, for example.
    #[track_caller]
    pub fn with_first_line(command: &mut Command) -> (Self, String) {
        let mut process = Self::start(command.stdout(Stdio::piped()));
        let (stdout, mut line) = (process.0.stdout.take().expect("it is piped"), String::new());
        BufReader::new(stdout).read_line(&mut line).expect("it prints text");
        assert!(!line.is_empty(), "it has ended");
        (process, line)
    }

    /// Sends a signal, such as `-STOP`.
    pub fn signal(&self, name: &str) {
        let status = Command::new("kill").args([name, &self.0.id().to_string()]).status();
        assert!(status.expect("there is a kill").success());
    }

    /// Ends it by Ctrl-C. It must succeed.
    #[track_caller]
    pub fn interrupt(mut self) {
        self.signal("-INT");
        assert!(self.0.wait().expect("it ends").success());
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}
