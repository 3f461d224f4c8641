//! `weeder sweep`: a result of the simulated trial against one or two of its parameters.

use crate::part::{Part, Shown};
use anyhow::Result;
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use comfy_table::{ContentArrangement, Table, presets};
use field::conditions::{self, Conditions, PARAMETERS};
use frame::{
    Messages, OutFile, OutName, Replace, Results, number_within,
    source::{self, offering},
    whole_within, with_bar,
};
use link::settings::{self, Setting};
use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::sync::LazyLock;
use study::experiment::{ControllerKind, PlotOutcome};
use study::shard::Shard;
use study::sweep::{Axis, Point, RESULTS, SPACINGS_CM, SPEEDS_KM_H, Sweep};
use study::table::{in_two_lines, optional, visible};
use uno_run::report::number_table;

/// The name of the command in its parts.
pub const COMMAND: &str = "sweep";

const RESULT: &str = RESULTS[0];

const EXAMPLES: &str = "\
Examples:
  weeder sweep --x lead_out_ms=0..300:20 --y speed=1..4:0.5
  weeder sweep --x ground.slip_percent=0..15:1 --speed 2 --result in_row_weeding
  weeder sweep --controller paper --x speed=0.5..3:0.5 --y crop.protected_mm=60..140:20
  weeder sweep --x margin_mm=0..100:10 --y machine.load_kg_cm=0..40:10 --out margin.csv
  weeder sweep --x k=1..9:2 --json | jq '.points[].plant_damage'
  weeder sweep --x k=1..9:2 --shard 2/4 --out 2.part      the second of four parts, for `weeder merge`
An axis is `speed` in km/h, `spacing` in cm, a parameter of the field as in its TOML file, or a setting of the firmware.";

const HELP_WIDTH: u16 = 100;

/// The examples, and all possible axes.
fn long_help() -> String {
    let mut table = Table::new();
    table.set_content_arrangement(ContentArrangement::Dynamic).set_width(HELP_WIDTH);
    table.load_style(presets::NOTHING).add_rows(axes());
    for column in table.column_iter_mut() {
        column.set_padding((2, 0));
    }
    format!("{EXAMPLES}\n\nWhat an axis can be:\n{}\n", table.trim_fmt())
}

/// All possible axes: the name, the range and the meaning of each.
fn axes() -> Vec<[String; 3]> {
    let line = |name: &str, least: f64, greatest: f64, meaning: &str| {
        [name.to_owned(), format!("{least} to {greatest}"), meaning.to_owned()]
    };
    let speed = line("speed", SPEEDS_KM_H.0, SPEEDS_KM_H.1, "forward speed in km/h");
    let spacing = line("spacing", SPACINGS_CM.0, SPACINGS_CM.1, "plant spacing in cm");
    let parameters = PARAMETERS.iter().map(|known| line(known.name, known.least, known.greatest, known.meaning));
    let settings = Setting::all().map(|setting| {
        line(&settings::name(setting), setting.least().into(), setting.greatest().into(), &settings::help(setting))
    });
    [speed, spacing].into_iter().chain(parameters).chain(settings).collect()
}

/// An axis; a shell that completes offers the names.
fn axis() -> impl TypedValueParser<Value = Axis> {
    static NAMES: LazyLock<Vec<String>> =
        LazyLock::new(|| axes().into_iter().map(|[name, ..]| format!("{name}=")).collect());
    offering(|| NAMES.iter().map(String::as_str).collect(), |text: &str| text.parse::<Axis>())
}

fn controller() -> impl TypedValueParser<Value = ControllerKind> {
    let ideal = PossibleValue::new("ideal").alias("all-knowing");
    let names = ["firmware", "without-look-ahead", "paper"].map(PossibleValue::new);
    PossibleValuesParser::new(names.into_iter().chain([ideal])).map(|name| match name.as_str() {
        "firmware" => ControllerKind::Firmware,
        "without-look-ahead" => ControllerKind::WithoutLookAhead,
        "paper" => ControllerKind::Paper,
        _ => ControllerKind::Ideal,
    })
}

