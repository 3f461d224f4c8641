//! The benchmark's figures as tables, beside published figures.
//!
//! The other figures were measured on the same chip in simavr at 16 MHz, with 4 cycles added for an interrupt's entry,
//! and a serial line of ten bits a byte: Arduino core 1.8.7 with avr-gcc 5.4 -Os, the Encoder library of PJRC, and
//! encoder handlers and classifiers in hand-written assembly.

use super::classifier::ClassifierCosts;
use super::encoder::{Direction, JITTER, Load, Rate, Turning};
use super::servo::{COUNTS_PER_S, Jitter};
use super::swings::Lateness;
use super::weeding::FirmwareCosts;
use comfy_table::{CellAlignment, Table, presets};
use knn_bench::Task;
use uno::CYCLES_PER_SECOND;

/// All results of the benchmark.
#[derive(Clone, Debug, PartialEq)]
pub struct Figures {
    /// The classifier alone.
    pub classifier: ClassifierCosts,
    /// The firmware at work.
    pub firmware: FirmwareCosts,
    /// The highest rate for each kind of turning.
    pub rates: Vec<(Turning, Rate)>,
    /// The servo's pulses.
    pub jitter: Jitter,
    /// The swings of many rows at 2.5 km/h.
    pub lateness: Lateness,
}

/// The four ways of turning the encoder beside each load.
pub const TURNINGS: [Turning; 8] = [
    turning(Load::Idle, Direction::Forward, 0.0),
    turning(Load::Idle, Direction::Backward, 0.0),
    turning(Load::Idle, Direction::Forward, JITTER),
    turning(Load::Idle, Direction::Backward, JITTER),
    turning(Load::Telemetry, Direction::Forward, 0.0),
    turning(Load::Telemetry, Direction::Backward, 0.0),
    turning(Load::Telemetry, Direction::Forward, JITTER),
    turning(Load::Telemetry, Direction::Backward, JITTER),
];

const fn turning(load: Load, direction: Direction, jitter: f64) -> Turning {
    Turning { load, direction, jitter }
}

impl Figures {
    /// All tables, the comparison with others first.
    pub fn tables(&self) -> [Table; 6] {
        [self.others(), self.rates(), self.times(), self.interrupts(), self.classifier(), self.memory()]
    }

    /// This firmware's figures beside others. A ratio above 1 is in its favour.
    fn others(&self) -> Table {
        let header = ["", "this firmware", "Arduino sketch", "best library", "assembly"];
        let mut table = number_table(&header);
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
        if let Some(cycles) = self.encoder_cycles() {
            // The assembly version stores the direction, as this firmware does. Without that it takes 24 cycles.
            fewer_is_better("cycles of an encoder edge", cycles, 0, [Some(233.0), Some(144.0), Some(41.0)]);
        }
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
        fewer_is_better("flash, bytes", self.firmware.size.flash as f64, 0, [Some(8_374.0), None, None]);
        fewer_is_better("static SRAM and heap, bytes", self.firmware.size.sram as f64, 0, [Some(883.0), None, None]);
        table
    }

    /// The lowest of the rates beside a load, without jitter.
    fn lowest_rate(&self, load: Load) -> f64 {
        let steady = self.rates.iter().filter(|(turning, _)| turning.load == load && turning.jitter == 0.0);
        steady.map(|(_, rate)| rate.counts_per_s).fold(f64::INFINITY, f64::min)
    }

    /// Mean cycles of an edge of the encoder.
    fn encoder_cycles(&self) -> Option<f64> {
        let handlers = &self.firmware.interrupts.handlers;
        let encoder: Vec<_> = ENCODER_VECTORS.iter().filter_map(|vector| handlers.get(vector)).collect();
        let (total, count) = encoder.iter().fold((0, 0), |sum, handler| (sum.0 + handler.total, sum.1 + handler.count));
        (count > 0).then(|| total as f64 / count as f64)
    }

    /// One line a load, with the highest rate in each direction.
    fn rates(&self) -> Table {
        let mut table = number_table(&[
            "highest counts/s without a lost count,\nfor any phase of the edges",
            "forward",
            "backward",
            "30 % jitter,\nforward",
            "30 % jitter,\nbackward",
            "serial line\nin use",
        ]);
        for (name, load) in [("idle", Load::Idle), ("status streaming, beam flickering", Load::Telemetry)] {
            let rates: Vec<Rate> =
                self.rates.iter().filter(|(turning, _)| turning.load == load).map(|&(_, rate)| rate).collect();
            let least_share = rates.iter().map(|rate| rate.line_share).fold(1.0, f64::min);
            let rates = rates.iter().map(|rate| thousands(rate.counts_per_s));
            table.add_row([name.to_owned()].into_iter().chain(rates).chain([format!("{:.0} %", least_share * 100.0)]));
        }
        table
    }

