//! `weeder trial`: the paper's experiment in a simulated field, with its report.

use crate::destination::{OutFolder, OutName, Replace};
use crate::examples;
use crate::numbers::{number_within, whole_within};
use crate::output::{say, tell};
use crate::part::{self, Part, Shown};
use crate::program::Finding;
use crate::progress::with_bar;
use crate::source;
use anyhow::{Result, ensure};
use clap::{Args, Command, FromArgMatches, ValueEnum};
use comfy_table::{CellAlignment, Table};
use field::budget;
use field::conditions::{self, presets};
use field::tool_path::{Effect, WeedCount, unweeded_strip_mm};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;
use study::evaluation::{Analysis, published};
use study::experiment::{self, Engine, Experiment, PlotOutcome, Total, Treatment};
use study::page::Page;
use study::shard::{Numbered, Shard};
use study::statistics::Share;
use study::sweep::{SPACINGS_CM, SPEEDS_KM_H};
use study::table::{distinct, in_two_lines};
use uno_run::report::number_table;
use uno_run::{firmware, picture};

/// The name of the command in its parts.
pub const COMMAND: &str = "trial";

/// Most plants of a trial, roughly: counts are limited to four billion.
const MOST_PLANTS: f64 = 2e9;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder trial                                       the machine that is set up, at the paper's speeds and spacings
  weeder trial --field soft-ground --out report      with a report, report/report.html
  weeder trial --field from-the-box --baselines paper   the machine straight from the box, beside the paper's controller
  weeder trial --brief                               the most important columns
  weeder trial --engine uno --replications 1         with the real firmware on the virtual Uno
  weeder trial --field my-field.toml --speeds 1,3 --spacings 30,40,50
  weeder trial --replications 1000 --shard 2/4 --out 2.part    the second of four parts, for `weeder merge`
The status is 1 if the firmware damaged a plant that a beam sees, or an alarm stopped it; with --shard, `weeder merge` has it.")]
pub struct Arguments {
    /// The firmware's code compiled for this computer, or its ELF on the virtual Uno, hundreds of times slower.
    #[arg(long, value_enum, default_value = "native")]
    engine: EngineName,
    /// Plots of each speed and spacing, 1 to 1000.
    #[arg(long, default_value = "3", value_parser = whole_within(1..=1000_u32))]
    replications: u32,
    /// Forward speeds in km/h, each 0.1 to 8.
    #[arg(long, value_delimiter = ',', default_value = "1,1.5,2,2.5", value_parser = number_within(SPEEDS_KM_H.0..=SPEEDS_KM_H.1))]
    speeds: Vec<f64>,
    /// Plant spacings in cm, each 5 to 500.
    #[arg(long, value_delimiter = ',', default_value = "50,60", value_parser = number_within(SPACINGS_CM.0..=SPACINGS_CM.1))]
    spacings: Vec<f64>,
    #[arg(
        long,
        value_name = "PRESET|FILE.toml",
        value_parser = source::preset_or_file(),
        hide_possible_values = true,
        default_value = conditions::DEFAULT,
        help = format!(
            "The field: a preset, or a TOML file with the differences from the first preset; - for standard input. Presets: {}.",
            presets().collect::<Vec<_>>().join(", ")
        )
    )]
    field: String,
    /// Examples to teach the firmware first, as with `weeder examples push`; - for standard input.
    #[arg(long, value_name = "FILE.csv", value_parser = source::file())]
    examples: Option<PathBuf>,
    /// The baselines on the same ground.
    #[arg(long, alias = "rivals", value_enum, value_delimiter = ',', default_values_t = [Baseline::Queue, Baseline::Paper, Baseline::Ideal])]
    baselines: Vec<Baseline>,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
    /// Number of seeds, from that one on, each with all replications: for rare events. 1 to 1000.
    #[arg(long, default_value = "1", value_parser = whole_within(1..=1000_u32))]
    seeds: u32,
    /// Run this ELF instead of this weeder's own firmware.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Write report.html, trial.csv and controllers.csv into this folder, and create it if needed; with --shard, the
    /// part to this file.
    #[arg(long, value_name = "FOLDER")]
    out: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Weed only the plots of this shard, the Ith of N, and write the result to the file of --out.
    #[arg(long, value_name = "I/N", requires = "out", conflicts_with_all = ["json", "brief"])]
    shard: Option<Shard>,
    /// Print only the most important columns.
    #[arg(long, conflicts_with = "json")]
    brief: bool,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
}

