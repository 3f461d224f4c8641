//! `weeder sweep`: a result of the simulated trial against one or two of its parameters.

use crate::course::number_within;
use crate::output;
use crate::progress::Progress;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum, builder::PossibleValuesParser};
use comfy_table::{CellAlignment, Table, presets};
use field::conditions::Conditions;
use field::experiment::Controller;
use field::sweep::{Axis, Point, Results, Sweep};
use field::whole_file;
use std::path::{Path, PathBuf};

/// What the user asks of a sweep.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder sweep --x lead_out_ms=0..300:20 --y speed=1..4:0.5
  weeder sweep --x ground.slip_percent=0..15:1 --speed 2 --result in_row_weeding
  weeder sweep --controller paper --x speed=0.5..3:0.5 --y crop.protected_mm=60..140:20
  weeder sweep --x margin_mm=0..100:10 --y machine.load_percent=0..100:25 --out margin.csv
An axis is `speed` in km/h, `spacing` in cm, a parameter of the field as in its TOML file (table.key), or a setting of the
firmware. `weeder sweep --x ?=0..1:1` lists them all.")]
pub struct Arguments {
    /// The parameter along the first axis, and its values.
    #[arg(long, value_name = "NAME=FROM..TO:STEP")]
    x: Axis,
    /// The parameter along the second axis, and its values.
    #[arg(long, value_name = "NAME=FROM..TO:STEP")]
    y: Option<Axis>,
    /// The result that a table with two axes shows.
    #[arg(long, default_value = "plant_damage", value_parser = PossibleValuesParser::new(Results::NAMES))]
    result: String,
    /// Who weeds: the firmware, the firmware without its leads, the paper's controller, or who knows every plant.
    #[arg(long, value_enum, default_value = "firmware")]
    controller: ControllerName,
    /// The field's conditions: a preset, or a TOML file, as of `weeder trial`.
    #[arg(long, value_name = "PRESET|FILE.toml", default_value = "transplanted")]
    field: String,
    /// Forward speed in km/h, where no axis has it.
    #[arg(long, default_value = "2.5", value_parser = number_within(0.1..=8.0))]
    speed: f64,
    /// Plant spacing in cm, where no axis has it.
    #[arg(long, default_value = "50", value_parser = number_within(5.0..=500.0))]
    spacing: f64,
    /// Which of all the possible fields.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Write all results of all points to this file as well.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<PathBuf>,
}

/// The controllers by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum ControllerName {
    Firmware,
    WithoutLookAhead,
    Paper,
    AllKnowing,
}

impl From<ControllerName> for Controller {
    fn from(name: ControllerName) -> Self {
        match name {
            ControllerName::Firmware => Self::Firmware,
            ControllerName::WithoutLookAhead => Self::WithoutLookAhead,
            ControllerName::Paper => Self::Paper,
            ControllerName::AllKnowing => Self::AllKnowing,
        }
    }
}

/// Runs it and prints the result.
///
/// # Errors
/// Where an axis or the field is wrong, or the file cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let sweep = Sweep {
        x: arguments.x.clone(),
        y: arguments.y.clone(),
        controller: arguments.controller.into(),
        conditions: Conditions::load(&arguments.field)?,
        speed_km_h: arguments.speed,
        spacing_cm: arguments.spacing,
        seed: arguments.seed,
    };
    let bar = Progress::new("sweeping");
    let points = sweep.run(|share| bar.show(share))?;
    bar.finish();
    let mut text = match &sweep.y {
        Some(y) => format!(
            "{}, {} across, {} down\n{}\n",
            arguments.result,
            sweep.x.parameter,
            y.parameter,
            grid(&sweep, y, &points, &arguments.result)
        ),
        None => format!("{}\n", list(&sweep, &points)),
    };
    if points.iter().any(|point| point.results.alarms_percent > 0.0) {
        text += "! an alarm took the tool out in some of the rows: --result alarms says in how many\n";
    }
    if let Some(path) = &arguments.out {
        write(path, &sweep, &points).with_context(|| format!("{} cannot be written", path.display()))?;
        text += &format!("Written: {}\n", path.display());
    }
    output::print(&text)
}

/// A result for people: with a mark where alarms spoil it, and a stroke where there is none.
fn shown(value: f64, point: &Point) -> String {
    match (value.is_finite(), point.results.alarms_percent > 0.0) {
        (false, _) => "-".to_owned(),
        (true, true) => format!("{value:.1} !"),
        (true, false) => format!("{value:.1}"),
    }
}

/// A line a value of the second axis, a column a value of the first.
fn grid(sweep: &Sweep, y: &Axis, points: &[Point], result: &str) -> Table {
    let result = Results::NAMES.iter().position(|name| *name == result).unwrap_or(0);
    let mut table = table([String::new()].into_iter().chain(sweep.x.values.iter().map(f64::to_string)));
    for (value, line) in y.values.iter().zip(points.chunks(sweep.x.values.len())) {
        let results = line.iter().map(|point| shown(point.results.values()[result], point));
        table.add_row([value.to_string()].into_iter().chain(results));
    }
    right(table)
}

/// A line a value of the only axis, a column a result.
fn list(sweep: &Sweep, points: &[Point]) -> Table {
    let names = Results::NAMES.iter().map(|name| name.replace('_', " "));
    let mut table = table([sweep.x.parameter.clone()].into_iter().chain(names));
    for point in points {
        let results = point.results.values().map(|value| shown(value, point));
        table.add_row([point.x.to_string()].into_iter().chain(results));
    }
    right(table)
}

fn table(header: impl Iterator<Item = String>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(header);
    table
}

fn right(mut table: Table) -> Table {
    table.column_iter_mut().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    table
}

fn write(path: &Path, sweep: &Sweep, points: &[Point]) -> Result<()> {
    whole_file::write(path, |to| {
        let mut writer = csv::Writer::from_writer(to);
        let axes = [Some(&sweep.x), sweep.y.as_ref()].into_iter().flatten().map(|axis| axis.parameter.as_str());
        writer.write_record(axes.chain(Results::NAMES))?;
        for point in points {
            let place = [Some(point.x), point.y].into_iter().flatten();
            let values = place.chain(point.results.values());
            // A result that there is not has an empty cell.
            writer
                .write_record(values.map(|value| if value.is_finite() { value.to_string() } else { String::new() }))?;
        }
        writer.flush()?;
        Ok(())
    })
}
