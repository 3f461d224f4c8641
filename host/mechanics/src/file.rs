//! Reads a machine from a TOML file. Errors name the line and the key, and say what would be right.
//!
//! Every key may be left out, and then has the value of the paper's machine. An unknown key is an error, because it is
//! most likely a misspelt key.

use crate::machine::{Input, Machine};
use files::{FileError, bounded_file, toml_entry};
use std::path::Path;

/// Reads a machine and checks it.
///
/// # Errors
/// If the file cannot be read, is no TOML, has unknown keys or units, or makes no calculable machine.
pub fn read(path: &Path) -> Result<Machine, FileError> {
    parse(path, &bounded_file::text(path)?)
}

/// Parses the text of such a file and checks the machine. `path` is named in errors.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, text: &str) -> Result<Machine, FileError> {
    bounded_file::check_nesting(path, text)?;
    let machine: Machine = toml::from_str(text).map_err(|error| {
        let byte = error.span().map_or(0, |span| span.start);
        FileError::at_byte(path, text, byte, explain(text, byte, error.message()))
    })?;
    machine.check().map_err(|error| {
        let (section, key) = error.place;
        FileError::at_key(path, text, &format!("{section}.{key}"), error.problem)
    })?;
    Ok(machine)
}

/// The TOML reader's error at a byte, with the key there and the paper's value.
fn explain(text: &str, byte: usize, message: &str) -> String {
    let message = message.trim().replace('\n', ", ");
    let Some(entry) = toml_entry::around(text, byte) else { return message };
    let is_here = |input: &Input| entry.name == format!("{}.{}", input.section, input.key);
    let right = Machine::default().inputs().into_iter().find(is_here);
    let right = right.map(|input| format!("; the paper's machine has {} = {}", input.key, input.written()));
    format!("{}: {message}{}", entry.name, right.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::unit::MM;

    #[test]
    fn omitted_values_are_the_papers() {
        let parse = |text| parse(Path::new("my.toml"), text).unwrap();
        assert_eq!(parse(""), Machine::default());
        let mut larger = Machine::default();
        larger.wheel.diameter = MM.of(500.0);
        assert_eq!(parse("[wheel]\ndiameter = \"500 mm\""), larger);
    }

    #[test]
    fn a_wrong_file_is_refused_with_its_line_its_key_and_what_would_be_right() {
        let right = "wheel.diameter: \"0.4 kg\" is not a length: write a number and mm, cm or m, in quotes; \
                     the paper's machine has diameter = \"400 mm\"";
        let scattered = "wheel.width = \"35 mm\"\nsoil.depth = \"2 kg\"\nwheel.diameter = \"400 mm\"";
        let thick = "[wheel]\ndiameter = \"80 mm\"\nrim_thickness = \"40 mm\"";
        for (text, line, words) in [
            ("[wheel]\nwidth = \"35 mm\"\ndiametre = \"400 mm\"", 3, "wheel.diametre: unknown field"),
            ("\n[whel]\n", 2, "whel: unknown field `whel`, expected one of `weeder`"),
            ("[wheel]\ndiameter = \"0.4 kg\"", 2, right),
            ("wheel.diameter = \"0.4 kg\"", 1, right),
            ("wheel = { width = \"35 mm\", diameter = \"0.4 kg\" }", 1, right),
            // Between the keys of another section.
            (scattered, 2, "soil.depth: \"2 kg\" is not a length"),
            ("[wheel]\ndiameter = 400", 2, "wheel.diameter: 400 is not a length: write a number and mm"),
            ("[engine]\nsafety_factor = \"2 N\"", 2, "write one without quotes and unit"),
            ("[chain]\ndrive_teeth = 14.5", 2, "14.5 is not a whole number"),
            ("[inter_row]\ntools = -1", 2, "-1 is not a whole number from 0"),
            // Values that do not go together.
            ("[crop]\nrow_spacing = \"100 mm\"", 2, "leaves no room for a sweep"),
            (thick, 3, "it has to be less than half of wheel.diameter, 80 mm"),
            // No TOML.
            ("[wheel]\ndiameter = 400 mm", 2, ""),
            ("wheel = 5", 1, "expected a section"),
        ] {
            let said = parse(Path::new("my.toml"), text).unwrap_err().to_string();
            assert!(said.starts_with(&format!("my.toml, line {line}: ")) && said.contains(words), "{said}");
        }
        let elsewhere = parse(Path::new("my.toml"), "[crop]\nprotection_zone = \"140 mm\"").unwrap_err().to_string();
        assert!(elsewhere.starts_with("my.toml: crop.row_spacing leaves no room"), "{elsewhere}");
    }
}