/// The engines by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum EngineName {
    /// The firmware's code, compiled for this computer.
    #[value(alias = "twin")]
    Native,
    /// The firmware itself, on the virtual Uno.
    Uno,
}

/// The firmware's baselines by their names.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Baseline {
    /// Keep-out zones without look-ahead.
    Queue,
    /// The paper's controller: one slot, and a polling loop.
    Paper,
    /// A controller that knows every plant.
    #[value(alias = "all-knowing")]
    Ideal,
}

impl Arguments {
    /// The firmware and its baselines, in the order in which they are shown.
    fn controllers(&self) -> Vec<Treatment> {
        let takes_part = |controller: &Treatment| match controller {
            Treatment::Firmware => true,
            Treatment::WithoutLookAhead => self.baselines.contains(&Baseline::Queue),
            Treatment::Paper => self.baselines.contains(&Baseline::Paper),
            Treatment::Ideal => self.baselines.contains(&Baseline::Ideal),
        };
        Treatment::ALL.into_iter().filter(takes_part).collect()
    }

    /// The command that gives the same result: its options that differ from the defaults, in a fixed order.
    fn words(&self) -> Result<Vec<String>> {
        let nothing = Self::augment_args(Command::new(COMMAND)).try_get_matches_from([COMMAND])?;
        let otherwise = Self::from_arg_matches(&nothing)?.options();
        let mut words = vec!["weeder".to_owned(), COMMAND.to_owned()];
        for ((option, value), (_, otherwise)) in self.options().into_iter().zip(otherwise) {
            if let Some(value) = value.filter(|value| otherwise.as_ref() != Some(value)) {
                words.extend([option.to_owned(), value]);
            }
        }
        Ok(words)
    }

    /// The options that decide the result, as typed.
    fn options(&self) -> [(&'static str, Option<String>); 10] {
        fn list<T>(values: &[T], word: impl Fn(&T) -> String) -> Option<String> {
            Some(values.iter().map(word).collect::<Vec<_>>().join(","))
        }
        fn name(value: &impl ValueEnum) -> String {
            value.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
        }
        let path = |path: &Option<PathBuf>| path.as_ref().map(|path| path.display().to_string());
        [
            ("--engine", Some(name(&self.engine))),
            ("--replications", Some(self.replications.to_string())),
            ("--speeds", list(&self.speeds, f64::to_string)),
            ("--spacings", list(&self.spacings, f64::to_string)),
            ("--field", Some(self.field.clone())),
            ("--examples", path(&self.examples)),
            ("--baselines", list(&self.baselines, name)),
            ("--seed", Some(self.seed.to_string())),
            ("--seeds", Some(self.seeds.to_string())),
            ("--elf", path(&self.elf)),
        ]
    }
}

/// The parameters that decide a trial's result, and its command.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Study {
    experiment: Experiment,
    engine: EngineName,
    /// The checksum of the firmware, if it runs on the virtual Uno.
    firmware: Option<String>,
    /// The field, as named by the user.
    field: String,
    /// The command that gives the same result, without its output options.
    words: Vec<String>,
}

