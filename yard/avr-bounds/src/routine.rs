//! A routine: its entry, and the graph of its places.
//!
//! `flow` follows the program's paths and makes it. `paths` finds loops in it, and `counted`, `cycles` and `registers` read it.

use crate::decode::{Instruction, Operation};
use crate::effects::Registers;
use crate::proved::Frame;
use crate::values::{Constants, Interrupts};
use std::collections::BTreeSet;
use std::rc::Rc;

/// The kind of a routine's entry, which decides how it must end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) enum Kind {
    /// From the reset vector.
    Reset,
    /// From an interrupt's vector.
    Handler,
    /// By a call.
    Function,
}

/// Which routine, in which circumstances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Entry {
    pub(crate) address: u32,
    pub(crate) interrupts: Interrupts,
    pub(crate) kind: Kind,
    /// Which calls of functions with bounded recursion are active.
    pub(crate) active: usize,
}

/// A place on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct Place {
    pub(crate) address: u32,
    /// Bytes on the stack since the routine's entry.
    pub(crate) depth: usize,
    pub(crate) interrupts: Interrupts,
}

/// An edge from a place to the next.
pub(crate) struct Edge {
    /// The place's number in its routine.
    pub(crate) to: usize,
    /// Cycles of the instruction on this edge, including the call instruction itself.
    pub(crate) cycles: u32,
    /// The routine called on this edge.
    pub(crate) through: Option<Rc<Routine>>,
    /// The number in R21 and R20 at the beginning of the edge, if it is known: the third argument, if each has 16 bits.
    /// This is the length of `memcpy` and similar functions.
    pub(crate) length: Option<u16>,
    /// Registers with known constants after the instruction.
    pub(crate) constants: Constants,
}

/// An instruction at a place, and its edges.
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) instruction: Instruction,
    pub(crate) edges: Vec<Edge>,
    /// If the routine returns here, the cycles of the return.
    pub(crate) returns: Option<u32>,
    /// Functions that are called from here and never return, and the cycles of the call.
    pub(crate) ends_in: Vec<(u32, Rc<Routine>)>,
    /// Whether the instruction waits for an unknown time.
    pub(crate) waits: bool,
}

impl Node {
    pub(crate) fn new(place: Place, instruction: Instruction) -> Node {
        Node { place, instruction, edges: Vec::new(), returns: None, ends_in: Vec::new(), waits: false }
    }

    /// Whether it feeds the watchdog, by itself or in a function that returns to it.
    pub(crate) fn feeds(&self) -> bool {
        let mut through = self.edges.iter().filter_map(|edge| edge.through.as_ref());
        self.instruction.operation == Operation::Wdr || through.any(|called| called.feeds)
    }

    /// The routines that it calls, with the cycles of the call, and [`Edge::length`] if they return.
    pub(crate) fn calls(&self) -> impl Iterator<Item = (u32, Option<u16>, &Rc<Routine>)> {
        let returning = self.edges.iter().filter_map(|edge| Some((edge.cycles, edge.length, edge.through.as_ref()?)));
        returning.chain(self.ends_in.iter().map(|(cycles, called)| (*cycles, None, called)))
    }

    /// The routines that it calls.
    pub(crate) fn called(&self) -> impl Iterator<Item = &Rc<Routine>> {
        self.calls().map(|(_, _, called)| called)
    }
}

/// A loop in the code of a routine.
pub(crate) struct Nested {
    /// The addresses in it.
    pub(crate) places: BTreeSet<usize>,
    /// The addresses at which it is entered.
    pub(crate) heads: BTreeSet<usize>,
}

/// A routine with all its paths.
pub(crate) struct Routine {
    pub(crate) entry: Entry,
    /// The reachable places; the first is the entry.
    pub(crate) nodes: Vec<Node>,
    /// Its loops.
    pub(crate) nest: Vec<Nested>,
    /// States of the interrupts after its returns: off, on.
    pub(crate) returns: BTreeSet<Interrupts>,
    /// Registers and flags with the same value at every return as at the entry.
    pub(crate) keeps: Registers,
    /// Whether R1 is zero at every return.
    pub(crate) leaves_zero: bool,
    /// The deepest stack, and the deepest stack with interrupts on: the bytes of each function, from the entry on.
    pub(crate) deepest: Vec<Frame>,
    pub(crate) deepest_interrupted: Option<Vec<Frame>>,
    /// Whether it can feed the watchdog and return.
    pub(crate) feeds: bool,
    /// The address where interrupts that were off at the entry are turned on, in it or in a called function.
    pub(crate) enables: Option<u32>,
}

/// Bytes of a stack.
pub(crate) fn bytes(frames: &[Frame]) -> usize {
    frames.iter().map(|frame| frame.bytes).sum()
}
