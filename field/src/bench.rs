//! What the firmware costs, in cycles and bytes, counted on the virtual Uno.
//!
//! [`classifier`] runs the bench's ELF, which raises D13 around each call that it measures: the cycles between the edges
//! are exact. [`firmware`] runs the real firmware on a row and reports its interrupts. [`classifier_table`],
//! [`interrupt_table`] and [`memory_table`] show the figures to people, the classifier's beside those of others.

use crate::firmware::{ImageError, Size};
use crate::machine::Machine;
use crate::motion::mm_s;
use crate::planting::{Planting, PlantingError};
use crate::signal::{CYCLES_PER_SECOND, Pin};
use crate::trial::{self, Trial};
use crate::uno::{InterruptStatistics, Uno, UnoError};
use crate::verdict::Timing;
use comfy_table::{CellAlignment, Table, presets};
use knn_bench::{QUERIES, Task};
use std::path::Path;
use thiserror::Error;

/// Cycles that D13 is high for longer than the call: those of the instruction that raises it (`sbi`, 2).
const EDGE_CYCLES: u64 = 2;

/// Longest time that the bench may take: ten times what it does.
const BENCH_CYCLES: u64 = 20 * CYCLES_PER_SECOND;

/// Simulated time between two reports of progress.
const PROGRESS_CYCLES: u64 = CYCLES_PER_SECOND / 20;

/// Cycles of others for one classification among 32 examples of five features, k = 3, on the same chip in simavr.
const OTHERS: [(&str, f64); 3] =
    [("Arduino_KNN\n(float)", 92_309.0), ("C, -O2", 3_910.0), ("assembly\nalone", 1_707.0)];

/// The number of examples for which the others were measured.
const OTHERS_EXAMPLES: u8 = 32;

