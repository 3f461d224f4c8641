//! `weeder evaluate`: judges a field trial by what was counted and measured in its plots.

use anyhow::{Context, Result};
use clap::Args;
use field::evaluation::{self, Analysis, ResponseAnalysis};
use serde_json::{Value, json};
use std::path::PathBuf;

/// What the user asks of a trial.
#[derive(Args)]
#[command(after_help = "Example: weeder evaluate trial.csv\n\n\
    A line a plot: the weeds that were counted before and after weeding, the plants and how many of them were damaged,\n\
    the area and the time that it took, the machine's working width and power.")]
pub struct Arguments {
    /// CSV file with the columns
    /// replication,speed_km_h,spacing_cm,weeds_before,weeds_after,plants,damaged,area_m2,time_s,width_m,power_hp.
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Print JSON for programs instead of tables.
    #[arg(long)]
    json: bool,
}

/// Reads, judges and prints.
///
/// # Errors
/// Where the table cannot be read, or has a plot that cannot be.
pub fn run(arguments: &Arguments) -> Result<()> {
    let records = evaluation::read_csv(&arguments.file)?;
    let analysis = Analysis::of(records).with_context(|| arguments.file.display().to_string())?;
    if arguments.json {
        println!("{:#}", in_json(&analysis));
    } else {
        print!("{analysis}");
    }
    Ok(())
}

/// The whole analysis; where there is no model, `no_model` says why.
fn in_json(analysis: &Analysis) -> Value {
    let plots = analysis.records.iter().zip(&analysis.performances);
    let plots: Vec<Value> = plots.map(|(record, result)| json!({ "record": record, "performance": result })).collect();
    let responses: Vec<Value> = analysis.responses.iter().map(response_in_json).collect();
    json!({
        "findings": analysis.findings(),
        "plots": plots,
        "treatments": analysis.treatments(),
        "responses": responses,
    })
}

fn response_in_json(analysis: &ResponseAnalysis) -> Value {
    let ResponseAnalysis { response, range, model, variance, published } = analysis;
    json!({
        "response": response,
        "unit": response.unit(),
        "range": range,
        "model": model.as_ref().ok(),
        "no_model": model.as_ref().err().map(ToString::to_string),
        "variance": variance.as_ref().ok(),
        "no_variance": variance.as_ref().err().map(ToString::to_string),
        "published": published,
    })
}
