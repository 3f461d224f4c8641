//! `weeder settings`: saves the machine's settings to a file, compares them, and sends them to a machine.

use crate::ports::{Chosen, Ports};
use anyhow::{Result, bail, ensure};
use clap::{Args, Subcommand};
use comfy_table::{Table, presets};
use control::alarm::Alarm;
use field::conditions::Conditions;
use frame::{Finding, Messages, OutFolder, OutName, Replace, Results, source};
use link::row_names::Row;
use link::settings::{self, Setting, SettingsError, Shown, name, unit};
use link::settings_file::{self, Named};
use serde_json::{Value, json};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder settings pull machine.toml           write the machine's settings into a file\n  \
    weeder settings push machine.toml           set and save them on a machine\n  \
    weeder settings diff machine.toml           list the differences\n  \
    weeder settings pull rows --all             every row, a file for each in the folder rows\n  \
    weeder settings push machine.toml --port left --port right")]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Write the machine's settings into a TOML file; --force keeps the comments of an existing one.
    #[command(after_help = "Example: weeder settings pull --json | jq .wheel_mm")]
    Pull {
        /// The file; with several rows, a folder with a file for each row.
        #[arg(value_name = "FILE.toml|FOLDER", required_unless_present = "json")]
        file: Option<OutName>,
        #[command(flatten)]
        replace: Replace,
        /// Also print them as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        ports: Ports,
    },
    /// Set a file's settings on the machine and save them there; nothing is sent unless all of them can be right.
    #[command(after_help = "\
Opening the port resets most Unos, and unsaved settings are lost.\n\n\
Example: weeder settings push machine.toml --port /dev/ttyACM0")]
    Push {
        /// A file for all rows, or a folder with a file for each row; - for standard input.
        #[arg(value_name = "FILE.toml|FOLDER", value_parser = source::file())]
        file: PathBuf,
        /// Do not `save` them: the next reset loses them. On most Unos, opening the port is a reset.
        #[arg(long)]
        no_save: bool,
        /// No effect; for older scripts. The settings are always saved.
        #[arg(long, hide = true, conflicts_with = "no_save")]
        save: bool,
        /// Print the settings that were set as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        ports: Ports,
    },
    /// List the settings that differ between file and machine; the status is 1 if one does.
    #[command(after_help = "Example: weeder settings diff machine.toml")]
    Diff {
        /// A file for all rows, or a folder with a file for each row; - for standard input.
        #[arg(value_name = "FILE.toml|FOLDER", value_parser = source::file())]
        file: PathBuf,
        /// Print the differences as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        ports: Ports,
    },
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    match &arguments.action {
        Action::Pull { file, replace, json, ports } => pull(file.as_ref(), *replace, *json, &ports.choose(None)?),
        Action::Push { file, no_save, save: _, json, ports } => push(file, !no_save, *json, &ports.choose(None)?),
        Action::Diff { file, json, ports } => diff(file, *json, &ports.choose(None)?),
    }
}