/// Why there are no figures.
#[derive(Debug, Error)]
pub enum BenchError {
    /// The virtual Uno stopped.
    #[error(transparent)]
    Uno(#[from] UnoError),
    /// The ELF cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The row of the firmware's run does not grow.
    #[error(transparent)]
    Planting(#[from] PlantingError),
    /// The bench did not run through.
    #[error("the bench showed {seen} of {expected} calls on D13: run the ELF that `cargo bench-firmware` makes")]
    Unfinished {
        /// Calls seen.
        seen: usize,
        /// Calls that make a complete bench.
        expected: usize,
    },
    /// The search in flash is wrong.
    #[error("{0} answers of the search in flash differ from the plain search's: its cycles mean nothing")]
    Different(u16),
    /// The ELF has no such variable.
    #[error("the bench has no variable `{0}`: run the ELF that `cargo bench-firmware` makes")]
    NoVariable(&'static str),
}

/// Cycles of the calls of one task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cycles {
    /// The fastest call.
    pub fewest: u64,
    /// The mean of all calls.
    pub mean: f64,
    /// The slowest call.
    pub most: u64,
}

impl Cycles {
    /// `None` without a call.
    fn of(calls: &[u64]) -> Option<Self> {
        let (fewest, most) = (*calls.iter().min()?, *calls.iter().max()?);
        Some(Self { fewest, mean: calls.iter().sum::<u64>() as f64 / calls.len() as f64, most })
    }
}

/// What the classifier costs.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassifierCosts {
    /// The cycles of each task.
    pub tasks: Vec<(Task, Cycles)>,
    /// Bytes of stack below the bench's own.
    pub stack: u16,
}

/// Runs the bench at `elf`. `progress` is told the share of the calls done, from 0 to 1.
///
/// # Errors
/// Where the ELF cannot be run or is not the bench, and where its search answers otherwise than the plain one.
pub fn classifier(elf: &Path, mut progress: impl FnMut(f64)) -> Result<ClassifierCosts, BenchError> {
    let mut uno = Uno::boot(elf)?;
    variable(&uno, "DIFFERENT_ANSWERS")?;
    let expected = Task::ALL.len() * QUERIES;
    let mut calls = Vec::new();
    let mut stack = None;
    while uno.cycle() < BENCH_CYCLES {
        uno.run_until(uno.cycle() + PROGRESS_CYCLES)?;
        if calls.len() < expected {
            calls = call_cycles(&uno);
            progress(calls.len() as f64 / expected as f64);
            // The plain search comes after all that is measured, and needs more stack.
            stack = (calls.len() < expected).then(|| uno.deepest_stack() as u16).or(stack);
        } else {
            match variable(&uno, "DIFFERENT_ANSWERS")? {
                u16::MAX => {}
                0 => break,
                different => return Err(BenchError::Different(different)),
            }
        }
    }
    if calls.len() != expected {
        return Err(BenchError::Unfinished { seen: calls.len(), expected });
    }
    // The stack grows down from the end of SRAM, and its pointer stands on the first free byte.
    let own = 0x8FF - variable(&uno, "STACK_POINTER")?;
    let cycles = calls.chunks(QUERIES).filter_map(Cycles::of);
    Ok(ClassifierCosts { tasks: Task::ALL.into_iter().zip(cycles).collect(), stack: stack.unwrap_or(own) - own })
}

/// Cycles of each call that D13 has shown.
fn call_cycles(uno: &Uno) -> Vec<u64> {
    let edges: Vec<_> = uno.changes().iter().filter(|change| change.pin == Pin::Led).collect();
    edges.chunks_exact(2).map(|edges| edges[1].cycle - edges[0].cycle - EDGE_CYCLES).collect()
}

fn variable(uno: &Uno, name: &'static str) -> Result<u16, BenchError> {
    let bytes = uno.read(name).and_then(|bytes| bytes.try_into().ok());
    bytes.map(u16::from_le_bytes).ok_or(BenchError::NoVariable(name))
}

/// What the firmware costs while it works.
#[derive(Clone, Debug, PartialEq)]
pub struct FirmwareCosts {
    /// Its interrupts.
    pub interrupts: InterruptStatistics,
    /// Flash and static SRAM.
    pub size: Size,
    /// Bytes of the stack at its deepest.
    pub stack: usize,
}

/// Speed of the firmware's run, the fastest of the paper's.
const SPEED_KM_H: f64 = 2.5;

/// Has the firmware at `elf` weed a row of ten plants and three tall weeds at 2.5 km/h, with its events reported and its
/// status asked for all the while. `progress` is told the share of the motion done, from 0 to 1.
///
/// # Errors
/// Where the ELF cannot be run.
pub fn firmware(elf: &Path, mut progress: impl FnMut(f64)) -> Result<FirmwareCosts, BenchError> {
    let planting = Planting {
        plants: 10,
        spacing_mm: 500.0,
        spacing_scatter_mm: 40.0,
        canopy_mm: 150.0,
        canopy_scatter_mm: 20.0,
        weeds: 3,
        ragged: true,
    };
    let trial = Trial::at_speed(planting.grow(1)?, Machine::default(), Timing::default(), mm_s(SPEED_KM_H));
    let mut uno = trial::boot(elf, &[trial.machine.beam_before(&trial.row, &trial.motion)])?;
    uno.send(b"events on\nstart now\n");
    uno.run_for_ms(100)?;
    uno.measure_interrupts();
    let start = uno.cycle();
    uno.drive(trial.machine.pin_changes(&trial.row, &trial.motion, start));
    let cycles = (trial.motion.duration_s() * CYCLES_PER_SECOND as f64) as u64;
    while uno.cycle() < start + cycles {
        uno.send(b"status\n");
        uno.run_until(uno.cycle() + PROGRESS_CYCLES)?;
        progress((uno.cycle() - start) as f64 / cycles as f64);
    }
    Ok(FirmwareCosts {
        interrupts: uno.interrupt_statistics().cloned().unwrap_or_default(),
        size: Size::read(elf)?,
        stack: uno.deepest_stack(),
    })
}

/// A table without inner lines whose columns, from the second on, are numbers.
fn number_table(header: Vec<String>) -> Table {
    let mut table = Table::new();
    table.load_style(presets::UTF8_BORDERS_ONLY).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// A line per task, with how many times as many cycles others take for the same.
pub fn classifier_table(costs: &ClassifierCosts) -> Table {
    let header = ["classifier", "fewest\ncycles", "mean", "most"].map(str::to_owned);
    let others = OTHERS.map(|(name, cycles)| format!("{name}\n{cycles:.0}"));
    let mut table = number_table(header.into_iter().chain(others).collect());
    for (task, cycles) in &costs.tasks {
        let (name, compared) = match task {
            Task::Quantise => ("scale five features to bytes".to_owned(), false),
            Task::Classify(count) => (format!("{count} random examples, k = 3"), *count == OTHERS_EXAMPLES),
            Task::ClassifyObjects => ("the firmware's own examples, k = 3".to_owned(), false),
        };
        let figures = [cycles.fewest.to_string(), format!("{:.0}", cycles.mean), cycles.most.to_string()];
        let ratios = OTHERS.map(|(_, theirs)| match compared {
            true => format!("x {:.1}", theirs / cycles.mean),
            false => String::new(),
        });
        table.add_row([name].into_iter().chain(figures).chain(ratios));
    }
    table
}

/// A line per interrupt, and the longest stretch without any.
pub fn interrupt_table(costs: &FirmwareCosts) -> Table {
    let header = ["interrupt", "times", "fewest\ncycles", "mean", "most"].map(str::to_owned);
    let mut table = number_table(header.into());
    for (&vector, handler) in &costs.interrupts.handlers {
        table.add_row([
            interrupt_name(vector),
            handler.count.to_string(),
            handler.fewest.to_string(),
            format!("{:.0}", handler.mean()),
            handler.most.to_string(),
        ]);
    }
    let longest = costs.interrupts.longest_off.to_string();
    table.add_row(["longest stretch with interrupts off", "", "", "", &longest]);
    table
}

/// What the firmware uses a vector for (data sheet, table 12-6).
fn interrupt_name(vector: u8) -> String {
    match vector {
        3 => "beam (PCINT0)".to_owned(),
        5 => "encoder (PCINT2)".to_owned(),
        11 => "servo (TIMER1_COMPA)".to_owned(),
        13 => "servo (TIMER1_OVF)".to_owned(),
        16 => "clock (TIMER0_OVF)".to_owned(),
        18 => "serial, received (USART_RX)".to_owned(),
        19 => "serial, sending (USART_UDRE)".to_owned(),
        other => format!("vector {other}"),
    }
}

/// The memory that the firmware and its classifier take.
pub fn memory_table(classifier: &ClassifierCosts, firmware: &FirmwareCosts) -> Table {
    let mut table = number_table(["memory", "bytes"].map(str::to_owned).into());
    for (name, bytes) in [
        ("flash", firmware.size.flash),
        ("static SRAM", firmware.size.sram),
        ("stack at its deepest", firmware.stack as u64),
        ("stack of a classification", classifier.stack.into()),
    ] {
        table.add_row([name.to_owned(), bytes.to_string()]);
    }
    table
}
