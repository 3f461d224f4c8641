//! An experiment's plots as a CSV table.

use super::{PlotOutcome, Treatment};
use crate::evaluation::PlotRecord;
use field::budget::Part;
use serde::Serialize;
use std::io;

/// A line of [`write_csv`]: a [`PlotRecord`], and values that only a simulated field has.
#[derive(Serialize)]
struct Line {
    controller: &'static str,
    replication: u32,
    speed_km_h: f64,
    spacing_cm: f64,
    weeds_before: u32,
    weeds_after: u32,
    plants: u32,
    damaged: u32,
    area_m2: f64,
    time_s: f64,
    width_m: f64,
    power_hp: f64,
    zones: u32,
    zones_reached: u32,
    margins_cut: u32,
    in_row_weeds_before: u64,
    in_row_weeds_after: u64,
    in_row_weeded_percent: f64,
    in_row_bound_percent: f64,
    undamaged_bound_percent: f64,
    damaged_by_tool: u32,
    damaged_unseen: u32,
    damaged_by_sweeps: u32,
    damaged_in_next_row: u32,
    lost_to_plants_percent: f64,
    lost_to_margins_percent: f64,
    lost_to_weeds_percent: f64,
    lost_to_guarded_percent: f64,
    lost_to_swings_percent: f64,
    lost_to_closed_percent: f64,
    alarms: u32,
}

/// Writes the results of some controllers as CSV, one line a plot. [`crate::evaluation::read_csv`] can read a table of
/// one controller.
///
/// # Errors
/// The errors of the writer.
pub fn write_csv(outcomes: &[PlotOutcome], controllers: &[Treatment], to: impl io::Write) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    for outcome in outcomes.iter().filter(|outcome| controllers.contains(&outcome.controller)) {
        let PlotRecord { replication, speed_km_h, spacing_cm, weeds_before, weeds_after, plants, damaged, .. } =
            outcome.record;
        let PlotRecord { area_m2, time_s, width_m, power_hp, .. } = outcome.record;
        let lost = |part| thousandth(100.0 * outcome.budget[part]);
        writer.serialize(Line {
            controller: outcome.controller.title(),
            replication,
            speed_km_h,
            spacing_cm,
            weeds_before,
            weeds_after,
            plants,
            damaged,
            area_m2,
            time_s: thousandth(time_s),
            width_m,
            power_hp,
            zones: outcome.zones.all,
            zones_reached: outcome.zones.reached,
            margins_cut: outcome.zones.margins_cut,
            in_row_weeds_before: outcome.effect.in_row.before,
            in_row_weeds_after: outcome.effect.in_row.after,
            in_row_weeded_percent: thousandth(100.0 * outcome.weeded_share),
            in_row_bound_percent: thousandth(100.0 * outcome.weedable_share),
            undamaged_bound_percent: thousandth(100.0 * outcome.undamaged_share),
            damaged_by_tool: outcome.effect.damaged,
            damaged_unseen: outcome.effect.unseen,
            damaged_by_sweeps: outcome.effect.swept,
            damaged_in_next_row: outcome.effect.neighbours,
            lost_to_plants_percent: lost(Part::Plants),
            lost_to_margins_percent: lost(Part::Margins),
            lost_to_weeds_percent: lost(Part::Weeds),
            lost_to_guarded_percent: lost(Part::Guarded),
            lost_to_swings_percent: lost(Part::Swings),
            lost_to_closed_percent: lost(Part::Closed),
            alarms: outcome.alarms,
        })?;
    }
    writer.flush()?;
    Ok(())
}

/// Rounds to a thousandth: further digits are not significant.
fn thousandth(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}
