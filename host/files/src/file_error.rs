//! The error for a file that people wrote: the file, or a line of it, and what would be right.
//!
//! The caller describes the problem. This module adds the place, and keeps the message in one line, because quoted text
//! may contain any characters.

use crate::toml_entry::find;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file cannot be used.
#[derive(Debug, Error)]
pub enum FileError {
    /// The file itself.
    #[error("{path} {problem}")]
    File {
        /// The file.
        path: PathBuf,
        /// The problem, after the name.
        problem: String,
        /// The system's error.
        source: io::Error,
    },
    /// A line of it.
    #[error("{path}{}: {}", at(*line), in_a_line(problem))]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1; 0 if it is about none of them.
        line: u64,
        /// The problem, and what would be right.
        problem: String,
    },
}

impl FileError {
    /// The system does not let it be used; `problem` follows its name.
    pub fn unusable(path: &Path, problem: impl Into<String>, source: io::Error) -> Self {
        Self::File { path: path.into(), problem: problem.into(), source }
    }

    /// The system cannot read it.
    pub fn unread(path: &Path, source: io::Error) -> Self {
        Self::unusable(path, "cannot be read", source)
    }

    /// Whether there is no such file.
    pub fn is_absence(&self) -> bool {
        matches!(self, Self::File { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }

    /// The system cannot write it.
    pub fn unwritten(path: &Path, source: io::Error) -> Self {
        Self::unusable(path, "cannot be written", source)
    }

    /// An error in the line with this byte of the file's text.
    pub fn at_byte(path: &Path, text: &str, byte: usize, problem: impl Into<String>) -> Self {
        let ends = text.bytes().take(byte).filter(|&byte| byte == b'\n').count();
        Self::Line { path: path.into(), line: 1 + ends as u64, problem: problem.into() }
    }

    /// Something is wrong with the key `table.key` of a TOML file, which may have left it out.
    pub fn at_key(path: &Path, text: &str, name: &str, problem: impl Into<String>) -> Self {
        match find(text, name) {
            Some(entry) => Self::at_byte(path, text, entry.span.start, problem),
            None => Self::Line { path: path.into(), line: 0, problem: problem.into() },
        }
    }
}

fn at(line: u64) -> String {
    if line == 0 { String::new() } else { format!(", line {line}") }
}

/// Quotes the text of a file or a machine for a message. Control characters and line ends are escaped, so that it stays
/// in its line and cannot control a terminal.
pub fn in_a_line(text: &str) -> String {
    let shown = |character: char| match character {
        control if control.is_control() => control.escape_default().to_string(),
        other => other.to_string(),
    };
    text.chars().map(shown).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quoted_text_stays_in_its_line_and_cannot_control_a_terminal() {
        let quoted = in_a_line("`left\nright\u{1b}[2J` is no name, `grün` is one");
        assert_eq!(quoted, r"`left\nright\u{1b}[2J` is no name, `grün` is one");
    }

    #[test]
    fn a_byte_stands_in_the_line_that_its_own_end_closes() {
        let text = "k = 3\n\nmargin_mm = far\n";
        for (byte, line) in [(0, 1), (5, 1), (6, 2), (7, 3), (text.len(), 4)] {
            let error = FileError::at_byte(Path::new("machine.toml"), text, byte, "it has to be a number").to_string();
            assert_eq!(error, format!("machine.toml, line {line}: it has to be a number"));
        }
    }
}
