//! The page's three files, read from their folder or included in a release.

use axum::body::Bytes;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The page: its content, style and script.
pub struct Page(pub(super) [Bytes; 3]);

/// The files in this program, if it is a release.
const INSIDE: Option<[&[u8]; 3]> = include!(concat!(env!("OUT_DIR"), "/inside.rs"));

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

    /// The included page. Only a release has one.
    pub fn inside() -> Option<Self> {
        INSIDE.map(|files| Self(files.map(Bytes::from_static)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_inside_where_the_build_was_given_one() {
        let inside = Page::inside();
        assert_eq!(inside.is_some(), option_env!("WEEDER_PAGE").is_some());
        assert!(inside.is_none_or(|page| page.0[0].starts_with(b"<!doctype html>")));
    }
}
