//! Reads a file up to a limit: a device or a recording without end is refused. [`check_nesting`] refuses TOML that would
//! exhaust the parser's stack.

use crate::FileError;
use std::fs::File;
use std::io::{ErrorKind, Read};
use std::path::Path;
use toml_parser::Source;
use toml_parser::lexer::TokenKind;

/// The longest file that people write, in MiB. Most have some KiB.
const WRITTEN_MIB: u64 = 16;

/// The longest record, in MiB. A machine and its receiver send 60 to 230 in a day. Reading takes five times the memory.
pub const RECORDED_MIB: u64 = 512;

/// The deepest nesting of tables, lists and dotted keys in TOML. No file of the tools nests more than three.
const MOST_NESTED: usize = 40;

/// Reads a file of UTF-8, without its byte order mark.
///
/// # Errors
/// If it cannot be read, is a folder, is too long, or is no UTF-8: with the line.
pub fn text(path: &Path) -> Result<String, FileError> {
    let bytes = bytes(path)?;
    if bytes.starts_with(&[0xFF, 0xFE]) || bytes.starts_with(&[0xFE, 0xFF]) {
        let problem = "saved as UTF-16: save it as UTF-8, in PowerShell by `| Out-File -Encoding utf8 FILE`".to_owned();
        return Err(FileError::Line { path: path.into(), line: 0, problem });
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let valid = String::from_utf8_lossy(&error.as_bytes()[..error.utf8_error().valid_up_to()]).into_owned();
        FileError::at_byte(path, &valid, valid.len(), "this is no UTF-8: save the file as UTF-8")
    })?;
    Ok(text.strip_prefix('\u{feff}').map_or_else(|| text.clone(), str::to_owned))
}

/// The content of a file that people wrote.
///
/// # Errors
/// If it cannot be read, is a folder, or is too long.
pub fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    up_to(path, WRITTEN_MIB)
}

/// The content of a record that a program wrote, which may be much longer.
///
/// # Errors
/// As [`bytes`].
pub fn recorded(path: &Path) -> Result<Vec<u8>, FileError> {
    up_to(path, RECORDED_MIB)
}

fn up_to(path: &Path, most_mib: u64) -> Result<Vec<u8>, FileError> {
    let unread = |source| FileError::unread(path, source);
    let file = File::open(path).map_err(unread)?;
    if file.metadata().is_ok_and(|there| there.is_dir()) {
        return Err(FileError::unusable(path, "is a folder, and a file is needed", ErrorKind::IsADirectory.into()));
    }
    let mut bytes = Vec::new();
    file.take((most_mib << 20) + 1).read_to_end(&mut bytes).map_err(unread)?;
    if bytes.len() as u64 > most_mib << 20 {
        let problem = format!("longer than {most_mib} MiB: no such file is read");
        return Err(FileError::Line { path: path.into(), line: 0, problem });
    }
    Ok(bytes)
}

/// Checks the nesting of TOML before it is parsed.
///
/// # Errors
/// Names the line in which it is too deep.
pub fn check_nesting(path: &Path, text: &str) -> Result<(), FileError> {
    let (mut depth, mut dots) = (0_usize, 0_usize);
    for token in Source::new(text).lex() {
        match token.kind() {
            TokenKind::LeftSquareBracket | TokenKind::LeftCurlyBracket => (depth, dots) = (depth + 1, 0),
            TokenKind::RightSquareBracket | TokenKind::RightCurlyBracket => {
                (depth, dots) = (depth.saturating_sub(1), 0)
            }
            TokenKind::Equals | TokenKind::Comma | TokenKind::Newline => dots = 0,
            TokenKind::Dot => dots += 1,
            _ => {}
        }
        if depth + dots > MOST_NESTED {
            let problem = format!("more than {MOST_NESTED} tables or lists lie within each other");
            return Err(FileError::at_byte(path, text, token.span().start(), problem));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn deep_nesting_is_refused_and_brackets_in_texts_do_not_count() {
        let check = |text: &str| check_nesting(Path::new("my.toml"), text).map_err(|error| error.to_string());
        let deep = [
            "a = ".to_owned() + &"{ a = ".repeat(400),
            "a = ".to_owned() + &"[".repeat(100_000),
            "a".to_owned() + &".a".repeat(400) + " = 1",
            "[".to_owned() + &"a.".repeat(400) + "a]",
            "\"\\\"\" = \"\"\nb = ".to_owned() + &"[".repeat(41),
        ];
        for text in deep {
            assert!(check(&text).unwrap_err().contains("more than 40 tables or lists"), "{text:.40}");
        }
        assert!(
            check(&format!("k = 1\n# {0}\na = \"{0}\"\nb = '{0}'\nc = \"\"\"{0}\n\"{0}\"\"\"\n", "[".repeat(99)))
                .is_ok()
        );
        assert!(check("a = 1.5\n".repeat(99).as_str()).is_ok());
    }

    #[test]
    fn a_file_that_is_no_text_is_refused_by_what_it_is() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |bytes: &[u8]| {
            let path = folder.path().join("my.toml");
            std::fs::write(&path, bytes).unwrap();
            text(&path).unwrap_err().to_string()
        };
        assert!(text(folder.path()).unwrap_err().to_string().contains("is a folder"));
        assert!(refused(b"\xFF\xFEk\0").contains("saved as UTF-16: save it as UTF-8, in PowerShell by"));
        assert!(refused(b"k = 3\nm = \"\xE4\"").contains("line 2: this is no UTF-8"));
        assert!(refused(&vec![b' '; (16 << 20) + 1]).contains("longer than 16 MiB"));
        std::fs::write(folder.path().join("bom"), "\u{feff}k = 3").unwrap();
        assert_eq!(text(&folder.path().join("bom")).unwrap(), "k = 3");
        #[cfg(unix)]
        assert!(text(Path::new("/dev/zero")).unwrap_err().to_string().contains("longer than 16 MiB"));
    }
}