#[derive(Args)]
#[command(after_help = format!("{EXAMPLES} `weeder sweep --help` lists them all."), after_long_help = long_help())]
pub struct Arguments {
    /// The parameter along the first axis, and its values.
    #[arg(long, value_name = "NAME=FROM..TO:STEP", value_parser = axis(), hide_possible_values = true)]
    x: Axis,
    /// The parameter along the second axis, and its values.
    #[arg(long, value_name = "NAME=FROM..TO:STEP", value_parser = axis(), hide_possible_values = true)]
    y: Option<Axis>,
    /// The result to show for two axes. With one axis, the table has all results.
    #[arg(long, default_value = RESULT, value_parser = PossibleValuesParser::new(RESULTS))]
    result: String,
    /// The controller: the firmware, the firmware without leads, the paper's, or the ideal controller.
    #[arg(long, value_parser = controller(), default_value = "firmware")]
    controller: ControllerKind,
    /// The field: a preset or a TOML file, as for `weeder trial`.
    #[arg(long, value_name = "PRESET|FILE.toml", value_parser = source::preset_or_file(), hide_possible_values = true, default_value = conditions::DEFAULT)]
    field: String,
    /// Forward speed in km/h, 0.1 to 8, if no axis has it.
    #[arg(long, default_value = "2.5", value_parser = number_within(SPEEDS_KM_H.0..=SPEEDS_KM_H.1))]
    speed: f64,
    /// Plant spacing in cm, 5 to 500, if no axis has it.
    #[arg(long, default_value = "50", value_parser = number_within(SPACINGS_CM.0..=SPACINGS_CM.1))]
    spacing: f64,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
    /// Also write all results of all points to this file; with --shard, the part.
    #[arg(long, value_name = "FILE.csv")]
    out: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Compute only the points of this shard, the Ith of N, and write them to the file of --out.
    #[arg(long, value_name = "I/N", requires = "out", conflicts_with = "json")]
    shard: Option<Shard>,
    /// Print all results of all points as JSON instead of a table.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let &Arguments { ref out, replace, json, ref result, .. } = arguments;
    let sweep = Sweep {
        x: arguments.x.clone(),
        y: arguments.y.clone(),
        controller: arguments.controller,
        conditions: Conditions::load(&arguments.field)?,
        field: arguments.field.clone(),
        speed_km_h: arguments.speed,
        spacing_cm: arguments.spacing,
        seed: arguments.seed,
    };
    sweep.warning()?.iter().for_each(|warning| writeln!(Messages, "Warning: {warning}"));
    if let Some(part) = Part::asked(arguments.shard, out.as_ref(), replace)? {
        let outcomes = with_bar("sweeping", |show| sweep.run_shard(part.shard, show))?;
        return part.write(COMMAND, sweep.size(), &sweep, outcomes);
    }
    let shown = Shown { out: out.clone(), replace, json, brief: false, result: Some(result.clone()) };
    let out = shown.file()?;
    let points = with_bar("sweeping", |show| sweep.run(show))?;
    show(&sweep, &points, &shown, out)
}

/// Prints the result of all points' plots, from this or other machines.
pub fn merge(sweep: &Sweep, outcomes: &[PlotOutcome], shown: &Shown) -> Result<()> {
    let out = shown.file()?;
    show(sweep, &sweep.points(outcomes)?, shown, out)
}

fn show(sweep: &Sweep, points: &[Point], shown: &Shown, out: Option<OutFile>) -> Result<()> {
    let printed = match shown.json {
        true => writeln!(Results, "{:#}", in_json(sweep, points)),
        false => write!(Results, "{}", in_words(shown.result.as_deref().unwrap_or(RESULT), sweep, points)),
    };
    if let Some(out) = out {
        write(&out, sweep, points)?;
        if !shown.json {
            writeln!(Results, "Written: {}", out.path().display())?;
        }
    }
    printed
}

/// The table, and notes on invalid values.
fn in_words(result: &str, sweep: &Sweep, points: &[Point]) -> String {
    let mut text = match &sweep.y {
        Some(y) => format!(
            "{}, {}, {} across, {} down\n{}\n",
            result.replace('_', " "),
            unit_of(result),
            with_unit(&sweep.x.parameter),
            with_unit(&y.parameter),
            grid(sweep, y, points, result)
        ),
        None => format!("{}\n", list(sweep, points)),
    };
    let _ = writeln!(text, "{}", about(sweep));
    if points.iter().any(|point| point.has_alarm) {
        text += "! an alarm took the tool out in some of the rows: --result alarms shows in how many\n";
    }
    text
}

