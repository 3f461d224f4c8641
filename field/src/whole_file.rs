//! Files that are written whole or not at all: what goes wrong half-way leaves what was there before.
//!
//! The text goes to a temporary file in the same folder, which then takes the name. It does not make folders.

use std::io::{self, Write};
use std::path::Path;
use tempfile::Builder;

/// Writes a file, or replaces one.
///
/// # Errors
/// Those of the system, and of `contents`; the file is then as it was before.
pub fn write<E: From<io::Error>>(path: &Path, contents: impl FnOnce(&mut dyn Write) -> Result<(), E>) -> Result<(), E> {
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let mut builder = Builder::new();
    // A temporary file is its owner's alone, which a report is not: the system's mask decides, as for any file.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let mut file = builder.tempfile_in(folder)?;
    let mut buffered = io::BufWriter::new(file.as_file_mut());
    contents(&mut buffered)?;
    buffered.flush()?;
    drop(buffered);
    file.persist(path).map_err(|error| error.error)?;
    Ok(())
}
