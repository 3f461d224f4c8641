//! An experiment's plots as a CSV table.

use super::{ControllerKind, PlotOutcome};
use crate::evaluation::PlotRecord;
use field::budget::Part;
use serde_json::Value;
use std::io;

/// A line of [`write_csv`]: a plot's record, figures and loss budget, each cell behind its column's name.
fn line(outcome: &PlotOutcome) -> Vec<(String, String)> {
    let [area_m2, time_s] = [outcome.record.area_m2, outcome.record.time_s].map(|value| value.map(thousandth));
    let record = PlotRecord { area_m2, time_s, ..outcome.record };
    let figure = |(name, figure): (&'static str, Value)| match figure.as_f64() {
        Some(number) if figure.is_f64() => (name, thousandth(number).to_string()),
        _ => (name, figure.to_string()),
    };
    let cells = [("controller", outcome.controller.title().to_owned())];
    let cells = cells.into_iter().chain(record.columns()).chain(outcome.figures().map(figure));
    let lost = [Part::Plants, Part::Margins, Part::Weeds, Part::Guarded, Part::Swings, Part::Closed]
        .map(|part| (format!("lost_to_{}_percent", part.key()), thousandth(100.0 * outcome.budget[part]).to_string()));
    let alarms = ("alarms".to_owned(), outcome.alarms.to_string());
    cells.map(|(name, cell)| (name.to_owned(), cell)).chain(lost).chain([alarms]).collect()
}

/// Writes the results of some controllers as CSV, one line a plot. [`crate::evaluation::read_csv`] can read a table of
/// one controller.
///
/// # Errors
/// The errors of the writer.
pub fn write_csv(
    outcomes: &[PlotOutcome],
    controllers: &[ControllerKind],
    to: impl io::Write,
) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    let lines = outcomes.iter().filter(|outcome| controllers.contains(&outcome.controller)).map(line);
    for (number, line) in lines.enumerate() {
        if number == 0 {
            writer.write_record(line.iter().map(|(name, _)| name))?;
        }
        writer.write_record(line.iter().map(|(_, cell)| cell))?;
    }
    writer.flush()?;
    Ok(())
}

/// Rounds to a thousandth: further digits are not significant.
fn thousandth(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
