//! Where a command reads a file: `-` is standard input, as everywhere.

use std::path::PathBuf;

/// Standard input as a file, where the system has one.
#[cfg(unix)]
const STANDARD_INPUT: &str = "/dev/stdin";

/// The file of this name, for the command line.
///
/// # Errors
/// Never, or where the system has no file for standard input.
pub fn file(name: &str) -> Result<PathBuf, String> {
    named(name).map(PathBuf::from)
}

/// What a word names that is a file, or else has a meaning of its own, such as a preset.
///
/// # Errors
/// As [`file()`].
pub fn named(name: &str) -> Result<String, String> {
    match name {
        #[cfg(unix)]
        "-" => Ok(STANDARD_INPUT.to_owned()),
        #[cfg(not(unix))]
        "-" => Err("standard input cannot be read here: name a file".to_owned()),
        _ => Ok(name.to_owned()),
    }
}
