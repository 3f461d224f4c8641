//! Reads a machine from a TOML file. Errors name the line and the key, and say what would be right.
//!
//! Every key may be left out, and then has the value of the paper's machine. An unknown key is an error, because it is
//! most likely a misspelt key.

use crate::machine::{Input, Machine};
use std::fmt::Write;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use thiserror::Error;
use toml::de::{DeTable, DeValue};

/// Why a file makes no machine.
#[derive(Debug, Error)]
pub enum FileError {
    /// The file cannot be read.
    #[error("{} cannot be read", path.display())]
    Unreadable {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// An error in the file.
    #[error("{}{}: {message}", path.display(), .line.map(|line| format!(", line {line}")).unwrap_or_default())]
    Wrong {
        /// The file.
        path: PathBuf,
        /// The line, from 1. `None` if the wrong value is not in the file.
        line: Option<usize>,
        /// The problem, and what would be right.
        message: String,
    },
}

/// Reads a machine and checks it.
///
/// # Errors
/// If the file cannot be read, is no TOML, has unknown keys or units, or makes no machine that could be calculated.
pub fn read(path: &Path) -> Result<Machine, FileError> {
    let text = fs::read_to_string(path).map_err(|source| FileError::Unreadable { path: path.to_owned(), source })?;
    parse(&text).map_err(|Mistake { line, message }| FileError::Wrong { path: path.to_owned(), line, message })
}

/// The problem of a text, and its place.
#[derive(Debug, PartialEq, Eq)]
struct Mistake {
    line: Option<usize>,
    message: String,
}

fn parse(text: &str) -> Result<Machine, Mistake> {
    let machine: Machine = toml::from_str(text).map_err(|error| unreadable(text, &error))?;
    machine.check().map_err(|error| {
        let (section, key) = error.place();
        let entry =
            entries(text).into_iter().find(|entry| entry.section == section && entry.key.as_deref() == Some(key));
        Mistake { line: entry.map(|entry| line(text, entry.start)), message: error.to_string() }
    })?;
    Ok(machine)
}

/// Converts an error of the TOML reader, with the key of the error and that key's value on the paper's machine.
fn unreadable(text: &str, error: &toml::de::Error) -> Mistake {
    let Some(span) = error.span() else { return Mistake { line: None, message: error.message().to_owned() } };
    let mut message = String::new();
    // A section may span its entries, and others' too if its keys are scattered.
    let around = entries(text).into_iter().filter(|entry| (entry.start..entry.end).contains(&span.start));
    let entry = around.min_by_key(|entry| entry.end - entry.start);
    if let Some(entry) = entry {
        let dotted = entry.key.as_ref().map(|key| format!(".{key}")).unwrap_or_default();
        // Writing to a String cannot fail.
        let _ = write!(message, "{}{dotted}: {}", entry.section, error.message());
        if let Some(input) = entry.input() {
            let _ = write!(message, "; the paper's machine has {} = {}", input.key, input.written());
        }
    } else {
        message.push_str(error.message());
    }
    Mistake { line: Some(line(text, span.start)), message }
}

fn line(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|byte| *byte == b'\n').count() + 1
}

/// A section, or a key with its value, and its bytes in the text.
struct Entry {
    section: String,
    key: Option<String>,
    start: usize,
    end: usize,
}

impl Entry {
    /// The input with that name, if there is one.
    fn input(&self) -> Option<Input> {
        let inputs = Machine::default().inputs();
        inputs.into_iter().find(|input| self.section == input.section && self.key.as_deref() == Some(input.key))
    }
}

