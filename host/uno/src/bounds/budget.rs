//! What a firmware may need at most, as a file says it, and whether it keeps to that.

use super::loops::LoopBounds;
use super::proved::{Bounds, Input};
use serde::{Deserialize, Serialize};
use std::io;
use std::path::{Path, PathBuf};

/// What a firmware may need at most.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Budgets {
    /// The deepest stack, in bytes.
    pub stack_bytes: u64,
    /// The longest handler.
    pub handler_cycles: u64,
    /// The longest critical section of the main program.
    pub critical_section_cycles: u64,
    /// Loops in a turn of the main program's loop of which nothing says how often they turn.
    pub loops_without_bound: u64,
    /// The longest turn of that loop, without the handlers that come in.
    pub turn_cycles: u64,
    /// Edges of the input in a second of which none is lost: at least so many.
    pub never_lost_per_s: u64,
    /// The input whose edges are watched.
    pub input: Input,
    /// How often the loops of some functions turn.
    #[serde(default)]
    pub loops: LoopBounds,
}

/// Why a file of budgets could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{}: {problem}", path.display())]
pub struct BudgetsError {
    /// The file.
    pub path: PathBuf,
    /// What is wrong with it.
    pub problem: BudgetsProblem,
}

/// What is wrong with a file of budgets.
#[derive(Debug, thiserror::Error)]
pub enum BudgetsProblem {
    /// The system does not give it.
    #[error(transparent)]
    File(#[from] io::Error),
    /// It is no TOML, lacks a budget, or has one that is not known; with line and column.
    #[error(transparent)]
    Content(#[from] toml::de::Error),
}

/// A bound beside its budget.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Held {
    /// The budget's name.
    pub name: &'static str,
    /// What was proved.
    pub proved: u64,
    /// What is allowed.
    pub budget: u64,
    /// Whether the one keeps to the other.
    pub keeps: bool,
}

impl Budgets {
    /// Reads them from a TOML file.
    ///
    /// # Errors
    /// Where it cannot be read, or says something else than every budget.
    pub fn read(path: &Path) -> Result<Budgets, BudgetsError> {
        let read = || Ok(toml::from_str(&std::fs::read_to_string(path)?)?);
        read().map_err(|problem| BudgetsError { path: path.into(), problem })
    }

    /// Holds bounds against them.
    pub fn hold(&self, bounds: &Bounds) -> Vec<Held> {
        let at_most = |name, proved, budget| Held { name, proved, budget, keeps: proved <= budget };
        // A main program whose turn is not found has bounded nothing.
        let loops = bounds.turn.as_ref().map_or(u64::MAX, |turn| turn.without_bound.len() as u64);
        let turn = bounds.turn.as_ref().and_then(|turn| turn.cycles).unwrap_or(u64::MAX);
        let rate = bounds.edges.as_ref().map_or(0, |edges| edges.never_lost_per_s);
        vec![
            at_most("stack_bytes", bounds.stack_bytes as u64, self.stack_bytes),
            at_most("handler_cycles", bounds.longest_handler_cycles(), self.handler_cycles),
            at_most("critical_section_cycles", bounds.critical_section_cycles, self.critical_section_cycles),
            at_most("loops_without_bound", loops, self.loops_without_bound),
            at_most("turn_cycles", turn, self.turn_cycles),
            Held {
                name: "never_lost_per_s",
                proved: rate,
                budget: self.never_lost_per_s,
                keeps: rate >= self.never_lost_per_s,
            },
        ]
    }
}
