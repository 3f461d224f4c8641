//! `weeder settings`: the machine's settings as a file that can be kept, compared, and given to the next machine.

use crate::Finding;
use crate::destination::FileName;
use crate::output::say;
use crate::source;
use anyhow::{Result, ensure};
use clap::{Args, Subcommand};
use comfy_table::{Table, presets};
use link::settings::{self, Setting, Settings, name, unit};
use link::{Link, settings_file};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};

/// What the user asks of the settings.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder settings pull machine.toml           write the machine's settings into a file\n  \
    weeder settings push machine.toml           set them on a machine, which keeps them for good\n  \
    weeder settings diff machine.toml           say what differs; ends with status 1 if anything does")]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Write the machine's settings into a TOML file; one that is there keeps its comments.
    #[command(after_help = "Example: weeder settings pull --json | jq .wheel_mm")]
    Pull {
        /// The file.
        #[arg(value_name = "FILE.toml", required_unless_present = "json")]
        file: Option<FileName>,
        /// Print them as JSON as well.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
    /// Set a file's settings on the machine and have it keep them for good; nothing is sent unless all of them can be right.
    #[command(after_help = "\
Opening the port is a reset on most Unos, and so is a loss of power: what is not saved is gone then.\n\n\
Example: weeder settings push machine.toml --port /dev/ttyACM0")]
    Push {
        /// The file; - for standard input.
        #[arg(value_name = "FILE.toml", value_parser = source::file)]
        file: PathBuf,
        /// Leave out the machine's `save`: its next reset, which on most Unos is the next opening of the port, takes them back.
        #[arg(long)]
        no_save: bool,
        /// What is done anyway; scripts may still say so.
        #[arg(long, hide = true, conflicts_with = "no_save")]
        save: bool,
        /// Print which were set as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
    /// Say which of a file's settings the machine has otherwise; the status is 1 where there is one.
    #[command(after_help = "Example: weeder settings diff machine.toml && echo the same")]
    Diff {
        /// The file; - for standard input.
        #[arg(value_name = "FILE.toml", value_parser = source::file)]
        file: PathBuf,
        /// Print the differences as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
}

/// Where the Uno is.
#[derive(Args)]
pub struct Port {
    /// The Uno's serial port, such as /dev/ttyACM0 or COM3; found by itself where there is only one Uno.
    #[arg(long)]
    pub port: Option<String>,
}

impl Port {
    /// The machine there.
    ///
    /// # Errors
    /// Where there is none, or another than a weeder.
    pub fn open(&self) -> Result<Link> {
        Ok(Link::open(self.port.as_deref())?)
    }
}

/// Pulls, pushes or compares.
///
/// # Errors
/// Where file or machine cannot be used; each says what would be right.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    match &arguments.action {
        Action::Pull { file, json, port } => {
            let file = file.as_ref().map(FileName::check).transpose()?;
            let settings = settings::read(&mut port.open()?)?;
            let printed = if *json { say!("{:#}", as_json(&settings)) } else { Ok(()) };
            if let Some(file) = file {
                settings_file::write(file.path(), &settings)?;
                if !json {
                    say!("The machine's settings are in {}", file.path().display())?;
                }
            }
            printed?;
            Ok(Finding::Good)
        }
        Action::Push { file, no_save, save: _, json, port } => {
            let (wanted, save) = (wanted(file)?, !no_save);
            let changed = settings::push(&mut port.open()?, &wanted, save)?;
            let changed: Vec<String> = changed.into_iter().map(name).collect();
            if *json {
                say!("{:#}", json!({ "set": changed, "saved": save }))?;
                return Ok(Finding::Good);
            }
            match changed.as_slice() {
                [] => say!("The machine has these settings already")?,
                changed => say!("Set: {}", changed.join(", "))?,
            }
            match save {
                true => say!("All settings are saved")?,
                false => say!("Not saved: the next reset takes them back, and on most Unos opening the port is one")?,
            }
            Ok(Finding::Good)
        }
        Action::Diff { file, json, port } => {
            let wanted = wanted(file)?;
            let found = settings::read(&mut port.open()?)?;
            let differences = differences(&wanted, &found);
            if *json {
                let rows = differences.iter().map(|&(setting, file, machine)| {
                    json!({ "setting": name(setting), "file": value(setting, file), "machine": value(setting, machine) })
                });
                say!("{:#}", Value::from_iter(rows))?;
            } else if differences.is_empty() {
                say!("The machine has the settings of {}", file.display())?;
            } else {
                say!("{}", table(&differences))?;
            }
            Ok(if differences.is_empty() { Finding::Good } else { Finding::Bad })
        }
    }
}

/// A file's settings, at least one.
fn wanted(file: &Path) -> Result<Vec<(Setting, u16)>> {
    let wanted = settings_file::read(file)?;
    ensure!(!wanted.is_empty(), "{} names no setting: `weeder settings pull` writes them all", file.display());
    Ok(wanted)
}

/// Settings that the machine has otherwise than the file: with the file's value and the machine's.
fn differences(wanted: &[(Setting, u16)], found: &Settings) -> Vec<(Setting, u16, u16)> {
    let with_found = wanted.iter().map(|&(setting, value)| (setting, value, found.get(setting)));
    with_found.filter(|(_, file, machine)| file != machine).collect()
}

fn table(differences: &[(Setting, u16, u16)]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(["setting", "file", "machine", "unit"]);
    for &(setting, file, machine) in differences {
        let [file, machine] = [file, machine].map(|number| value(setting, number).to_string());
        table.add_row([name(setting), file, machine, unit(setting)]);
    }
    table
}

fn as_json(settings: &Settings) -> Value {
    Value::Object(Map::from_iter(Setting::all().map(|setting| (name(setting), value(setting, settings.get(setting))))))
}

/// A setting's value in JSON, as in the file.
fn value(setting: Setting, number: u16) -> Value {
    settings_file::is_true(setting, number).map_or_else(|| Value::from(number), Value::from)
}
