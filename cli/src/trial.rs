//! `weeder trial`: the paper's experiment in a simulated field, with its report.

use crate::Finding;
use crate::course::number_within;
use crate::progress::Progress;
use anyhow::{Context, Result};
use clap::{Args, ValueEnum, builder::RangedU64ValueParser};
use comfy_table::{CellAlignment, Table, presets};
use field::conditions::Conditions;
use field::evaluation::Analysis;
use field::experiment::{self, Controller, Engine, Experiment, PlotOutcome};
use field::page::{Comparison, ControllerPoint, Page, RowPicture};
use field::{firmware, picture, whole_file};
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;
use std::{env, fs};

/// What the user asks of a trial.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder trial                                       the paper's speeds and spacings, three replications
  weeder trial --field soft-ground --out report      with its report as a page, report/report.html
  weeder trial --engine uno --replications 1         with the real firmware on the virtual Uno
  weeder trial --field my-field.toml --speeds 1,3 --spacings 30,40,50
The status is 1 where the firmware damaged plants that could have been kept.")]
pub struct Arguments {
    /// What runs the firmware: its code compiled for this computer, or the ELF on the virtual Uno, some 500 times slower.
    #[arg(long, value_enum, default_value = "twin")]
    engine: EngineName,
    /// Plots of each speed and spacing.
    #[arg(long, default_value = "3", value_parser = RangedU64ValueParser::<u32>::new().range(1..=1000))]
    replications: u32,
    /// Forward speeds in km/h.
    #[arg(long, value_delimiter = ',', default_value = "1,1.5,2,2.5", value_parser = number_within(0.1..=8.0))]
    speeds: Vec<f64>,
    /// Plant spacings in cm.
    #[arg(long, value_delimiter = ',', default_value = "50,60", value_parser = number_within(5.0..=500.0))]
    spacings: Vec<f64>,
    /// The field's conditions: a preset (transplanted, even-stand, direct-sown, weedy, soft-ground, heavy-soil, dusty), or a TOML
    /// file that says what differs from the first of them.
    #[arg(long, value_name = "PRESET|FILE.toml", default_value = "transplanted")]
    field: String,
    /// Which of all the possible fields: the same seed gives the same one.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Run this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Write report.html, trial.csv and controllers.csv to this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print JSON for programs instead of tables.
    #[arg(long)]
    json: bool,
}

/// The engines by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum EngineName {
    /// The firmware's code, compiled for this computer.
    Twin,
    /// The firmware itself, on the virtual Uno.
    Uno,
}

/// Runs it and prints the result.
///
/// # Errors
/// Where the field is wrong, the firmware cannot be built or run, or a file cannot be written.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let experiment = Experiment {
        speeds_km_h: ascending(&arguments.speeds),
        spacings_cm: ascending(&arguments.spacings),
        replications: arguments.replications,
        controllers: Controller::ALL.to_vec(),
        conditions: Conditions::load(&arguments.field)?,
        seed: arguments.seed,
    };
    if let Some(folder) = &arguments.out {
        fs::create_dir_all(folder).with_context(|| format!("the folder {} cannot be made", folder.display()))?;
    }
    let engine = match (arguments.engine, &arguments.elf) {
        (EngineName::Twin, _) => Engine::Twin,
        (EngineName::Uno, Some(path)) => Engine::Uno(path.clone()),
        (EngineName::Uno, None) => Engine::Uno(firmware::build()?),
    };
    let (bar, began) = (Progress::new("weeding"), Instant::now());
    let outcomes = experiment.run(&engine, |share| bar.show(share))?;
    bar.finish();
    let took_s = began.elapsed().as_secs_f64();

    let comparison = experiment::compare(&outcomes);
    let analysis = Analysis::of(experiment::records(&outcomes, Controller::Firmware))?;
    let summary = summary(&experiment, &comparison);
    if arguments.json {
        println!("{:#}", json!({ "summary": summary, "plots": outcomes.iter().map(in_json).collect::<Vec<_>>() }));
    } else {
        println!("{}\n", side_by_side(&comparison));
        summary.iter().for_each(|sentence| println!("{sentence}"));
        let worked_s: f64 = outcomes.iter().map(|outcome| outcome.moved_s).sum();
        println!(
            "Pace: {:.1} h of work in {took_s:.1} s, {:.0} times real time.",
            worked_s / 3600.0,
            worked_s / took_s
        );
    }
    if let Some(folder) = &arguments.out {
        write_report(
            folder,
            arguments,
            &experiment,
            &engine,
            &Findings { outcomes: &outcomes, comparison, analysis, summary },
        )?;
        if !arguments.json {
            println!("\nWritten: report.html, trial.csv and controllers.csv in {}", folder.display());
        }
    }
    let damaged = |controller| -> u32 {
        outcomes.iter().filter(|o| o.controller == controller).map(|outcome| outcome.effect.damaged).sum()
    };
    let is_good = damaged(Controller::Firmware) <= damaged(Controller::AllKnowing);
    Ok(if is_good { Finding::Good } else { Finding::Bad })
}

