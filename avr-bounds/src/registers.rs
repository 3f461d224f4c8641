//! Checks that every live register is preserved over calls and interrupts.
//!
//! By default every function must keep the calling convention: it preserves R2 to R17, R28 and R29, and leaves zero in
//! R1. This also finds a missing push or pop in assembly. The rest of this page describes the rule `followed`, for
//! programs whose compiler drops the convention or goes beyond it. With GCC's `-fipa-ra`, part of `-Os`, a caller keeps
//! values in registers that the called function does not change. With LLVM's `--enable-ipra` a function need not save a
//! register that none of its callers needs. The ELF does not list those registers, but the analysis can derive them:
//!
//! - **preserved**: at each return of the function the register holds its value at the entry. It was not changed, or it
//!   was saved and restored ([`Routine::keeps`]);
//! - **live** after a call: the register is read later before it is changed. The reader is the caller, a function that
//!   the caller calls, or code behind the caller's own return ([`LiveIn`]). Saving and restoring a register does not
//!   count as a read;
//! - **results** of a function: see below.
//!
//! A register that is live after a call must be preserved by the function, or hold its result. All other registers are
//! clobbered: after the call they hold values that the caller must not use.
//!
//! # Results of a function
//!
//! Results are in R18 to R25 only, and end in R25 or R24 (AVR calling conventions of GCC and LLVM, libgcc's division
//! included). One of these registers holds a result if an instruction writes a value that reaches a return and that the
//! function itself does not need. A value that serves only to calculate unneeded values is itself unneeded. So a result
//! that is calculated in a loop counts. A counter, a pointer or a temporary value is needed until its last use in the
//! function, so it does not count. The division routines branch on their partial results; a list names those results
//! ([`LIBRARY`]). All registers between a result and R25 also count, and R25 counts with R24, because a value of
//! several bytes uses neighbouring registers.
//!
//! # What the check finds, and what it does not
//!
//! It finds an instruction that reads a clobbered register, on any path. It also finds a call that clobbers a live
//! register which holds no result, if that register was set before the call and not read since.
//!
//! It accepts one kind of read. The register was also read before the call, and both a clobbered and a valid value can
//! reach the read. Compilers make such reads when they copy an empty `Option`: its payload was never set and is copied
//! with the rest. An analysis of registers cannot tell this from an error. A test removes the saving of a register from
//! functions of the firmware, and counts how often the check finds it.
//!
//! # Other checks
//!
//! R1 is zero at every return, and at every call of a function that reads it or lets its caller read it. A handler
//! leaves every register and every flag as it found them. This proof does not check that handlers and main program
//! share memory correctly. Rust ensures that.

use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::effects::{Effects, Registers};
use crate::error::{BoundsError, Clobbered};
use crate::flow::{Code, Kind, Node, Place, Routine};
use crate::paths::leading_to;
use crate::proved::Lasting;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::RangeInclusive;
use std::rc::Rc;

/// The register that is zero except between instructions that change it (AVR calling convention).
const ZERO: usize = 1;

/// Registers that results are in: R18 to R25 (AVR calling conventions).
const RESULTS: Registers = Registers::range(18..=25);

/// The division routines, which use their own results, and the registers of quotient and remainder (GCC's AVR calling
/// convention, exceptions).
const LIBRARY: [(&str, RangeInclusive<usize>); 3] =
    [("__udivmodqi4", 24..=25), ("__udivmodhi4", 22..=25), ("__udivmodsi4", 18..=25)];

/// The stack pointer's lower byte, by its address in the data space.
const SPL: u16 = 0x5D;

/// The live registers at a place.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct LiveIn {
    registers: Registers,
    /// Bytes of the stack that are restored into a live register, by the number of bytes below them.
    stack: BTreeSet<usize>,
}

impl LiveIn {
    /// Adds live registers. Returns whether there are new ones.
    fn join(&mut self, other: &LiveIn) -> bool {
        let before = (self.registers, self.stack.len());
        self.registers |= other.registers;
        self.stack.extend(&other.stack);
        before != (self.registers, self.stack.len())
    }
}