fn pull(file: Option<&OutName>, replace: Replace, json: bool, chosen: &Chosen) -> Result<Finding> {
    let names = chosen.rows.iter().map(|row| format!("{}.toml", row.name));
    let folder = match file {
        Some(file) if chosen.are_several => Some(file.folder(names, replace)?),
        Some(file) => file.file(replace).map(|_| None)?,
        None => None,
    };
    let path = |row: &Row| match file?.path() {
        folder if chosen.are_several => Some(Chosen::file_in(folder, row, "toml")),
        file => Some(file.to_owned()),
    };
    let pulled = chosen.each(|row, link| {
        let lines = settings::read_lines(link)?;
        if let Some(other) = settings::other_version(link.version(), &lines) {
            writeln!(Messages, "{}: {other}", row.name);
        }
        let shown = Shown::by(&lines);
        // Another version's status may be unknown.
        if settings::status(link).is_ok_and(|status| status.alarm == Some(Alarm::SettingsLost)) {
            const LOST: &str = "the machine lost its settings, or is new (alarm 5-1): it started with factory settings";
            if let Some(path) =
                path(row).filter(|path| path.metadata().is_ok_and(|there| there.is_file() && there.len() > 0))
            {
                let path = path.display();
                bail!(
                    "{LOST}, and {path} is not replaced. `weeder settings push {path}` restores them. Then `clear` in \
                     `weeder monitor` ends the alarm"
                );
            }
            writeln!(Messages, "{}: {LOST}", row.name);
        }
        Ok(shown)
    });
    let write = |(row, pulled): (&Row, Result<Shown>)| {
        let settings = pulled?;
        folder.as_ref().map_or(Ok(()), OutFolder::make)?;
        path(row).map_or(Ok(()), |path| settings_file::write(&path, &settings))?;
        Ok(settings)
    };
    let written = chosen.rows.iter().zip(pulled).map(write).collect();
    chosen.show(written, json, as_json, |place, _| {
        let path = path(&chosen.rows[place]).unwrap_or_default();
        chosen.under_name(place, &format!("The machine's settings are in {}", path.display()))
    })?;
    Ok(Finding::Good)
}

fn push(file: &Path, save: bool, json: bool, chosen: &Chosen) -> Result<Finding> {
    let wanted = chosen.wanted(file)?;
    let pushed = chosen.each(|row, link| {
        let wanted = &wanted[&row.name];
        Ok(settings::push(link, &wanted.settings, &wanted.foreign, save)?)
    });
    let in_json = |set: &Vec<String>| json!({ "set": set, "saved": save });
    chosen.show(pushed, json, in_json, |place, set| {
        let text = match set.as_slice() {
            [] => "The machine has these settings already".to_owned(),
            set => format!("Set: {}", set.join(", ")),
        };
        let saved = match save {
            true => "All settings are saved",
            false => "Not saved: the next reset takes them back, and on most Unos opening the port is one",
        };
        format!("{}\n{}", chosen.under_name(place, &text), chosen.under_name(place, saved))
    })?;
    Ok(Finding::Good)
}

fn diff(file: &Path, json: bool, chosen: &Chosen) -> Result<Finding> {
    let wanted = chosen.wanted(file)?;
    let found = chosen.each(|row, link| Ok(differences(&wanted[&row.name], &settings::read_shown(link)?)?));
    let differs = found.iter().flatten().any(|differences| !differences.is_empty());
    let in_json = |differences: &Vec<Difference>| {
        let of_one =
            |(name, file, machine, _): &Difference| json!({ "setting": name, "file": file, "machine": machine });
        differences.iter().map(of_one).collect()
    };
    chosen.show(found, json, in_json, |place, differences| {
        let file = chosen.file_of(place, file);
        if differences.is_empty() {
            chosen.under_name(place, &format!("The machine has the settings of {}", file.display()))
        } else if chosen.are_several {
            let head = chosen.under_name(place, &format!("not as in {}", file.display()));
            format!("{head}\n{}", table(differences))
        } else {
            table(differences).to_string()
        }
    })?;
    Ok(Finding::of(!differs))
}

impl Chosen {
    /// The settings for each row, by its name. All files are read before anything is sent.
    fn wanted(&self, file: &Path) -> Result<HashMap<String, Named>> {
        if !file.is_dir() {
            let wanted = wanted(file)?;
            return Ok(self.rows.iter().map(|row| (row.name.clone(), wanted.clone())).collect());
        }
        let has_all = self.rows.iter().all(|row| Self::file_in(file, row, "toml").is_file());
        ensure!(self.are_several || has_all, "{} is a folder: name a file", file.display());
        self.rows.iter().map(|row| Ok((row.name.clone(), wanted(&Self::file_in(file, row, "toml"))?))).collect()
    }

