//! What a command says on standard output, also to a pipe that its reader has closed, and how it was called.

use anyhow::Result;
use std::env;
use std::io::{self, ErrorKind, Write};

/// Prints a text as it is. Whoever closes a pipe early has read enough.
///
/// # Errors
/// Whatever else standard output suffers from.
pub fn print(text: &str) -> Result<()> {
    match io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(()),
    }
}

/// The command as it was typed, for a report that says how to make it again.
///
/// # Errors
/// Where a word cannot be quoted for a shell.
pub fn command_line() -> Result<String> {
    let words: Vec<String> = ["weeder".to_owned()].into_iter().chain(env::args().skip(1)).collect();
    Ok(shlex::try_join(words.iter().map(String::as_str))?)
}
