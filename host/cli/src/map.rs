//! `weeder map`: shows logs with a satellite receiver on a map, and summarises them.

use crate::receiver::AntennaArguments;
use anyhow::{Result, bail};
use clap::Args;
use comfy_table::{Table, presets};
use field::counted;
use files::in_a_line;
use frame::{Messages, OutName, Replace, Results, number_within, source};
use gps::summary::{Stand, Summary};
use gps::wheel::Ratio;
use gps::{Job, Wanted, map, picture};
use logbook::log::{self, Entry, Kind};
use serde_json::json;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::io::Write;
use std::path::{Path, PathBuf};

#[derive(Args)]
#[command(after_help = "\
It writes GeoJSON (WGS84) for QGIS: a point for each plant, weed, swing, alarm and label.\n\
Lines are the ground weeded and not weeded. docs/map.md has the expected error.\n\
Antenna options replace those of the record.\n\n\
Examples:
  weeder map field.csv -o field.geojson --svg field.svg
  weeder map monday.csv tuesday.csv -o field.geojson --row-spacing 750 --table field-table.csv
  weeder map field.csv -o field.geojson --beam-ahead 610 --gps-delay 120    a better measurement")]
pub struct Arguments {
    /// Records, as `weeder record --gps` writes them; - for standard input.
    #[arg(value_name = "LOG.csv", required = true, value_parser = source::file())]
    logs: Vec<PathBuf>,
    /// The map.
    #[arg(long, short, value_name = "FILE.geojson")]
    out: OutName,
    /// Also draw it.
    #[arg(long, value_name = "FILE.svg")]
    svg: Option<OutName>,
    /// Write the counts as a table, with a line for each record.
    #[arg(long, value_name = "FILE.csv")]
    table: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Row spacing in mm, 50 to 5000, for the area.
    #[arg(long, value_name = "MM", default_value = "600", value_parser = number_within(50.0..=5000.0))]
    row_spacing: f64,
    /// Plant spacing in mm, 20 to 5000, to count missing plants. Default: the median.
    #[arg(long, value_name = "MM", value_parser = number_within(20.0..=5000.0))]
    spacing: Option<f64>,
    /// Longest distance without a fix for interpolated positions, in m, 0 to 1000.
    #[arg(long, value_name = "M", default_value = "20", value_parser = number_within(0.0..=1000.0))]
    longest_outage: f64,
    #[command(flatten)]
    antenna: AntennaArguments,
    /// Print the counts as JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let replace = arguments.replace;
    let out = arguments.out.file(replace)?;
    let svg = arguments.svg.as_ref().map(|svg| svg.file(replace)).transpose()?;
    let table = arguments.table.as_ref().map(|table| table.file(replace)).transpose()?;
    let stand = Stand { row_spacing_mm: arguments.row_spacing, spacing_mm: arguments.spacing };
    let over = |antenna| arguments.antenna.over(antenna);
    let wanted = Wanted { antenna: &over, longest_outage_m: arguments.longest_outage };
    let (mut jobs, mut has_receiver, mut contents) = (Vec::new(), false, HashMap::new());
    for path in &arguments.logs {
        let log = log::read(path)?;
        let is_work = log.iter().any(|entry| entry.kind == Kind::Status);
        if let Some(other) = contents.insert(hash(&log), path).filter(|_| is_work) {
            bail!("{} and {} have the same lines: name each record once", other.display(), path.display());
        }
        has_receiver |= log.iter().any(|entry| matches!(entry.kind, Kind::GpsFound | Kind::Gps | Kind::GpsDamaged));
        let (name, job) = (name(path, &arguments.logs), Job::read(&log, &wanted));
        if job.without_wheel > 0 {
            writeln!(
                Messages,
                "{name}: the wheel of {} is unknown, and nothing is counted there: the log lacks the settings, or has one that this version does not allow",
                counted(job.without_wheel as usize, "status line")
            );
        }
        if job.left_out > 0 {
            writeln!(
                Messages,
                "{name}: {} left out: damaged, of another firmware, or with a position far from those around",
                counted(job.left_out as usize, "line")
            );
        }
        jobs.push((name, job));
    }
    let counted: Vec<(&str, Summary)> =
        jobs.iter().map(|(name, job)| (name.as_str(), Summary::of(job, &stand))).collect();
    let printed = match arguments.json {
        true => {
            let records = counted.iter().map(|(record, summary)| json!({ "record": record, "count": summary }));
            writeln!(Results, "{:#}", serde_json::Value::from_iter(records))
        }
        false => writeln!(Results, "{}", shown(&counted)),
    };
    let named: Vec<(&str, &Job)> = jobs.iter().map(|(name, job)| (name.as_str(), job)).collect();
    out.write(|to| Ok(writeln!(to, "{}", map::features(&named))?))?;
    if let Some(svg) = &svg {
        let jobs: Vec<&Job> = jobs.iter().map(|(_, job)| job).collect();
        match picture::draw(&jobs, &picture::Words::default()) {
            Some(drawn) => svg.write(|to| Ok(svg::write(to, &drawn)?))?,
            None => writeln!(Messages, "{} is not drawn: no event in the records has a position", svg.path().display()),
        }
    }
    if let Some(table) = &table {
        table.write(|to| write_csv(&counted, to))?;
    }
    if counted.iter().all(|(_, summary)| summary.fixes == 0) {
        let advice = if has_receiver {
            "see the lines `gps_mark` and `gps_damaged` of the receiver"
        } else {
            "`weeder record --gps PORT` records a receiver"
        };
        writeln!(Messages, "The records have no fix, so no event has a position: {advice}");
    }
    for (record, summary) in &counted {
        for problem in problems(summary) {
            writeln!(Messages, "{record}: {problem}");
        }
    }
    printed
}