/// The field, seed, speed, spacing and controller of a sweep.
fn about(sweep: &Sweep) -> String {
    let mut text = format!("Field {}, seed {}", sweep.field, sweep.seed);
    for (name, value, unit) in [("speed", sweep.speed_km_h, "km/h"), ("spacing", sweep.spacing_cm, "cm")] {
        if !columns(sweep).any(|column| column == name) {
            let _ = write!(text, ", {value} {unit}");
        }
    }
    format!("{text}, {}.", sweep.controller.title())
}

/// All results of all points, by the names of the file's columns. A missing result is null, and so are speed and spacing where an
/// axis has them.
fn in_json(sweep: &Sweep, points: &[Point]) -> Value {
    let point = |point: &Point| {
        let values = place(point).chain(point.results).map(Value::from);
        Map::from_iter(columns(sweep).map(str::to_owned).zip(values))
    };
    let unless_axis = |name: &str, value: f64| (!columns(sweep).any(|column| column == name)).then_some(value);
    json!({
        "field": sweep.field,
        "seed": sweep.seed,
        "controller": sweep.controller.title(),
        "speed_km_h": unless_axis("speed", sweep.speed_km_h),
        "spacing_cm": unless_axis("spacing", sweep.spacing_cm),
        "points": points.iter().map(point).collect::<Vec<_>>(),
    })
}

/// The axes by their names, and then the results.
fn columns(sweep: &Sweep) -> impl Iterator<Item = &str> {
    let axes = [Some(&sweep.x), sweep.y.as_ref()].into_iter().flatten();
    axes.map(|axis| axis.parameter.as_str()).chain(RESULTS)
}

/// A point's values on the axes.
fn place(point: &Point) -> impl Iterator<Item = f64> {
    [Some(point.x), point.y].into_iter().flatten()
}

/// A value as text: with a mark if alarms make it invalid, and a dash if there is none.
fn shown(value: f64, point: &Point) -> String {
    let text = optional(value.is_finite().then_some(value), |value| visible(value, 1));
    if value.is_finite() && point.has_alarm { text + " !" } else { text }
}

/// A line a value of the second axis, a column a value of the first.
fn grid(sweep: &Sweep, y: &Axis, points: &[Point], result: &str) -> Table {
    let result = RESULTS.iter().position(|name| *name == result).unwrap_or(0);
    let mut table = number_table([String::new()].into_iter().chain(sweep.x.values.iter().map(f64::to_string)), 0);
    for (value, line) in y.values.iter().zip(points.chunks(sweep.x.values.len())) {
        let results = line.iter().map(|point| shown(point.results[result], point));
        table.add_row([value.to_string()].into_iter().chain(results));
    }
    table
}

fn unit_of(result: &str) -> &'static str {
    if result == "performance_index" { "ha %²/(h hp)" } else { "%" }
}

/// An axis with its unit. The names of other axes end with theirs.
fn with_unit(axis: &str) -> String {
    match axis {
        "speed" => "speed, km/h".to_owned(),
        "spacing" => "spacing, cm".to_owned(),
        _ => axis.to_owned(),
    }
}

/// A line a value of the only axis, a column a result.
fn list(sweep: &Sweep, points: &[Point]) -> Table {
    let names = RESULTS.iter().map(|name| format!("{}\n{}", in_two_lines(&name.replace('_', " ")), unit_of(name)));
    let mut table = number_table([with_unit(&sweep.x.parameter)].into_iter().chain(names), 0);
    for point in points {
        let results = point.results.map(|value| shown(value, point));
        table.add_row([point.x.to_string()].into_iter().chain(results));
    }
    table
}

fn write(out: &OutFile, sweep: &Sweep, points: &[Point]) -> Result<()> {
    out.write(|to| {
        let mut writer = csv::Writer::from_writer(to);
        writer.write_record(columns(sweep))?;
        for point in points {
            let values = place(point).chain(point.results);
            // A missing result has an empty cell.
            writer
                .write_record(values.map(|value| if value.is_finite() { value.to_string() } else { String::new() }))?;
        }
        Ok(writer.flush()?)
    })
}
