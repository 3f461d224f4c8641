//! The control flow of a program: its calls and paths, the depth of the stack on each path, and whether interrupts are
//! on.
//!
//! A [`Routine`] has one entry, with interrupts on or off: a function, a handler, or the program after a reset. From
//! its entry every path is followed to its ends. A place on a path consists of an address, the bytes on the stack, and
//! the state of the interrupts. Two paths that reach an address with different stacks therefore make two places. A
//! stack that grows in a loop makes places without end, and the analysis detects this. For every place the analysis
//! knows the register contents that matter (`values`). It derives the registers that a call preserves from the called
//! function, not from a convention.
//!
//! A jump into another function is followed like any jump: compilers make it from a call at the end (tail call). The
//! program starts again at the reset vector's address, so a path ends there. Computed calls and jumps lead to all their
//! targets (`targets`).
//!
//! The analysis refuses what it cannot follow: indirect calls without targets, recursion without a bound in the
//! budgets, and a stack pointer or a handler's interrupt flag with an unknown value. It assumes that no store through a
//! pointer hits a return address or a saved register.

use crate::budget::Budgets;
use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::effects::Registers;
use crate::elf;
use crate::error::{BoundsError, Problem};
use crate::proved::{self, Frame};
use crate::targets::{Targets, Where};
use crate::values::{Constants, DEEPEST, INTERRUPT_FLAG, Interrupts, Known, Value, turn};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

/// The EEPROM control register's bits that start a read and a write, and for how many cycles they halt the core (data
/// sheets, EEPROM data memory).
const EERE: u16 = 0;
const EEPE: u16 = 1;
const READ_HALT_CYCLES: u32 = 4;
const WRITE_HALT_CYCLES: u32 = 2;

/// SREG's bit of the last result being zero.
const ZERO_FLAG: u16 = 1;

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
#[derive(Clone)]
pub(crate) struct Edge {
    /// The place's number in its routine.
    pub(crate) to: usize,
    /// Cycles of the instruction on this edge, including the call instruction itself.
    pub(crate) cycles: u32,
    /// The routine called on this edge.
    pub(crate) through: Option<Rc<Routine>>,
    /// The number in R21 and R20 at the beginning of the edge, if it is known: the length argument of `memcpy` and
    /// similar functions.
    pub(crate) length: Option<u16>,
    /// Registers with known constants after the instruction.
    pub(crate) constants: Constants,
}

/// An instruction at a place, and its edges.
#[derive(Clone)]
pub(crate) struct Node {
    pub(crate) place: Place,
    pub(crate) edges: Vec<Edge>,
    /// If the routine returns here, the cycles of the return.
    pub(crate) returns: Option<u32>,
    /// Functions that are called from here and never return, and the cycles of the call.
    pub(crate) ends_in: Vec<(u32, Rc<Routine>)>,
    /// Whether the instruction waits for an unknown time.
    pub(crate) waits: bool,
}

/// A routine with all its paths.
pub(crate) struct Routine {
    pub(crate) entry: Entry,
    /// The reachable places; the first is the entry.
    pub(crate) nodes: Vec<Node>,
    /// States of the interrupts after its returns: off, on.
    pub(crate) returns: BTreeSet<Interrupts>,
    /// Registers and flags with the same value at every return as at the entry.
    pub(crate) keeps: Registers,
    /// Whether R1 is zero at every return.
    pub(crate) leaves_zero: bool,
    /// The deepest stack, and the deepest stack with interrupts on: the bytes of each function, from the entry on.
    pub(crate) deepest: Vec<Frame>,
    pub(crate) deepest_interrupted: Option<Vec<Frame>>,
    /// The address where interrupts that were off at the entry are turned on, in it or in a called function.
    pub(crate) enables: Option<u32>,
}

/// Bytes of a stack.
pub(crate) fn bytes(frames: &[Frame]) -> usize {
    frames.iter().map(|frame| frame.bytes).sum()
}

/// A program in flash, and the known facts about its routines.
pub(crate) struct Code<'a> {
    pub(crate) elf: &'a elf::Program,
    budgets: &'a Budgets,
    targets: Targets,
    /// Which calls of functions with bounded recursion can be active at once: each by its function's address.
    active: Vec<Vec<u32>>,
    /// Indirect calls, with their targets.
    pub(crate) indirect: BTreeMap<u32, Where>,
    routines: BTreeMap<Entry, Rc<Routine>>,
    /// The routines that are being followed, the outermost first.
    open: Vec<Entry>,
}