/// The facts about a routine that are valid for all its callers.
struct Summary {
    /// Registers and flags with the same value at every return as at the entry.
    keeps: Registers,
    /// Registers with a result.
    gives: Registers,
    /// Registers whose value at the entry is read.
    reads: Registers,
    /// Registers whose value at the entry is read on every path.
    surely_reads: Registers,
}

/// Which needs are meant.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum What {
    /// Registers that are live after the return and preserved until there. Registers that are read on the way do not
    /// count.
    Lasting,
    /// Registers that are read before they change.
    Needed,
}

/// Proves that every live value is preserved in this program. `main` and the handlers are its entries.
pub(crate) fn prove<'a>(
    program: &Code,
    main: &Rc<Routine>,
    handlers: impl Iterator<Item = (u8, &'a Rc<Routine>)>,
) -> Result<Lasting, BoundsError> {
    let handlers: Vec<_> = handlers.collect();
    let mut survey = Survey { program, summaries: BTreeMap::new(), order: Vec::new() };
    for routine in handlers.iter().map(|(_, handler)| *handler).chain([main]) {
        survey.summarise(routine)?;
    }
    restored(program, handlers.into_iter())?;
    survey.hold()
}

/// The registers that functions preserve (AVR calling convention).
fn is_preserved(register: usize) -> bool {
    matches!(register, 2..=17 | 28 | 29)
}

/// Proves that every function of this program keeps the calling convention, and that handlers restore all registers and
/// flags.
pub(crate) fn prove_convention<'a>(
    program: &Code,
    handlers: impl Iterator<Item = (u8, &'a Rc<Routine>)>,
) -> Result<(), BoundsError> {
    let functions = program.routines().filter(|routine| routine.entry.kind == Kind::Function);
    for routine in functions.filter(|routine| !routine.returns.is_empty()) {
        let broken = |routine: &Routine| {
            Registers::which(|register| {
                is_preserved(register) && !routine.keeps.contains(register) || register == ZERO && !routine.leaves_zero
            })
        };
        // An error names the function itself, not its caller.
        let called = routine.nodes.iter().flat_map(called).filter(|called| !called.returns.is_empty());
        let broken = broken(routine) - called.fold(Registers::NONE, |all, called| all | broken(called));
        if !broken.is_empty() {
            let function = program.name_of(routine.entry);
            return Err(BoundsError::NotPreserved { function, registers: broken.to_string() });
        }
    }
    restored(program, handlers)
}

/// Checks that handlers change no register and no flag.
fn restored<'a>(program: &Code, handlers: impl Iterator<Item = (u8, &'a Rc<Routine>)>) -> Result<(), BoundsError> {
    for (vector, handler) in handlers {
        let clobbered = Registers::ALL - handler.keeps;
        // A handler that never returns may change registers.
        if !clobbered.is_empty() && !handler.returns.is_empty() {
            let function = program.name_of(handler.entry);
            return Err(BoundsError::HandlerSpoils { vector, function, registers: clobbered.to_string() });
        }
    }
    Ok(())
}

/// The facts about the routines of a program.
struct Survey<'a> {
    program: &'a Code<'a>,
    summaries: BTreeMap<*const Routine, Summary>,
    /// All routines, each after those that it calls.
    order: Vec<Rc<Routine>>,
}

