//! `weeder soak`: hours of the decisions and minutes of the real firmware, with random faults.

use crate::part::{self, Part};
use anyhow::{Result, ensure};
use clap::Args;
use frame::{Finding, Messages, OutName, Replace, Results, Show, whole_within, with_bar};
use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use soak::{Plan, SoakError, Subject, Tally};
use std::path::{Path, PathBuf};
use std::time::Instant;
use study::shard::{Numbered, Shard};
use uno_run::firmware;

/// The name of the command in its parts.
pub const COMMAND: &str = "soak";

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder soak                                        a day of the decisions, half an hour of the firmware
  weeder soak --hours 0 --uno-minutes 6 --faults 900    only the firmware, a fault every 4 s
  weeder soak --hours 1 --uno-minutes 0 --json | jq '.parts[0].alarms'
  weeder soak --hours 240 --shard 2/4 --out 2.part   the second of four parts, for `weeder merge`
The status is 1 if a plant was harmed, or another rule was broken.")]
pub struct Arguments {
    /// Simulated hours of the native run, 0 to 10000; 0 for none.
    #[arg(long, default_value = "24", value_parser = whole_within(0..=10_000_u32))]
    hours: u32,
    /// Simulated minutes of the firmware on the virtual Uno, 0 to 10000; 0 for none.
    #[arg(long, default_value = "30", value_parser = whole_within(0..=10_000_u32))]
    uno_minutes: u32,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
    /// Faults in a simulated hour, on average, 0 to 10000.
    #[arg(long, default_value = "120", value_parser = whole_within(0..=10_000_u32))]
    faults: u32,
    /// Run this ELF instead of this weeder's own firmware.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Run only this shard, the Ith of N, and write its result to the file of --out.
    #[arg(long, value_name = "I/N", requires = "out", conflicts_with = "json")]
    shard: Option<Shard>,
    /// The file for --shard.
    #[arg(long, value_name = "FILE", requires = "shard")]
    out: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Print JSON instead of words.
    #[arg(long)]
    json: bool,
}

/// The parameters that decide a soak's result.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Study {
    seed: u64,
    faults: u32,
    hours: u32,
    uno_minutes: u32,
    /// The checksum of the firmware, if it is run.
    firmware: Option<String>,
}

impl Study {
    fn plan(&self) -> Plan {
        Plan { seed: self.seed, faults_an_hour: self.faults.into() }
    }
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let &Arguments { hours, uno_minutes, seed, faults, json, .. } = arguments;
    ensure!(
        hours > 0 || uno_minutes > 0,
        "with --hours 0 and --uno-minutes 0 nothing is tried: one of them has to be above 0"
    );
    ensure!(
        uno_minutes > 0 || arguments.elf.is_none(),
        "with --uno-minutes 0 no ELF is run: ask for some minutes, or leave out --elf"
    );
    let part = Part::asked(arguments.shard, arguments.out.as_ref(), arguments.replace)?;
    let elf = (uno_minutes > 0).then(|| arguments.elf.clone().map_or_else(firmware::build, Ok)).transpose()?;
    let firmware = elf.as_deref().map(part::check_sum).transpose()?;
    let study = Study { seed, faults, hours, uno_minutes, firmware };
    if let Some(part) = part {
        return write_part(&study, elf.as_deref(), part);
    }
    let decisions = (hours > 0).then_some((DECISIONS, Subject::Decisions, hours));
    let firmware = elf.as_deref().map(|elf| (FIRMWARE, Subject::Firmware(elf), uno_minutes));
    let stages = decisions.into_iter().chain(firmware).map(|(title, subject, parts)| {
        Stage::of(title, json, |show| soak::run(study.plan(), subject, parts.into(), show))
    });
    let stages = stages.collect::<Result<Vec<_>>>()?;
    conclude(&study, &stages, json)
}

/// Computes a shard's hours and minutes. The numbers of minutes follow those of hours.
fn write_part(study: &Study, elf: Option<&Path>, part: Part) -> Result<Finding> {
    let hours = u64::from(study.hours);
    let all = hours + u64::from(study.uno_minutes);
    let numbers: Vec<u64> = part.shard.numbers(all).collect();
    let count = numbers.len() as f64;
    let tallies = with_bar("soaking", |show| {
        let tally = |(number, begun)| {
            let show = |share: f64| show((f64::from(begun) + share) / count);
            let (subject, part) = match elf {
                Some(elf) if number >= hours => (Subject::Firmware(elf), number - hours),
                _ => (Subject::Decisions, number),
            };
            let outcome = soak::part(study.plan(), subject, (part, 1.0), show)?;
            show(1.0);
            Ok(Numbered { number, outcome })
        };
        numbers.into_iter().zip(0..).map(tally).collect::<Result<Vec<_>>>()
    })?;
    part.write(COMMAND, all, study, tallies)?;
    Ok(Finding::Good)
}

/// Prints the results of all hours and minutes, which may come from several machines.
pub fn merge(study: &Study, mut tallies: Vec<Tally>, json: bool) -> Result<Finding> {
    let minutes = tallies.split_off((study.hours as usize).min(tallies.len()));
    let mut stages = Vec::new();
    for (title, tallies) in [(DECISIONS, tallies), (FIRMWARE, minutes)] {
        if !tallies.is_empty() {
            let stage = Stage { title, tally: soak::total(tallies.into_iter().map(Ok::<_, SoakError>))? };
            stage.say(json)?;
            stages.push(stage);
        }
    }
    conclude(study, &stages, json)
}

/// Prints the summary of all stages. Returns whether all is well.
fn conclude(study: &Study, stages: &[Stage], json: bool) -> Result<Finding> {
    let &Study { seed, faults, hours, uno_minutes, .. } = study;
    let is_good = stages.iter().all(|stage| stage.tally.violations.is_empty());
    if json {
        let stages = stages.iter().map(Stage::in_json).collect::<Value>();
        writeln!(Results, "{:#}", json!({ "seed": seed, "faults_an_hour": faults, "parts": stages }))?;
    } else if !is_good {
        writeln!(
            Results,
            "To see it again, with the same --elf if one was named: weeder soak --seed {seed} --faults {faults} \
             --hours {hours} --uno-minutes {uno_minutes}"
        )?;
    }
    Ok(Finding::of(is_good))
}

/// A stage's name for programs, and for people.
type Title = (&'static str, &'static str);

const DECISIONS: Title = ("decisions", "The decision core on the host");
const FIRMWARE: Title = ("firmware", "The firmware on the virtual Uno");

struct Stage {
    title: Title,
    tally: Tally,
}

impl Stage {
    /// Runs it with a progress bar, and prints its result, unless the output is JSON.
    fn of(title: Title, json: bool, work: impl FnOnce(Show) -> Result<Tally, SoakError>) -> Result<Self> {
        let began = Instant::now();
        let stage = Self { title, tally: with_bar(title.1, work)? };
        stage.say(json)?;
        let took_s = began.elapsed().as_secs_f64();
        writeln!(Messages, "Pace        {took_s:.1} s, {:.0} times real time", stage.tally.seconds / took_s);
        Ok(stage)
    }

    /// Prints its result, unless the output is JSON.
    fn say(&self, json: bool) -> Result<()> {
        if json { Ok(()) } else { writeln!(Results, "{}\n{}", self.title.1, self.tally) }
    }

    fn in_json(&self) -> Value {
        let mut value = json!(self.tally);
        value["part"] = self.title.0.into();
        value
    }
}
