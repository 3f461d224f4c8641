//! The errors of a field's conditions: what is wrong, its line in the file, and what would be right.

use super::parameters::PARAMETERS;
use super::presets::presets;
use control::settings::Setting;
use files::in_a_line;
use std::io;
use std::path::PathBuf;
use thiserror::Error;
use toml::de::DeTable;

/// What is wrong with conditions, and what would be right.
#[derive(Debug, Error)]
pub enum ConditionsError {
    /// Neither a preset nor a file that can be read.
    #[error("{} is none of the presets ({presets}), and as a file it cannot be read", path.display(), presets = presets().collect::<Vec<_>>().join(", "))]
    Unreadable {
        /// The name or path.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// The file is no TOML, or has keys or kinds of values that are not known.
    #[error("{}, line {line}: {problem}", path.display())]
    NotUnderstood {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong, and what would be right if that is known.
        problem: String,
    },
    /// A value in a file is out of its range.
    #[error("{}, line {line}: {problem}", path.display())]
    AtLine {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: usize,
        /// What is wrong.
        problem: WrongValue,
    },
    /// A value is wrong.
    #[error(transparent)]
    Wrong(#[from] WrongValue),
}

/// A value that a parameter or setting cannot have.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum WrongValue {
    /// The value is out of its range.
    #[error("{name} is {value}, but has to be {least} to {greatest}: {meaning}")]
    OutOfRange {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
        /// The least value.
        least: f64,
        /// The greatest value.
        greatest: f64,
        /// Its meaning.
        meaning: String,
    },
    /// Sweeps would run through a protected zone.
    #[error("machine.sweep_from_mm is {from_mm}, but {why}")]
    Sweeps {
        /// Where they begin.
        from_mm: f64,
        /// What would be right.
        why: String,
    },
    /// A count is no whole number.
    #[error("{name} is {value}, but has to be a whole number")]
    NotWhole {
        /// The parameter.
        name: String,
        /// Its value.
        value: f64,
    },
    /// The name is unknown.
    #[error("{0} is neither a parameter of the field nor a setting of the firmware; there are {known}", known = names().collect::<Vec<_>>().join(", "))]
    Unknown(String),
}

/// All names that [`Conditions::set`] takes.
fn names() -> impl Iterator<Item = String> {
    PARAMETERS
        .iter()
        .map(|parameter| parameter.name.to_owned())
        .chain(Setting::all().map(|setting| setting.text().to_string()))
}

impl WrongValue {
    pub(super) fn name(&self) -> &str {
        match self {
            Self::OutOfRange { name, .. } | Self::NotWhole { name, .. } | Self::Unknown(name) => name,
            Self::Sweeps { .. } => "machine.sweep_from_mm",
        }
    }
}

/// The number of the line with `table.key`, from 1.
pub(super) fn line(text: &str, name: &str) -> Option<usize> {
    let (table, key) = name.split_once('.')?;
    let root = DeTable::parse(text).ok()?;
    let (key, _) = root.get_ref().get(table)?.get_ref().as_table()?.get_key_value(key)?;
    Some(line_at(text, key.span().start))
}

/// The number of the line with this byte, from 1.
pub(super) fn line_at(text: &str, byte: usize) -> usize {
    text.bytes().take(byte).filter(|&byte| byte == b'\n').count() + 1
}

/// The TOML reader's error in one line. If it is the value of a parameter or setting, the line also gives the valid
/// range.
pub(super) fn explain(text: &str, error: &toml::de::Error) -> String {
    let at = error.span().map_or(0, |span| span.start);
    let root = DeTable::parse(text).ok();
    let entries = root.iter().flat_map(|root| root.get_ref()).flat_map(|(table, entries)| {
        let entries = entries.get_ref().as_table().into_iter().flatten();
        entries.map(|(key, value)| (table.get_ref().as_ref(), key.get_ref().as_ref(), value.span()))
    });
    let wrong = entries.into_iter().find_map(|(table, key, value): (&str, &str, _)| {
        let is_here = value.contains(&at);
        let (least, greatest, meaning) = range(table, key).filter(|_| is_here)?;
        let written = in_a_line(&text[value]);
        Some(format!("{table}.{key} is {written}, but has to be a number from {least} to {greatest}: {meaning}"))
    });
    wrong.unwrap_or_else(|| error.message().trim().replace('\n', ", "))
}

/// The range of a parameter or setting, and what it is.
fn range(table: &str, key: &str) -> Option<(f64, f64, String)> {
    if table == "settings" {
        let setting = Setting::find(key.as_bytes())?;
        let range = setting.description();
        return Some((range.least.into(), range.greatest.into(), setting.help().to_string()));
    }
    let parameter = PARAMETERS.iter().find(|known| known.name.split_once('.') == Some((table, key)))?;
    Some((parameter.least, parameter.greatest, parameter.meaning.to_owned()))
}
