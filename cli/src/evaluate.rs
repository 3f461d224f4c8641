//! `weeder evaluate`: judges a field trial by what was counted and measured in its plots.

use crate::output;
use anyhow::{Context, Result};
use clap::Args;
use field::evaluation::{self, Analysis, ResponseAnalysis};
use field::page::Page;
use field::whole_file;
use serde_json::{Value, json};
use std::fs;
use std::path::{Path, PathBuf};

/// The report's name in its folder.
const REPORT: &str = "report.html";

/// What the user asks of a trial.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder evaluate trial.csv                   say how the machine did, and what that depends on\n  \
    weeder evaluate trial.csv --out report      write report/report.html with plots as well\n  \
    weeder evaluate trial.csv --json | jq .responses[0].model.terms")]
pub struct Arguments {
    /// CSV file, a line a plot, with the columns
    /// replication,speed_km_h,spacing_cm,weeds_before,weeds_after,plants,damaged,area_m2,time_s,width_m,power_hp.
    #[arg(value_name = "FILE.csv")]
    file: PathBuf,
    /// Print JSON for programs instead of tables.
    #[arg(long)]
    json: bool,
    /// Write report.html into this folder, which is made where there is none.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Reads, judges and prints.
///
/// # Errors
/// Where the table cannot be read or has a plot that cannot be, or the report cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let records = evaluation::read_csv(&arguments.file)?;
    let analysis = Analysis::of(records).with_context(|| arguments.file.display().to_string())?;
    let written =
        arguments.out.as_deref().map(|folder| write_report(&analysis, &arguments.file, folder)).transpose()?;
    if arguments.json {
        return output::print(&format!("{:#}\n", in_json(&analysis)));
    }
    let written = written.map(|path| format!("\nReport      {}\n", path.display()));
    output::print(&format!("{analysis}{}", written.unwrap_or_default()))
}

/// Writes the report, and returns where it is.
fn write_report(analysis: &Analysis, file: &Path, folder: &Path) -> Result<PathBuf> {
    let name = file.file_name().unwrap_or(file.as_os_str()).display();
    let page = Page {
        title: &format!("Field trial: {name}"),
        summary: analysis.findings(),
        command: &output::command_line()?,
        parameters: &[
            ("plots from".to_owned(), name.to_string()),
            ("weeder's version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ],
        analysis,
        comparison: None,
        row: None,
    };
    let html = page.html()?;
    fs::create_dir_all(folder).with_context(|| format!("{} cannot be made", folder.display()))?;
    let path = folder.join(REPORT);
    whole_file::write(&path, |to| to.write_all(html.as_bytes()))
        .with_context(|| format!("{} cannot be written", path.display()))?;
    Ok(path)
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
