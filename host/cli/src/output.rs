//! The one way in which all commands print: results on standard output, words beside them on standard error.
//!
//! Whoever closes a pipe early has read enough: what else is printed goes nowhere, and the command ends as if it had been read.
//! Whatever else keeps a result from being printed, such as a full disk, is the command's error. Words beside the result are
//! for whoever watches: where they cannot be told, nothing is lost. They quote files and machines, which may send anything: a terminal
//! gets no orders from there.

use anyhow::{Context, Result};
use files::in_a_line;
use std::env;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

/// Prints a line of a result; takes what `println!` does, and returns what [`print()`] does.
macro_rules! say {
    ($($words:tt)*) => { $crate::output::print(format_args!("{}\n", format_args!($($words)*))) };
}

/// Tells a line beside the result; takes what `eprintln!` does.
macro_rules! tell {
    ($($words:tt)*) => { $crate::output::tell_line(format_args!($($words)*)) };
}

pub(crate) use {say, tell};

/// Prints a part of the result as it is.
///
/// # Errors
/// Whatever standard output suffers from, but for a pipe that its reader has closed.
pub fn print(text: Arguments) -> Result<()> {
    let mut output = io::stdout().lock();
    match output.write_fmt(text).and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("the result cannot be printed"),
    }
}

/// Tells a line beside the result, by [`tell!`].
pub fn tell_line(line: Arguments) {
    // Nobody is left who could be told.
    let _ = writeln!(io::stderr(), "{}", in_a_line(&line.to_string()));
}

/// The command as it was typed, for a report that says how to make it again.
///
/// # Errors
/// Where a word cannot be quoted for a shell.
pub fn command_line() -> Result<String> {
    let words: Vec<String> = ["weeder".to_owned()].into_iter().chain(env::args().skip(1)).collect();
    Ok(shlex::try_join(words.iter().map(String::as_str))?)
}
