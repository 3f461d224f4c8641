//! Reads the files that a user names, up to a limit: a device without end is refused.

use crate::error::BoundsError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The longest file, in MiB. An ELF with all debug information has a few.
const MOST_MIB: u64 = 64;

pub(crate) fn bytes(path: &Path) -> Result<Vec<u8>, BoundsError> {
    let unread = |reason: io::Error| BoundsError(format!("{} cannot be read: {reason}", path.display()));
    let mut bytes = Vec::new();
    let mut file = File::open(path).map_err(unread)?.take((MOST_MIB << 20) + 1);
    file.read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > MOST_MIB << 20 {
        return Err(BoundsError(format!("{} is longer than {MOST_MIB} MiB: no such file is read", path.display())));
    }
    Ok(bytes)
}

pub(crate) fn text(path: &Path) -> Result<String, BoundsError> {
    String::from_utf8(bytes(path)?)
        .map_err(|_| BoundsError(format!("{} is no UTF-8: save the file as UTF-8", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_without_end_or_that_is_no_text_is_refused() {
        let refused = |path: &Path| text(path).expect_err("it is refused").to_string();
        assert!(refused(Path::new("/dev/zero")).contains("longer than 64 MiB"));
        assert!(refused(Path::new("/")).contains("cannot be read"));
        let file = tempfile::NamedTempFile::new().expect("there is room for a file");
        std::fs::write(file.path(), b"\xE4").expect("it can be written");
        assert!(refused(file.path()).contains("is no UTF-8"));
    }
}
