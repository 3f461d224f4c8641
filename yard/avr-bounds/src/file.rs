//! Reads the files that a user names, up to a limit: a device without end is refused.

use crate::error::BoundsError;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The longest file, in MiB. An ELF with all debug information has a few.
const MOST_MIB: u64 = 64;

/// The deepest nesting of TOML. The parser would exhaust its stack at some hundreds, and budgets nest three deep.
const MOST_NESTED: usize = 40;

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

/// The text of a TOML file. Brackets and points in texts count too, because none of them needs so many.
pub(crate) fn toml(path: &Path) -> Result<String, BoundsError> {
    let error = |problem: &str| BoundsError(format!("{}{problem}", path.display()));
    let text = String::from_utf8(bytes(path)?).map_err(|_| error(" is no UTF-8: save the file as UTF-8"))?;
    let mut depth = 0_usize;
    for (number, line) in (1..).zip(text.lines()) {
        let mut deepest = line.matches('.').count();
        for letter in line.chars() {
            depth = match letter {
                '[' | '{' => depth + 1,
                ']' | '}' => depth.saturating_sub(1),
                _ => depth,
            };
            deepest = deepest.max(depth);
        }
        if deepest > MOST_NESTED {
            return Err(error(&format!(", line {number}: more than {MOST_NESTED} tables or lists in one another")));
        }
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn endless_files_and_deep_nesting_are_refused() {
        let refused = |path: &Path| toml(path).expect_err("it is refused").to_string();
        assert!(refused(Path::new("/dev/zero")).contains("longer than 64 MiB"));
        assert!(refused(Path::new("/")).contains("cannot be read"));
        let file = tempfile::NamedTempFile::new().expect("there is room for a file");
        for deep in ["[".repeat(10_000), "{ a = ".repeat(400), "a.".repeat(400)] {
            std::fs::write(file.path(), format!("\na = {deep}")).expect("it can be written");
            assert!(refused(file.path()).contains(", line 2: more than 40 tables"), "{deep:.20}");
        }
        let budgets = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../budgets.toml");
        assert!(!budgets.exists() || toml(&budgets).is_ok());
    }
}