/// The outcome of a plot.
#[derive(Serialize, Deserialize)]
pub struct PlotPart {
    /// By each controller.
    by_controller: Vec<PlotOutcome>,
    /// The first plot also has the report's picture of a row: the merging machine may have no firmware.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

/// The files of a report.
const REPORT: [&str; 3] = ["report.html", "trial.csv", "controllers.csv"];

/// Runs it and prints the result, or writes a part of it.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let &Arguments { replace, json, brief, .. } = arguments;
    let part = Part::asked(arguments.shard, arguments.out.as_ref(), replace)?;
    let out = arguments.out.clone().filter(|_| part.is_none());
    let shown = Shown { out, replace, json, brief, result: None };
    let folder = shown.folder(REPORT)?;
    let examples = arguments.examples.as_deref().map(examples::in_table).transpose()?.unwrap_or_default();
    let experiment = Experiment {
        speeds_km_h: distinct(arguments.speeds.clone()),
        spacings_cm: distinct(arguments.spacings.clone()),
        replications: arguments.replications,
        controllers: arguments.controllers(),
        conditions: source::field(&arguments.field)?,
        examples: examples.into_iter().map(|example| (example.features, example.label)).collect(),
        seed: arguments.seed,
        seeds: arguments.seeds,
    };
    let plants = experiment.plants();
    ensure!(
        plants <= MOST_PLANTS,
        "this trial has some {plants:.0} plants, but has to have at most {MOST_PLANTS}: ask for fewer or shorter rows, or fewer replications"
    );
    let engine = match arguments.engine {
        EngineName::Native => Engine::Native,
        EngineName::Uno => Engine::Uno(arguments.elf.clone().map_or_else(firmware::build, Ok)?),
    };
    let firmware = match &engine {
        Engine::Native => None,
        Engine::Uno(elf) => Some(part::check_sum(elf)?),
    };
    let (field, words) = (arguments.field.clone(), arguments.words()?);
    let study = Study { experiment, engine: arguments.engine, firmware, field, words };
    let began = Instant::now();
    if let Some(part) = part {
        let plots = with_bar("weeding", |show| study.experiment.run_shard(part.shard, &engine, show))?;
        let with_picture = |Numbered { number, outcome: by_controller }| {
            let picture = if number == 0 { picture_of(&study.experiment, &engine)? } else { None };
            Ok(Numbered { number, outcome: PlotPart { by_controller, picture } })
        };
        let plots = plots.into_iter().map(with_picture).collect::<Result<Vec<_>>>()?;
        part.write(COMMAND, study.experiment.size(), &study, plots)?;
        return Ok(Finding::Good);
    }
    let outcomes = with_bar("weeding", |show| study.experiment.run(&engine, show))?;
    if !json && !brief {
        let worked_s: f64 = outcomes.iter().map(|outcome| outcome.moved_s).sum();
        let took_s = began.elapsed().as_secs_f64();
        tell!("Pace: {:.1} h of work in {took_s:.1} s, {:.0} times real time.", worked_s / 3600.0, worked_s / took_s);
    }
    show(&study, &outcomes, &shown, folder.as_ref(), || picture_of(&study.experiment, &engine))
}

/// Prints the result of all plots, from this or other machines.
pub fn merge(study: Study, mut plots: Vec<PlotPart>, shown: &Shown) -> Result<Finding> {
    let folder = shown.folder(REPORT)?;
    let picture = plots.first_mut().and_then(|plot| plot.picture.take());
    let outcomes: Vec<PlotOutcome> = plots.into_iter().flat_map(|plot| plot.by_controller).collect();
    show(&study, &outcomes, shown, folder.as_ref(), || Ok(picture))
}

/// A picture of a row that the firmware weeded, as SVG.
fn picture_of(experiment: &Experiment, engine: &Engine) -> Result<Option<String>> {
    let example = experiment.example(engine)?;
    Ok(example.map(|(row, judgement)| picture::draw(&row, &judgement).to_string()))
}

