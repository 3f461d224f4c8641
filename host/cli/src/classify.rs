//! `weeder classify`: classifies recorded detections as the firmware does.
//!
//! The built-in examples, the scale, the radius and the code of the search are the firmware's.

use anyhow::Result;
use clap::Args;
use field::row::Kind;
use frame::{Finding, Results, source, whole_within};
use serde_json::{Value, json};
use std::path::PathBuf;
use study::training::table::{self, Recorded};
use study::training::{Confusion, MAX_K, Model, class_of, label_of};

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder classify field.csv          the output of `dump`, labelled or not
  weeder classify field.csv --k 5    with five votes
  weeder classify field.csv --json | jq '.[] | select(.answer == \"unknown\")'
The status is 1 if a plant would be classified as a weed.")]
pub struct Arguments {
    /// CSV file with the columns speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm, and label if known; - for
    /// standard input.
    #[arg(value_name = "FILE.csv", value_parser = source::file())]
    file: PathBuf,
    #[arg(
        long,
        value_name = "N",
        value_parser = whole_within(1..=MAX_K),
        help = format!("Examples that vote, 1 to {MAX_K}; left out, the k of the table's training")
    )]
    k: Option<u8>,
    /// Print a JSON object for each detection instead of the table.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let objects = table::read(&arguments.file)?;
    let mut model = Model::built_in();
    model.k = arguments.k.unwrap_or(model.k);
    let labelled = objects.iter().filter_map(|object| Some((object.kind?, model.class(&object.features))));
    let confusion: Confusion = labelled.collect();
    if arguments.json {
        writeln!(Results, "{:#}", as_json(&model, &objects)?)?;
    } else {
        writeln!(Results, "{}", model.table(&objects)?)?;
        if confusion.total() > 0 {
            writeln!(Results, "\n{confusion}")?;
        }
    }
    Ok(Finding::of(confusion.plants_taken_for_weeds() == 0))
}

fn as_json(model: &Model, objects: &[Recorded]) -> Result<Value> {
    let row = |(number, object): (usize, &Recorded)| {
        let answer = model.answer(&object.features)?;
        let votes = |kind| answer.votes[usize::from(label_of(kind))];
        Ok(json!({
            "detection": number,
            "answer": format!("{:?}", class_of(&answer)).to_lowercase(),
            "votes_plant": votes(Kind::Plant),
            "votes_weed": votes(Kind::Weed),
            "nearest_squared": answer.nearest,
            "label": object.kind.map(|kind| kind.to_string()),
        }))
    };
    (1..).zip(objects).map(row).collect()
}