impl<'a> Code<'a> {
    pub(crate) fn new(elf: &'a elf::Program, budgets: &'a Budgets) -> Code<'a> {
        Code {
            elf,
            budgets,
            targets: Targets::new(elf, budgets),
            active: vec![Vec::new()],
            indirect: BTreeMap::new(),
            routines: BTreeMap::new(),
            open: Vec::new(),
        }
    }

    /// The instruction at an address.
    pub(crate) fn instruction(&self, address: u32) -> Result<Instruction, BoundsError> {
        let found = Instruction::at(&self.elf.flash, address).filter(|found| self.elf.chip.has(found.operation));
        found.ok_or_else(|| self.refuse(address, Problem::NoInstruction))
    }

    /// The error for an instruction at an address.
    fn refuse(&self, address: u32, problem: Problem) -> BoundsError {
        BoundsError::at(&self.place(address), problem)
    }

    /// An address with its function and line.
    pub(crate) fn place(&self, address: u32) -> proved::Place {
        proved::Place { address, function: self.name(address), source: self.elf.line(address) }
    }

    /// The number of active calls in a called function; `None` if the recursion is at its limit.
    fn enter(&mut self, function: u32, active: usize) -> Option<usize> {
        let symbol = self.elf.functions.get(&function);
        let Some(bound) = symbol.and_then(|symbol| self.budgets.recursion.get(&symbol.name)) else {
            return Some(active);
        };
        let mut all = self.active[active].clone();
        all.push(function);
        if all.iter().filter(|other| **other == function).count() > bound.depth {
            return None;
        }
        let known = self.active.iter().position(|known| *known == all);
        Some(known.unwrap_or_else(|| {
            self.active.push(all);
            self.active.len() - 1
        }))
    }

    /// The routines that were followed.
    pub(crate) fn routines(&self) -> impl Iterator<Item = &Rc<Routine>> {
        self.routines.values()
    }

    /// The function that an address lies in.
    pub(crate) fn name(&self, address: u32) -> String {
        let before = self.elf.functions.range(..=address).next_back();
        before.map_or_else(|| format!("{address:#06x}"), |(_, symbol)| symbol.name.clone())
    }

    /// A routine's name. A handler has the name of the function that its vector leads to.
    pub(crate) fn name_of(&self, entry: Entry) -> String {
        let leads_to = || self.instruction(entry.address).ok()?.target(self.flash_bytes());
        match entry.kind {
            Kind::Reset => "reset".to_owned(),
            Kind::Handler => self.name(leads_to().unwrap_or(entry.address)),
            Kind::Function => self.name(entry.address),
        }
    }

    /// Follows a routine through all its paths, and the routines that it calls.
    pub(crate) fn follow(&mut self, entry: Entry) -> Result<Rc<Routine>, BoundsError> {
        if let Some(routine) = self.routines.get(&entry) {
            return Ok(Rc::clone(routine));
        }
        if let Some(first) =
            self.open.iter().position(|open| open.address == entry.address && open.active == entry.active)
        {
            let function = self.name(entry.address);
            let circle: Vec<String> = self.open[first..].iter().map(|open| self.name(open.address)).collect();
            return Err(BoundsError(format!(
                "there is recursion, which has no deepest stack: {}, which calls {function} calls itself: set in the budgets how \
                 many calls are active at once, as in [recursion] {function:?} = {{ depth = 3, because = \"..\" }}; if a call by a \
                 pointer only seems to be one of these, link with -Wl,--emit-relocs, which lists the functions whose address is \
                 taken",
                circle.join(", which calls ")
            )));
        }
        self.open.push(entry);
        let routine = Rc::new(Follower::new(self, entry).follow()?);
        self.open.pop();
        self.routines.insert(entry, Rc::clone(&routine));
        Ok(routine)
    }

    pub(crate) fn flash_bytes(&self) -> u32 {
        self.elf.chip.flash_bytes
    }
}

/// The next address of an instruction at a place.
struct Next {
    place: Place,
    known: Known,
    cycles: u32,
    through: Option<Rc<Routine>>,
}

/// The effects of an instruction at a place.
#[derive(Default)]
struct Step {
    next: Vec<Next>,
    returns: Option<u32>,
    ends_in: Vec<(u32, Rc<Routine>)>,
    waits: bool,
}

