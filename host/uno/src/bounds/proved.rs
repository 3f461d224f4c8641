//! What was proved of a firmware, and of which input.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// Bytes of the stack that a function holds at its deepest.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Frame {
    /// The function, as in its source, without the types that it is made for.
    pub function: String,
    /// What it has put onto the stack when it calls the next of them, the address that it is returned to from there included; the
    /// last one, at its deepest.
    pub bytes: usize,
}

/// A handler.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Handler {
    /// Its vector, counted from 0 (reset).
    pub vector: u8,
    /// Its name.
    pub function: String,
    /// The longest time from the interrupt's response to the end of its return; `None` for one that never returns.
    pub cycles: Option<u64>,
    /// The most that it puts onto the stack, the address it returns to included, and where it does not return as well.
    pub stack_bytes: usize,
}

/// An input whose edges ask for interrupts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The vectors that its edges ask for.
    pub vectors: BTreeSet<u8>,
    /// The register that their handlers look at, by its address in the data space: PINB 0x23, PINC 0x26, PIND 0x29.
    pub port: u16,
    /// Edges between two looks that the handlers can still tell apart.
    pub edges_between_looks: u64,
}

/// How fast an input's edges may come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EdgeBounds {
    /// The longest time from an edge until a handler looks, in cycles.
    pub wait_cycles: u64,
    /// Evenly spaced edges in a second of which none is ever lost.
    pub never_lost_per_s: u64,
}

/// A turn of the main program's loop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct TurnBound {
    /// The longest from one `wdr` to the next, in cycles, without the handlers that come in; `None` where a loop has no bound.
    pub cycles: Option<u64>,
    /// Loops in it of which nobody has said how often they turn: the address and the function of each.
    pub without_bound: Vec<(u32, String)>,
}

/// Values in registers that last over calls, each of which was found to be left alone or put back.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Lasting {
    /// Places that call a function.
    pub calls: usize,
    /// Bytes in registers that are needed behind them, of all calls together.
    pub bytes: usize,
}

/// All that was proved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Bounds {
    /// The deepest stack in bytes: the main program, and the deepest handler where it comes in.
    pub stack_bytes: usize,
    /// Whose frames those are, from the reset on.
    pub stack: Vec<Frame>,
    /// Every handler, by its vector.
    pub handlers: Vec<Handler>,
    /// The longest stretch of the main program with the interrupt flag clear: from behind the instruction that clears it to behind
    /// the one that sets it, in cycles; 0 where it never clears it. Before interrupts are first turned on does not count.
    pub critical_section_cycles: u64,
    /// The longest time from one moment at which the main program lets interrupts in to the next, in cycles.
    pub closed_cycles: u64,
    /// The watched input.
    pub edges: Option<EdgeBounds>,
    /// The main program's loop; `None` where no loop feeds the watchdog.
    pub turn: Option<TurnBound>,
    /// What lasts in registers.
    pub lasting: Lasting,
}

impl Bounds {
    /// The longest of the handlers, in cycles; 0 without one.
    pub fn longest_handler_cycles(&self) -> u64 {
        self.handlers.iter().filter_map(|handler| handler.cycles).max().unwrap_or_default()
    }
}
