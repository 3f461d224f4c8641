//! Settings as a TOML file with comments, one key a setting.
//!
//! A file is made from the firmware's own table: help, range, unit and default are above each value. Writing to an
//! existing file preserves its comments and its order. Settings that a file does not name are not changed. Each value
//! is checked against the table. The first error gives its line and what would be right.

use super::settings::{Foreign, OtherSetting, Setting, Settings, Shown, help, name, range};
use files::{FileError, bounded_file, whole_file};
use std::path::Path;
use toml_edit::{Decor, DocumentMut, Item, Key, RawString, TomlError, Value};

const HEAD: &str = "\
# Settings of a weeder. `weeder settings push` sends them to the machine, `weeder settings diff` compares.
# Settings that are not named here are not changed.
";

/// How files of 0.1.0 name `merge_gap_mm`, which was in ticks of the encoder.
const OLD_MERGE_GAP: &str = "merge_gap_ticks";

/// The factory's leads and top speed of the version with that name, which are not safe. They are left out.
const UNSAFE: [(Setting, u16); 3] = [(Setting::LeadOutMs, 180), (Setting::LeadInMs, 40), (Setting::TopSpeedMmS, 1400)];

/// The settings in a file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Named {
    /// Those of this program, each within its range.
    pub settings: Vec<(Setting, u16)>,
    /// Those that another version of the firmware may know.
    pub foreign: Vec<Foreign>,
}

/// Reads a file's settings.
///
/// # Errors
/// Names the file, the line, and what would be right.
pub fn read(path: &Path) -> Result<Named, FileError> {
    parse(path, &bounded_file::text(path)?).map(|(_, named)| named)
}

/// Writes all settings of a machine into a file, also those that only the machine knows. An existing file must be a
/// settings file. It keeps its comments, and settings that the machine does not show become comments.
///
/// # Errors
/// As [`read`], and if the file cannot be written.
pub fn write(path: &Path, shown: &Shown) -> Result<(), FileError> {
    // A pipe or a device has no comments to keep, and may have no end.
    let old = if path.is_file() { bounded_file::text(path)? } else { HEAD.to_owned() };
    let new = updated(path, &old, shown)?;
    let written = whole_file::write(path, |to| to.write_all(new.as_bytes()));
    written.map_err(|source| FileError::unwritten(path, source))
}

pub(super) fn no_toml(path: &Path, text: &str, error: &TomlError) -> FileError {
    let start = error.span().map_or(0, |span| span.start);
    FileError::at_byte(path, text, start, error.message().replace('\n', ", "))
}

fn parse(path: &Path, text: &str) -> Result<(DocumentMut, Named), FileError> {
    bounded_file::check_nesting(path, text)?;
    let document: DocumentMut = text.parse().map_err(|error| no_toml(path, text, &error))?;
    let (mut settings, mut foreign) = (Vec::new(), Vec::new());
    let mut old_merge_gap = None;
    for (key, item) in document.iter() {
        let wrong = |problem| FileError::at_key(path, text, key, problem);
        let number = item.as_integer().and_then(|number| u16::try_from(number).ok());
        if key == OLD_MERGE_GAP {
            let problem = wrong(format!("{key} has to be a whole number, 0 to 2000; now it is merge_gap_mm, in mm"));
            match number.filter(|&ticks| ticks <= 2000) {
                Some(ticks) => old_merge_gap = Some((ticks, problem.to_string())),
                None => return Err(problem),
            }
            continue;
        }
        let (known, is_switch) = (Setting::find(key.as_bytes()), item.is_bool());
        let value = number.or(item.as_bool().map(u16::from));
        if let (Some(setting), Some(value)) = (known, value)
            && setting.is_switched() == is_switch
            && setting.allows(value)
        {
            settings.push((setting, value));
            continue;
        }
        let problem = wrong(match known {
            Some(setting) => {
                let whole = if setting.is_switched() { "" } else { "a whole number, " };
                format!("{key} is `{}`: it has to be {whole}{}", item.to_string().trim(), range(setting))
            }
            None => {
                let known: Vec<String> = Setting::all().map(name).collect();
                format!("there is no setting `{key}`: there are {}", known.join(", "))
            }
        });
        // Another version may have the setting, or a wider range.
        let is_possible = known.is_none_or(|setting| !setting.is_switched() && !is_switch);
        match value.filter(|_| is_possible) {
            Some(value) => {
                foreign.push(Foreign { name: key.to_owned(), value, problem: problem.to_string(), replaced_by: None });
            }
            None => return Err(problem),
        }
    }
    if old_merge_gap.is_some() {
        settings.retain(|setting| !UNSAFE.contains(setting));
    }
    if let Some((value, problem)) = old_merge_gap
        && settings.iter().all(|&(setting, _)| setting != Setting::MergeGapMm)
    {
        let replaced_by = Some((Setting::MergeGapMm, merge_gap_mm(value, &settings)));
        foreign.push(Foreign { name: OLD_MERGE_GAP.to_owned(), value, problem, replaced_by });
    }
    Ok((document, Named { settings, foreign }))
}