/// Follows one routine.
struct Follower<'p, 'a> {
    program: &'p mut Code<'a>,
    entry: Entry,
    known: HashMap<Place, Known>,
    returns: BTreeSet<Interrupts>,
    keeps: Registers,
    leaves_zero: bool,
    enables: Option<u32>,
}

impl<'p, 'a> Follower<'p, 'a> {
    fn new(program: &'p mut Code<'a>, entry: Entry) -> Self {
        Follower {
            program,
            entry,
            known: HashMap::new(),
            returns: BTreeSet::new(),
            keeps: Registers::ALL,
            leaves_zero: true,
            enables: None,
        }
    }

    fn follow(mut self) -> Result<Routine, BoundsError> {
        let start = Place { address: self.entry.address, depth: 0, interrupts: self.entry.interrupts };
        self.known.insert(start, Known::at_entry(self.entry.kind == Kind::Function));
        let mut to_do = vec![start];
        let mut steps: BTreeMap<Place, Step> = BTreeMap::new();
        while let Some(place) = to_do.pop() {
            let step = self.step(place)?;
            for Next { place: next, known, .. } in &step.next {
                let is_new = match self.known.get_mut(next) {
                    Some(before) => before.meet(known),
                    None => self.known.insert(*next, known.clone()).is_none(),
                };
                if is_new {
                    to_do.push(*next);
                }
            }
            steps.insert(place, step);
        }

        // The entry comes first.
        let mut places: Vec<Place> = steps.keys().copied().collect();
        let first = places.iter().position(|place| *place == start).unwrap_or_default();
        places.swap(0, first);
        let numbers: HashMap<Place, usize> = places.iter().copied().zip(0..).collect();
        let node = |place: &Place| {
            let Step { next, returns, ends_in, waits } = &steps[place];
            let length = self.known[place].length();
            let edge = |next: &Next| Edge {
                to: numbers[&next.place],
                cycles: next.cycles,
                through: next.through.clone(),
                length,
                constants: next.known.constants(),
            };
            Node {
                place: *place,
                edges: next.iter().map(edge).collect(),
                returns: *returns,
                ends_in: ends_in.clone(),
                waits: *waits,
            }
        };
        let nodes: Vec<Node> = places.iter().map(node).collect();
        let deepest = self.deepest(&nodes, |_| true, |routine| Some(&routine.deepest)).unwrap_or_default();
        let deepest_interrupted = self.deepest(
            &nodes,
            |place| place.interrupts == Interrupts::On,
            |routine| routine.deepest_interrupted.as_ref(),
        );
        Ok(Routine {
            entry: self.entry,
            nodes,
            returns: self.returns,
            keeps: self.keeps,
            leaves_zero: self.leaves_zero,
            deepest,
            deepest_interrupted,
            enables: self.enables,
        })
    }

    /// The deepest stack over the selected places, and over the called routines.
    fn deepest(
        &self,
        nodes: &[Node],
        counts: impl Fn(&Place) -> bool,
        of: impl Fn(&Routine) -> Option<&Vec<Frame>>,
    ) -> Option<Vec<Frame>> {
        let function = self.program.name_of(self.entry);
        let own = nodes.iter().filter(|node| counts(&node.place)).map(|node| (node.place.depth, None));
        let calls = nodes.iter().flat_map(|node| {
            let ends_in = node.ends_in.iter().map(|(_, called)| called);
            let called = node.edges.iter().filter_map(|edge| edge.through.as_ref()).chain(ends_in);
            called.map(|routine| {
                (node.place.depth + self.program.elf.chip.return_address_bytes(), Some(Rc::clone(routine)))
            })
        });
        let frames = own.chain(calls).filter_map(|(depth, called)| {
            let below = called.as_deref().map(&of);
            let below = match below {
                Some(None) => return None,
                Some(Some(frames)) => frames.as_slice(),
                None => &[],
            };
            Some((depth + bytes(below), depth, below.to_vec()))
        });
        let (_, depth, below) = frames.max_by_key(|(total, ..)| *total)?;
        Some([vec![Frame { function, bytes: depth }], below].concat())
    }

