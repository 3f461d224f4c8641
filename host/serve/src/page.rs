//! The page's three files.

use axum::body::Bytes;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The page: its content, style and script.
pub struct Page(pub(super) [Bytes; 3]);

/// Why there is no page.
#[derive(Debug, Error)]
#[error(
    "{} of the page cannot be read: name a release's folder `page` by --page, or make it in a clone of the repository by \
     `./setup.sh page`",
    path.display()
)]
pub struct NoPage {
    path: PathBuf,
    source: io::Error,
}

impl Page {
    /// Reads the page's files.
    ///
    /// # Errors
    /// If one of them is not there.
    pub fn read(folder: &Path) -> Result<Self, NoPage> {
        let read = |name: &str| {
            let path = folder.join(name);
            fs::read(&path).map(Bytes::from).map_err(|source| NoPage { path, source })
        };
        Ok(Self([read("index.html")?, read("page.css")?, read("page.js")?]))
    }

    /// The page of these files: its content, style and script.
    pub fn of(files: [&'static [u8]; 3]) -> Self {
        Self(files.map(Bytes::from_static))
    }
}
