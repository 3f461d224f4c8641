//! `weeder bench-uno`: limits and costs of the firmware and its classifier on an Arduino Uno.

use anyhow::Result;
use clap::Args;
use frame::{Results, with_bar};
use knn_bench::Task;
use serde_json::{Value, json};
use uno::elf::Size;
use uno_run::bench::table::Figures;
use uno_run::bench::{self, encoder, servo, swings};
use uno_run::firmware;

#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder bench-uno > figures.txt
  weeder bench-uno --json | jq .memory.flash_bytes")]
pub struct Arguments {
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
}

/// The rows whose swings are compared with their ideal positions.
const ROWS: u64 = 50;

pub fn run(arguments: &Arguments) -> Result<()> {
    let bench_elf = firmware::BENCH.elf()?;
    let elf = firmware::build()?;
    let classifier = with_bar("classifying", |show| bench::classifier(&bench_elf, show))?;
    let rates = with_bar("turning the encoder", |show| encoder::highest_rates(&elf, show))?;
    let jitter = with_bar("watching the servo", |show| servo::jitter(&elf, show))?;
    let lateness = with_bar("swinging", |show| swings::lateness(&elf, &swings::Rows::at_walking_speed(0..ROWS), show))?;
    let figures = Figures { classifier, size: Size::read(&elf)?, rates, jitter, lateness };
    if arguments.json {
        return writeln!(Results, "{:#}", in_json(&figures));
    }
    for table in figures.tables() {
        writeln!(Results, "{table}")?;
    }
    Ok(())
}

/// The measured figures. Published figures are only in the tables.
fn in_json(Figures { classifier, size, rates, jitter, lateness }: &Figures) -> Value {
    let tasks: Vec<Value> = classifier
        .tasks
        .iter()
        .map(|&(task, cycles)| {
            let (name, examples) = match task {
                Task::Quantise => ("quantise", None),
                Task::Classify(examples) => ("classify", Some(examples)),
                Task::ClassifyObjects => ("classify_objects", None),
            };
            json!({ "task": name, "examples": examples, "cycles": cycles })
        })
        .collect();
    let (earliest_ticks, latest_ticks) = lateness.span_ticks();
    json!({
        "encoder": rates,
        "servo": jitter,
        "swings": {
            "count": lateness.errors_ticks.len(),
            "earliest_ticks": earliest_ticks,
            "latest_ticks": latest_ticks,
            "mean_distance_ticks": lateness.mean_ticks(),
            "ticks_per_s": lateness.ticks_per_s,
        },
        "classifier": tasks,
        "memory": {
            "flash_bytes": size.flash,
            "static_sram_bytes": size.sram,
            "classification_stack_bytes": classifier.stack,
        },
    })
}
