//! `weeder classify`: what the firmware's classifier says of recorded objects.
//!
//! The built-in examples, the scale and the radius are those of the firmware, and so is the code that searches them.

use crate::Finding;
use anyhow::Result;
use clap::Args;
use field::training::{Confusion, Model, table};
use std::path::PathBuf;

/// What the user asks to be classified.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder classify field.csv          what `dump` has printed, labelled or not
  weeder classify field.csv --k 5    with five votes
The status is 1 where a plant would be taken for a weed.")]
pub struct Arguments {
    /// A CSV file with the columns speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm and, if known, label.
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Examples that vote; as the firmware starts with where none are given.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=i64::from(field::training::MAX_K)))]
    k: Option<u8>,
}

/// Classifies, and prints a line an object and, where there are labels, who was taken for whom.
///
/// # Errors
/// Where the file or its contents are wrong.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let objects = table::read(&arguments.file)?;
    let mut model = Model::built_in();
    model.k = arguments.k.unwrap_or(model.k);
    println!("{}", model.table(&objects)?);

    let labelled = objects.iter().filter_map(|object| Some((object.kind?, model.class(&object.features))));
    let confusion: Confusion = labelled.collect();
    if confusion.total() > 0 {
        println!("\n{confusion}");
    }
    if confusion.plants_taken_for_weeds() == 0 { Ok(Finding::Good) } else { Ok(Finding::Bad) }
}
