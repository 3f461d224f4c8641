//! Shared file handling of the host's crates: CSV tables that people made, and files that are written completely or not
//! at all.
//!
//! [`csv_table`] reads a table and names file, line and column where something is wrong. The reader of each table says what
//! the values mean. [`FileError`] is how any file that people write is refused. [`bounded_file`] reads a file up to a limit.
//! [`toml_entry`] names the key where a TOML file is wrong. [`whole_file`] writes a file whole or not at all. The crate knows
//! nothing of weeding.

pub mod bounded_file;
pub mod csv_table;
mod file_error;
pub mod toml_entry;
pub mod whole_file;

pub use csv_table::{CsvTable, Line};
pub use file_error::{FileError, in_a_line};

/// The known name that a misspelt one most likely means. A name may also lack its part before a point.
pub fn near<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    /// From 0 for nothing in common to 1 for the same.
    const LIKE: f64 = 0.85;
    let likeness = |known: &str| {
        let key = known.split_once('.').map_or(known, |(_, key)| key);
        strsim::jaro_winkler(name, known).max(strsim::jaro_winkler(name, key))
    };
    let known = known.into_iter().map(|known| (likeness(known), known)).filter(|(likeness, _)| *likeness >= LIKE);
    known.max_by(|(a, _), (b, _)| a.total_cmp(b)).map(|(_, known)| known)
}

#[cfg(test)]
mod tests {
    use super::near;

    #[test]
    fn a_misspelt_name_is_found_and_another_word_is_not() {
        let known = ["ground.slip_percent", "margin_mm", "lead_out_ms", "lead_in_ms", "walked", "paper"];
        for (name, meant) in [
            ("ground.slip", "ground.slip_percent"),
            ("slip_percent", "ground.slip_percent"),
            ("margin", "margin_mm"),
            ("lead_outms", "lead_out_ms"),
            ("walkd", "walked"),
        ] {
            assert_eq!(near(name, known), Some(meant), "{name}");
        }
        for name in ["", "no-such-field", "my-field.toml", "crop"] {
            assert_eq!(near(name, known), None, "{name}");
        }
    }
}