/// Converts ticks to millimetres of the wheel in these settings. Missing settings have their defaults.
fn merge_gap_mm(ticks: u16, settings: &[(Setting, u16)]) -> u16 {
    let mut all = Settings::new();
    for &(setting, value) in settings {
        all.set(setting, value).expect("what a file says has been checked");
    }
    let millimetres = f64::from(ticks) * 1000.0 / f64::from(all.wheel().ticks(1000).0);
    millimetres.round().min(Setting::MergeGapMm.greatest().into()) as u16
}

/// Makes comments of the values whose key is not `kept`. They stay in their places, with their own comments.
fn comment_out(document: &mut DocumentMut, kept: impl Fn(&str) -> bool) {
    let text = |raw: Option<&RawString>| raw.and_then(RawString::as_str).unwrap_or_default().to_owned();
    let mut carried = String::new();
    let names: Vec<String> = document.iter().map(|(name, _)| name.to_owned()).collect();
    for name in names {
        if !kept(&name) {
            if let Some((key, item)) = document.remove_entry(&name) {
                let value = item.to_string().replace('\n', "\n# ");
                carried += &format!("{}# {name} ={value}\n", text(key.leaf_decor().prefix()));
            }
        } else if let Some(mut key) = document.key_mut(&name) {
            let prefix = std::mem::take(&mut carried) + &text(key.leaf_decor().prefix());
            key.leaf_decor_mut().set_prefix(prefix);
        }
    }
    let trailing = carried + &text(Some(document.trailing()));
    document.set_trailing(trailing);
}

/// The comment above a setting that this version does not know.
const ONLY_MACHINE: &str = "only the machine's firmware knows this setting, or this value";

