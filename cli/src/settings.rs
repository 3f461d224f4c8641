//! `weeder settings`: the machine's settings as a file that can be kept, compared, and given to the next machine.

use crate::Finding;
use anyhow::{Result, ensure};
use clap::{Args, Subcommand};
use comfy_table::{Table, presets};
use field::link::settings::{self, Setting, Settings, name, unit};
use field::link::{Link, settings_file};
use serde_json::{Map, Value, json};
use std::path::PathBuf;

/// What the user asks of the settings.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder settings pull machine.toml           write the machine's settings into a file\n  \
    weeder settings push machine.toml --save    set them on a machine, and keep them there\n  \
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
        file: Option<PathBuf>,
        /// Print them as JSON as well.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
    /// Set a file's settings on the machine; nothing is sent unless all of them can be right.
    #[command(after_help = "Example: weeder settings push machine.toml --save --port /dev/ttyACM0")]
    Push {
        /// The file.
        #[arg(value_name = "FILE.toml")]
        file: PathBuf,
        /// Have the machine keep all its settings for good.
        #[arg(long)]
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
        /// The file.
        #[arg(value_name = "FILE.toml")]
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
    fn open(&self) -> Result<Link> {
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
            let settings = settings::read(&mut port.open()?)?;
            if let Some(file) = file {
                settings_file::write(file, &settings)?;
                if !json {
                    println!("The machine's settings are in {}", file.display());
                }
            }
            if *json {
                println!("{:#}", as_json(&settings));
            }
            Ok(Finding::Good)
        }
        Action::Push { file, save, json, port } => {
            let wanted = settings_file::read(file)?;
            ensure!(!wanted.is_empty(), "{} names no setting: `weeder settings pull` writes them all", file.display());
            let changed = settings::push(&mut port.open()?, &wanted, *save)?;
            let changed: Vec<String> = changed.into_iter().map(name).collect();
            if *json {
                println!("{:#}", json!({ "set": changed, "saved": save }));
                return Ok(Finding::Good);
            }
            match changed.as_slice() {
                [] => println!("The machine has these settings already"),
                changed => println!("Set: {}", changed.join(", ")),
            }
            println!(
                "{}",
                if *save { "All settings are saved" } else { "--save would have kept them over a loss of power" }
            );
            Ok(Finding::Good)
        }
        Action::Diff { file, json, port } => {
            let wanted = settings_file::read(file)?;
            let found = settings::read(&mut port.open()?)?;
            let differences = differences(&wanted, &found);
            if *json {
                let rows = differences.iter().map(|&(setting, file, machine)| {
                    json!({ "setting": name(setting), "file": value(setting, file), "machine": value(setting, machine) })
                });
                println!("{:#}", Value::from_iter(rows));
            } else if differences.is_empty() {
                println!("The machine has the settings of {}", file.display());
            } else {
                println!("{}", table(&differences));
            }
            Ok(if differences.is_empty() { Finding::Good } else { Finding::Bad })
        }
    }
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
