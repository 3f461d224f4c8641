//! Where a program goes: its calls, its paths, how deep the stack is on each of them and whether interrupts are on.
//!
//! A [`Routine`] is what is entered at one place, with interrupts on or off: a function, a handler, or the program after a
//! reset. From its entry every path is followed to its ends. A place on a path is an address together with the bytes that lie on
//! the stack there and the state of the interrupts; so a stack that differs between two paths to one address is two places,
//! and one that grows in a loop never ends, which is found. For every place it is known what the registers hold, as far as it
//! matters (`values`). What a call leaves of them is worked out from the function that is called, not from a convention.
//!
//! A jump into another function, as compilers make of a call at the end, is followed like any jump. The reset vector's address
//! is where a program starts anew, so a path ends there.
//!
//! What cannot be followed is refused: indirect calls and jumps, recursion, a stack pointer or an interrupt flag made of what
//! is not known. It is assumed that no store by a pointer hits a return address or a saved register.

use super::decode::Instruction;
use super::decode::Operation::*;
use super::error::BoundsError;
use super::proved::Frame;
use super::values::{DEEPEST, Doubt, INTERRUPT_FLAG, Interrupts, Known, Value};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

/// EECR by its address in the data space, its bits that start to read and to write (data sheet, section 8.6.3), and for how many cycles the
/// core then stands still.
const EECR: u16 = 0x3F;
const EERE: u16 = 0;
const EEPE: u16 = 1;
const READ_HALT_CYCLES: u32 = 4;
const WRITE_HALT_CYCLES: u32 = 2;

/// How a routine is entered, and so how it has to end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) enum Kind {
    /// From the reset vector.
    Reset,
    /// From an interrupt's vector.
    Handler,
    /// By a call.
    Function,
}

/// Which routine, in which circumstances.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Entry {
    pub(super) address: u32,
    pub(super) interrupts: Interrupts,
    pub(super) kind: Kind,
}

/// A place on a path.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(super) struct Place {
    pub(super) address: u32,
    /// Bytes on the stack since the routine's entry.
    pub(super) depth: usize,
    pub(super) interrupts: Interrupts,
}

/// A way from a place to the next.
#[derive(Clone)]
pub(super) struct Way {
    /// The place's number in its routine.
    pub(super) to: usize,
    /// Cycles of the instruction on this way, those of a call's own included.
    pub(super) cycles: u32,
    /// The routine that is run through on this way.
    pub(super) through: Option<Rc<Routine>>,
    /// The number in R21 and R20 where the way begins, if it is known: how many bytes a call of `memcpy` and its like is about.
    pub(super) length: Option<u16>,
}

/// An instruction at a place, and where it leads.
#[derive(Clone)]
pub(super) struct Node {
    pub(super) place: Place,
    pub(super) ways: Vec<Way>,
    /// The routine returns here, after so many cycles.
    pub(super) returns: Option<u32>,
    /// A function that is called from here and never returns, and the cycles of the call.
    pub(super) ends_in: Option<(u32, Rc<Routine>)>,
}

/// A routine whose every path is known.
pub(super) struct Routine {
    pub(super) entry: Entry,
    /// The places that can be come to; the first is the entry.
    pub(super) nodes: Vec<Node>,
    /// States of the interrupts behind its returns: off, on.
    pub(super) returns: BTreeSet<Interrupts>,
    /// Registers that hold at every return what they held at the entry.
    keeps: [bool; 32],
    /// The deepest stack, and the deepest where an interrupt can come in: who holds how much of it, from the entry on.
    pub(super) deepest: Vec<Frame>,
    pub(super) deepest_interrupted: Option<Vec<Frame>>,
    /// Where interrupts that were off at the entry are turned on, in it or in what it calls.
    pub(super) enables: Option<u32>,
}

/// Bytes of a stack.
pub(super) fn bytes(frames: &[Frame]) -> usize {
    frames.iter().map(|frame| frame.bytes).sum()
}

/// A program in flash, and what is known of its routines.
pub(super) struct Program<'a> {
    flash: &'a [u8],
    names: &'a BTreeMap<u32, String>,
    routines: BTreeMap<Entry, Rc<Routine>>,
    /// Those that are being followed, the outermost first.
    open: Vec<Entry>,
}

/// Bytes that a call puts onto the stack: where it returns to.
const RETURN_ADDRESS_BYTES: usize = 2;