/// All entries of a text, each section before its keys. Empty if the text is no TOML.
fn entries(text: &str) -> Vec<Entry> {
    let mut entries = Vec::new();
    let Ok(document) = DeTable::parse(text) else { return entries };
    for (section, value) in document.get_ref() {
        let name = section.get_ref().to_string();
        let (start, end) = (section.span().start, value.span().end);
        entries.push(Entry { section: name.clone(), key: None, start, end });
        let DeValue::Table(table) = value.get_ref() else { continue };
        entries.extend(table.iter().map(|(key, value)| Entry {
            section: name.clone(),
            key: Some(key.get_ref().to_string()),
            start: key.span().start,
            end: value.span().end,
        }));
    }
    entries
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::MM;

    #[track_caller]
    fn assert_refused(text: &str, line: usize, words: &str) {
        let mistake = parse(text).unwrap_err();
        assert_eq!(mistake.line, Some(line), "{}", mistake.message);
        assert!(mistake.message.contains(words), "{}", mistake.message);
    }

    #[test]
    fn what_is_left_out_is_as_on_the_papers_machine() {
        assert_eq!(parse("").unwrap(), Machine::default());
        let mut larger = Machine::default();
        larger.wheel.diameter = MM.of(500.0);
        assert_eq!(parse("[wheel]\ndiameter = \"500 mm\"").unwrap(), larger);
    }

    #[test]
    fn the_printed_machine_is_read_back_as_it_was() {
        let machine = Machine::default();
        let read = parse(&machine.to_toml()).unwrap();
        for (read, printed) in read.inputs().into_iter().zip(machine.inputs()) {
            assert_eq!(read.written(), printed.written(), "{}.{}", read.section, read.key);
        }
    }

    #[test]
    fn an_unknown_key_is_refused_with_the_known_ones() {
        assert_refused("[wheel]\nwidth = \"35 mm\"\ndiametre = \"400 mm\"", 3, "wheel.diametre: unknown field");
        assert_refused("[wheel]\ndiametre = \"400 mm\"", 2, "`diameter`");
        assert_refused("\n[whel]\n", 2, "whel: unknown field `whel`, expected one of `weeder`");
    }

    #[test]
    fn a_wrong_unit_is_refused_with_the_right_ones() {
        let right = "wheel.diameter: \"0.4 kg\" is not a length: write a number and mm, cm or m, in quotes; \
                     the paper's machine has diameter = \"400 mm\"";
        assert_refused("[wheel]\ndiameter = \"0.4 kg\"", 2, right);
        assert_refused("wheel.diameter = \"0.4 kg\"", 1, right);
        assert_refused("wheel = { width = \"35 mm\", diameter = \"0.4 kg\" }", 1, right);
    }

    #[test]
    fn a_mistake_between_the_keys_of_another_section_is_found() {
        let scattered = "wheel.width = \"35 mm\"\nsoil.depth = \"2 kg\"\nwheel.diameter = \"400 mm\"";
        assert_refused(scattered, 2, "soil.depth: \"2 kg\" is not a length");
    }

    #[test]
    fn a_number_without_its_unit_is_refused() {
        assert_refused("[wheel]\ndiameter = 400", 2, "wheel.diameter: 400 is not a length: write a number and mm");
        assert_refused("[engine]\nsafety_factor = \"2 N\"", 2, "write one without quotes and unit");
        assert_refused("[chain]\ndrive_teeth = 14.5", 2, "14.5 is not a whole number");
        assert_refused("[inter_row]\ntools = -1", 2, "-1 is not a whole number from 0");
    }

    #[test]
    fn a_negative_length_is_refused_with_the_range() {
        let text = "# mine\n[wheel]\nwidth = \"35 mm\"\ndiameter = \"-400 mm\"";
        assert_refused(text, 4, "wheel.diameter is -400 mm: it has to be from 50 to 3000 mm");
    }

    #[test]
    fn a_friction_angle_of_90_degrees_is_refused_with_the_range() {
        assert_refused("[crop]\nweed_friction = \"90 degrees\"", 2, "it has to be from 5 to 85 degrees");
        assert_refused("[soil]\ninternal_friction = \"90°\"", 2, "it has to be from 0 to 60 degrees");
    }

    #[test]
    fn values_that_do_not_go_together_are_refused() {
        assert_refused("[crop]\nrow_spacing = \"100 mm\"", 2, "leaves no room for a sweep");
        let thick = "[wheel]\ndiameter = \"80 mm\"\nrim_thickness = \"40 mm\"";
        assert_refused(thick, 3, "it has to be less than half of wheel.diameter, 80 mm");
        assert_eq!(parse("[crop]\nprotection_zone = \"140 mm\"").unwrap_err().line, None);
    }

    #[test]
    fn what_is_no_toml_is_refused_with_its_line() {
        assert_refused("[wheel]\ndiameter = 400 mm", 2, "");
        assert_refused("wheel = 5", 1, "expected a section");
    }
}
