//! What a command says on standard output, also to a pipe that its reader has closed.

use anyhow::Result;
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