impl<'a> Program<'a> {
    pub(super) fn new(flash: &'a [u8], names: &'a BTreeMap<u32, String>) -> Program<'a> {
        Program { flash, names, routines: BTreeMap::new(), open: Vec::new() }
    }

    /// The instruction at an address.
    pub(super) fn instruction(&self, address: u32) -> Result<Instruction, BoundsError> {
        let refused = || BoundsError::NoInstruction { address, function: self.name(address) };
        Instruction::at(self.flash, address).ok_or_else(refused)
    }

    /// The routines that were followed.
    pub(super) fn routines(&self) -> impl Iterator<Item = &Rc<Routine>> {
        self.routines.values()
    }

    /// The function that an address lies in.
    pub(super) fn name(&self, address: u32) -> String {
        let before = self.names.range(..=address).next_back();
        before.map_or_else(|| format!("{address:#06x}"), |(_, name)| name.clone())
    }

    /// What a routine is called: a handler after the function that its vector leads to.
    pub(super) fn name_of(&self, entry: Entry) -> String {
        let leads_to = || self.instruction(entry.address).ok()?.target(self.flash_bytes());
        match entry.kind {
            Kind::Reset => "reset".to_owned(),
            Kind::Handler => self.name(leads_to().unwrap_or(entry.address)),
            Kind::Function => self.name(entry.address),
        }
    }

    /// Follows a routine through all its paths, and those that it calls.
    pub(super) fn follow(&mut self, entry: Entry) -> Result<Rc<Routine>, BoundsError> {
        if let Some(routine) = self.routines.get(&entry) {
            return Ok(Rc::clone(routine));
        }
        if let Some(first) = self.open.iter().position(|open| open.address == entry.address) {
            let mut circle: Vec<String> = self.open[first..].iter().map(|open| self.name(open.address)).collect();
            circle.push(self.name(entry.address));
            return Err(BoundsError::Recursion { circle });
        }
        self.open.push(entry);
        let routine = Rc::new(Follower::new(self, entry).follow()?);
        self.open.pop();
        self.routines.insert(entry, Rc::clone(&routine));
        Ok(routine)
    }

    fn flash_bytes(&self) -> u32 {
        crate::elf::FLASH_BYTES as u32
    }
}

/// Where an instruction leads from a place.
struct Next {
    place: Place,
    known: Known,
    cycles: u32,
    through: Option<Rc<Routine>>,
}

/// All that an instruction does at a place.
#[derive(Default)]
struct Step {
    next: Vec<Next>,
    returns: Option<u32>,
    ends_in: Option<(u32, Rc<Routine>)>,
}

/// Follows one routine.
struct Follower<'p, 'a> {
    program: &'p mut Program<'a>,
    entry: Entry,
    known: HashMap<Place, Known>,
    returns: BTreeSet<Interrupts>,
    keeps: [bool; 32],
    enables: Option<u32>,
}

impl<'p, 'a> Follower<'p, 'a> {
    fn new(program: &'p mut Program<'a>, entry: Entry) -> Self {
        Follower { program, entry, known: HashMap::new(), returns: BTreeSet::new(), keeps: [true; 32], enables: None }
    }