    /// The loop's turns, the servo's jitter, and the delays of the swings.
    fn times(&self) -> Table {
        let mut table = number_table(&["times", "cycles", "ms", "ticks at\n2.5 km/h"]);
        let of_cycles = |cycles: f64| {
            let ms = cycles * 1e3 / CYCLES_PER_SECOND as f64;
            [thousands(cycles), format!("{ms:.2}"), String::new()]
        };
        let of_ticks = |ticks: f64| {
            let ms = self.lateness.milliseconds(ticks);
            [String::new(), format!("{ms:.2}"), format!("{ticks:.1}")]
        };
        let turns = self.firmware.turns;
        let swings = self.lateness.errors_ticks.len();
        let (earliest, latest) = self.lateness.span_ticks();
        for (name, figures) in [
            ("longest turn of the loop, weeding with its status streaming".to_owned(), of_cycles(turns.longest as f64)),
            ("mean turn".to_owned(), of_cycles(turns.mean())),
            (
                format!("jitter of {} servo pulses at {COUNTS_PER_S} counts/s: width", self.jitter.pulses),
                of_cycles(self.jitter.width_cycles as f64),
            ),
            ("frame of 20 ms".to_owned(), of_cycles(self.jitter.frame_cycles as f64)),
            (format!("from a swing's due place to the servo's pin, earliest of {swings}"), of_ticks(earliest)),
            ("latest".to_owned(), of_ticks(latest)),
            ("mean distance".to_owned(), of_ticks(self.lateness.mean_ticks())),
        ] {
            table.add_row([name].into_iter().chain(figures));
        }
        table
    }

    /// A line per interrupt, and how long they are off.
    fn interrupts(&self) -> Table {
        let mut table = number_table(&["interrupt", "times", "fewest\ncycles", "mean", "most"]);
        for (&vector, handler) in &self.firmware.interrupts.handlers {
            table.add_row([
                interrupt_name(vector),
                handler.count.to_string(),
                handler.fewest.to_string(),
                format!("{:.0}", handler.mean()),
                handler.most.to_string(),
            ]);
        }
        let off = [
            ("longest stretch with interrupts off", self.firmware.interrupts.longest_off),
            ("longest critical section outside of them", self.firmware.interrupts.longest_critical_section),
        ];
        for (name, cycles) in off {
            table.add_row([name, "", "", "", &cycles.to_string()]);
        }
        table
    }

    /// A line per task of the classifier.
    fn classifier(&self) -> Table {
        let mut table = number_table(&["classifier", "fewest\ncycles", "mean", "most"]);
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

    /// The memory that the firmware and its classifier take.
    fn memory(&self) -> Table {
        let mut table = number_table(&["memory", "bytes"]);
        for (name, bytes) in [
            ("flash", self.firmware.size.flash),
            ("static SRAM", self.firmware.size.sram),
            ("stack at its deepest", self.firmware.stack as u64),
            ("stack of a classification", self.classifier.stack.into()),
        ] {
            table.add_row([name.to_owned(), bytes.to_string()]);
        }
        table
    }
}

/// A table without inner lines. Its columns from the second on are numbers.
fn number_table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(header.iter().copied());
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Another implementation's figure, and the ratio to it.
fn beside(theirs: String, ratio: f64) -> String {
    format!("{theirs} (x {ratio:.2})")
}

/// A whole number with a comma every three digits.
fn thousands(number: f64) -> String {
    let digits = format!("{number:.0}");
    let mut grouped = String::with_capacity(digits.len() + digits.len() / 3);
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push(',');
        }
        grouped.push(digit);
    }
    grouped
}

/// The vectors that the encoder's pins can raise (data sheet, table 12-6): INT0, INT1 and PCINT2.
const ENCODER_VECTORS: [u8; 3] = [1, 2, 5];

/// The firmware's use of a vector (data sheet, table 12-6).
fn interrupt_name(vector: u8) -> String {
    match vector {
        1 => "encoder A (INT0)".to_owned(),
        2 => "encoder B (INT1)".to_owned(),
        3 => "beam (PCINT0)".to_owned(),
        5 => "encoder (PCINT2)".to_owned(),
        6 => "watchdog (WDT)".to_owned(),
        14 => "heartbeat (TIMER0_COMPA)".to_owned(),
        15 => "heartbeat (TIMER0_COMPB)".to_owned(),
        16 => "clock (TIMER0_OVF)".to_owned(),
        18 => "serial, received (USART_RX)".to_owned(),
        19 => "serial, sending (USART_UDRE)".to_owned(),
        other => format!("vector {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_large_number_is_read_in_threes() {
        assert_eq!([7.0, 999.4, 1000.0, 744_111.0, 1e6].map(thousands), ["7", "999", "1,000", "744,111", "1,000,000"]);
    }
}
