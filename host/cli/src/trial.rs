//! `weeder trial`: the paper's experiment in a simulated field, with its report.

mod summary;
mod tables;

use self::summary::{about, against_the_paper, summary};
use self::tables::Contents::{Brief, Ground, Plants};
use self::tables::{LOSS_BUDGET, by_speed, loss_budget};
use crate::examples;
use crate::part::{self, Part, Shown};
use anyhow::{Result, ensure};
use clap::{Args, Command, FromArgMatches, ValueEnum};
use field::conditions::{self, presets};
use frame::{Finding, Messages, OutFolder, OutName, Replace, Results, number_within, source, whole_within, with_bar};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Instant;
use study::evaluation::Analysis;
use study::experiment::{self, ControllerKind, Engine, Experiment, PlotOutcome, Total};
use study::page::Page;
use study::shard::{Numbered, Shard};
use study::sweep::{SPACINGS_CM, SPEEDS_KM_H};
use study::table::distinct;
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
    fn controllers(&self) -> Vec<ControllerKind> {
        let baselines = [Baseline::Queue, Baseline::Paper, Baseline::Ideal].into_iter();
        let all = baselines.zip([ControllerKind::WithoutLookAhead, ControllerKind::Paper, ControllerKind::Ideal]);
        let asked = all.filter(|(name, _)| self.baselines.contains(name)).map(|(_, controller)| controller);
        [ControllerKind::Firmware].into_iter().chain(asked).collect()
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

#[derive(Serialize, Deserialize)]
pub struct PlotPart {
    by_controller: Vec<PlotOutcome>,
    /// The first plot also has the report's picture of a row: the merging machine may have no firmware.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    picture: Option<String>,
}

const REPORT: [&str; 3] = ["report.html", "trial.csv", "controllers.csv"];

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
    ensure!(
        arguments.engine == EngineName::Uno || arguments.elf.is_none(),
        "the engine `native` runs no ELF: name --engine uno as well, or leave out --elf"
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
        writeln!(
            Messages,
            "Pace: {:.1} h of work in {took_s:.1} s, {:.0} times real time.",
            worked_s / 3600.0,
            worked_s / took_s
        );
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
    let summary = summary(&study.experiment, &totals);
    let printed = if json {
        writeln!(
            Results,
            "{:#}",
            json!({
                "field": study.field,
                "seed": study.experiment.seed,
                "seeds": study.experiment.seeds,
                "summary": summary,
                "plots": outcomes.iter().map(in_json).collect::<Vec<_>>(),
            })
        )
    } else if brief {
        writeln!(Results, "{}\n{}", by_speed(&totals, Brief), about(study))
    } else {
        let [plants, ground] = [Plants, Ground].map(|contents| by_speed(&totals, contents));
        let (budget, about, summary) = (loss_budget(&totals), about(study), summary.join("\n"));
        writeln!(Results, "{plants}\n{ground}\n\n{LOSS_BUDGET}\n{budget}\n{about}\n\n{summary}")
    };
    let alarms: u32 = of(&totals, ControllerKind::Firmware).map(|total| total.plots.alarms).sum();
    let damaged: u32 = of(&totals, ControllerKind::Firmware).map(|total| total.plots.effect.injured_of_seen().0).sum();
    if let Some(folder) = folder {
        // It may take much longer than the trial.
        let analysis = Analysis::of(experiment::records(outcomes, ControllerKind::Firmware))?;
        write_report(folder, study, picture()?, outcomes, &totals, &analysis, summary)?;
        if !json {
            writeln!(Results, "\nWritten: report.html, trial.csv and controllers.csv in {}", folder.path().display())?;
        }
    }
    printed?;
    Ok(Finding::of(damaged == 0 && alarms == 0))
}

/// The totals of one controller, by speed.
fn of(totals: &[Total], controller: ControllerKind) -> impl Iterator<Item = &Total> {
    totals.iter().filter(move |total| total.plots.controller == controller)
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
    folder.write(report, |to| Ok(to.write_all(html.as_bytes())?))?;
    folder.write(plots, |to| Ok(experiment::write_csv(outcomes, &[ControllerKind::Firmware], to)?))?;
    folder.write(controllers, |to| Ok(experiment::write_csv(outcomes, &experiment.controllers, to)?))
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
