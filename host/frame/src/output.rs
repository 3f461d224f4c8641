//! Printing of all commands: results go to standard output, other messages to standard error.
//!
//! A reader that closes a pipe early has read enough. The command then drops the rest of its output and ends with its
//! usual status. Any other failure to print a result, such as a full disk, is the command's error. Messages beside the
//! result are for an operator who watches, so a failure to print them is ignored. Messages quote files and machines,
//! which may contain control characters. These are removed before they reach a terminal.

use anyhow::{Context, Result};
use files::in_a_line;
use std::env;
use std::fmt::Arguments;
use std::io::{self, ErrorKind, Write};

/// Prints a line of a result. Takes the arguments of `println!`, and returns the result of [`print()`](crate::print()).
#[macro_export]
macro_rules! say {
    ($($words:tt)*) => { $crate::print(format_args!("{}\n", format_args!($($words)*))) };
}

/// Prints a message. Takes the arguments of `eprintln!`.
#[macro_export]
macro_rules! tell {
    ($($words:tt)*) => { $crate::tell_line(format_args!($($words)*)) };
}

/// Prints a part of the result, unchanged.
///
/// # Errors
/// Any error of standard output, except a pipe that its reader has closed.
pub fn print(text: Arguments) -> Result<()> {
    print_to(&mut io::stdout().lock(), text)
}

/// As [`print()`], to this output.
///
/// # Errors
/// As [`print()`].
pub fn print_to(output: &mut impl Write, text: Arguments) -> Result<()> {
    match output.write_fmt(text).and_then(|()| output.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("the result cannot be printed"),
    }
}

/// Prints a message, for [`tell!`].
pub fn tell_line(line: Arguments) {
    // Standard error is closed: there is no other place for the message.
    let _ = writeln!(io::stderr(), "{}", in_a_line(&line.to_string()));
}

/// The command as it was typed, for a report that says how to make it again. Fails if a word cannot be quoted for a
/// shell.
pub fn command_line() -> Result<String> {
    let words: Vec<_> = env::args_os().skip(1).collect();
    let words = words.iter().map(|word| word.to_string_lossy());
    let words: Vec<_> = ["weeder".into()].into_iter().chain(words).collect();
    Ok(shlex::try_join(words.iter().map(AsRef::as_ref))?)
}
