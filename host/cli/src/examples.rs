//! `weeder examples`: the taught examples of a machine as a table, to save, to train from, and to teach to another
//! machine.

use crate::ports::Port;
use anyhow::{Result, bail, ensure};
use clap::{Args, Subcommand};
use comfy_table::{Table, presets};
use field::counted;
use field::row::Kind;
use frame::{Finding, Messages, OutFile, OutName, Replace, Results, source};
use link::examples::{self, OnMachine, Taught, contradiction, example_of, features_of};
use serde_json::{Map, Value, json};
use std::path::{Path, PathBuf};
use study::training::{Labelled, label_of, listing, table};

#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder examples pull chilli.csv             write the taught examples into a table
  weeder examples push chilli.csv             teach it to another machine
  weeder examples diff chilli.csv             list what only one of them has
  weeder train chilli.csv                     learn from it, see docs/training.md")]
pub struct Arguments {
    #[command(subcommand)]
    action: Action,
}

#[derive(Subcommand)]
enum Action {
    /// Write the machine's taught examples into a CSV file, for `weeder train` and `push`; the status is 1 if some are
    /// invalid.
    #[command(after_help = "Example: weeder examples pull chilli.csv --port /dev/ttyACM0")]
    Pull {
        /// The file.
        #[arg(value_name = "FILE.csv", required_unless_present = "json")]
        file: Option<OutName>,
        #[command(flatten)]
        replace: Replace,
        /// Also print them as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
    /// Teach the machine a table's examples; nothing is sent unless there is room for all of them.
    #[command(after_help = "\
An Uno has room for 32 examples beside its built-in table. It keeps them without power.\n\n\
Example: weeder examples push chilli.csv --replace")]
    Push {
        /// The table; - for standard input.
        #[arg(value_name = "FILE.csv", value_parser = source::file())]
        file: PathBuf,
        /// Make the machine forget examples that the table does not have.
        #[arg(long)]
        replace: bool,
        /// Teach even examples that the built-in table contradicts.
        #[arg(long)]
        force: bool,
        /// Print what was done as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
    /// List the examples that only the table or only the machine has; the status is 1 if there is one, or an invalid
    /// one.
    #[command(after_help = "Example: weeder examples diff chilli.csv")]
    Diff {
        /// The table; - for standard input.
        #[arg(value_name = "FILE.csv", value_parser = source::file())]
        file: PathBuf,
        /// Print the differences as JSON.
        #[arg(long)]
        json: bool,
        #[command(flatten)]
        port: Port,
    },
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    match &arguments.action {
        Action::Pull { file, replace, json, port } => {
            let file = file.as_ref().map(|file| file.file(*replace)).transpose()?;
            let OnMachine { taught, spoiled } = on_machine(port, file.as_ref().map(OutFile::path))?;
            let taught = examples_of(taught);
            let printed = if *json {
                writeln!(Results, "{:#}", Value::from_iter(taught.iter().filter_map(in_json)))
            } else {
                Ok(())
            };
            if let Some(file) = file {
                let objects: Vec<Labelled> = taught.iter().filter_map(object).collect();
                file.write(|to| Ok(listing::write_csv(&objects, to)?))?;
                if !json {
                    writeln!(
                        Results,
                        "The taught examples are in {}: {} examples",
                        file.path().display(),
                        taught.len()
                    )?;
                }
            }
            printed?;
            Ok(Finding::of(spoiled == 0))
        }
        Action::Push { file, replace, force, json, port } => {
            let wanted = in_table(file)?;
            if !force {
                refuse_contradictions(&wanted)?;
            }
            let pushed = examples::push(&mut port.open()?, &wanted, *replace)?;
            match *json {
                true => writeln!(Results, "{:#}", json!({ "taught": pushed.taught, "forgotten": pushed.forgotten }))?,
                false => {
                    writeln!(Results, "Taught: {}. Known already: {}.", pushed.taught, wanted.len() - pushed.taught)?;
                    if *replace {
                        writeln!(Results, "Forgotten: {}.", pushed.forgotten)?;
                    }
                }
            }
            Ok(Finding::Good)
        }
        Action::Diff { file, json, port } => {
            let (wanted, found) = (in_table(file)?, on_machine(port, None)?);
            let (in_file, surplus) = examples::compare(&wanted, &found.taught);
            let on_machine = examples_of(surplus);
            let is_same = in_file.is_empty() && on_machine.is_empty();
            match *json {
                true => {
                    let list = |examples: &[Taught]| Value::from_iter(examples.iter().filter_map(in_json));
                    writeln!(
                        Results,
                        "{:#}",
                        json!({ "only_in_file": list(&in_file), "only_on_machine": list(&on_machine) })
                    )?;
                }
                false if is_same => writeln!(Results, "The machine was taught the examples in {}", file.display())?,
                false => writeln!(Results, "{}", differences(&in_file, &on_machine))?,
            }
            Ok(Finding::of(is_same && found.spoiled == 0))
        }
    }
}

/// Reads the machine's taught examples, in the order of their numbers. Warns of invalid ones. Fails if a table would
/// lose them, because the others replace it.
fn on_machine(port: &Port, replaced: Option<&Path>) -> Result<OnMachine> {
    let found = examples::read(&mut port.open()?)?;
    if found.spoiled > 0 {
        let invalid = format!(
            "Another built-in table or a damaged memory made {} of the machine invalid: `forget all`, then push their file",
            counted(found.spoiled, "example")
        );
        if let Some(table) = replaced.filter(|path| path.metadata().is_ok_and(|there| there.len() > 0)) {
            bail!("{invalid}. {} is not replaced", table.display());
        }
        writeln!(Messages, "{invalid}");
    }
    Ok(found)
}

fn examples_of(numbered: Vec<(u16, Taught)>) -> Vec<Taught> {
    numbered.into_iter().map(|(_, example)| example).collect()
}

/// A table's examples. Equal ones stay, because each votes. Fails if it is no such table, or has lines and no label.
pub fn in_table(file: &Path) -> Result<Vec<Taught>> {
    let objects = table::read_or_empty(file)?;
    let labelled = objects.iter().filter_map(|object| Some(example_of(&object.features, label_of(object.kind?))));
    let examples: Vec<Taught> = labelled.collect();
    let unlabelled = objects.len() - examples.len();
    ensure!(
        !examples.is_empty() || objects.is_empty(),
        "{} has no labelled detection: fill in the column {}, plant or weed",
        file.display(),
        table::LABEL
    );
    if unlabelled > 0 {
        writeln!(Messages, "Passed over {unlabelled} without a label");
    }
    Ok(examples)
}

/// As the machine refuses a label that its built-in examples contradict.
fn refuse_contradictions(wanted: &[Taught]) -> Result<()> {
    let contradicting: Vec<_> =
        wanted.iter().filter(|example| contradiction(example).is_some()).filter_map(object).collect();
    let Some(Labelled { features, kind }) = contradicting.first() else { return Ok(()) };
    let [speed, spacing, .., hold, _] = features.values();
    bail!(
        "{} of {} examples have a label that the built-in ones contradict. The first: a {kind} at {speed} mm/s, \
         {spacing} mm behind the last plant, with a hold of {hold} mm. Look again; --force teaches them all the same. Nothing was sent",
        contradicting.len(),
        wanted.len(),
    )
}

/// An example in millimetres. `None` for bytes that no detection has: neither a machine nor a table has them.
fn object(example: &Taught) -> Option<Labelled> {
    let kind = if example.label == label_of(Kind::Plant) { Kind::Plant } else { Kind::Weed };
    features_of(example).map(|features| Labelled { features, kind })
}

fn differences(in_file: &[Taught], on_machine: &[Taught]) -> Table {
    let mut table = Table::new();
    let heading = ["only", table::LABEL].into_iter().chain(table::COLUMNS);
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(heading);
    for (place, examples) in [("in the file", in_file), ("on the machine", on_machine)] {
        for Labelled { features, kind } in examples.iter().filter_map(object) {
            let values = features.values().map(|value| value.to_string());
            table.add_row([place.to_owned(), kind.to_string()].into_iter().chain(values));
        }
    }
    table
}

fn in_json(example: &Taught) -> Option<Value> {
    let Labelled { features, kind } = object(example)?;
    let values =
        table::COLUMNS.iter().zip(features.values()).map(|(column, value)| ((*column).to_owned(), json!(value)));
    let label = (table::LABEL.to_owned(), json!(kind.to_string()));
    Some(Value::Object(Map::from_iter(values.chain([label]))))
}
