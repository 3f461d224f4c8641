//! Settings as a TOML file with comments, one key a setting.
//!
//! A file is made from the firmware's own table: help, range, unit and default are above each value. Writing to an
//! existing file preserves its comments and its order. Settings that a file does not name are not changed. Each value
//! is checked against the table. The first error gives its line and what would be right.

use super::settings::{Setting, Settings, help, name, range};
use files::{FileError, whole_file};
use std::fs;
use std::path::Path;
use toml_edit::{Decor, DocumentMut, Item, Key, TomlError, Value};

/// The head of a new file.
const HEAD: &str = "\
# Settings of a weeder. `weeder settings push` sends them to the machine, `weeder settings diff` compares.
# Settings that are not named here are not changed.
";

/// How files of 0.1.0 name `merge_gap_mm`, which was in ticks of the encoder.
const OLD_MERGE_GAP: &str = "merge_gap_ticks";

/// Reads a file's settings, each within its range.
///
/// # Errors
/// Names the file, the line, and what would be right.
pub fn read(path: &Path) -> Result<Vec<(Setting, u16)>, FileError> {
    parse(path, &text(path)?).map(|(_, settings)| settings)
}

/// Writes all settings into a file. An existing file keeps its comments, and must be a settings file.
///
/// # Errors
/// As [`read`], and if the file cannot be written.
pub fn write(path: &Path, settings: &Settings) -> Result<(), FileError> {
    let old = if path.exists() { text(path)? } else { HEAD.to_owned() };
    let new = updated(path, &old, settings)?;
    let written = whole_file::write(path, |to| to.write_all(new.as_bytes()));
    written.map_err(|source| FileError::unwritten(path, source))
}

/// A switch as TOML and JSON write it: true or false. `None` for other settings.
pub fn is_true(setting: Setting, value: u16) -> Option<bool> {
    setting.is_switched().then_some(value != 0)
}

fn text(path: &Path) -> Result<String, FileError> {
    let bytes = fs::read(path).map_err(|source| FileError::unread(path, source))?;
    String::from_utf8(bytes)
        .map_err(|_| FileError::at_byte(path, "", 0, "this is no text: a settings file is TOML in UTF-8"))
}

/// An error in the line where a text is no TOML.
pub(super) fn no_toml(path: &Path, text: &str, error: &TomlError) -> FileError {
    let start = error.span().map_or(0, |span| span.start);
    FileError::at_byte(path, text, start, error.message().replace('\n', ", "))
}

fn parse(path: &Path, text: &str) -> Result<(DocumentMut, Vec<(Setting, u16)>), FileError> {
    let document: DocumentMut = text.parse().map_err(|error| no_toml(path, text, &error))?;
    let mut settings = Vec::new();
    let mut old_merge_gap = None;
    for (key, item) in document.iter() {
        let wrong = |problem| FileError::at_key(path, text, key, problem);
        if key == OLD_MERGE_GAP {
            let ticks = item.as_integer().and_then(|ticks| u16::try_from(ticks).ok()).filter(|&ticks| ticks <= 2000);
            let right = || wrong(format!("{key} has to be a whole number, 0 to 2000; now it is merge_gap_mm, in mm"));
            old_merge_gap = Some(ticks.ok_or_else(right)?);
            continue;
        }
        let Some(setting) = Setting::find(key.as_bytes()) else {
            let known: Vec<String> = Setting::all().map(name).collect();
            return Err(wrong(format!("there is no setting `{key}`: there are {}", known.join(", "))));
        };
        let value = value(setting, item)
            .ok_or_else(|| wrong(format!("{key} is `{}`: it has to be {}", item.to_string().trim(), right(setting))))?;
        settings.push((setting, value));
    }
    if let Some(ticks) = old_merge_gap.filter(|_| settings.iter().all(|&(setting, _)| setting != Setting::MergeGapMm)) {
        settings.push((Setting::MergeGapMm, merge_gap_mm(ticks, &settings)));
    }
    Ok((document, settings))
}

/// Converts ticks to millimetres of the wheel in these settings. Missing settings have their defaults.
fn merge_gap_mm(ticks: u16, settings: &[(Setting, u16)]) -> u16 {
    let mut all = Settings::new();
    for &(setting, value) in settings {
        all.set(setting, value).expect("what a file says has been checked");
    }
    let millimetres = f64::from(ticks) * 1000.0 / f64::from(all.wheel().ticks(1000).0);
    millimetres.round().min(Setting::MergeGapMm.description().greatest.into()) as u16
}

/// The value of an item for a setting, if it is valid.
fn value(setting: Setting, item: &Item) -> Option<u16> {
    if setting.is_switched() {
        return item.as_bool().map(u16::from);
    }
    let description = setting.description();
    let value = u16::try_from(item.as_integer()?).ok()?;
    (description.least..=description.greatest).contains(&value).then_some(value)
}

/// The valid values of a setting.
fn right(setting: Setting) -> String {
    let whole = if setting.is_switched() { "" } else { "a whole number, " };
    format!("{whole}{}", range(setting))
}