    /// Executes the instruction at a place.
    fn step(&mut self, place: Place) -> Result<Step, BoundsError> {
        let mut known = self.known[&place].clone();
        let instruction = self.program.instruction(place.address)?;
        let at = place.address;
        let chip = self.program.elf.chip;
        if place.depth > DEEPEST.min(usize::from(chip.ram_last)) {
            return Err(self.program.refuse(at, Problem::GrowsForEver));
        }
        if known.upper_half.is_some() && place.interrupts == Interrupts::On {
            return Err(self.program.refuse(at, Problem::HalfAStackPointer));
        }
        // Any handler can change these registers.
        if place.interrupts == Interrupts::On {
            known.kept = [Value::Unknown; 3];
        }
        let cycles =
            instruction.cycles + chip.more_cycles(instruction.operation) + halt_cycles(&instruction, chip.eecr);
        let mut interrupts = match place.interrupts {
            Interrupts::Off => Interrupts::Off,
            Interrupts::Soon | Interrupts::On => Interrupts::On,
        };
        let mut step = Step::default();
        let target = instruction.target(chip.flash_bytes);
        match instruction.operation {
            Rjmp | Jmp | Rcall | Call if target.is_some_and(|target| self.program.targets.is_table_jump(target)) => {
                let targets = self.program.targets.of_table(self.program.elf, at, &known);
                let (targets, table_cycles) = targets.ok_or_else(|| self.program.refuse(at, Problem::Indirect))?;
                known.after(Registers::range(1..=29));
                self.lead(&mut step, targets, place, known, interrupts, cycles + table_cycles)?;
            }
            Icall | Eicall | Ijmp | Eijmp => {
                let targets =
                    self.program.targets.of_pointer(self.program.elf, &self.program.name(at), &instruction, &known);
                let targets = targets.ok_or_else(|| self.program.refuse(at, Problem::Indirect))?;
                self.lead(&mut step, targets, place, known, interrupts, cycles)?;
            }
            Rjmp | Jmp => self.go(&mut step, target.unwrap_or_default(), known, interrupts, cycles, None),
            Brbs | Brbc => {
                let flag = (instruction.operand('s') == INTERRUPT_FLAG).then_some(place.interrupts != Interrupts::Off);
                let taken_if_set = instruction.operation == Brbs;
                let mut if_set = known.clone();
                if instruction.operand('s') == ZERO_FLAG {
                    if_set.is_zero();
                }
                let (taken, passed) = if taken_if_set { (if_set, known) } else { (known, if_set) };
                if flag != Some(!taken_if_set) {
                    let target = target.unwrap_or_default();
                    self.go(&mut step, target, taken, interrupts, cycles + 1, None);
                }
                if flag != Some(taken_if_set) {
                    self.go(&mut step, instruction.next(), passed, interrupts, cycles, None);
                }
            }
            Cpse | Sbrc | Sbrs | Sbic | Sbis => {
                let skipped = self.program.instruction(instruction.next())?;
                let bit = match (instruction.operation, known.registers[instruction.source()]) {
                    (Sbrc | Sbrs, Value::Status(on, _)) if instruction.operand('b') == INTERRUPT_FLAG => Some(on),
                    _ => None,
                };
                let skips_if_set = instruction.operation == Sbrs;
                if bit != Some(!skips_if_set) {
                    let cycles = cycles + skipped.bytes() / 2;
                    self.go(&mut step, skipped.next(), known.clone(), interrupts, cycles, None);
                }
                if bit != Some(skips_if_set) {
                    self.go(&mut step, instruction.next(), known, interrupts, cycles, None);
                }
            }
            Rcall | Call => {
                let target = target.unwrap_or_default();
                if target == instruction.next() {
                    // A compiler's shortest code for pushing bytes.
                    known.stack.extend(vec![Value::Unknown; chip.return_address_bytes()]);
                    self.go(&mut step, target, known, interrupts, cycles, None);
                } else {
                    self.call(&mut step, target, place, known, interrupts, cycles)?;
                }
            }
            Ret | Reti => {
                if !known.stack.is_empty() {
                    return Err(self.program.refuse(at, Problem::ReturnsElsewhere));
                }
                if self.entry.kind == Kind::Reset
                    || (instruction.operation == Reti) != (self.entry.kind == Kind::Handler)
                {
                    return Err(self.program.refuse(at, Problem::WrongReturn));
                }
                self.returns.insert(interrupts);
                let holds = |register: usize| known.registers[register] == Value::AtEntry(register);
                self.keeps = self.keeps & (Registers::which(holds) | known.unchanged);
                self.leaves_zero &= known.constant(1) == Some(0);
                step.returns = Some(cycles);
            }
            _ => {
                let before = interrupts;
                let is_start_up = self.entry.kind == Kind::Reset;
                let done = known.carry_out(&instruction, &chip, place.interrupts, &mut interrupts, is_start_up);
                match done {
                    // The value is unknown, so interrupts can be on or off.
                    Err(Problem::UnknownStatus) if self.entry.kind != Kind::Handler => {
                        self.go(&mut step, instruction.next(), known.clone(), Interrupts::Off, cycles, None);
                        turn(&mut interrupts, true);
                    }
                    Ok(()) => {}
                    Err(problem) => return Err(self.program.refuse(at, problem)),
                }
                if before == Interrupts::Off
                    && interrupts != Interrupts::Off
                    && self.entry.interrupts == Interrupts::Off
                {
                    self.enables.get_or_insert(at);
                }
                // A sleep with interrupts off does not end, and the time of a write to flash is unknown.
                step.waits = match instruction.operation {
                    Sleep => place.interrupts == Interrupts::Off,
                    operation => operation == Spm,
                };
                self.go(&mut step, instruction.next(), known, interrupts, cycles, None);
            }
        }
        Ok(step)
    }