/// Everything that came of a trial.
struct Findings<'a> {
    outcomes: &'a [PlotOutcome],
    comparison: Comparison,
    analysis: Analysis,
    summary: Vec<String>,
}

/// Levels in ascending order, each once.
fn ascending(levels: &[f64]) -> Vec<f64> {
    let mut levels = levels.to_vec();
    levels.sort_by(f64::total_cmp);
    levels.dedup();
    levels
}

/// A line a speed: damage and weeding of each controller, and what bounds both.
fn side_by_side(comparison: &Comparison) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY);
    let names = || comparison.controllers.iter().map(|curve| curve.name.as_str());
    let header = ["speed\nkm/h".to_owned()].into_iter();
    let header = header.chain(names().map(|name| format!("plants damaged, %\n{name}")));
    let header = header.chain(names().map(|name| format!("row weeded, %\n{name}")));
    table.set_header(header.chain(["row weeded, %\nat best".to_owned()]));
    for (index, &(speed_km_h, bound_percent)) in comparison.bound.iter().enumerate() {
        let of_all = |value: fn(&ControllerPoint) -> f64| {
            let points = comparison.controllers.iter().filter_map(move |curve| curve.points.get(index));
            points.map(move |point| format!("{:.1}", value(point)))
        };
        let cells = [format!("{speed_km_h}")].into_iter();
        let cells = cells.chain(of_all(|point| point.plant_damage_percent));
        let cells = cells.chain(of_all(|point| point.in_row_weeding_percent));
        table.add_row(cells.chain([format!("{bound_percent:.1}")]));
    }
    table.column_iter_mut().for_each(|column| column.set_cell_alignment(CellAlignment::Right));
    table
}

/// What came of it, in plain words.
fn summary(experiment: &Experiment, comparison: &Comparison) -> Vec<String> {
    let worst = |points: &[ControllerPoint]| {
        let worst = points.iter().map(|point| (point.plant_damage_percent, point.speed_km_h));
        worst.fold((0.0, 0.0), |worst, point| if point.0 > worst.0 { point } else { worst })
    };
    let mut sentences: Vec<String> = comparison
        .controllers
        .iter()
        .map(|curve| match worst(&curve.points) {
            (0.0, _) => format!("Plants damaged by {}: none at any speed.", curve.name),
            (percent, speed) => {
                format!("Plants damaged by {}: at most {percent:.1} %, at {speed} km/h.", curve.name)
            }
        })
        .collect();
    let unavoidable = comparison.unavoidable.iter().map(|&(speed, percent)| (percent, speed));
    sentences.push(match unavoidable.fold((0.0, 0.0), |worst, point| if point.0 > worst.0 { point } else { worst }) {
        (0.0, _) => "All of them could have been kept with this servo.".to_owned(),
        (percent, speed) => format!("Up to {percent:.1} %, at {speed} km/h, could not be kept with this servo."),
    });
    if let Some(firmware) = comparison.controllers.first() {
        let short = firmware
            .points
            .iter()
            .zip(&comparison.bound)
            .map(|(point, (_, bound))| bound - point.in_row_weeding_percent);
        sentences.push(format!(
            "In the row the firmware weeds at most {:.1} points less of the ground than this servo allows at best; \
             weeding efficiency over the whole plot, as in the paper, counts the ground between the rows as well.",
            short.fold(0.0, f64::max)
        ));
    }
    sentences.push(format!(
        "Field: {} rows a controller of {} m, seed {}.",
        experiment.rows(),
        experiment.conditions.plot.row_m,
        experiment.seed
    ));
    sentences
}

