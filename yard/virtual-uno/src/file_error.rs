//! The error of a file.

use std::fmt::Display;
use std::fs::File;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

/// The longest ELF or HEX file, in MiB. An ELF with debug information has some 2.
const MOST_MIB: u64 = 64;

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

    /// The content of a file up to a limit: a device without end is refused.
    pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, Self> {
        let mut bytes = Vec::new();
        let read = File::open(path).and_then(|file| file.take((MOST_MIB << 20) + 1).read_to_end(&mut bytes));
        match read.map_err(|source| Self::unread(path, source))? as u64 > MOST_MIB << 20 {
            true => Err(Self::new(path, format_args!("is longer than {MOST_MIB} MiB: no such file is read"))),
            false => Ok(bytes),
        }
    }

    pub(crate) fn failed(path: &Path, problem: impl Display, source: io::Error) -> Self {
        Self { source: Some(source), ..Self::new(path, problem) }
    }
}
