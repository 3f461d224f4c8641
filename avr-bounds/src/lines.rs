//! Maps addresses to lines of source, by the ELF's debug information.

use addr2line::Loader;
use std::cell::OnceCell;
use std::fmt;
use std::path::{Path, PathBuf};

/// The lines of an ELF, which are read when the first is asked for.
pub(crate) struct Lines {
    path: PathBuf,
    loader: OnceCell<Option<Loader>>,
}

impl Lines {
    pub(crate) fn of(path: &Path) -> Lines {
        Lines { path: path.into(), loader: OnceCell::new() }
    }

    /// File and line of an address.
    pub(crate) fn at(&self, address: u32) -> Option<String> {
        let loader = self.loader.get_or_init(|| Loader::new(&self.path).ok()).as_ref()?;
        let location = loader.find_location(address.into()).ok()??;
        let file = Path::new(location.file?).file_name()?.to_string_lossy().into_owned();
        Some(format!("{file}:{}", location.line?))
    }
}

impl fmt::Debug for Lines {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "lines of {}", self.path.display())
    }
}