/// The command that makes the same report again.
fn command_line() -> String {
    let words = env::args().skip(1).map(|word| {
        let is_plain = word.chars().all(|c| c.is_ascii_alphanumeric() || "-_./,=:".contains(c));
        if is_plain { word } else { format!("'{word}'") }
    });
    ["weeder".to_owned()].into_iter().chain(words).collect::<Vec<_>>().join(" ")
}

fn write_report(
    folder: &Path,
    arguments: &Arguments,
    experiment: &Experiment,
    engine: &Engine,
    findings: &Findings,
) -> Result<()> {
    let engine_name = match engine {
        Engine::Twin => "the firmware's code, compiled for the host",
        Engine::Uno(_) => "the firmware on the virtual Uno",
    };
    let mut parameters = vec![
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("engine".to_owned(), engine_name.to_owned()),
        ("field".to_owned(), arguments.field.clone()),
        ("seed".to_owned(), experiment.seed.to_string()),
    ];
    parameters.extend(experiment.conditions.values().map(|(parameter, value)| {
        (parameter.name.to_owned(), format!("{value}: {} ({})", parameter.meaning, parameter.source))
    }));
    let settings = experiment.conditions.settings.iter();
    parameters.extend(settings.map(|(setting, value)| (format!("settings.{setting}"), value.to_string())));
    let row = experiment.example(engine)?.map(|(row, judgement)| RowPicture {
        drawing: picture::draw(&row, &judgement),
        caption: "The first metres of a row at the highest speed, as the firmware weeded them.".to_owned(),
    });
    let page = Page {
        title: "Field trial of the intra-row weeder, simulated",
        summary: findings.summary.clone(),
        command: &command_line(),
        parameters: &parameters,
        analysis: &findings.analysis,
        comparison: Some(&findings.comparison),
        row: row.as_ref(),
    };
    let html = page.html()?;
    let write = |name: &str, contents: &dyn Fn(&mut dyn Write) -> Result<()>| {
        let path = folder.join(name);
        whole_file::write(&path, |to| contents(to)).with_context(|| format!("{} cannot be written", path.display()))
    };
    write("report.html", &|to| Ok(to.write_all(html.as_bytes())?))?;
    write("trial.csv", &|to| Ok(experiment::write_csv(findings.outcomes, &[Controller::Firmware], to)?))?;
    write("controllers.csv", &|to| Ok(experiment::write_csv(findings.outcomes, &experiment.controllers, to)?))
}

fn in_json(outcome: &PlotOutcome) -> serde_json::Value {
    let in_row = outcome.effect.in_row;
    json!({
        "controller": outcome.controller.title(),
        "record": outcome.record,
        "performance": outcome.record.performance(),
        "in_row_weeds_before": in_row.before,
        "in_row_weeds_after": in_row.after,
        "in_row_weeded_percent": 100.0 * outcome.weeded_share,
        "in_row_bound_percent": 100.0 * outcome.weedable_share,
        "alarms": outcome.alarms,
    })
}
