//! `weeder soak`: hours of the decisions and minutes of the real firmware, with everything going wrong now and then.

use crate::Finding;
use crate::progress::Progress;
use anyhow::Result;
use clap::{Args, builder::RangedU64ValueParser};
use field::firmware;
use field::soak::{self, Plan, SoakError, Tally};
use std::path::PathBuf;
use std::time::Instant;

/// What the user asks of a soak.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder soak                                        a day of the decisions, half an hour of the firmware
  weeder soak --hours 0 --uno-minutes 6 --faults 900    the firmware alone, with a fault every four seconds
The status is 1 where something happened that must not.")]
pub struct Arguments {
    /// Simulated hours of the decision core on the host.
    #[arg(long, default_value = "24", value_parser = RangedU64ValueParser::<u32>::new().range(0..=10_000))]
    hours: u32,
    /// Simulated minutes of the firmware on the virtual Uno.
    #[arg(long, default_value = "30", value_parser = RangedU64ValueParser::<u32>::new().range(0..=10_000))]
    uno_minutes: u32,
    /// Which of all the possible soaks: the same seed gives the same one.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Faults in a simulated hour, on average.
    #[arg(long, default_value = "120", value_parser = RangedU64ValueParser::<u32>::new().range(0..=10_000))]
    faults: u32,
    /// Run this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
}

/// Runs it and prints what it has shown.
///
/// # Errors
/// Where the firmware cannot be built or run.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let plan = Plan { seed: arguments.seed, faults_an_hour: arguments.faults.into() };
    let mut is_good = true;
    if arguments.hours > 0 {
        is_good &= report("The decision core on the host", |bar| {
            soak::hours(plan, arguments.hours.into(), |share| bar.show(share))
        })?;
    }
    if arguments.uno_minutes > 0 {
        let elf = match &arguments.elf {
            Some(path) => path.clone(),
            None => firmware::build()?,
        };
        is_good &= report("The firmware on the virtual Uno", |bar| {
            soak::minutes(plan, arguments.uno_minutes.into(), &elf, |share| bar.show(share))
        })?;
    }
    if is_good {
        return Ok(Finding::Good);
    }
    println!("To see it again: weeder soak --seed {} --faults {}", arguments.seed, arguments.faults);
    Ok(Finding::Bad)
}

/// Runs a part behind its progress bar and prints what it has shown; whether all was as it must be.
fn report(title: &'static str, work: impl FnOnce(&Progress) -> Result<Tally, SoakError>) -> Result<bool> {
    let began = Instant::now();
    let bar = Progress::new(title);
    let tally = work(&bar);
    bar.finish();
    let (tally, took_s) = (tally?, began.elapsed().as_secs_f64());
    println!("{title}\n{tally}Pace        {took_s:.1} s, {:.0} times real time\n", tally.seconds / took_s);
    Ok(tally.violations.is_empty())
}
