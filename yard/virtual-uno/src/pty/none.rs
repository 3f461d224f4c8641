//! Pseudo terminals where the system has none that report who opens them: opening one is an error.

use crate::file_error::FileError;
use std::path::Path;

/// A pseudo terminal. This system has none, so the type has no value.
#[derive(Debug)]
pub enum Pty {}

impl Pty {
    /// Opens none.
    ///
    /// # Errors
    /// Always.
    pub fn open() -> Result<Pty, FileError> {
        let port = Path::new("the virtual Uno's serial port");
        Err(FileError::new(port, "needs Linux: this system has no such terminals"))
    }

    /// As on Linux.
    pub fn path(&self) -> &Path {
        match *self {}
    }

    /// As on Linux.
    pub fn link(&mut self, _: &Path) -> Result<(), FileError> {
        match *self {}
    }

    /// As on Linux.
    pub fn was_opened(&mut self) -> Result<bool, FileError> {
        match *self {}
    }

    /// As on Linux.
    pub fn read(&mut self, _: &mut [u8]) -> Result<usize, FileError> {
        match *self {}
    }

    /// As on Linux.
    pub fn write(&mut self, _: &[u8]) -> Result<usize, FileError> {
        match *self {}
    }
}
