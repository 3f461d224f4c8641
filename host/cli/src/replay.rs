//! `weeder replay`: repeats the decisions of a log on the PC.

use anyhow::{Context, Result};
use clap::Args;
use frame::{Finding, Results, source};
use logbook::{log, replay};
use serde_json::json;
use std::path::PathBuf;

#[derive(Args)]
#[command(after_help = "\
It shows the first difference between log and replay, and the status is then 1.\n\
A swing may differ by 12 ticks plus the distance of 25 ms: the log has the speed ten times a second.\n\
A line that was lost on the way to the log shows as a difference too.\n\nExample:\n  weeder replay row.csv --json | jq .difference")]
pub struct Arguments {
    /// A log of `weeder record` or `weeder monitor --log`; - for standard input.
    #[arg(value_name = "LOG.csv", value_parser = source::file())]
    log: PathBuf,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let name = arguments.log.display();
    let replayed = replay::replay(&log::read(&arguments.log)?).with_context(|| format!("{name} cannot be replayed"))?;
    let difference = replayed.difference.as_ref().map(ToString::to_string);
    if arguments.json {
        let result = json!({
            "objects": replayed.objects,
            "swings": replayed.swings,
            "alarms": replayed.alarms,
            "farthest_swing_ticks": replayed.farthest_swing,
            "difference": difference,
            "notes": replayed.notes,
        });
        writeln!(Results, "{result:#}")?;
    } else {
        for note in &replayed.notes {
            writeln!(Results, "Note: {note}")?;
        }
        writeln!(
            Results,
            "The same: {} detections, {} alarms and {} swings, which differ by {} ticks at the most",
            replayed.objects, replayed.alarms, replayed.swings, replayed.farthest_swing
        )?;
        match &difference {
            Some(difference) => writeln!(Results, "But {name}, {difference}")?,
            None => writeln!(Results, "The decisions of {name} are those of this version")?,
        }
    }
    Ok(Finding::of(difference.is_none()))
}