/// Prints a trial's result, and writes its report.
fn show(
    study: &Study,
    outcomes: &[PlotOutcome],
    shown: &Shown,
    folder: Option<&OutFolder>,
    picture: impl FnOnce() -> Result<Option<String>>,
) -> Result<Finding> {
    let &Shown { json, brief, .. } = shown;
    let totals = experiment::totals(outcomes);
    let analysis = Analysis::of(experiment::records(outcomes, Treatment::Firmware))?;
    let summary = summary(&study.experiment, &totals);
    let printed = if json {
        say!("{:#}", json!({ "summary": summary, "plots": outcomes.iter().map(in_json).collect::<Vec<_>>() }))
    } else if brief {
        say!("{}\n{}", by_speed(&totals, Brief), about(study))
    } else {
        let [plants, ground] = [Plants, Ground].map(|contents| by_speed(&totals, contents));
        let (budget, about, summary) = (loss_budget(&totals), about(study), summary.join("\n"));
        say!("{plants}\n{ground}\n\n{LOSS_BUDGET}\n{budget}\n{about}\n\n{summary}")
    };
    let alarms: u32 = of(&totals, Treatment::Firmware).map(|total| total.plots.alarms).sum();
    let damaged: u32 = of(&totals, Treatment::Firmware).map(|total| total.plots.effect.injured_of_seen().0).sum();
    if let Some(folder) = folder {
        write_report(folder, study, picture()?, outcomes, &totals, &analysis, summary)?;
        if !json {
            say!("\nWritten: report.html, trial.csv and controllers.csv in {}", folder.path().display())?;
        }
    }
    printed?;
    Ok(Finding::of(damaged == 0 && alarms == 0))
}

/// The differences between the paper's controller here and in the paper, at the paper's speeds, and their reason.
fn against_the_paper(outcomes: &[PlotOutcome]) -> Vec<String> {
    let (slowest, fastest) = published::SPEEDS_KM_H;
    let mut records = experiment::records(outcomes, Treatment::Paper);
    records.retain(|record| (slowest..=fastest).contains(&record.speed_km_h));
    let said = Analysis::of(records).map(|analysis| analysis.against_the_paper()).unwrap_or_default();
    if said.is_empty() {
        return said;
    }
    let reason = format!(
        "This is the paper's program at {slowest} to {fastest} km/h, on this report's machine and field. The paper prints no servo \
         times, canopies or straying, so these are assumed. Its own slopes contradict each other too."
    );
    [said, vec![reason]].concat()
}

/// The totals of one controller, by speed.
fn of(totals: &[Total], controller: Treatment) -> impl Iterator<Item = &Total> {
    totals.iter().filter(move |total| total.plots.controller == controller)
}

/// A column: its heading, its value for a total, and the tables that have it.
type Column = (&'static str, fn(&Total) -> String, &'static [Contents]);

/// The tables of a trial, each with a line for each speed and controller.
#[derive(Clone, Copy, PartialEq)]
enum Contents {
    /// The most important columns, for `--brief`.
    Brief,
    /// The results for plants.
    Plants,
    /// The weeded ground.
    Ground,
}

use Contents::{Brief, Ground, Plants};

const COLUMNS: [Column; 13] = [
    ("km/h", |total| total.speed_km_h().to_string(), &[Brief, Plants, Ground]),
    ("controller", |total| name(total.plots.controller).to_owned(), &[Brief, Plants, Ground]),
    ("seen plants\ndamaged, %", |total| interval(total.damage_of_seen()), &[Brief, Plants]),
    ("unseen\nplants, %", |total| without_interval(&interval(total.damage_of_unseen())), &[Plants]),
    ("zones\nreached, %", |total| format!("{:.1}", total.zones_reached_percent()), &[Brief, Plants]),
    ("margins\ncut, %", |total| format!("{:.1}", total.margins_cut_percent()), &[Plants]),
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
fn name(controller: Treatment) -> &'static str {
    let title = controller.title();
    ["a ", "the "].iter().find_map(|article| title.strip_prefix(article)).unwrap_or(title)
}

/// A table of a trial, at most 110 characters wide.
fn by_speed(totals: &[Total], contents: Contents) -> Table {
    let columns = || COLUMNS.iter().filter(|(_, _, tables)| tables.contains(&contents));
    let mut table = number_table(columns().map(|(heading, _, _)| heading), 0);
    for total in totals {
        table.add_row(columns().map(|(_, cell, _)| cell(total)));
    }
    table.column_iter_mut().skip(1).take(1).for_each(|column| column.set_cell_alignment(CellAlignment::Left));
    table
}

/// The heading of the loss budget.
const LOSS_BUDGET: &str = "Loss budget of the row's ground with this firmware, %";

