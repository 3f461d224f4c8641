//! The page's three files, as they lie in their folder, and the form for the code, which is a part of this program.

use axum::body::Bytes;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// A file as it is given away.
pub struct File {
    /// Its media type.
    pub media: &'static str,
    /// What is in it, which all who ask for it share.
    pub content: Bytes,
}

/// The page.
pub struct Page {
    /// What is shown.
    pub html: File,
    /// How it looks.
    pub css: File,
    /// What it does.
    pub js: File,
}

/// Why there is no page.
#[derive(Debug, Error)]
#[error(
    "{} of the page cannot be read: name a release's folder `page` by --page, or make it in a clone of the repository by \
     `npm --prefix page ci` and `npm --prefix page run build`",
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
    /// Where one of them is not there.
    pub fn read(folder: &Path) -> Result<Self, NoPage> {
        let read = |name: &str, media| {
            let path = folder.join(name);
            match fs::read(&path) {
                Ok(content) => Ok(File { media, content: content.into() }),
                Err(source) => Err(NoPage { path, source }),
            }
        };
        Ok(Self {
            html: read("index.html", "text/html; charset=utf-8")?,
            css: read("page.css", "text/css; charset=utf-8")?,
            js: read("page.js", "text/javascript; charset=utf-8")?,
        })
    }
}

/// The form for the code.
pub mod form {
    /// What is shown.
    pub const HTML: &str = include_str!("pair/pair.html");
    /// How it looks.
    pub const CSS: &str = include_str!("pair/pair.css");
    /// What it does.
    pub const JS: &str = include_str!("pair/pair.js");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_without_a_page_is_said_with_the_way_to_one() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let error = Page::read(folder).err().expect("there is no page there").to_string();
        assert!(error.contains("index.html of the page cannot be read"), "{error}");
        assert!(error.contains("`npm --prefix page run build`"), "{error}");
    }
}