fn updated(path: &Path, old: &str, shown: &Shown) -> Result<String, FileError> {
    let (mut document, _) = parse(path, old)?;
    // In a file without values the comments belong to its end, and new values would go before them.
    let head = if document.is_empty() {
        document = DocumentMut::new();
        old
    } else {
        ""
    };
    // A machine without the new name shows the old one, and its value stays in ticks.
    if !shown.missing.contains(&Setting::MergeGapMm)
        && let Some((key, item)) = document.remove_entry(OLD_MERGE_GAP)
    {
        // Moves the user's comments as well. The generated ones, two lines, are of the old setting.
        let mut decor = key.leaf_decor().clone();
        if let Some((of_user, generated)) =
            decor.prefix().and_then(RawString::as_str).and_then(|text| text.split_once(ONLY_MACHINE))
        {
            let of_user = of_user.trim_end_matches(['#', ' ']);
            let (help, range) = (help(Setting::MergeGapMm), range(Setting::MergeGapMm));
            let rest: String = generated.split_inclusive('\n').skip(2).collect();
            decor.set_prefix(format!("{of_user}# {help}\n# {range}\n{rest}"));
        }
        document.insert_formatted(&Key::new(name(Setting::MergeGapMm)).with_leaf_decor(decor), item);
    }
    comment_out(&mut document, |key| {
        let is_known = Setting::find(key.as_bytes()).is_some_and(|setting| !shown.missing.contains(&setting));
        is_known || shown.others.iter().any(|other| other.name == key)
    });
    let known = Setting::all().filter(|setting| !shown.missing.contains(setting)).map(|setting| {
        let comment = format!("\n# {}\n# {}\n", help(setting), range(setting));
        (name(setting), shown.settings.get(setting), setting.is_switched(), comment)
    });
    let foreign = shown.others.iter().map(|OtherSetting { name, value, range, is_switched, unit }| {
        let range = if *is_switched {
            "true or false".to_owned()
        } else {
            format!("{} to {} {unit}", range.start(), range.end())
        };
        let comment = format!("\n# {ONLY_MACHINE}\n# {}\n", range.trim_end());
        (name.clone(), *value, *is_switched, comment)
    });
    for (name, value, is_switched, comment) in known.chain(foreign) {
        let mut value = if is_switched { Value::from(value != 0) } else { Value::from(i64::from(value)) };
        match document.get_mut(&name).and_then(Item::as_value_mut) {
            Some(old) => {
                *value.decor_mut() = old.decor().clone();
                *old = value;
            }
            None => {
                document.insert(&name, Item::Value(value));
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
    use std::fs;

    /// Parses a file's text. Returns the error's message otherwise, also for a setting of another version.
    fn parsed(text: &str) -> Result<Vec<(Setting, u16)>, String> {
        let (_, named) = parse(Path::new("machine.toml"), text).map_err(|error| error.to_string())?;
        named.foreign.into_iter().next().map_or(Ok(named.settings), |foreign| Err(foreign.problem))
    }

    /// What a machine of this version shows.
    fn shown(settings: Settings) -> Shown {
        Shown { settings, ..Shown::default() }
    }

    #[test]
    fn settings_that_only_the_machine_knows_are_kept_and_read_back() {
        let other = |name: &str, value, is_switched| OtherSetting {
            name: name.to_owned(),
            value,
            range: 0..=1200,
            is_switched,
            unit: if is_switched { String::new() } else { "mm".to_owned() },
        };
        let others = vec![other("wheel_mm", 900, false), other("tilt_mm", 7, false), other("lamp", 1, true)];
        let shown = Shown { missing: vec![Setting::WheelMm, Setting::K], others, ..Shown::default() };
        let text = updated(Path::new("machine.toml"), HEAD, &shown).unwrap();
        assert!(text.contains("knows this setting, or this value\n# 0 to 1200 mm\ntilt_mm = 7\n"), "{text}");
        assert!(text.contains("\nlamp = true\n") && !text.contains("\nk ="), "{text}");
        let (_, named) = parse(Path::new("machine.toml"), &text).unwrap();
        let values: Vec<(&str, u16)> = named.foreign.iter().map(|foreign| (&*foreign.name, foreign.value)).collect();
        assert_eq!(values, [("wheel_mm", 900), ("tilt_mm", 7), ("lamp", 1)]);
        assert!(named.foreign.iter().all(|foreign| shown.takes(foreign).is_ok()));
        let error = Shown::default().takes(&named.foreign[1]).unwrap_err().to_string();
        assert!(error.contains("there is no setting `tilt_mm`: there are "), "{error}");
        assert!(error.contains("nothing was sent"), "{error}");
    }

    #[test]
    fn a_new_file_has_every_setting_with_its_help_and_range() {
        let settings = rig::settings(&[(Setting::WheelMm, 405), (Setting::EndSwitch, 1)]);
        let text = updated(Path::new("machine.toml"), HEAD, &shown(settings.clone())).unwrap();
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
        let new = updated(Path::new("machine.toml"), old, &shown(Settings::new())).unwrap();
        assert!(new.starts_with("# my machine\nk = 3 # five plants\n\nwheel_mm = 400\n"), "{new}");
        assert!(new.contains("\nmargin_mm = 50\n") && new.ends_with("\n# the end\n"), "{new}");
        assert_eq!(updated(Path::new("machine.toml"), &new, &shown(Settings::new())).unwrap(), new);
    }

    #[test]
    fn a_value_that_the_machine_does_not_show_becomes_a_comment() {
        let old = "# Field north\nwarp_mm = 7 # mine\nk = 5 # five plants\nlead_out_ms = 999\ntilt_mm = 7\n";
        let shown = Shown { missing: vec![Setting::LeadOutMs], ..Shown::default() };
        let new = updated(Path::new("machine.toml"), old, &shown).unwrap();
        let values = new.lines().filter(|line| !line.starts_with('#')).collect::<Vec<_>>().concat();
        assert!(values.contains("k = 3 # five plants"), "{new}");
        assert!(!values.contains("lead_out_ms") && !values.contains("tilt_mm"), "{new}");
        for comment in ["# Field north\n# warp_mm = 7 # mine\nk = 3", "# lead_out_ms = 999\n# tilt_mm = 7\n"] {
            assert!(new.contains(comment), "{new}");
        }
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
        let named = |text| parse(Path::new("machine.toml"), text).unwrap().1;
        let gap = |text| {
            let Named { settings, foreign } = named(text);
            let replaced = foreign.iter().filter_map(|foreign| Shown::default().replacement(foreign));
            settings.into_iter().chain(replaced).find(|(setting, _)| *setting == Setting::MergeGapMm)
        };
        assert_eq!(gap("merge_gap_ticks = 40"), Some((Setting::MergeGapMm, 21)));
        assert_eq!(gap("merge_gap_ticks = 40\nticks_per_m = 1000"), Some((Setting::MergeGapMm, 40)));
        assert_eq!(gap("merge_gap_ticks = 2000\nticks_per_m = 500"), Some((Setting::MergeGapMm, 1000)));
        assert_eq!(gap("merge_gap_ticks = 40\nmerge_gap_mm = 5"), Some((Setting::MergeGapMm, 5)));
        assert!(parsed("merge_gap_ticks = 2001").unwrap_err().contains("now it is merge_gap_mm"));
        // The factory's lead of that version is left out, and another one is the user's.
        let leads = named("merge_gap_ticks = 40\nlead_out_ms = 180\nlead_in_ms = 30").settings;
        assert_eq!(leads, [(Setting::LeadInMs, 30)]);
        let generated = "# mine\n\n# only the machine's firmware knows this setting, or this value\n# 0 to 2000 ticks\nmerge_gap_ticks = 40\n";
        let new = updated(Path::new("machine.toml"), generated, &Shown::default()).unwrap();
        assert!(new.starts_with("# mine\n\n# ") && new.contains(" mm, default 21\nmerge_gap_mm = "), "{new}");
        assert!(!new.contains("only the machine") && !new.contains("ticks\n"), "{new}");
        let old = "# ragged leaves\nmerge_gap_ticks = 60 # three were too few\n";
        let new = updated(Path::new("machine.toml"), old, &shown(Settings::new())).unwrap();
        assert!(new.starts_with("# ragged leaves\nmerge_gap_mm = 21 # three were too few\n"), "{new}");
        let ticks = OtherSetting {
            name: OLD_MERGE_GAP.to_owned(),
            value: 40,
            range: 0..=2000,
            is_switched: false,
            unit: "ticks".to_owned(),
        };
        let of_its_version = Shown { missing: vec![Setting::MergeGapMm], others: vec![ticks], ..Shown::default() };
        let new = updated(Path::new("machine.toml"), old, &of_its_version).unwrap();
        assert!(new.starts_with("# ragged leaves\nmerge_gap_ticks = 40 # three were too few\n"), "{new}");
        assert_eq!(gap(&new), Some((Setting::MergeGapMm, 21)));
        let foreign = &named(&new).foreign[0];
        assert_eq!(of_its_version.takes(foreign).unwrap().value, 40);
        assert_eq!(of_its_version.replacement(foreign), None);
    }

    #[test]
    fn a_file_of_something_else_is_not_written_over() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for content in [&b"[package]\nname = \"weeder\"\n"[..], b"\xFF\xFE"] {
            fs::write(file.path(), content).unwrap();
            assert!(write(file.path(), &shown(Settings::new())).is_err());
            assert_eq!(fs::read(file.path()).unwrap(), content);
        }
    }

    #[test]
    fn a_file_that_does_not_exist_is_named() {
        let error = read(Path::new("no/such.toml")).unwrap_err();
        assert_eq!(error.to_string(), "no/such.toml cannot be read");
    }
}
