//! The frame of the programs `weeder` and `weeder-sim`: they parse their words, run a command, and exit with a status.

use crate::numbers::with_negative_numbers;
use crate::{Messages, destination};
use anyhow::Result;
use clap::builder::StyledStr;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Command, Parser};
use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

/// A command's finding, for scripts that check its exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No plant was damaged, nothing differs.
    Good,
    /// A plant was damaged, something differs, or a bound is over its budget.
    Bad,
}

impl From<()> for Finding {
    fn from((): ()) -> Self {
        Self::Good
    }
}

impl Finding {
    /// Good if this is true.
    pub fn of(is_good: bool) -> Self {
        if is_good { Self::Good } else { Self::Bad }
    }
}

/// Parses the program's words and runs their command. Returns the exit status: 0 if all is good, 1 if not, and 2 for an
/// error, which is printed.
pub fn main<A: Parser>(run: impl FnOnce(A) -> Result<Finding>) -> ExitCode {
    match run(parse(env::args_os().collect()).unwrap_or_else(|error| error.exit())) {
        Ok(Finding::Good) => ExitCode::SUCCESS,
        Ok(Finding::Bad) => ExitCode::from(1),
        Err(error) => {
            writeln!(Messages, "error: {error:#}");
            ExitCode::from(2)
        }
    }
}

/// The grammar of all commands.
pub fn grammar<A: Parser>() -> Command {
    with_negative_numbers(A::command())
}

/// Parses a command line.
///
/// # Errors
/// As clap. For an unknown command, the error lists the known ones. An output has to be a file of its own.
pub fn parse<A: Parser>(words: Vec<OsString>) -> Result<A, clap::Error> {
    let found = grammar::<A>().try_get_matches_from(&words).and_then(|found| {
        destination::check(&found)
            .map_err(|problem| clap::Error::raw(ErrorKind::ValueValidation, format!("{problem}\n")))?;
        A::from_arg_matches(&found)
    });
    found.map_err(|mut error| {
        if error.kind() == ErrorKind::InvalidSubcommand {
            let mut command = grammar::<A>();
            let mut words = words.iter().skip(1);
            while let Some(inner) = words.next().and_then(|word| command.find_subcommand(word)) {
                command = inner.clone();
            }
            let known: Vec<&str> = command.get_subcommands().map(Command::get_name).collect();
            let tip = StyledStr::from(format!("the commands are {}", known.join(", ")));
            error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
        }
        error
    })
}
