//! The errors of a field's conditions: what is wrong, its line in the file, and what would be right.

use super::parameters::PARAMETERS;
use control::settings::Setting;
use files::toml_entry::{self, Entry};
use std::fmt::Display;
use thiserror::Error;

/// A value that a parameter or setting cannot have.
#[derive(Clone, Debug, Error, PartialEq)]
#[error("{name} {problem}")]
pub struct WrongValue {
    /// The parameter, or `settings` and a setting.
    pub(super) name: String,
    problem: String,
}

impl WrongValue {
    pub(super) fn new(name: impl Into<String>, problem: impl Into<String>) -> Self {
        Self { name: name.into(), problem: problem.into() }
    }

    pub(super) fn out_of_range(name: impl Into<String>, value: f64, range: (f64, f64), meaning: impl Display) -> Self {
        let (least, greatest) = range;
        Self::new(name, format!("is {value}, but has to be {least} to {greatest}: {meaning}"))
    }

    pub(super) fn not_whole(name: &str, value: f64) -> Self {
        Self::new(name, format!("is {value}, but has to be a whole number"))
    }

    pub(super) fn unknown(name: impl Into<String>) -> Self {
        let known = names().collect::<Vec<_>>().join(", ");
        Self::new(name, format!("is neither a parameter of the field nor a setting of the firmware; there are {known}"))
    }
}

/// All names that [`Conditions::set`] takes.
fn names() -> impl Iterator<Item = String> {
    PARAMETERS
        .iter()
        .map(|parameter| parameter.name.to_owned())
        .chain(Setting::all().map(|setting| setting.text().to_string()))
}

/// The TOML reader's error at a byte, in one line. For a value of a parameter or setting: the valid values.
pub(super) fn explain(text: &str, byte: usize, error: &toml::de::Error) -> String {
    let entry = toml_entry::around(text, byte).filter(|entry| entry.value.contains(&byte));
    let wrong = entry.and_then(|Entry { name, value, .. }| {
        let (table, key) = name.split_once('.')?;
        let (least, greatest, meaning) = range(table, key)?;
        let written = &text[value];
        Some(format!("{name} is {written}, but has to be a number from {least} to {greatest}: {meaning}"))
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
