//! A command's finding, which becomes its exit status.

use crate::output::tell;
use anyhow::Result;
use std::process::ExitCode;

/// A command's finding, for scripts that check its exit status.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Finding {
    /// No plant was damaged, nothing differs.
    Good,
    /// A plant was damaged, something differs, or a bound is over its budget.
    Bad,
}

/// The exit status of a command: 0 if all is good, 1 if not, and 2 for an error, which is printed.
pub fn exit(found: Result<Finding>) -> ExitCode {
    match found {
        Ok(Finding::Good) => ExitCode::SUCCESS,
        Ok(Finding::Bad) => ExitCode::from(1),
        Err(error) => {
            tell!("error: {error:#}");
            ExitCode::from(2)
        }
    }
}
