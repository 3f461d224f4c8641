//! The plots of a trial as a CSV table, which a spreadsheet or a simulated trial may have written.
//!
//! The columns are the fields of [`PlotRecord`], in any order, with others among them that are not read; lines that begin
//! with `#` are comments. Every line is checked before anything follows from one.

use super::PlotRecord;
pub use crate::csv_table::TableError;
use crate::csv_table::{CsvTable, Line};
use std::io;
use std::path::Path;
use std::str::FromStr;

/// The columns, which carry their units.
pub const COLUMNS: [&str; 11] = [
    "replication",
    "speed_km_h",
    "spacing_cm",
    "weeds_before",
    "weeds_after",
    "plants",
    "damaged",
    "area_m2",
    "time_s",
    "width_m",
    "power_hp",
];

/// Reads the plots of a trial.
///
/// # Errors
/// Names the file, the line and the column, and what would be right: a missing column, text in a number, a value out of
/// its range, more weeds after than before, more damaged plants than plants, or a replication of a speed and spacing that stood there before.
pub fn read_csv(path: &Path) -> Result<Vec<PlotRecord>, TableError> {
    let table = CsvTable::read(path, &COLUMNS)?;
    let mut plots: Vec<(u64, PlotRecord)> = Vec::new();
    for line in table.lines() {
        let plot = record(line)?;
        let same = |other: &PlotRecord| {
            (other.replication, other.speed_km_h, other.spacing_cm)
                == (plot.replication, plot.speed_km_h, plot.spacing_cm)
        };
        if let Some((first, _)) = plots.iter().find(|(_, other)| same(other)) {
            return Err(line.error(format!(
                "replication {} of {} km/h and {} cm stands in line {first} already: each plot has a replication of its own",
                plot.replication, plot.speed_km_h, plot.spacing_cm
            )));
        }
        plots.push((line.number(), plot));
    }
    Ok(plots.into_iter().map(|(_, plot)| plot).collect())
}

/// One line of the table.
fn record(line: Line) -> Result<PlotRecord, TableError> {
    let plot = PlotRecord {
        replication: count(line, "replication")?,
        speed_km_h: number(line, "speed_km_h")?,
        spacing_cm: number(line, "spacing_cm")?,
        weeds_before: count(line, "weeds_before")?,
        weeds_after: count(line, "weeds_after")?,
        plants: count(line, "plants")?,
        damaged: count(line, "damaged")?,
        area_m2: number(line, "area_m2")?,
        time_s: number(line, "time_s")?,
        width_m: number(line, "width_m")?,
        power_hp: number(line, "power_hp")?,
    };
    plot.check().map_err(|problem| line.error(problem.to_string()))?;
    Ok(plot)
}

fn count(line: Line, column: &str) -> Result<u32, TableError> {
    line.value(column, "a whole number, 0 or more")
}

fn number(line: Line, column: &str) -> Result<f64, TableError> {
    let Number(value) = line.value(column, "a number, like 1.5")?;
    Ok(value)
}

/// A number as people write it: neither `inf` nor `nan`.
struct Number(f64);

impl FromStr for Number {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        text.parse().ok().filter(|value: &f64| value.is_finite()).map(Self).ok_or(())
    }
}

/// Writes the plots as a table that [`read_csv`] reads.
///
/// # Errors
/// Those of the writer.
pub fn write_csv(records: &[PlotRecord], to: impl io::Write) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    for record in records {
        writer.serialize(record)?;
    }
    writer.flush()?;
    Ok(())
}
