//! The classifier alone: cycles of a classification, from the bench's ELF.
//!
//! The bench (`bench/` in the workspace) raises D13 around each call, so the cycles between the edges are exact. It
//! also compares every answer of the search in flash with a plain search. If they differ, no figure is returned.

use crate::run::PROGRESS_CYCLES;
use anyhow::{Context, Result, bail, ensure};
use field::wiring;
use knn_bench::{QUERIES, Task};
use serde::Serialize;
use std::path::Path;
use uno::{CYCLES_PER_SECOND, Uno};

/// Cycles that D13 is high in addition to the call: the instruction that raises it (`sbi`, 2).
const EDGE_CYCLES: u64 = 2;

/// Longest time of the bench: ten times its usual time.
const BENCH_CYCLES: u64 = 20 * CYCLES_PER_SECOND;

const RIGHT_ELF: &str = "run the ELF that `cargo bench-firmware` makes";

/// Cycles of the calls of one task.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
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

/// The classifier's costs.
#[derive(Clone, Debug, PartialEq)]
pub struct ClassifierCosts {
    /// The cycles of each task.
    pub tasks: Vec<(Task, Cycles)>,
    /// Bytes of stack below the bench's own.
    pub stack: u16,
}

/// Runs the bench at `elf`. `progress` gets the share of the calls done, from 0 to 1.
///
/// # Errors
/// If the ELF cannot be run or is not the bench, or its search differs from the plain one.
pub fn classifier(elf: &Path, mut progress: impl FnMut(f64)) -> Result<ClassifierCosts> {
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
            // The plain search comes after all measurements, and needs more stack.
            stack = (calls.len() < expected).then(|| uno.deepest_stack() as u16).or(stack);
        } else {
            match variable(&uno, "DIFFERENT_ANSWERS")? {
                u16::MAX => {}
                0 => break,
                different => bail!(
                    "{different} answers of the search in flash differ from the plain search's: its cycles mean nothing"
                ),
            }
        }
    }
    let seen = calls.len();
    ensure!(seen == expected, "the bench showed {seen} of {expected} calls on D13: {RIGHT_ELF}");
    // The stack grows down from the end of SRAM, and its pointer stands on the first free byte.
    let own = 0x8FF - variable(&uno, "STACK_POINTER")?;
    let cycles = calls.chunks(QUERIES).filter_map(Cycles::of);
    Ok(ClassifierCosts { tasks: Task::ALL.into_iter().zip(cycles).collect(), stack: stack.unwrap_or(own) - own })
}

/// Cycles of each call that D13 has shown.
fn call_cycles(uno: &Uno) -> Vec<u64> {
    let edges: Vec<_> = uno.changes().iter().filter(|change| change.pin == wiring::LED).collect();
    edges.chunks_exact(2).map(|edges| edges[1].cycle - edges[0].cycle - EDGE_CYCLES).collect()
}

fn variable(uno: &Uno, name: &'static str) -> Result<u16> {
    let bytes = uno.read(name).and_then(|bytes| bytes.try_into().ok());
    bytes.map(u16::from_le_bytes).with_context(|| format!("the bench has no variable `{name}`: {RIGHT_ELF}"))
}
