//! The result of a proof: the bounds, and the program that they hold for.

use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::fmt;

/// A place in the program.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
pub struct Place {
    /// Its address in bytes of flash.
    pub address: u32,
    /// The function it lies in.
    pub function: String,
    /// File and line, where the ELF says it.
    pub source: Option<String>,
}

/// Function, address and line.
impl fmt::Display for Place {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "{:#06x} {}", self.address, self.function)?;
        self.source.iter().try_for_each(|source| write!(to, " ({source})"))
    }
}

/// The longest time of something.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize)]
pub struct Longest {
    /// Cycles; `None` where something on the way has no bound.
    pub cycles: Option<u64>,
    /// What has none: loops, and instructions that wait.
    pub without_bound: Vec<Place>,
}

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
    /// The longest time from the interrupt's response to the end of its return; `None` for one that never returns, and where a loop
    /// has no bound.
    pub cycles: Option<u64>,
    /// What in it has no bound.
    pub without_bound: Vec<Place>,
    /// The longest time from the request to the first instruction of the handler, if every handler that goes before it comes in once.
    /// `None` where something on the way has no bound.
    pub response_cycles: Option<u64>,
    /// The most that it puts onto the stack, the address it returns to included, and where it does not return as well.
    pub stack_bytes: usize,
}

/// An input whose edges ask for interrupts.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Input {
    /// The vectors that its edges ask for.
    pub vectors: BTreeSet<u8>,
    /// The register that their handlers look at, by its address in the data space: on an ATmega328P PINB 0x23, PINC 0x26, PIND 0x29.
    pub port: u16,
    /// Edges between two looks that the handlers can still tell apart.
    pub edges_between_looks: u64,
    /// The chip's clock.
    #[serde(default = "clock_hz")]
    pub clock_hz: u64,
}

/// An Arduino's clock.
fn clock_hz() -> u64 {
    16_000_000
}

/// How fast an input's edges may come.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct EdgeBounds {
    /// The longest time from an edge until a handler looks, in cycles.
    pub wait_cycles: u64,
    /// The highest rate of evenly spaced edges, in edges a second, at which no edge is lost.
    pub never_lost_per_s: u64,
}

/// Values that are live over a call. Each register was found to be untouched, or saved and restored.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Lasting {
    /// Places that call a function.
    pub calls: usize,
    /// Bytes in registers that are needed behind them, of all calls together.
    pub bytes: usize,
}

/// A function, with all that it calls.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct FunctionBounds {
    /// Its name.
    pub function: String,
    /// Where it begins.
    pub address: u32,
    /// Its deepest stack, without the address it returns to.
    pub stack_bytes: usize,
    /// Its longest time, from its first instruction to the end of its return; `None` where it never returns.
    pub longest: Option<Longest>,
    /// The functions that it calls.
    pub calls: BTreeSet<String>,
}

/// A call or a jump to an address that the program works out.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Indirect {
    /// Where it is.
    pub place: Place,
    /// How its targets were found.
    pub found: Found,
    /// Where it can lead.
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
    /// By slot, from the virtual tables, with all functions whose address the program takes.
    Slot,
    /// All functions whose address the program takes.
    Taken,
}

/// All that was proved.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Bounds {
    /// The chip.
    pub chip: &'static str,
    /// The deepest stack in bytes: the main program, and the deepest handler where it comes in.
    pub stack_bytes: usize,
    /// Whose frames those are, from the reset on.
    pub stack: Vec<Frame>,
    /// Every handler, by its vector.
    pub handlers: Vec<Handler>,
    /// The longest stretch of the main program with the interrupt flag clear: from behind the instruction that clears it to behind
    /// the one that sets it; 0 where it never clears it. Before interrupts are first turned on does not count.
    pub critical_section: Longest,
    /// The longest time from one moment at which the main program lets interrupts in to the next.
    pub closed: Longest,
    /// The watched input.
    pub edges: Option<EdgeBounds>,
    /// The longest turn of the main program's loop, from one `wdr` to the next, without the handlers that come in; `None` where no
    /// loop feeds the watchdog.
    pub turn: Option<Longest>,
    /// What lasts in registers, where that is followed.
    pub lasting: Option<Lasting>,
    /// Every loop without a bound, but for those that the program never leaves.
    pub loops_without_bound: Vec<Place>,
    /// Calls and jumps to addresses that are worked out.
    pub indirect: Vec<Indirect>,
    /// Every function that is come to.
    pub functions: Vec<FunctionBounds>,
}

impl Bounds {
    /// The longest of the handlers that return, in cycles; 0 without one.
    pub fn longest_handler_cycles(&self) -> u64 {
        self.handlers.iter().filter_map(|handler| handler.cycles).max().unwrap_or_default()
    }
}