/// The firmware's loss budget, a line a speed: each adds up to 100 %.
fn loss_budget(totals: &[Total]) -> Table {
    let headings = budget::Part::ALL.map(|part| in_two_lines(part.title()));
    let mut table = number_table(std::iter::once("km/h".to_owned()).chain(headings), 0);
    for total in of(totals, Treatment::Firmware) {
        let shares = total.plots.budget.tenths().map(|(_, tenths)| format!("{:.1}", f64::from(tenths) / 10.0));
        table.add_row(std::iter::once(total.speed_km_h().to_string()).chain(shares));
    }
    table
}

/// The largest loss of the row's ground.
fn most_lost(total: &Total) -> String {
    let (part, share) = total.plots.budget.largest_loss();
    format!("{} {:.1}", part.key(), 100.0 * share)
}

/// The weeded share of the row's ground, and the confidence range of its mean.
fn weeded(total: &Total) -> String {
    let mean = total.weeded_percent.mean;
    total.weeded_percent.within.map_or(format!("{mean:.1}"), |within| format!("{mean:.1} ± {within:.1}"))
}

/// The removed share of the weeds.
fn gone(weeds: WeedCount) -> String {
    weeds.efficiency_percent().map_or("-".to_owned(), |percent| format!("{percent:.1}"))
}

/// The result in words.
fn summary(experiment: &Experiment, totals: &[Total]) -> Vec<String> {
    let mut sentences: Vec<String> =
        experiment.controllers.iter().map(|&controller| damage(totals, controller)).collect();
    if experiment.controllers.contains(&Treatment::Paper) {
        let (lowest, highest) = published::DAMAGED_PERCENT;
        sentences.push(format!(
            "The paper's controller is the paper's program on this machine. On its own machine the paper measured {lowest} to {highest} %. \
             `weeder trial --field paper` simulates that machine."
        ));
    }
    let alarms: u32 = of(totals, Treatment::Firmware).map(|total| total.plots.alarms).sum();
    if alarms > 0 {
        sentences.push(format!(
            "In {alarms} of {} rows an alarm took the firmware's tool out for the rest of the row. Exclude those rows.",
            experiment.rows()
        ));
    }
    let short_of_bound =
        of(totals, Treatment::Firmware).map(|total| total.plots.weedable_share - total.plots.weeded_share);
    let zone = match experiment.conditions.timing().stem_zone_mm {
        0 => "canopy".to_owned(),
        zone_mm => format!("zone of {zone_mm} mm round the stem"),
    };
    sentences.push(format!(
        "With each plant's {zone} and its margin kept, this servo could weed at most {:.1} points more of the row's ground than the \
         firmware did.",
        100.0 * short_of_bound.fold(0.0, f64::max)
    ));
    let mut weeds = Effect::default();
    of(totals, Treatment::Firmware).for_each(|total| weeds += total.plots.effect);
    let Effect { damaged, unseen, swept, neighbours, .. } = weeds;
    if damaged + swept + neighbours > 0 {
        sentences.push(format!(
            "Of the plants that the firmware's machine damaged, the tool hit {damaged}: the beam cannot see {unseen} of them. Sweeps cut \
             {swept}, where the machine strays. The tool cut {neighbours} in the next row, where it swung aside."
        ));
    }
    let strip_mm = unweeded_strip_mm(&experiment.conditions.machine(0), &experiment.conditions.machine);
    if strip_mm > 0.0 {
        sentences.push(format!(
            "Between tool and sweeps a strip of {strip_mm:.1} mm on either side of the row is not weeded: a tool of {:.0} mm would fill it.",
            2.0 * experiment.conditions.machine.sweep_from_mm
        ));
    }
    if let (Some(in_row), Some(in_plot)) = (weeds.in_row.efficiency_percent(), weeds.in_plot.efficiency_percent()) {
        sentences.push(format!(
            "Of the weeds in the row the firmware removed {in_row:.0} %; of all weeds of the plot, as the paper counts them, \
             {in_plot:.0} % were gone."
        ));
    }
    sentences
}

