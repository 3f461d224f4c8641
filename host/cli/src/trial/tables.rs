//! The tables of a trial for a terminal: plants, ground and loss budget.

use self::Contents::{Brief, Ground, Plants};
use super::of;
use comfy_table::{CellAlignment, Table};
use field::budget;
use field::tool_path::WeedCount;
use study::experiment::{ControllerKind, Total};
use study::statistics::Share;
use study::table::{in_two_lines, optional};
use uno_run::report::number_table;

/// A column: its heading, its value for a total, and the tables that have it.
type Column = (&'static str, fn(&Total) -> String, &'static [Contents]);

/// The tables of a trial, each with a line for each speed and controller.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Contents {
    /// The most important columns, for `--brief`.
    Brief,
    Plants,
    Ground,
}

const COLUMNS: [Column; 13] = [
    ("km/h", |total| total.speed_km_h().to_string(), &[Brief, Plants, Ground]),
    ("controller", |total| name(total.plots.controller).to_owned(), &[Brief, Plants, Ground]),
    ("seen plants\ndamaged, %", |total| interval(total.damage_of_seen()), &[Brief, Plants]),
    ("unseen\nplants, %", |total| without_interval(&interval(total.damage_of_unseen())), &[Plants]),
    ("zones\nreached, %", |total| total.zones_reached().shown(), &[Brief, Plants]),
    ("margins\ncut, %", |total| total.margins_cut().shown(), &[Plants]),
    ("rows with\nan alarm", |total| total.plots.alarms.to_string(), &[Plants]),
    ("row ground\nweeded, %", weeded, &[Brief, Ground]),
    ("most\nlost to, %", most_lost, &[Brief, Ground]),
    ("with all\nmargins\nkept at\nmost, %", |total| format!("{:.1}", 100.0 * total.plots.weedable_share), &[Ground]),
    ("undamaged\nat most, %", |total| format!("{:.1}", 100.0 * total.plots.undamaged_share), &[Ground]),
    ("weeds\ngone in\nrow, %", |total| gone(total.plots.effect.in_row), &[Brief, Ground]),
    ("weeds\ngone in\nplot, %", |total| gone(total.plots.effect.in_plot), &[Ground]),
];

/// A share alone: the table has no room for a second interval, and `--json` has it.
fn without_interval(share: &str) -> String {
    share.split(" (").next().unwrap_or_default().to_owned()
}

/// A controller's title without its article, for a table.
fn name(controller: ControllerKind) -> &'static str {
    let title = controller.title();
    ["a ", "the "].iter().find_map(|article| title.strip_prefix(article)).unwrap_or(title)
}

/// A table of a trial, at most 110 characters wide.
pub(super) fn by_speed(totals: &[Total], contents: Contents) -> Table {
    let columns = || COLUMNS.iter().filter(|(_, _, tables)| tables.contains(&contents));
    let mut table = number_table(columns().map(|(heading, _, _)| heading), 0);
    for total in totals {
        table.add_row(columns().map(|(_, cell, _)| cell(total)));
    }
    table.column_iter_mut().skip(1).take(1).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    table
}

pub(super) const LOSS_BUDGET: &str = "Loss budget of the row's ground with this firmware, %";

/// The firmware's loss budget, a line a speed: each adds up to 100 %.
pub(super) fn loss_budget(totals: &[Total]) -> Table {
    let headings = budget::Part::ALL.map(|part| in_two_lines(part.title()));
    let mut table = number_table(std::iter::once("km/h".to_owned()).chain(headings), 0);
    for total in of(totals, ControllerKind::Firmware) {
        let shares = total.plots.budget.tenths().map(|(_, tenths)| format!("{:.1}", f64::from(tenths) / 10.0));
        table.add_row(std::iter::once(total.speed_km_h().to_string()).chain(shares));
    }
    table
}

/// The largest loss of the row's ground.
fn most_lost(total: &Total) -> String {
    // In the tenths of the loss budget, which add up.
    let largest = total.plots.budget.largest_loss().0;
    let (part, tenths) = total.plots.budget.tenths()[largest as usize];
    format!("{} {:.1}", part.key(), f64::from(tenths) / 10.0)
}

/// The weeded share of the row's ground, and the confidence range of its mean.
fn weeded(total: &Total) -> String {
    let mean = total.weeded_percent.mean;
    total.weeded_percent.within.map_or(format!("{mean:.1}"), |within| format!("{mean:.1} ± {within:.1}"))
}

/// The removed share of the weeds.
fn gone(weeds: WeedCount) -> String {
    optional(weeds.efficiency_percent(), |percent| format!("{percent:.1}"))
}

fn interval(share: Share) -> String {
    if share.of == 0 { share.shown() } else { format!("{} ({share})", share.shown()) }
}
