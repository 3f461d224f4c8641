//! Runs `weeder` with a terminal's input, and returns its whole output.

use std::io::Write;
use std::process::{Command, Output, Stdio};

/// Runs it with this input to its end.
pub fn typed(weeder: &mut Command, input: impl AsRef<[u8]>) -> Output {
    let weeder = weeder.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut weeder = weeder.spawn().expect("cargo has built the command");
    // A command that fails at once reads no input.
    let _ = weeder.stdin.take().expect("it is piped").write_all(input.as_ref());
    weeder.wait_with_output().expect("it ends")
}

/// Its output, if it ended with this status.
#[track_caller]
pub fn printed(output: &Output, status: i32) -> String {
    let [out, error] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert_eq!(output.status.code(), Some(status), "{out}{error}");
    out + &error
}
