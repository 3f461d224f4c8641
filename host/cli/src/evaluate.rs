//! `weeder evaluate`: evaluates a field trial from the counts and measurements of its plots.

use anyhow::{Context, Result};
use clap::Args;
use field::counted;
use frame::{Messages, OutFolder, OutName, Replace, Results, command_line, number_within, source, whole_within};
use link::settings::shown;
use logbook::follower;
use logbook::log::{Entry, Kind};
use logbook::worked::worked;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use study::evaluation::field_log::{self, OfLog};
use study::evaluation::{self, Analysis, PlotRecord, ResponseAnalysis};
use study::page::Page;

const REPORT: &str = "report.html";

#[derive(Args)]
#[command(after_help = "Examples:\n  \
    weeder evaluate trial.csv                   the results, and what they depend on\n  \
    weeder evaluate trial.csv --out report      also write report/report.html, with plots\n  \
    weeder evaluate trial.csv --speeds 1,1.5,2,2.5   the table has measured speeds\n  \
    weeder evaluate trial.csv --log row.csv     speed, time, plants and area come from the machine's log\n  \
    weeder evaluate trial.csv --json | jq '.responses[0].model.terms'")]
pub struct Arguments {
    /// CSV file with a line for each plot: replication, speed_km_h, spacing_cm, weeds_before, weeds_after, plants, damaged,
    /// area_m2, time_s, width_m, power_hp; - for standard input.
    #[arg(value_name = "FILE.csv", value_parser = source::file())]
    file: PathBuf,
    /// Nominal speeds in km/h, 0.1 to 15, where the table has measured ones: means and analysis of variance take the nearest.
    #[arg(long, value_delimiter = ',', value_parser = number_within(0.1..=15.0))]
    speeds: Vec<f64>,
    /// Log of `weeder monitor --log` or `weeder record`: each stretch of work is a plot, in the order of the plots'
    /// numbers. It gives each plot its speed, and fills the empty cells of time, plants and area.
    #[arg(long, value_name = "FILE.csv", value_parser = source::file(), conflicts_with = "speeds")]
    log: Option<PathBuf>,
    /// The plot of each stretch of work in the log, 0 to 100000, 0 for none.
    #[arg(long, value_delimiter = ',', requires = "log", value_parser = whole_within(0..=100_000_u32))]
    plots: Vec<u32>,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
    /// Write report.html into this folder, and create it if needed.
    #[arg(long, value_name = "FOLDER")]
    out: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let folder = arguments.out.as_ref().map(|out| out.folder([REPORT], arguments.replace)).transpose()?;
    let mut records = evaluation::read_csv(&arguments.file)?;
    let (analysis, joined) = match &arguments.log {
        Some(log) => {
            let levels_km_h = records.iter().map(|record| record.speed_km_h).collect();
            let log = logbook::log::read(log)?;
            // The firmware of another version may allow what is out of range here.
            let is_foreign = |entry: &&Entry| {
                entry.kind == Kind::Setting && shown(&entry.text).is_some_and(|(setting, value)| !setting.allows(value))
            };
            if let Some(Entry { number, text, .. }) = log.iter().find(is_foreign) {
                writeln!(
                    Messages,
                    "Warning: line {number} of the log has `{text}`, which this version does not allow: it counts as unknown"
                );
            }
            let unread = follower::unread(&log);
            if unread > 0 {
                let lines = counted(unread, "line");
                writeln!(Messages, "Warning: {lines} of the log left out: damaged, or of another firmware");
            }
            let stretches = worked(&log);
            let joined = field_log::join(&mut records, &stretches, &arguments.plots)?;
            let warnings = joined.iter().flat_map(|of_log| [of_log.warning(), of_log.too_few_plants()]);
            warnings.flatten().for_each(|warning| writeln!(Messages, "{warning}"));
            (Analysis::at_levels(records, levels_km_h), Some(joined))
        }
        None => (Analysis::at_speeds(records, &arguments.speeds), None),
    };
    let analysis = analysis.with_context(|| arguments.file.display().to_string())?;
    let printed = match (arguments.json, &joined) {
        (true, joined) => {
            let mut json = in_json(&analysis);
            json["log"] = json!(joined);
            writeln!(Results, "{json:#}")
        }
        (false, Some(joined)) => write!(Results, "{}\n\n{analysis}", field_log::of_log_table(joined)),
        (false, None) => write!(Results, "{analysis}"),
    };
    if let Some(folder) = &folder {
        write_report(&analysis, joined.as_deref(), arguments, folder)?;
        if !arguments.json {
            writeln!(Results, "\nReport      {}", folder.path().join(REPORT).display())?;
        }
    }
    printed
}

fn write_report(
    analysis: &Analysis,
    joined: Option<&[OfLog]>,
    arguments: &Arguments,
    folder: &OutFolder,
) -> Result<()> {
    let name_of = |file: &Path| file.file_name().unwrap_or(file.as_os_str()).display().to_string();
    let name = name_of(&arguments.file);
    let mut parameters = vec![("plots from".to_owned(), name.clone())];
    parameters.extend(arguments.log.as_deref().map(|log| ("log from".to_owned(), name_of(log))));
    parameters.push(("weeder's version".to_owned(), env!("WEEDER_VERSION").to_owned()));
    let page = Page {
        title: &format!("Field trial: {name}"),
        summary: analysis.findings(),
        paper: analysis.against_the_paper(),
        command: &command_line()?,
        parameters: &parameters,
        analysis,
        log: joined.map(field_log::of_log_table),
        totals: &[],
        row: None,
    };
    let html = page.html()?;
    folder.write(REPORT, |to| Ok(to.write_all(html.as_bytes())?))
}

/// The whole analysis. Without a model, `no_model` says why.
fn in_json(analysis: &Analysis) -> Value {
    // The level joins a plot with its treatment: its own speed may be a measured one.
    let plot = |(record, level): (&PlotRecord, &f64)| json!({ "record": record, "speed_level_km_h": level, "performance": record.performance() });
    let plots: Vec<Value> = analysis.records.iter().zip(&analysis.levels_km_h).map(plot).collect();
    let responses: Vec<Value> = analysis.responses.iter().map(response_in_json).collect();
    json!({
        "findings": analysis.findings(),
        "plots": plots,
        "treatments": analysis.treatments(),
        "responses": responses,
    })
}

fn response_in_json(analysis: &ResponseAnalysis) -> Value {
    let ResponseAnalysis { response, numbers, range, model, checks, binomial, variance, published, .. } = analysis;
    let counts = binomial.as_ref();
    json!({
        "response": response,
        "unit": response.unit(),
        "plots": numbers,
        "range": range,
        "model": model.as_ref().ok(),
        "no_model": model.as_ref().err().map(ToString::to_string),
        "checks": checks,
        "binomial": counts.and_then(|model| model.as_ref().ok()),
        "no_binomial": counts.and_then(|model| model.as_ref().err()).map(ToString::to_string),
        "variance": variance.as_ref().ok(),
        "no_variance": variance.as_ref().err().map(ToString::to_string),
        "published": published,
    })
}