    fn follow(mut self) -> Result<Routine, BoundsError> {
        let start = Place { address: self.entry.address, depth: 0, interrupts: self.entry.interrupts };
        self.known.insert(start, Known::at_entry());
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
            let Step { next, returns, ends_in } = &steps[place];
            let length = self.known[place].length();
            let way = |next: &Next| Way {
                to: numbers[&next.place],
                cycles: next.cycles,
                through: next.through.clone(),
                length,
            };
            Node { place: *place, ways: next.iter().map(way).collect(), returns: *returns, ends_in: ends_in.clone() }
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
            deepest,
            deepest_interrupted,
            enables: self.enables,
        })
    }

    /// The deepest stack over the places that count, and those of the routines called.
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
            let called = node.ways.iter().filter_map(|way| way.through.as_ref()).chain(ends_in);
            called.map(|routine| (node.place.depth + RETURN_ADDRESS_BYTES, Some(Rc::clone(routine))))
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

    /// Carries the instruction at a place out.
    fn step(&mut self, place: Place) -> Result<Step, BoundsError> {
        let mut known = self.known[&place].clone();
        let instruction = self.program.instruction(place.address)?;
        let function = || self.program.name(place.address);
        let at = place.address;
        if place.depth > DEEPEST {
            return Err(BoundsError::GrowsForEver { address: at, function: function() });
        }
        if known.upper_half.is_some() && place.interrupts == Interrupts::On {
            return Err(BoundsError::HalfAStackPointer { address: at, function: function() });
        }
        // What lies in these can be changed by any handler that comes in.
        if place.interrupts == Interrupts::On {
            known.kept = [Value::Unknown; 3];
        }
        let cycles = instruction.cycles + halt_cycles(&instruction);
        let mut interrupts = match place.interrupts {
            Interrupts::Off => Interrupts::Off,
            Interrupts::Soon | Interrupts::On => Interrupts::On,
        };
        let is_moving =
            matches!(instruction.operation, Mov | Movw | Ldi | In | Out | Push | Pop | Ld | Ldd | St | Std | Lds | Sts);
        if !is_moving && instruction.operation != Sbci {
            known.borrow = known.borrow.filter(|_| instruction.operation == Subi);
        }

        let mut step = Step::default();
        let mut go = |address: u32, known: Known, interrupts: Interrupts, cycles: u32, through: Option<Rc<Routine>>| {
            // The reset vector starts the program anew.
            if address != 0 {
                let place = Place { address, depth: known.stack.len(), interrupts };
                step.next.push(Next { place, known, cycles, through });
            }
        };
        let target = instruction.target(self.program.flash_bytes());
        match instruction.operation {
            Icall | Ijmp => return Err(BoundsError::Indirect { address: at, function: function() }),
            Sleep | Spm | Break => {
                let what = format!("{:?}", instruction.operation).to_lowercase();
                return Err(BoundsError::NoTime { what, address: at, function: function() });
            }
            Rjmp | Jmp => go(target.unwrap_or_default(), known, interrupts, cycles, None),
            Brbs | Brbc => {
                let flag = (instruction.operand('s') == INTERRUPT_FLAG).then_some(place.interrupts != Interrupts::Off);
                let taken_if_set = instruction.operation == Brbs;
                if flag != Some(!taken_if_set) {
                    go(target.unwrap_or_default(), known.clone(), interrupts, cycles + 1, None);
                }
                if flag != Some(taken_if_set) {
                    go(instruction.next(), known, interrupts, cycles, None);
                }
            }
            Cpse | Sbrc | Sbrs | Sbic | Sbis => {
                let skipped = self.program.instruction(instruction.next())?;
                let bit = match (instruction.operation, known.registers[instruction.source()]) {
                    (Sbrc | Sbrs, Value::Status(on)) if instruction.operand('b') == INTERRUPT_FLAG => Some(on),
                    _ => None,
                };
                let skips_if_set = instruction.operation == Sbrs;
                if bit != Some(!skips_if_set) {
                    go(skipped.next(), known.clone(), interrupts, cycles + skipped.bytes() / 2, None);
                }
                if bit != Some(skips_if_set) {
                    go(instruction.next(), known, interrupts, cycles, None);
                }
            }
            Rcall | Call => {
                let target = target.unwrap_or_default();
                if target == instruction.next() {
                    // A compiler's shortest way to put two bytes onto the stack.
                    known.stack.extend([Value::Unknown; RETURN_ADDRESS_BYTES]);
                    go(target, known, interrupts, cycles, None);
                } else if target != 0 {
                    let entry = Entry { address: target, interrupts, kind: Kind::Function };
                    let called = self.program.follow(entry)?;
                    if self.enables.is_none() && self.entry.interrupts == Interrupts::Off {
                        self.enables = called.enables.filter(|_| interrupts == Interrupts::Off);
                    }
                    for (register, _) in called.keeps.iter().enumerate().filter(|(_, keeps)| !**keeps) {
                        known.registers[register] = Value::Unknown;
                    }
                    known.kept = [Value::Unknown; 3];
                    for &interrupts in &called.returns {
                        go(instruction.next(), known.clone(), interrupts, cycles, Some(Rc::clone(&called)));
                    }
                    if called.returns.is_empty() {
                        step.ends_in = Some((cycles, called));
                    }
                }
            }
            Ret | Reti => {
                if !known.stack.is_empty() {
                    return Err(BoundsError::ReturnsElsewhere { address: at, function: function() });
                }
                if self.entry.kind == Kind::Reset
                    || (instruction.operation == Reti) != (self.entry.kind == Kind::Handler)
                {
                    return Err(BoundsError::WrongReturn { address: at, function: function() });
                }
                self.returns.insert(interrupts);
                for (register, keeps) in self.keeps.iter_mut().enumerate() {
                    *keeps &= known.registers[register] == Value::AtEntry(register);
                }
                step.returns = Some(cycles);
            }
            _ => {
                let before = interrupts;
                let is_start_up = self.entry.kind == Kind::Reset;
                known.carry_out(&instruction, place.interrupts, &mut interrupts, is_start_up).map_err(|doubt| {
                    match doubt {
                        Doubt::TakesTooMuch => BoundsError::TakesTooMuch { address: at, function: function() },
                        Doubt::Stack => BoundsError::UnknownStack { address: at, function: function() },
                        Doubt::Status => BoundsError::UnknownStatus { address: at, function: function() },
                    }
                })?;
                if before == Interrupts::Off
                    && interrupts != Interrupts::Off
                    && self.entry.interrupts == Interrupts::Off
                {
                    self.enables.get_or_insert(at);
                }
                go(instruction.next(), known, interrupts, cycles, None);
            }
        }
        Ok(step)
    }
}

/// Cycles for which the core stands still behind an instruction, because of the EEPROM (data sheet, section 8.6.3). A
/// write of the whole register may order either; it is taken for the longer.
fn halt_cycles(instruction: &Instruction) -> u32 {
    match (instruction.operation, instruction.data_address()) {
        (Sbi, Some(EECR)) => match instruction.operand('b') {
            EERE => READ_HALT_CYCLES,
            EEPE => WRITE_HALT_CYCLES,
            _ => 0,
        },
        (Out | Sts, Some(EECR)) => READ_HALT_CYCLES,
        _ => 0,
    }
}