fn updated(path: &Path, old: &str, settings: &Settings) -> Result<String, FileError> {
    let (mut document, _) = parse(path, old)?;
    // In a file without values the comments belong to its end, and new values would go before them.
    let head = if document.is_empty() {
        document = DocumentMut::new();
        old
    } else {
        ""
    };
    if let Some((key, item)) = document.remove_entry(OLD_MERGE_GAP) {
        // Moves its comments as well.
        document.insert_formatted(&Key::new(name(Setting::MergeGapMm)).with_leaf_decor(key.leaf_decor().clone()), item);
    }
    for setting in Setting::all() {
        let name = name(setting);
        let value = settings.get(setting);
        let mut value = is_true(setting, value).map_or_else(|| Value::from(i64::from(value)), Value::from);
        match document.get_mut(&name).and_then(Item::as_value_mut) {
            Some(old) => {
                *value.decor_mut() = old.decor().clone();
                *old = value;
            }
            None => {
                document.insert(&name, Item::Value(value));
                let comment = format!("\n# {}\n# {}\n", help(setting), range(setting));
                if let Some(mut key) = document.key_mut(&name) {
                    *key.leaf_decor_mut() = Decor::new(comment, " ");
                }
            }
        }
    }
    Ok(format!("{head}{document}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Parses a file's text. Returns the error's message otherwise.
    fn parsed(text: &str) -> Result<Vec<(Setting, u16)>, String> {
        parse(Path::new("machine.toml"), text).map(|(_, settings)| settings).map_err(|error| error.to_string())
    }

    #[test]
    fn a_new_file_holds_every_setting_with_its_help_and_range_and_is_read_back() {
        let mut settings = Settings::new();
        settings.set(Setting::WheelMm, 405).unwrap();
        settings.set(Setting::EndSwitch, 1).unwrap();
        let text = updated(Path::new("machine.toml"), HEAD, &settings).unwrap();
        assert!(text.starts_with(HEAD), "{text}");
        let wheel = "\n# wheel diameter\n# 200 to 800 mm, default 400\nwheel_mm = 405\n";
        assert!(text.contains(wheel), "{text}");
        assert!(text.ends_with("# true or false, default false\nend_switch = true\n"), "{text}");
        let all: Vec<(Setting, u16)> = Setting::all().map(|setting| (setting, settings.get(setting))).collect();
        assert_eq!(parsed(&text), Ok(all));
    }

    #[test]
    fn comments_and_order_of_a_file_stay() {
        let old = "# my machine\nk = 5 # five plants\n\nwheel_mm = 405\n# the end\n";
        let new = updated(Path::new("machine.toml"), old, &Settings::new()).unwrap();
        assert!(new.starts_with("# my machine\nk = 3 # five plants\n\nwheel_mm = 400\n"), "{new}");
        assert!(new.contains("\nmargin_mm = 50\n") && new.ends_with("\n# the end\n"), "{new}");
        assert_eq!(updated(Path::new("machine.toml"), &new, &Settings::new()).unwrap(), new);
    }

    #[test]
    fn an_error_in_a_file_has_its_line_and_what_would_be_right() {
        for (text, wrong) in [
            (
                "k = 3\nwheel = 400\n",
                "machine.toml, line 2: there is no setting `wheel`: there are ticks_per_rev, wheel_mm",
            ),
            ("# x\n\nk = 0\n", "machine.toml, line 3: k is `0`: it has to be a whole number, 1 to 15, default 3"),
            (
                "wheel_mm = \"400\"",
                "line 1: wheel_mm is `\"400\"`: it has to be a whole number, 200 to 800 mm, default 400",
            ),
            ("wheel_mm = 400.5", "it has to be a whole number"),
            ("wheel_mm = -400", "it has to be a whole number"),
            ("wheel_mm = 65936", "it has to be a whole number"),
            ("end_switch = 1", "line 1: end_switch is `1`: it has to be true or false, default false"),
            ("[machine]\nwheel_mm = 400", "line 1: there is no setting `machine`"),
            ("k = 3\nk = 5\n", "line 2: duplicate key"),
            ("k = 3\nwheel_mm 400\n", "machine.toml, line 2: "),
        ] {
            let error = parsed(text).unwrap_err();
            assert!(error.contains(wrong), "{text:?}: {error}");
        }
    }

    #[test]
    fn a_merge_gap_in_ticks_is_read_in_millimetres_of_the_files_own_wheel() {
        let gap = |text| parsed(text).unwrap().into_iter().find(|(setting, _)| *setting == Setting::MergeGapMm);
        assert_eq!(gap("merge_gap_ticks = 40"), Some((Setting::MergeGapMm, 21)));
        assert_eq!(gap("merge_gap_ticks = 40\nticks_per_m = 1000"), Some((Setting::MergeGapMm, 40)));
        assert_eq!(gap("merge_gap_ticks = 2000\nticks_per_m = 500"), Some((Setting::MergeGapMm, 1000)));
        assert_eq!(gap("merge_gap_ticks = 40\nmerge_gap_mm = 5"), Some((Setting::MergeGapMm, 5)));
        assert!(parsed("merge_gap_ticks = 2001").unwrap_err().contains("now it is merge_gap_mm"));
        let old = "# ragged leaves\nmerge_gap_ticks = 60 # three were too few\n";
        let new = updated(Path::new("machine.toml"), old, &Settings::new()).unwrap();
        assert!(new.starts_with("# ragged leaves\nmerge_gap_mm = 21 # three were too few\n"), "{new}");
    }

    #[test]
    fn a_file_of_something_else_is_not_written_over() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for content in [&b"[package]\nname = \"weeder\"\n"[..], b"\xFF\xFE"] {
            fs::write(file.path(), content).unwrap();
            assert!(write(file.path(), &Settings::new()).is_err());
            assert_eq!(fs::read(file.path()).unwrap(), content);
        }
    }

    #[test]
    fn a_file_that_does_not_exist_is_named() {
        let error = read(Path::new("no/such.toml")).unwrap_err();
        assert_eq!(error.to_string(), "no/such.toml cannot be read");
    }
}
