//! The benchmark's figures as tables, beside published figures.
//!
//! The other figures were measured on the same chip in simavr at 16 MHz, with 4 cycles added for an interrupt's entry,
//! and a serial line of ten bits a byte: Arduino core 1.8.7 with avr-gcc 5.4 -Os, the Encoder library of PJRC, and
//! encoder handlers and classifiers in hand-written assembly.

use super::classifier::ClassifierCosts;
use super::encoder::{Load, Rate};
use super::servo::Jitter;
use super::swings::Lateness;
use crate::report::number_table;
use comfy_table::Table;
use knn_bench::Task;
use uno::CYCLES_PER_SECOND;
use uno::elf::Size;

/// All results of the benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// The classifier alone.
    pub classifier: ClassifierCosts,
    /// The firmware's flash and static SRAM.
    pub size: Size,
    /// The highest rate of each way of turning the encoder.
    pub rates: Vec<Rate>,
    /// The servo's pulses.
    pub jitter: Jitter,
    /// The swings of many rows at 2.5 km/h.
    pub lateness: Lateness,
}

impl Figures {
    /// All tables, the comparison with others first.
    pub fn tables(&self) -> [Table; 3] {
        [self.others(), self.rates(), self.classifier()]
    }

    /// This firmware's figures beside others. A ratio above 1 is in its favour.
    fn others(&self) -> Table {
        let header = ["", "this firmware", "Arduino sketch", "best library", "assembly"];
        let mut table = number_table(header, 1);
        let idle = self.lowest_rate(Load::Idle);
        let busy = self.lowest_rate(Load::Telemetry);
        for (name, ours, others) in [
            ("counts/s without loss, alone", idle, [67_770.0, 108_061.0, 744_111.0]),
            ("  beside serial at 115200", busy, [49_429.0, 82_195.0, 206_225.0]),
            ("  and a servo", busy, [36_906.0, 55_090.0, 128_543.0]),
        ] {
            let others = others.map(|theirs| beside(thousands(theirs), ours / theirs));
            table.add_row([name.to_owned(), thousands(ours)].into_iter().chain(others));
        }
        let mut fewer_is_better = |name: &str, ours: f64, decimals: usize, others: [Option<f64>; 3]| {
            let figure = |figure: f64| if decimals > 0 { format!("{figure:.decimals$}") } else { thousands(figure) };
            let others = others.map(|theirs| match theirs {
                Some(theirs) if ours > 0.0 => beside(figure(theirs), theirs / ours),
                Some(theirs) => figure(theirs),
                None => String::new(),
            });
            table.add_row([name.to_owned(), figure(ours)].into_iter().chain(others));
        };
        // The one in assembly remembers the direction, as ours does; without that it takes 24.
        let others = [Some(233.0), Some(144.0), Some(41.0)];
        fewer_is_better("cycles of an encoder edge", self.jitter.edge_cycles, 0, others);
        let classification = self.classifier.tasks.iter().find(|(task, _)| *task == Task::Classify(32));
        if let Some((_, cycles)) = classification {
            let others = [Some(92_309.0), Some(3_910.0), Some(1_707.0)];
            fewer_is_better("cycles to classify, 32 examples", cycles.mean, 0, others);
        }
        let jitter_us = self.jitter.width_cycles as f64 * 1e6 / CYCLES_PER_SECOND as f64;
        fewer_is_better("servo jitter, 20,000 counts/s, us", jitter_us, 1, [Some(23.6), Some(16.9), Some(0.0)]);
        let lateness = self.lateness.worst_ticks();
        fewer_is_better("worst swing at 2.5 km/h, ticks", lateness, 1, [Some(31.6), None, None]);
        // A classifier and a serial line, without a schedule of several plants, settings, alarms, or field examples.
        fewer_is_better("flash, bytes", self.size.flash as f64, 0, [Some(8_374.0), None, None]);
        fewer_is_better("static SRAM and heap, bytes", self.size.sram as f64, 0, [Some(883.0), None, None]);
        table
    }

    fn lowest_rate(&self, load: Load) -> f64 {
        let steady = self.rates.iter().filter(|rate| rate.turning.load == load && rate.turning.jitter == 0.0);
        steady.map(|rate| rate.counts_per_s).fold(f64::INFINITY, f64::min)
    }

    /// One line a load, with the highest rate in each direction.
    fn rates(&self) -> Table {
        let header = [
            "highest counts/s without a lost count,\nfor any phase of the edges",
            "forward",
            "backward",
            "30 % jitter,\nforward",
            "30 % jitter,\nbackward",
            "serial line\nin use",
        ];
        let mut table = number_table(header, 1);
        for (name, load) in [("idle", Load::Idle), ("status streaming, beam flickering", Load::Telemetry)] {
            let rates: Vec<&Rate> = self.rates.iter().filter(|rate| rate.turning.load == load).collect();
            let least_share = rates.iter().map(|rate| rate.line_share).fold(1.0, f64::min);
            let rates = rates.iter().map(|rate| thousands(rate.counts_per_s));
            table.add_row([name.to_owned()].into_iter().chain(rates).chain([format!("{:.0} %", least_share * 100.0)]));
        }
        table
    }

    /// A line per task of the classifier.
    fn classifier(&self) -> Table {
        let mut table = number_table(["classifier", "fewest\ncycles", "mean", "most"], 1);
        for (task, cycles) in &self.classifier.tasks {
            let name = match task {
                Task::Quantise => "scale five features to bytes".to_owned(),
                Task::Classify(count) => format!("{count} random examples, k = 3"),
                Task::ClassifyObjects => "the firmware's own examples, k = 3".to_owned(),
            };
            table.add_row([name, cycles.fewest.to_string(), format!("{:.0}", cycles.mean), cycles.most.to_string()]);
        }
        table
    }
}

/// Another implementation's figure, and the ratio to it.
fn beside(theirs: String, ratio: f64) -> String {
    format!("{theirs} (x {ratio:.2})")
}

/// A whole number with a comma every three digits.
fn thousands(number: f64) -> String {
    let backwards: Vec<char> = format!("{number:.0}").chars().rev().collect();
    let groups: Vec<String> = backwards.chunks(3).map(String::from_iter).collect();
    groups.join(",").chars().rev().collect()
}