impl Survey<'_> {
    fn of(&self, routine: &Rc<Routine>) -> &Summary {
        &self.summaries[&Rc::as_ptr(routine)]
    }

    fn summarise(&mut self, routine: &Rc<Routine>) -> Result<(), BoundsError> {
        if self.summaries.contains_key(&Rc::as_ptr(routine)) {
            return Ok(());
        }
        for called in routine.nodes.iter().flat_map(called) {
            self.summarise(called)?;
        }
        // By the calling convention, R1 is zero at the entry.
        let leaves_zero = routine.leaves_zero && routine.entry.kind == Kind::Function;
        let keeps = routine.keeps | Registers::which(|register| register == ZERO && leaves_zero);
        let gives = self.gives(routine, keeps)?;
        let needs = self.needs(routine, gives, What::Needed)?;
        let reads = needs[0].registers;
        // On an endless path every register counts as read, so such paths restrict nothing.
        let surely_reads = self.sure_needs(routine, &needs)?[0] & reads;
        let summary = Summary { keeps, gives, reads, surely_reads };
        self.summaries.insert(Rc::as_ptr(routine), summary);
        self.order.push(Rc::clone(routine));
        Ok(())
    }

    /// The live registers at each place, for these live registers after the return.
    fn needs(&self, routine: &Routine, behind: Registers, what: What) -> Result<Vec<LiveIn>, BoundsError> {
        let nodes = &routine.nodes;
        let from = leading_to(nodes);
        let mut needs = vec![LiveIn::default(); nodes.len()];
        let mut to_do: Vec<usize> = (0..nodes.len()).collect();
        while let Some(number) = to_do.pop() {
            let node = &nodes[number];
            let mut before = self.in_front(node, &needs, what);
            let instruction = self.program.instruction(node.place.address)?;
            let depth = node.place.depth;
            match instruction.operation {
                Push if before.stack.remove(&depth) => before.registers |= Registers::one(instruction.source()),
                Pop if before.registers.contains(instruction.destination()) => {
                    before.registers = before.registers - Registers::one(instruction.destination());
                    before.stack.extend(depth.checked_sub(1));
                }
                // Bytes that the stack pointer moves past were written to be read through a pointer.
                Out if what != What::Lasting && instruction.data_address() == Some(SPL) => {
                    let least = node.edges.iter().map(|edge| nodes[edge.to].place.depth).min();
                    before.stack.extend(least.unwrap_or(depth)..depth);
                }
                _ => {
                    let reads = reads(&instruction, before.registers);
                    before.registers = before.registers - instruction.effects().changes;
                    if what != What::Lasting {
                        before.registers |= reads;
                    }
                }
            }
            if node.returns.is_some() {
                before.registers |= behind;
            }
            if needs[number].join(&before) {
                to_do.extend(&from[number]);
            }
        }
        Ok(needs)
    }

    /// The live registers before a call at a place, after the instruction itself.
    fn in_front(&self, node: &Node, needs: &[LiveIn], what: What) -> LiveIn {
        let mut all = LiveIn::default();
        for edge in &node.edges {
            let mut behind = needs[edge.to].clone();
            if let Some(called) = &edge.through {
                behind.registers = behind.registers & self.of(called).keeps;
            }
            all.join(&behind);
        }
        for called in called(node).filter(|_| what == What::Needed) {
            all.registers |= self.of(called).reads;
        }
        all
    }

    /// The result registers of a routine that preserves these registers.
    fn gives(&self, routine: &Routine, keeps: Registers) -> Result<Registers, BoundsError> {
        let name = self.program.name_of(routine.entry);
        if let Some((_, gives)) = LIBRARY.iter().find(|(library, _)| *library == name) {
            return Ok(Registers::range(gives.clone()));
        }
        let needs = self.needs(routine, Registers::NONE, What::Needed)?;
        let reaching = self.needs(routine, RESULTS - keeps, What::Lasting)?;
        let mut gives = Registers::NONE;
        for node in &routine.nodes {
            let (needed, reaching) = (behind(node, &needs), behind(node, &reaching));
            for edge in &node.edges {
                if let Some(called) = &edge.through {
                    gives |= (self.of(called).gives & reaching) - needed;
                }
            }
            let effects = self.program.instruction(node.place.address)?.effects();
            if !effects.acts {
                gives |= (effects.changes & reaching) - needed;
            }
        }
        // A result ends in R25, and begins in R24, R22 or R18.
        for first in [18..=21, 22..=23, 24..=25] {
            if !(gives & Registers::range(first.clone())).is_empty() {
                gives |= Registers::range(*first.start()..=25);
            }
        }
        Ok(gives - keeps)
    }

    /// Registers that are read on every path from a place, before they change and in this routine.
    fn sure_needs(&self, routine: &Routine, needs: &[LiveIn]) -> Result<Vec<Registers>, BoundsError> {
        let nodes = &routine.nodes;
        let from = leading_to(nodes);
        let mut sure = vec![Registers::ALL; nodes.len()];
        let mut to_do: Vec<usize> = (0..nodes.len()).collect();
        while let Some(number) = to_do.pop() {
            let node = &nodes[number];
            let instruction = self.program.instruction(node.place.address)?;
            let edges = node.edges.iter().map(|edge| match &edge.through {
                Some(called) => (sure[edge.to] & self.of(called).keeps) | self.of(called).surely_reads,
                None => sure[edge.to],
            });
            let ends = node.ends_in.iter().map(|(_, called)| self.of(called).surely_reads);
            let returns = node.returns.map(|_| Registers::NONE);
            let all = edges.chain(ends).chain(returns).fold(Registers::ALL, |all, edge| all & edge);
            let before = (all - instruction.effects().changes) | reads(&instruction, behind(node, needs));
            if before != sure[number] {
                sure[number] = before;
                to_do.extend(&from[number]);
            }
        }
        Ok(sure)
    }

    /// Registers that were written on every path to a place, and not read since.
    fn unread(&self, routine: &Routine) -> Result<Vec<Registers>, BoundsError> {
        self.on_every_path(
            routine,
            |unread, effects| {
                let new = if effects.acts { Registers::NONE } else { effects.changes };
                (unread - effects.reads - effects.changes) | new
            },
            |unread, called| unread & (self.of(called).keeps - self.of(called).reads),
        )
    }

    /// Registers that a call has clobbered on every path to a place, and that were not written since.
    fn clobbered(&self, routine: &Routine) -> Result<Vec<Registers>, BoundsError> {
        let through = |clobbered, called: &Rc<Routine>| (clobbered - self.of(called).gives) | self.clobbers(called);
        self.on_every_path(routine, |clobbered, effects| clobbered - effects.changes, through)
    }

    /// For each place: the registers that are in a set on every path from the entry. The set changes after each
    /// instruction, and then through its called function.
    fn on_every_path(
        &self,
        routine: &Routine,
        after: impl Fn(Registers, &Effects) -> Registers,
        through: impl Fn(Registers, &Rc<Routine>) -> Registers,
    ) -> Result<Vec<Registers>, BoundsError> {
        let mut held = vec![None; routine.nodes.len()];
        held[0] = Some(Registers::NONE);
        let mut to_do = vec![0];
        while let Some(number) = to_do.pop() {
            let node = &routine.nodes[number];
            let effects = self.program.instruction(node.place.address)?.effects();
            let behind = after(held[number].unwrap_or(Registers::ALL), &effects);
            for edge in &node.edges {
                let behind = edge.through.as_ref().map_or(behind, |called| through(behind, called));
                let both = held[edge.to].map_or(behind, |before| before & behind);
                if held[edge.to].replace(both) != Some(both) {
                    to_do.push(edge.to);
                }
            }
        }
        Ok(held.into_iter().map(|held| held.unwrap_or(Registers::ALL)).collect())
    }

    /// Registers that a routine changes and that hold no result. R1 is checked separately.
    fn clobbers(&self, routine: &Rc<Routine>) -> Registers {
        let Summary { keeps, gives, .. } = *self.of(routine);
        Registers::ALL - keeps - gives - Registers::one(ZERO)
    }

    /// Checks every call against the registers that are live after it.
    fn hold(&self) -> Result<Lasting, BoundsError> {
        let mut needed_behind: BTreeMap<*const Routine, Registers> = BTreeMap::new();
        let mut found: BTreeMap<(u32, u32), Registers> = BTreeMap::new();
        let mut lasting: BTreeMap<u32, Registers> = BTreeMap::new();
        // Callers first.
        for routine in self.order.iter().rev() {
            let needed_behind_it = needed_behind.get(&Rc::as_ptr(routine)).copied().unwrap_or_default();
            let needs = self.needs(routine, needed_behind_it | self.of(routine).gives, What::Needed)?;
            let clobbered = self.clobbered(routine)?;
            let unread = self.unread(routine)?;
            for (number, node) in routine.nodes.iter().enumerate() {
                let Place { address, .. } = node.place;
                let needed = behind(node, &needs);
                let instruction = self.program.instruction(address)?;
                let mut read = reads(&instruction, self.in_front(node, &needs, What::Needed).registers);
                for called in called(node) {
                    let Summary { keeps, reads, surely_reads, .. } = *self.of(called);
                    read |= surely_reads;
                    let mut clobbers = (needed & unread[number]) - keeps - RESULTS - reads;
                    let zero = if node.has_zero { needed - keeps } else { needed | reads };
                    clobbers |= zero & Registers::one(ZERO);
                    if !clobbers.is_empty() {
                        *found.entry((address, called.entry.address)).or_default() |= clobbers;
                    }
                    *needed_behind.entry(Rc::as_ptr(called)).or_default() |= needed;
                    *lasting.entry(address).or_default() |= needed & (keeps - Registers::one(ZERO));
                }
                for register in (read & clobbered[number]).iter() {
                    for (place, called) in self.clobberers(routine, number, register)? {
                        *found.entry((place, called)).or_default() |= Registers::one(register);
                    }
                }
            }
        }
        if found.is_empty() {
            let bytes = lasting.values().map(|registers| registers.iter().count()).sum();
            return Ok(Lasting { calls: lasting.len(), bytes });
        }
        let clobbered = |((address, called), registers): ((u32, u32), Registers)| Clobbered {
            address,
            function: self.program.name(address),
            called: self.program.name(called),
            registers: registers.to_string(),
        };
        Err(BoundsError::Clobbered { all: found.into_iter().map(clobbered).collect() })
    }

    /// The calls that have clobbered a register at a place: their addresses, and the called functions.
    fn clobberers(
        &self,
        routine: &Routine,
        place: usize,
        register: usize,
    ) -> Result<BTreeSet<(u32, u32)>, BoundsError> {
        let from = leading_to(&routine.nodes);
        let (mut found, mut seen) = (BTreeSet::new(), BTreeSet::new());
        let mut to_do = vec![place];
        while let Some(to) = to_do.pop() {
            for &number in &from[to] {
                let node = &routine.nodes[number];
                let through = node.edges.iter().filter(|edge| edge.to == to).filter_map(|edge| edge.through.as_ref());
                let clobbering: Vec<_> = through.filter(|called| self.clobbers(called).contains(register)).collect();
                found.extend(clobbering.iter().map(|called| (node.place.address, called.entry.address)));
                let changes = self.program.instruction(node.place.address)?.effects().changes;
                if clobbering.is_empty() && !changes.contains(register) && seen.insert(number) {
                    to_do.push(number);
                }
            }
        }
        Ok(found)
    }
}

/// The registers that an instruction reads, for these live registers after it. An instruction without a live effect
/// reads nothing.
fn reads(instruction: &Instruction, needed: Registers) -> Registers {
    let effects = instruction.effects();
    let has_purpose = effects.acts || !(effects.changes & needed).is_empty();
    if has_purpose { effects.reads } else { Registers::NONE }
}

/// The registers that are live after an instruction, and after its called function.
fn behind(node: &Node, needs: &[LiveIn]) -> Registers {
    node.edges.iter().fold(Registers::NONE, |all, edge| all | needs[edge.to].registers)
}

/// The routines that a place calls.
fn called(node: &Node) -> impl Iterator<Item = &Rc<Routine>> {
    node.edges.iter().filter_map(|edge| edge.through.as_ref()).chain(node.ends_in.iter().map(|(_, called)| called))
}