/// A number for the content of a record.
fn hash(log: &[Entry]) -> u64 {
    let mut hasher = DefaultHasher::new();
    log.hash(&mut hasher);
    hasher.finish()
}

/// What is wrong with a record, and what would be right.
fn problems(summary: &Summary) -> Vec<String> {
    let mut problems = Vec::new();
    if let (Some(value), Some(error)) = (summary.wheel_ratio, summary.wheel_ratio_error)
        && (Ratio { value, error }).is_wrong()
    {
        problems.push(format!(
            "for each metre of the wheel the receiver has {value:.3} ± {error:.3} m: calibrate the wheel (docs/set-up.md), unless it slips"
        ));
    }
    if summary.wheel_spun_m > 0.0 {
        problems.push(format!(
            "the wheel rolled {:.1} m on the spot, which ground and area contain: see `wheel_spun` on the map, and press the wheel to the ground",
            summary.wheel_spun_m
        ));
    }
    if summary.restarts > 0 {
        problems.push(format!(
            "the machine restarted at work, {} times: see `restart` on the map, it has not weeded from there",
            summary.restarts
        ));
    }
    problems
}

/// A log's name on the map: its file's name, or its path if another of the logs has that name.
fn name(path: &Path, logs: &[PathBuf]) -> String {
    let is_only = logs.iter().filter(|log| log.file_name() == path.file_name()).count() == 1;
    let name = path.file_name().filter(|_| is_only);
    name.map_or_else(|| path.display().to_string(), |name| name.to_string_lossy().into_owned())
}

fn rows(summary: &Summary) -> [(&'static str, String); 22] {
    let mm = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.0}"));
    [
        ("plants, those unknown among them", summary.plants.to_string()),
        ("  of them unknown", summary.unknown.to_string()),
        ("  distance between them, mm", mm(summary.spacing_mean_mm)),
        ("  its scatter (standard deviation), mm", mm(summary.spacing_scatter_mm)),
        ("  missing", summary.missing.to_string()),
        ("tall weeds", summary.weeds.to_string()),
        ("swings out of the row", summary.swings.to_string()),
        ("alarms", summary.alarms.to_string()),
        ("restarts at work", summary.restarts.to_string()),
        ("ground of the row worked, m", format!("{:.1}", summary.worked_m)),
        ("  weeded, m", format!("{:.1}", summary.weeded_m)),
        ("  weeded, %", summary.weeded_percent.map_or("unknown".to_owned(), |share| format!("{share:.1}"))),
        ("area, ha", format!("{:.4}", summary.area_ha)),
        ("hours at work, of those recorded", format!("{:.2} of {:.2}", summary.work_h, summary.record_h)),
        ("places measured", summary.measured.to_string()),
        ("  interpolated over an outage", summary.interpolated.to_string()),
        ("  without a place", summary.without_place.to_string()),
        ("fixes", summary.fixes.to_string()),
        ("  that had jumped", summary.jumps.to_string()),
        (
            "receiver's metres for a metre of the wheel",
            match (summary.wheel_ratio, summary.wheel_ratio_error) {
                (Some(ratio), Some(error)) => format!("{ratio:.3} ± {error:.3}"),
                _ => "unknown".to_owned(),
            },
        ),
        ("  wheel spun, m; gaps of its statuses", format!("{:.1}; {}", summary.wheel_spun_m, summary.wheel_gaps)),
        (
            "fix lost, receiver lost, damaged lines",
            format!("{}, {}, {}", summary.fix_losses, summary.receiver_losses, summary.damaged_lines),
        ),
    ]
}

fn shown(counted: &[(&str, Summary)]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY);
    table.set_header([String::new()].into_iter().chain(counted.iter().map(|(name, _)| in_a_line(name))));
    let columns: Vec<_> = counted.iter().map(|(_, summary)| rows(summary)).collect();
    let Some(first) = columns.first() else { return table };
    for (row, (title, _)) in first.iter().enumerate() {
        let cells = columns.iter().map(|column| column[row].1.clone());
        table.add_row([(*title).to_owned()].into_iter().chain(cells));
    }
    table
}

/// A line a record, with the names of the JSON.
fn write_csv(counted: &[(&str, Summary)], to: &mut dyn Write) -> Result<()> {
    #[derive(serde::Serialize)]
    struct Line<'a> {
        record: &'a str,
    }
    let mut csv = csv::Writer::from_writer(to);
    for (record, summary) in counted {
        csv.serialize((Line { record }, summary))?;
    }
    Ok(csv.flush()?)
}