    /// Continues at an address.
    fn go(
        &self,
        step: &mut Step,
        address: u32,
        known: Known,
        interrupts: Interrupts,
        cycles: u32,
        through: Option<Rc<Routine>>,
    ) {
        // The reset vector starts the program again, and from a bootloader address 0 another.
        if address != 0 && address != self.program.elf.start {
            let place = Place { address, depth: known.stack.len(), interrupts };
            step.next.push(Next { place, known, cycles, through });
        }
    }

    /// Continues at every target of an indirect call or jump.
    fn lead(
        &mut self,
        step: &mut Step,
        targets: Where,
        place: Place,
        known: Known,
        interrupts: Interrupts,
        cycles: u32,
    ) -> Result<(), BoundsError> {
        let instruction = self.program.instruction(place.address)?;
        let is_call = matches!(instruction.operation, Rcall | Call | Icall | Eicall);
        for &target in &targets.addresses {
            if is_call {
                self.call(step, target, place, known.clone(), interrupts, cycles)?;
            } else {
                self.go(step, target, known.clone(), interrupts, cycles, None);
            }
        }
        self.program.indirect.insert(place.address, targets);
        Ok(())
    }

    /// Calls a function and continues after it.
    fn call(
        &mut self,
        step: &mut Step,
        target: u32,
        place: Place,
        mut known: Known,
        interrupts: Interrupts,
        cycles: u32,
    ) -> Result<(), BoundsError> {
        if target == 0 || target == self.program.elf.start {
            return Ok(());
        }
        let Some(active) = self.program.enter(target, self.entry.active) else { return Ok(()) };
        let called = self.program.follow(Entry { address: target, interrupts, kind: Kind::Function, active })?;
        if self.enables.is_none() && self.entry.interrupts == Interrupts::Off {
            self.enables = called.enables.filter(|_| interrupts == Interrupts::Off);
        }
        known.after(called.keeps);
        known.kept = [Value::Unknown; 3];
        // The calling convention, which is checked at the function's return.
        if called.leaves_zero && !called.keeps.contains(1) {
            known.registers[1] = Value::Constant(0);
        }
        let next = self.program.instruction(place.address)?.next();
        for &interrupts in &called.returns {
            self.go(step, next, known.clone(), interrupts, cycles, Some(Rc::clone(&called)));
        }
        if called.returns.is_empty() {
            step.ends_in.push((cycles, called));
        }
        Ok(())
    }
}

/// Cycles that the EEPROM halts the core after an instruction. A write of the whole register may start either; it
/// counts as the longer one.
fn halt_cycles(instruction: &Instruction, eecr: u16) -> u32 {
    match (instruction.operation, instruction.data_address()) {
        (Sbi, Some(address)) if address == eecr => match instruction.operand('b') {
            EERE => READ_HALT_CYCLES,
            EEPE => WRITE_HALT_CYCLES,
            _ => 0,
        },
        (Out | Sts, Some(address)) if address == eecr => READ_HALT_CYCLES,
        _ => 0,
    }
}