/// The field, its seeds and its rows, for the tables. Their lines have the speeds.
fn about(study: &Study) -> String {
    let Study { experiment: Experiment { seed, seeds, conditions, spacings_cm, .. }, field, .. } = study;
    let seeds = if *seeds > 1 {
        format!("seeds {seed} to {}", seed.wrapping_add((seeds - 1).into()))
    } else {
        format!("seed {seed}")
    };
    let spacings: Vec<String> = spacings_cm.iter().map(f64::to_string).collect();
    let rows = study.experiment.rows();
    format!(
        "Field {field}, {seeds}: {rows} rows of {} m for each controller, plants {} cm apart.",
        conditions.plot.row_m,
        spacings.join(" and ")
    )
}

/// A share and its interval.
fn interval(share: Share) -> String {
    if share.of == 0 { "-".to_owned() } else { format!("{} ({share})", share.shown()) }
}

/// How many plants a controller damaged, and where it damaged most.
fn damage(totals: &[Total], controller: Treatment) -> String {
    let name = controller.title();
    let (damaged, plants) = of(totals, controller).fold((0, 0), |(damaged, plants), total| {
        (damaged + total.plots.effect.injured(), plants + total.plots.effect.plants)
    });
    let share = Share::of(damaged, plants);
    let worst = of(totals, controller).max_by(|a, b| a.plant_damage_percent().total_cmp(&b.plant_damage_percent()));
    match worst {
        Some(worst) if damaged > 0 => format!(
            "Plants damaged by {name}: {damaged} of {plants} ({} %, {}), most of them at {} km/h, {} %.",
            share,
            share.kind(),
            worst.speed_km_h(),
            worst.damage().shown()
        ),
        _ => format!("Plants damaged by {name}: none of {plants} ({share} %, {}).", share.kind()),
    }
}

fn write_report(
    folder: &OutFolder,
    study: &Study,
    picture: Option<String>,
    outcomes: &[PlotOutcome],
    totals: &[Total],
    analysis: &Analysis,
    summary: Vec<String>,
) -> Result<()> {
    let Study { experiment, field, .. } = study;
    let engine_name = match study.engine {
        EngineName::Native => "the firmware's code, compiled for the host",
        EngineName::Uno => "the firmware on the virtual Uno",
    };
    let mut parameters = vec![
        ("version".to_owned(), env!("WEEDER_VERSION").to_owned()),
        ("engine".to_owned(), engine_name.to_owned()),
        ("field".to_owned(), field.clone()),
        ("seed".to_owned(), experiment.seed.to_string()),
    ];
    parameters.extend(experiment.conditions.values().map(|(parameter, value)| {
        (parameter.name.to_owned(), format!("{value}: {} ({})", parameter.meaning, parameter.source))
    }));
    let settings = experiment.conditions.settings.iter();
    parameters.extend(settings.map(|(setting, value)| (format!("settings.{setting}"), value.to_string())));
    let words = [study.words.clone(), vec!["--out".to_owned(), folder.path().display().to_string()]].concat();
    let page = Page {
        title: "Field trial of the intra-row weeder, simulated",
        summary,
        paper: against_the_paper(outcomes),
        command: &shlex::try_join(words.iter().map(String::as_str))?,
        parameters: &parameters,
        analysis,
        log: None,
        totals,
        row: picture.as_deref(),
    };
    let html = page.html()?;
    let [report, plots, controllers] = REPORT;
    folder.write(report, |to| to.write_all(html.as_bytes()))?;
    folder.write(plots, |to| experiment::write_csv(outcomes, &[Treatment::Firmware], to))?;
    folder.write(controllers, |to| experiment::write_csv(outcomes, &experiment.controllers, to))
}

fn in_json(outcome: &PlotOutcome) -> Value {
    let lost = outcome.budget.shares().map(|(part, share)| (part.key(), 100.0 * share));
    let mut plot = json!({
        "controller": outcome.controller.title(),
        "record": outcome.record,
        "performance": outcome.record.performance(),
        "alarms": outcome.alarms,
        "loss_budget_percent": BTreeMap::from_iter(lost),
    });
    outcome.figures().into_iter().for_each(|(name, figure)| plot[name] = figure);
    plot
}