    fn file_of(&self, place: usize, file: &Path) -> PathBuf {
        match self.rows.get(place) {
            Some(row) if file.is_dir() => Self::file_in(file, row, "toml"),
            _ => file.to_owned(),
        }
    }

    /// Prints the rows' results, each in words, or all in JSON: the only row's value, or each row's by its name. A
    /// failed row has `null`, but if the only row has failed, there is only its error. Fails if a row failed, or the
    /// results cannot be printed.
    fn show<T>(
        &self,
        done: Vec<Result<T>>,
        json: bool,
        value: impl Fn(&T) -> Value,
        words: impl Fn(usize, &T) -> String,
    ) -> Result<()> {
        if json {
            let value = |done: &Result<T>| done.as_ref().map_or(Value::Null, &value);
            match done.as_slice() {
                [only] if !self.are_several => {
                    only.as_ref().map_or(Ok(()), |_| writeln!(Results, "{:#}", value(only)))?
                }
                all => {
                    writeln!(Results, "{:#}", Value::from_iter(self.names().into_iter().zip(all.iter().map(value))))?
                }
            }
        } else {
            for (place, done) in done.iter().enumerate() {
                done.as_ref().map_or(Ok(()), |done| writeln!(Results, "{}", words(place, done)))?;
            }
        }
        self.check(done)
    }
}

/// The settings of a file, at least one.
fn wanted(file: &Path) -> Result<Named> {
    // Its leads and its stroke, on another machine, would bring the tool over plants.
    let is_preset = !file.exists() && file.to_str().and_then(Conditions::preset).is_some();
    ensure!(
        !is_preset,
        "{} is a simulated machine, and its settings hold for no other: measure yours with `weeder set-up`",
        file.display()
    );
    let wanted = settings_file::read(file)?;
    ensure!(wanted != Named::default(), "{} names no setting: `weeder settings pull` writes them all", file.display());
    Ok(wanted)
}

/// A setting that the machine has otherwise than the file: its name, the file's value, the machine's, and its unit.
type Difference = (String, Value, Value, String);

fn differences(wanted: &Named, found: &Shown) -> Result<Vec<Difference>, SettingsError> {
    let mut differences = Vec::new();
    let replaced = wanted.foreign.iter().filter_map(|foreign| found.replacement(foreign));
    for (setting, file) in wanted.settings.iter().copied().chain(replaced) {
        let own = found.others.iter().find(|other| other.name == name(setting)).map(|other| Value::from(other.value));
        let machine = match found.missing.contains(&setting) {
            true => own.unwrap_or(Value::Null),
            false => value(setting.is_switched(), found.settings.get(setting)),
        };
        differences.push((name(setting), value(setting.is_switched(), file), machine, unit(setting)));
    }
    for foreign in wanted.foreign.iter().filter(|foreign| found.replacement(foreign).is_none()) {
        let own = found.takes(foreign)?;
        let value = |number| value(own.is_switched, number);
        differences.push((own.name.clone(), value(foreign.value), value(own.value), own.unit.clone()));
    }
    differences.retain(|(_, file, machine, _)| file != machine);
    Ok(differences)
}

fn table(differences: &[Difference]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(["setting", "file", "machine", "unit"]);
    for (name, file, machine, unit) in differences {
        table.add_row([name, &file.to_string(), &machine.to_string(), unit]);
    }
    table
}

fn as_json(shown: &Shown) -> Value {
    let known = Setting::all().filter(|setting| !shown.missing.contains(setting));
    let known = known.map(|setting| (name(setting), value(setting.is_switched(), shown.settings.get(setting))));
    let others = shown.others.iter().map(|other| (other.name.clone(), value(other.is_switched, other.value)));
    known.chain(others).collect()
}

/// A setting's value in JSON, as in the file.
fn value(is_switched: bool, number: u16) -> Value {
    if is_switched { Value::from(number != 0) } else { Value::from(number) }
}
