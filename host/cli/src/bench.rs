//! `weeder bench-uno`: limits and costs of the firmware and its classifier on an Arduino Uno.

use crate::output::say;
use crate::progress::Progress;
use anyhow::Result;
use clap::Args;
use knn_bench::Task;
use serde_json::{Value, json};
use trial::bench::encoder::{Direction, Load};
use trial::bench::table::{Figures, TURNINGS};
use trial::bench::{self, Cycles, encoder, servo, swings};
use trial::firmware;

/// How the figures are to be printed.
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

/// Measures and prints the figures.
///
/// # Errors
/// If the bench or the firmware cannot be built or run.
pub fn run(arguments: &Arguments) -> Result<()> {
    let bench_elf = firmware::build_bench()?;
    let elf = firmware::build()?;
    let bar = Progress::new("classifying");
    let classifier = bench::classifier(&bench_elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("weeding");
    let firmware = bench::weeding(&elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("turning the encoder");
    let share_each = 1.0 / TURNINGS.len() as f64;
    let mut rates = Vec::new();
    for (done, turning) in TURNINGS.into_iter().enumerate() {
        let rate = encoder::highest_rate(&elf, turning, |share| bar.show((done as f64 + share) * share_each))?;
        rates.push((turning, rate));
    }
    bar.finish();
    let bar = Progress::new("watching the servo");
    let jitter = servo::jitter(&elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("swinging");
    let lateness = swings::lateness(&elf, &swings::Rows::at_walking_speed(0..ROWS), |share| bar.show(share))?;
    bar.finish();
    let figures = Figures { classifier, firmware, rates, jitter, lateness };
    if arguments.json {
        return say!("{:#}", in_json(&figures));
    }
    for table in figures.tables() {
        say!("{table}")?;
    }
    Ok(())
}

/// The measured values, without the published figures in the tables.
fn in_json(figures: &Figures) -> Value {
    let Figures { classifier, firmware, rates, jitter, lateness } = figures;
    let rates: Vec<Value> = rates
        .iter()
        .map(|(turning, rate)| {
            json!({
                "load": match turning.load { Load::Idle => "idle", Load::Telemetry => "telemetry" },
                "direction": match turning.direction { Direction::Forward => "forward", Direction::Backward => "backward" },
                "jitter": turning.jitter,
                "counts_per_s": rate.counts_per_s,
                "line_share": rate.line_share,
            })
        })
        .collect();
    let handlers: Vec<Value> = firmware
        .interrupts
        .handlers
        .iter()
        .map(|(vector, handler)| {
            json!({ "vector": vector, "times": handler.count, "cycles": in_cycles(handler.fewest, handler.mean(), handler.most) })
        })
        .collect();
    let tasks: Vec<Value> = classifier
        .tasks
        .iter()
        .map(|&(task, Cycles { fewest, mean, most })| {
            let (name, examples) = match task {
                Task::Quantise => ("quantise", None),
                Task::Classify(examples) => ("classify", Some(examples)),
                Task::ClassifyObjects => ("classify_objects", None),
            };
            json!({ "task": name, "examples": examples, "cycles": in_cycles(fewest, mean, most) })
        })
        .collect();
    let (earliest_ticks, latest_ticks) = lateness.span_ticks();
    json!({
        "encoder": rates,
        "turns": { "count": firmware.turns.count, "mean_cycles": firmware.turns.mean(), "longest_cycles": firmware.turns.longest },
        "interrupts": {
            "handlers": handlers,
            "longest_off_cycles": firmware.interrupts.longest_off,
            "longest_critical_section_cycles": firmware.interrupts.longest_critical_section,
        },
        "servo": { "pulses": jitter.pulses, "width_jitter_cycles": jitter.width_cycles, "frame_jitter_cycles": jitter.frame_cycles },
        "swings": {
            "count": lateness.errors_ticks.len(),
            "earliest_ticks": earliest_ticks,
            "latest_ticks": latest_ticks,
            "mean_distance_ticks": lateness.mean_ticks(),
            "ticks_per_s": lateness.ticks_per_s,
        },
        "classifier": tasks,
        "memory": {
            "flash_bytes": firmware.size.flash,
            "static_sram_bytes": firmware.size.sram,
            "deepest_stack_bytes": firmware.stack,
            "classification_stack_bytes": classifier.stack,
        },
    })
}

fn in_cycles(fewest: u64, mean: f64, most: u64) -> Value {
    json!({ "fewest": fewest, "mean": mean, "most": most })
}

#[cfg(test)]
mod tests {
    use super::*;
    use trial::bench::encoder::{Rate, Turning};
    use trial::bench::servo::Jitter;
    use trial::bench::swings::Lateness;
    use trial::bench::{ClassifierCosts, FirmwareCosts};
    use uno::elf::Size;
    use uno::{InterruptStatistics, Turns};

    #[test]
    fn a_program_finds_each_figure_by_its_name_and_unit() {
        let figures = Figures {
            classifier: ClassifierCosts {
                tasks: vec![(Task::Classify(32), Cycles { fewest: 1, mean: 2.5, most: 4 })],
                stack: 50,
            },
            firmware: FirmwareCosts {
                interrupts: InterruptStatistics { longest_off: 70, ..Default::default() },
                turns: Turns { count: 2, longest: 9, total: 16 },
                line_share: 1.0,
                size: Size { flash: 29_000, sram: 900 },
                stack: 300,
            },
            rates: vec![(
                Turning { load: Load::Telemetry, direction: Direction::Backward, jitter: 0.0 },
                Rate { counts_per_s: 90_000.0, line_share: 0.9 },
            )],
            jitter: Jitter { width_cycles: 0, frame_cycles: 8, pulses: 100 },
            lateness: Lateness {
                errors_ticks: vec![-1.0, 3.0],
                ticks_per_s: 1326.0,
                plants: 1,
                not_kept: 0,
                damaged: 0,
                wrong_positions: 0,
            },
        };
        let found = in_json(&figures);
        for (pointer, expected) in [
            ("/memory/flash_bytes", json!(29_000)),
            ("/encoder/0/load", json!("telemetry")),
            ("/encoder/0/direction", json!("backward")),
            ("/encoder/0/counts_per_s", json!(90_000.0)),
            ("/turns/mean_cycles", json!(8.0)),
            ("/interrupts/longest_off_cycles", json!(70)),
            ("/swings/latest_ticks", json!(3.0)),
            ("/classifier/0/examples", json!(32)),
            ("/classifier/0/cycles/mean", json!(2.5)),
        ] {
            assert_eq!(found.pointer(pointer), Some(&expected), "{pointer} in {found:#}");
        }
    }
}
