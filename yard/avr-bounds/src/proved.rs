//! The result of a proof: the bounds, and the program that they hold for.

use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// A place in the program.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Place {
    /// Its address in bytes of flash.
    pub address: u32,
    /// Its function.
    pub function: String,
    /// File and line, if the ELF has them.
    pub source: Option<String>,
}

/// Function, address and line.
impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "{:#06x} {}{}", self.address, self.function, self.line())
    }
}

impl Place {
    fn line(&self) -> String {
        self.source.iter().map(|source| format!(" ({source})")).collect()
    }

    pub(crate) fn address_and_line(&self) -> String {
        format!("{:#06x}{}", self.address, self.line())
    }
}

/// A longest time.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Longest {
    /// Cycles; `None` if a part of it has no bound.
    pub cycles: Option<u64>,
    /// The unbounded parts: loops, instructions that wait, and what takes more than 2^40 cycles.
    pub without_bound: Vec<Place>,
}

/// The greatest number of bytes of the stack that a function uses.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Frame {
    /// The function's name in its source, without type parameters.
    pub function: String,
    /// Its bytes on the stack when it calls the next function, including the return address of that call. For the last
    /// function: its deepest stack.
    pub bytes: usize,
}

/// A handler.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Handler {
    /// Its vector, counted from 0 (reset).
    pub vector: u8,
    /// Its name.
    pub function: String,
    /// The longest time from the interrupt's response to the end of its return; the default if it never returns.
    #[serde(flatten)]
    pub longest: Longest,
    /// The longest time from the request to the first instruction of the handler, if every handler of higher rank runs
    /// once. `None` if a part of it has no bound.
    pub response_cycles: Option<u64>,
    /// The most bytes that it uses on the stack, including its return address, also on paths without a return.
    pub stack_bytes: usize,
}

/// An input whose edges request interrupts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The vectors that its edges ask for.
    pub vectors: BTreeSet<u8>,
    /// The data address of the register that their handlers read. ATmega328P: PINB 0x23, PINC 0x26, PIND 0x29.
    pub port: u16,
    /// Edges between two reads that the handlers can still distinguish.
    pub edges_between_looks: u64,
    /// The chip's clock.
    #[serde(default = "clock_hz")]
    pub clock_hz: u64,
}

/// An Arduino's clock.
fn clock_hz() -> u64 {
    16_000_000
}

/// The highest rate of an input's edges.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EdgeBounds {
    /// The longest time from an edge to a read, in cycles.
    pub wait_cycles: u64,
    /// The highest rate of evenly spaced edges, in edges a second, at which no edge is lost.
    pub never_lost_per_s: u64,
}

/// A function, with all functions that it calls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FunctionBounds {
    /// Its name.
    pub function: String,
    /// Its first address.
    pub address: u32,
    /// Its deepest stack, without its return address.
    pub stack_bytes: usize,
    /// Its longest time, from its first instruction to the end of its return; `None` if it never returns.
    pub longest: Option<Longest>,
    /// The functions that it calls, by their first addresses.
    pub calls: BTreeMap<u32, String>,
}

/// A call or a jump to an address that the program works out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Indirect {
    /// Its address.
    pub place: Place,
    /// How its targets were found.
    pub found: Found,
    /// Its possible targets.
    pub targets: BTreeSet<String>,
}

/// How the targets of an indirect call were found.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Found {
    /// The address was followed to its constant.
    Followed,
    /// It jumps through a compiler's table.
    Table,
    /// The budgets list them.
    Listed,
    /// By slot, from the virtual tables, and all functions whose address the program takes.
    Slot,
    /// All functions whose address the program takes.
    Taken,
}

/// All that was proved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Bounds {
    /// The chip.
    pub chip: &'static str,
    /// The deepest stack in bytes: the main program, and the deepest handler that can interrupt it there.
    pub stack_bytes: usize,
    /// Its frames, from the reset on.
    pub stack: Vec<Frame>,
    /// Every handler, by its vector.
    pub handlers: Vec<Handler>,
    /// The longest stretch of the main program with the interrupt flag clear: from the end of the instruction that
    /// clears it to the end of the one that sets it; 0 if it is never cleared. The time before interrupts are first
    /// turned on does not count.
    pub critical_section: Longest,
    /// The longest time between two moments at which the main program lets interrupts in, with the wake-up from a sleep.
    pub closed: Longest,
    /// The watched input.
    pub edges: Option<EdgeBounds>,
    /// The longest turn of the main loop, from `wdr` to `wdr`, without handlers and sleep; `None` if no loop has one.
    /// Without a bound if a loop has it only in a called function.
    pub turn: Option<Longest>,
    /// Every loop without a bound in the whole program, except those that it never leaves. The budget `loops_without_bound`
    /// is for those in a turn.
    pub all_loops_without_bound: Vec<Place>,
    /// Calls and jumps to computed addresses.
    pub indirect: Vec<Indirect>,
    /// Every function that the program reaches.
    pub functions: Vec<FunctionBounds>,
}

impl Bounds {
    /// The longest of the handlers that return, in cycles; 0 without one.
    pub fn longest_handler_cycles(&self) -> u64 {
        self.handlers.iter().filter_map(|handler| handler.longest.cycles).max().unwrap_or_default()
    }
}
