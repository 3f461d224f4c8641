//! The error of a file.

use std::fmt::Display;
use std::io;
use std::path::{Path, PathBuf};

/// A file that cannot be used, and why.
#[derive(Debug, thiserror::Error)]
#[error("{} {problem}", path.display())]
pub struct FileError {
    path: PathBuf,
    problem: String,
    source: Option<io::Error>,
}

impl FileError {
    pub(crate) fn new(path: &Path, problem: impl Display) -> Self {
        Self { path: path.into(), problem: problem.to_string(), source: None }
    }

    pub(crate) fn unread(path: &Path, source: io::Error) -> Self {
        Self::failed(path, "cannot be read", source)
    }

    pub(crate) fn failed(path: &Path, problem: impl Display, source: io::Error) -> Self {
        Self { source: Some(source), ..Self::new(path, problem) }
    }
}
