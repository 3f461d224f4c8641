//! An experiment's plots as a CSV table.

use super::{PlotOutcome, Treatment};
use crate::evaluation::PlotRecord;
use field::budget::Part;
use std::io;

/// A line of [`write_csv`]: a plot's record, and what only a simulated field can tell; each cell behind its column's
/// name.
fn line(outcome: &PlotOutcome) -> Vec<(&'static str, String)> {
    let PlotOutcome { record, zones, effect, .. } = outcome;
    let percent = |share: f64| thousandth(100.0 * share).to_string();
    let lost = |part| percent(outcome.budget[part]);
    let mut line = vec![("controller", outcome.controller.title().to_owned())];
    line.extend(PlotRecord { time_s: thousandth(record.time_s), ..*record }.columns());
    line.extend([
        ("zones", zones.all.to_string()),
        ("zones_reached", zones.reached.to_string()),
        ("margins_cut", zones.margins_cut.to_string()),
        ("in_row_weeds_before", effect.in_row.before.to_string()),
        ("in_row_weeds_after", effect.in_row.after.to_string()),
        ("in_row_weeded_percent", percent(outcome.weeded_share)),
        ("in_row_bound_percent", percent(outcome.weedable_share)),
        ("undamaged_bound_percent", percent(outcome.undamaged_share)),
        ("damaged_by_tool", effect.damaged.to_string()),
        ("damaged_unseen", effect.unseen.to_string()),
        ("damaged_by_sweeps", effect.swept.to_string()),
        ("damaged_in_next_row", effect.neighbours.to_string()),
        ("lost_to_plants_percent", lost(Part::Plants)),
        ("lost_to_margins_percent", lost(Part::Margins)),
        ("lost_to_weeds_percent", lost(Part::Weeds)),
        ("lost_to_guarded_percent", lost(Part::Guarded)),
        ("lost_to_swings_percent", lost(Part::Swings)),
        ("lost_to_closed_percent", lost(Part::Closed)),
        ("alarms", outcome.alarms.to_string()),
    ]);
    line
}

/// Writes the results of some controllers as CSV, one line a plot. [`crate::evaluation::read_csv`] can read a table of
/// one controller.
///
/// # Errors
/// The errors of the writer.
pub fn write_csv(outcomes: &[PlotOutcome], controllers: &[Treatment], to: impl io::Write) -> Result<(), csv::Error> {
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
