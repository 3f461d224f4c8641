//! `weeder soak`: hours of the decisions and minutes of the real firmware, with everything going wrong now and then.

use crate::Finding;
use crate::numbers::whole_within;
use crate::output::say;
use crate::progress::Progress;
use anyhow::{Result, ensure};
use clap::Args;
use serde_json::{Value, json};
use std::path::PathBuf;
use std::time::Instant;
use trial::firmware;
use trial::soak::{self, Plan, SoakError, Tally};

/// What the user asks of a soak.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder soak                                        a day of the decisions, half an hour of the firmware
  weeder soak --hours 0 --uno-minutes 6 --faults 900    the firmware alone, with a fault every four seconds
  weeder soak --hours 1 --uno-minutes 0 --json | jq .parts[0].alarms
The status is 1 where something happened that must not.")]
pub struct Arguments {
    /// Simulated hours of the decision core on the host, 0 to 10000; 0 leaves it out.
    #[arg(long, default_value = "24", value_parser = whole_within(0..=10_000_u32))]
    hours: u32,
    /// Simulated minutes of the firmware on the virtual Uno, 0 to 10000; 0 leaves it out.
    #[arg(long, default_value = "30", value_parser = whole_within(0..=10_000_u32))]
    uno_minutes: u32,
    /// Which of all the possible soaks, 0 to 18446744073709551615: the same seed gives the same one.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    seed: u64,
    /// Faults in a simulated hour, on average, 0 to 10000.
    #[arg(long, default_value = "120", value_parser = whole_within(0..=10_000_u32))]
    faults: u32,
    /// Run this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Print JSON for programs instead of words.
    #[arg(long)]
    json: bool,
}

/// Runs it and prints what it has shown.
///
/// # Errors
/// Where nothing is asked for, or the firmware cannot be built or run.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    ensure!(
        arguments.hours > 0 || arguments.uno_minutes > 0,
        "with --hours 0 and --uno-minutes 0 nothing is tried: one of them has to be above 0"
    );
    let plan = Plan { seed: arguments.seed, faults_an_hour: arguments.faults.into() };
    let mut parts = Vec::new();
    if arguments.hours > 0 {
        parts.push(Part::of("decisions", "The decision core on the host", arguments, |bar| {
            soak::hours(plan, arguments.hours.into(), |share| bar.show(share))
        })?);
    }
    if arguments.uno_minutes > 0 {
        let elf = match &arguments.elf {
            Some(path) => path.clone(),
            None => firmware::build()?,
        };
        parts.push(Part::of("firmware", "The firmware on the virtual Uno", arguments, |bar| {
            soak::minutes(plan, arguments.uno_minutes.into(), &elf, |share| bar.show(share))
        })?);
    }
    let is_good = parts.iter().all(|part| part.tally.violations.is_empty());
    if arguments.json {
        let parts = parts.iter().map(Part::in_json).collect::<Value>();
        say!("{:#}", json!({ "seed": arguments.seed, "faults_an_hour": arguments.faults, "parts": parts }))?;
    } else if !is_good {
        say!("To see it again: weeder soak --seed {} --faults {}", arguments.seed, arguments.faults)?;
    }
    Ok(if is_good { Finding::Good } else { Finding::Bad })
}

/// A part of a soak, and what it has shown.
struct Part {
    name: &'static str,
    tally: Tally,
    took_s: f64,
}

impl Part {
    /// Runs it behind its progress bar, and says what it has shown, unless that is for programs.
    fn of(
        name: &'static str,
        title: &'static str,
        arguments: &Arguments,
        work: impl FnOnce(&Progress) -> Result<Tally, SoakError>,
    ) -> Result<Self> {
        let began = Instant::now();
        let bar = Progress::new(title);
        let tally = work(&bar);
        bar.finish();
        let part = Self { name, tally: tally?, took_s: began.elapsed().as_secs_f64() };
        if !arguments.json {
            let pace = part.tally.seconds / part.took_s;
            say!("{title}\n{}Pace        {:.1} s, {pace:.0} times real time\n", part.tally, part.took_s)?;
        }
        Ok(part)
    }

    fn in_json(&self) -> Value {
        let Tally { seconds, metres, rows, plants, weeded_metres, harmed, mistaken, blind, .. } = self.tally;
        let Tally { faults, alarms, resets, warnings, violations, .. } = &self.tally;
        json!({
            "part": self.name,
            "seconds": seconds,
            "took_s": self.took_s,
            "metres": metres,
            "rows": rows,
            "plants": plants,
            "weeded_metres": weeded_metres,
            "harmed": harmed,
            "mistaken": mistaken,
            "blind": blind,
            "faults": faults,
            "alarms": alarms,
            "resets": resets,
            "warnings": warnings,
            "violations": violations,
        })
    }
}
