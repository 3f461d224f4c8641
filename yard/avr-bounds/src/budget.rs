//! The budgets file: the limits that a program must keep, and the check that it keeps them.
//!
//! The file also holds facts that the ELF does not: loop bounds, targets of indirect calls, and the depth of recursion.

use crate::error::BoundsError;
use crate::file;
use crate::loops::LoopBounds;
use crate::proved::{Bounds, Input, Longest};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

/// The limits of a program, and facts about it. Every key is optional.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Budgets {
    /// The chip, if the ELF does not name it.
    pub chip: Option<String>,
    /// The address of the interrupt vectors, if it is not where the program begins.
    pub vectors: Option<u32>,
    /// The deepest stack, in bytes.
    pub stack_bytes: Option<u64>,
    /// The longest handler.
    pub handler_cycles: Option<u64>,
    /// The longest critical section of the main program.
    pub critical_section_cycles: Option<u64>,
    /// Loops without a bound in a turn of the main program's loop.
    pub loops_without_bound: Option<u64>,
    /// The longest turn of that loop, without the handlers that come in.
    pub turn_cycles: Option<u64>,
    /// The lowest rate of edges, in edges a second, at which no edge may be lost.
    pub never_lost_per_s: Option<u64>,
    /// The rule for values in registers.
    pub registers: RegisterRule,
    /// The input with a required rate.
    pub input: Option<Input>,
    /// How often the loops of some functions turn.
    pub loops: LoopBounds,
    /// Targets of indirect calls: for each calling function, the functions that it may call.
    pub calls: BTreeMap<String, Vec<String>>,
    /// How often functions may be active at once.
    pub recursion: BTreeMap<String, Depth>,
}

/// The depth of a recursion.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Depth {
    /// How many calls of the function are active at once, at most.
    pub depth: usize,
    /// Why there are no more.
    pub because: String,
}

/// The rule for values in registers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RegisterRule {
    /// Functions preserve r2 to r17, r28 and r29 and leave zero in r1, as in the calling convention. Handlers preserve
    /// all registers and flags.
    #[default]
    Convention,
    /// Nothing. For programs that break the convention.
    Unchecked,
}

/// A bound beside its budget.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Held {
    /// The budget's name.
    pub name: &'static str,
    /// The proved value.
    pub proved: u64,
    /// The budget.
    pub budget: u64,
    /// Whether the bound keeps to the budget.
    pub keeps: bool,
}

impl Budgets {
    /// Reads them from a TOML file.
    ///
    /// # Errors
    /// If it cannot be read, is empty, or says what is not known.
    pub fn read(path: &Path) -> Result<Budgets, BoundsError> {
        let text = file::toml(path)?;
        if text.trim().is_empty() {
            return Err(BoundsError(format!("{} is empty, so it has no budget", path.display())));
        }
        toml::from_str(&text).map_err(|error| {
            let line = error.span().map_or(1, |span| 1 + text[..span.start].matches('\n').count());
            let problem = error.message().trim().replace('\n', ", ");
            BoundsError(format!("{}, line {line}: {problem}", path.display()))
        })
    }

    /// Holds bounds against the budgets that there are.
    ///
    /// # Errors
    /// If there is a budget for a time that has no bound, or that the program does not have.
    pub fn hold(&self, bounds: &Bounds) -> Result<Vec<Held>, BoundsError> {
        let mut held = Vec::new();
        let mut hold = |name, proved, budget: Option<u64>, keeps: fn(&u64, &u64) -> bool| {
            held.extend(budget.map(|budget| Held { name, proved, budget, keeps: keeps(&proved, &budget) }));
        };
        hold("stack_bytes", bounds.stack_bytes as u64, self.stack_bytes, u64::le);
        if self.handler_cycles.is_some() {
            for handler in &bounds.handlers {
                handler.longest.or_refuse(&format!("the handler of vector {}", handler.vector))?;
            }
        }
        hold("handler_cycles", bounds.longest_handler_cycles(), self.handler_cycles, u64::le);
        if self.critical_section_cycles.is_some() {
            let longest = bounds.critical_section.or_refuse("a stretch without interrupts")?;
            hold("critical_section_cycles", longest, self.critical_section_cycles, u64::le);
        }
        let no_turn = "no loop has `wdr`: take turn_cycles and loops_without_bound out of the budgets";
        let turn = || bounds.turn.as_ref().ok_or_else(|| BoundsError(no_turn.to_owned()));
        if self.loops_without_bound.is_some() {
            let loops = turn()?.without_bound.len() as u64;
            hold("loops_without_bound", loops, self.loops_without_bound, u64::le);
        }
        if self.turn_cycles.is_some() {
            let longest = turn()?.or_refuse("a turn of the main loop, which must have its `wdr` itself,")?;
            hold("turn_cycles", longest, self.turn_cycles, u64::le);
        }
        if self.never_lost_per_s.is_some() {
            let no_input = "never_lost_per_s needs an input: add its vectors and its port to the budgets, in [input]";
            let edges = bounds.edges.as_ref().ok_or_else(|| BoundsError(no_input.to_owned()))?;
            hold("never_lost_per_s", edges.never_lost_per_s, self.never_lost_per_s, u64::ge);
        }
        Ok(held)
    }
}

impl Longest {
    /// The cycles of a time that must have a bound; `what` names it in the error. 0 if it never ends.
    pub(crate) fn or_refuse(&self, what: &str) -> Result<u64, BoundsError> {
        let Some(place) = self.without_bound.first() else { return Ok(self.cycles.unwrap_or_default()) };
        let function = &place.function;
        Err(BoundsError(format!(
            "{what} has a loop without a bound, or a call of more than 2^40 cycles, at {} in {function}: give a loop's bound, by a \
             record in .loop_bounds or for the function, as in [loops] {function:?} = {{ passes = 9, because = \"..\" }}",
            place.address_and_line()
        )))
    }
}
