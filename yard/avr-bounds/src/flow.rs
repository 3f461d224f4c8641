//! The control flow of a program: its calls and paths, with the stack and the state of the interrupts on each.
//!
//! A [`Routine`] has one entry, with interrupts on or off: a function, a handler, or the program after a reset. From
//! its entry every path is followed to its ends. A place on a path consists of an address, the bytes on the stack, and
//! the state of the interrupts. Two paths that reach an address with different stacks therefore make two places. A
//! stack that grows in a loop makes places without end, and the analysis detects this. For every place the analysis
//! knows the register contents that matter (`values`). It derives the registers that a call preserves from the called
//! function, not from a convention.
//!
//! A jump into another function is followed like any jump: compilers make it from a call at the end (tail call). A jump
//! or call to the reset vector's address, also by a null pointer, starts the program again, with the stack and the
//! interrupts as they are. Such a path ends where the start-up code has turned interrupts off and set the stack pointer:
//! the state is then that after a reset. Computed calls and jumps lead to all their targets (`targets`).
//!
//! The analysis refuses what it cannot follow: indirect calls without targets, recursion without a bound in the
//! budgets, and a stack pointer or a handler's interrupt flag with an unknown value. It assumes that no store through a
//! pointer hits a return address or a saved register.

use crate::budget::Budgets;
use crate::counted;
use crate::decode::Instruction;
use crate::decode::Operation::*;
use crate::effects::Registers;
use crate::elf;
use crate::error::{BoundsError, Problem};
use crate::paths;
use crate::proved::{self, Found, Frame};
use crate::reach::Reach;
use crate::routine::{Edge, Entry, Kind, Node, Place, Routine, bytes};
use crate::targets::{Targets, Where};
use crate::values::{DEEPEST, INTERRUPT_FLAG, Interrupts, Known, Value};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::rc::Rc;

/// The most calls within calls. Each takes some of the host's stack: 2 MB are enough for 300.
const MOST_NESTED: usize = 200;

/// SREG's bit of the last result being zero.
const ZERO_FLAG: u16 = 1;

/// A program in flash, and the known facts about its routines.
pub(crate) struct Code<'a> {
    pub(crate) elf: &'a elf::Program,
    budgets: &'a Budgets,
    /// The address of the interrupt vectors, if the program has some.
    pub(crate) vectors: Option<u32>,
    reach: Reach,
    targets: Targets,
    /// Which calls of functions with bounded recursion can be active at once: each by its function's address.
    active: Vec<Vec<u32>>,
    /// Indirect calls, with their targets.
    pub(crate) indirect: BTreeMap<u32, Where>,
    routines: BTreeMap<Entry, Rc<Routine>>,
    /// The routines that are being followed, the outermost first.
    open: Vec<Entry>,
    /// Where start-up code that runs again has set the stack pointer.
    restarts: BTreeSet<Place>,
}

impl<'a> Code<'a> {
    pub(crate) fn new(elf: &'a elf::Program, budgets: &'a Budgets) -> Code<'a> {
        let vectors = budgets.vectors.or(elf.has_vectors.then_some(elf.start));
        let reach = Reach::of(elf, vectors);
        let of_vectors = vectors.map(|first| first + u32::from(elf.chip.vectors) * elf.chip.vector_bytes);
        let targets = Targets::new(elf, budgets, &reach, of_vectors.unwrap_or(elf.start));
        Code {
            elf,
            budgets,
            vectors,
            reach,
            targets,
            active: vec![Vec::new()],
            indirect: BTreeMap::new(),
            routines: BTreeMap::new(),
            open: Vec::new(),
            restarts: BTreeSet::new(),
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

    /// The function that an address lies in, for readers: of functions without a size the last one before it.
    pub(crate) fn name(&self, address: u32) -> String {
        let unknown = || format!("{address:#06x}");
        let Some((first, end)) = self.elf.extent(address) else { return unknown() };
        if address < end { self.elf.functions[&first].name.clone() } else { unknown() }
    }

    /// The name of the function that an address surely lies in: by its size, or by a path from its beginning. Only such
    /// a name may bring facts from the budgets.
    pub(crate) fn name_for_facts(&self, address: u32) -> Option<&str> {
        let (first, end) = self.elf.extent(address)?;
        let symbol = &self.elf.functions[&first];
        let is_within = if symbol.bytes > 0 { address < end } else { self.reach.passes(first, address) };
        is_within.then_some(symbol.name.as_str())
    }

    /// Refuses a program that starts itself again in another state than a reset leaves.
    pub(crate) fn check_restarts(&self, main: &Routine) -> Result<(), BoundsError> {
        let is_of_main = |place: &&Place| main.nodes.iter().any(|node| node.place == **place);
        match self.restarts.iter().find(|place| !is_of_main(place)) {
            None => Ok(()),
            Some(place) => Err(self.refuse(place.address, Problem::StartsDifferently)),
        }
    }

    /// A routine's name. A handler has the name of the function that its vector leads to.
    pub(crate) fn name_of(&self, entry: Entry) -> String {
        let leads_to = || self.instruction(entry.address).ok()?.target(self.elf.chip.flash_bytes);
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
        if self.open.len() == MOST_NESTED {
            return Err(BoundsError(format!(
                "{MOST_NESTED} functions call each other on the way to {}, and the analysis follows no more: call fewer within each \
                 other, or lower their depth in [recursion]",
                self.name(entry.address)
            )));
        }
        self.open.push(entry);
        let routine = Routine {
            entry,
            nodes: Vec::new(),
            nest: Vec::new(),
            returns: BTreeSet::new(),
            keeps: Registers::ALL,
            leaves_zero: true,
            deepest: Vec::new(),
            deepest_interrupted: None,
            feeds: false,
            enables: None,
        };
        let follower =
            Follower { program: self, routine, known: Vec::new(), numbers: HashMap::new(), to_do: Vec::new() };
        let routine = Rc::new(follower.follow()?);
        self.open.pop();
        self.routines.insert(entry, Rc::clone(&routine));
        Ok(routine)
    }
}

/// The state after an instruction, and its cycles.
#[derive(Clone)]
struct After {
    known: Known,
    cycles: u32,
}

/// Follows one routine.
struct Follower<'p, 'a> {
    program: &'p mut Code<'a>,
    routine: Routine,
    /// The known facts at each of its places.
    known: Vec<Known>,
    numbers: HashMap<Place, usize>,
    to_do: Vec<usize>,
}

impl Follower<'_, '_> {
    fn follow(mut self) -> Result<Routine, BoundsError> {
        let Entry { address, interrupts, kind, .. } = self.routine.entry;
        self.reach(address, Known::at_entry(kind == Kind::Function, interrupts))?;
        while let Some(number) = self.to_do.pop() {
            self.step(number)?;
        }
        let deepest = self.deepest(|_| true, |routine| Some(&routine.deepest)).unwrap_or_default();
        let is_on = |place: &Place| place.interrupts == Interrupts::On;
        let deepest_interrupted = self.deepest(is_on, |routine| routine.deepest_interrupted.as_ref());
        let leaves_zero = self.routine.leaves_zero || kind == Kind::Function && self.returns_zero();
        let nodes = &self.routine.nodes;
        let returning = paths::reaching(nodes, |node| nodes[node].returns.is_some());
        let feeds = nodes.iter().zip(returning).any(|(node, returns)| returns && node.feeds());
        let nest = paths::nest(nodes);
        Ok(Routine { nest, feeds, deepest, deepest_interrupted, leaves_zero, ..self.routine })
    }

    /// Whether R1 is zero at every return, also where a loop counts it down to zero.
    fn returns_zero(&self) -> bool {
        const ZERO: usize = 1;

        let nodes = &self.routine.nodes;
        let edges = |node: usize| -> Vec<usize> { nodes[node].edges.iter().map(|edge| edge.to).collect() };
        let loops = paths::loops(&(0..nodes.len()).collect(), &edges);
        let exits: BTreeSet<(usize, usize)> =
            loops.iter().flat_map(|circle| counted::exits_with_zero(nodes, circle, ZERO)).collect();
        // Zero until a path shows otherwise.
        let mut is_zero = vec![true; nodes.len()];
        let mut to_do: Vec<usize> = (0..nodes.len()).collect();
        while let Some(number) = to_do.pop() {
            let node = &nodes[number];
            for edge in &node.edges {
                let keeps = match &edge.through {
                    Some(called) => called.keeps.has(ZERO) || called.leaves_zero,
                    None => !node.instruction.effects().changes.has(ZERO),
                };
                let comes_zero =
                    edge.constants[ZERO] == Some(0) || is_zero[number] && keeps || exits.contains(&(number, edge.to));
                if !comes_zero && std::mem::replace(&mut is_zero[edge.to], false) {
                    to_do.push(edge.to);
                }
            }
        }
        nodes.iter().zip(is_zero).all(|(node, is_zero)| node.returns.is_none() || is_zero)
    }

    /// The number of the place that a path reaches with these facts. If they are new, the place is to be followed.
    fn reach(&mut self, address: u32, known: Known) -> Result<usize, BoundsError> {
        let place = Place { address, depth: known.stack.len(), interrupts: known.interrupts };
        let number = match self.numbers.get(&place) {
            Some(&number) if !self.known[number].meet(&known) => return Ok(number),
            Some(&number) => number,
            None => {
                self.routine.nodes.push(Node::new(place, self.program.instruction(address)?));
                self.known.push(known);
                self.numbers.insert(place, self.known.len() - 1);
                self.known.len() - 1
            }
        };
        self.to_do.push(number);
        Ok(number)
    }

    /// The deepest stack over the selected places, and over the called routines.
    fn deepest(
        &self,
        counts: impl Fn(&Place) -> bool,
        of: impl Fn(&Routine) -> Option<&Vec<Frame>>,
    ) -> Option<Vec<Frame>> {
        let nodes = &self.routine.nodes;
        let none: &[Frame] = &[];
        let own = nodes.iter().filter(|node| counts(&node.place)).map(|node| (node.place.depth, none));
        let return_address = self.program.elf.chip.return_address_bytes();
        let calls =
            nodes.iter().flat_map(|node| node.called().map(|called| (node.place.depth + return_address, called)));
        let calls = calls.filter_map(|(depth, called)| Some((depth, of(called)?.as_slice())));
        let (depth, below) = own.chain(calls).max_by_key(|(depth, below)| depth + bytes(below))?;
        let frame = Frame { function: self.program.name_of(self.routine.entry), bytes: depth };
        Some([&[frame], below].concat())
    }

    /// Executes the instruction at a place.
    fn step(&mut self, number: usize) -> Result<(), BoundsError> {
        let Node { place, instruction, .. } = self.routine.nodes[number];
        let mut known = self.known[number].clone();
        let at = place.address;
        let chip = self.program.elf.chip;
        if place.depth > DEEPEST.min(usize::from(chip.ram_last)) {
            let problem = if known.restarts { Problem::StartsDeeper } else { Problem::GrowsForEver };
            return Err(self.program.refuse(at, problem));
        }
        if known.upper_half.is_some() && place.interrupts == Interrupts::On {
            return Err(self.program.refuse(at, Problem::HalfAStackPointer));
        }
        // Any handler can change these registers.
        if place.interrupts == Interrupts::On {
            known.kept = [Value::Unknown; 3];
        }
        let halt_cycles = chip.halt_cycles(&instruction, known.written(&instruction));
        let cycles = instruction.cycles + chip.more_cycles(instruction.operation) + halt_cycles;
        if known.interrupts == Interrupts::Soon {
            known.interrupts = Interrupts::On;
        }
        let interrupts = known.interrupts;
        let mut after = After { known, cycles };
        self.routine.nodes[number] = Node::new(place, instruction);
        let (next, target) = (instruction.next(), instruction.target(chip.flash_bytes));
        match instruction.operation {
            Rjmp | Jmp | Rcall | Call
                if target.is_some_and(|target| self.program.elf.table_jumps.contains(&target)) =>
            {
                let targets = self.program.targets.of_table(self.program.elf, at, &after.known);
                let (targets, table_cycles) = targets.ok_or_else(|| self.program.refuse(at, Problem::Indirect))?;
                // The routine changes R0 and the pointer.
                after.known.after(Registers::which(|register| matches!(register, 1..=29)));
                after.cycles += table_cycles;
                self.lead(number, targets, after)?;
            }
            Icall | Eicall | Ijmp | Eijmp => {
                let caller = self.program.name_for_facts(at);
                let targets = self.program.targets.of_pointer(self.program.elf, caller, &instruction, &after.known);
                let targets = targets.ok_or_else(|| self.program.refuse(at, Problem::Indirect))?;
                self.lead(number, targets, after)?;
            }
            Rjmp | Jmp => self.go(number, target.unwrap_or_default(), after, None)?,
            Brbs | Brbc => {
                let flag = (instruction.operand('s') == INTERRUPT_FLAG).then_some(place.interrupts != Interrupts::Off);
                let taken_if_set = instruction.operation == Brbs;
                let mut if_set = after.clone();
                if instruction.operand('s') == ZERO_FLAG {
                    if_set.known.is_zero();
                }
                let (mut taken, passed) = if taken_if_set { (if_set, after) } else { (after, if_set) };
                taken.cycles += 1;
                if flag != Some(!taken_if_set) {
                    self.go(number, target.unwrap_or_default(), taken, None)?;
                }
                if flag != Some(taken_if_set) {
                    self.go(number, next, passed, None)?;
                }
            }
            Cpse | Sbrc | Sbrs | Sbic | Sbis => {
                let skipped = self.program.instruction(next)?;
                let bit = match (instruction.operation, after.known.registers[instruction.source]) {
                    (Sbrc | Sbrs, Value::Status(on, _)) if instruction.operand('b') == INTERRUPT_FLAG => Some(on),
                    _ => None,
                };
                let skips_if_set = instruction.operation == Sbrs;
                if bit != Some(!skips_if_set) {
                    let skips = After { cycles: cycles + skipped.bytes() / 2, ..after.clone() };
                    self.go(number, skipped.next(), skips, None)?;
                }
                if bit != Some(skips_if_set) {
                    self.go(number, next, after, None)?;
                }
            }
            Rcall | Call if target == Some(next) => {
                // A compiler's shortest code for pushing bytes.
                after.known.stack.extend(vec![Value::Unknown; chip.return_address_bytes()]);
                self.go(number, next, after, None)?;
            }
            Rcall | Call => self.call(number, target.unwrap_or_default(), after)?,
            Ret | Reti => {
                let Routine { entry, keeps, leaves_zero, .. } = &mut self.routine;
                if !after.known.stack.is_empty() {
                    return Err(self.program.refuse(at, Problem::ReturnsElsewhere));
                }
                if entry.kind == Kind::Reset || (instruction.operation == Reti) != (entry.kind == Kind::Handler) {
                    return Err(self.program.refuse(at, Problem::WrongReturn));
                }
                let holds = |register: usize| after.known.registers[register] == Value::AtEntry(register);
                *keeps &= Registers::which(holds) | after.known.unchanged;
                *leaves_zero &= after.known.constant(1) == Some(0);
                self.routine.returns.insert(interrupts);
                self.routine.nodes[number].returns = Some(cycles);
            }
            _ => {
                let Entry { kind, interrupts: at_entry, .. } = self.routine.entry;
                let known = &mut after.known;
                if let Some(depth) = known.starts_again(&instruction, &chip) {
                    let place = Place { address: next, depth, interrupts };
                    self.program.restarts.insert(place);
                    return Ok(());
                }
                match known.carry_out(&instruction, &chip, kind == Kind::Reset) {
                    // The value is unknown, so interrupts can be on or off.
                    Err(Problem::UnknownStatus) if kind != Kind::Handler => {
                        let mut off = after.clone();
                        off.known.interrupts = Interrupts::Off;
                        self.go(number, next, off, None)?;
                        after.known.turn_interrupts(true);
                    }
                    Ok(()) => {}
                    Err(problem) => return Err(self.program.refuse(at, problem)),
                }
                if interrupts == Interrupts::Off
                    && after.known.interrupts != Interrupts::Off
                    && at_entry == Interrupts::Off
                {
                    self.routine.enables.get_or_insert(at);
                }
                // A sleep with interrupts off does not end, and the time of a write to flash is unknown.
                self.routine.nodes[number].waits = match instruction.operation {
                    Sleep => place.interrupts == Interrupts::Off,
                    operation => operation == Spm,
                };
                self.go(number, next, after, None)?;
            }
        }
        Ok(())
    }

    /// Continues at an address.
    fn go(&mut self, from: usize, address: u32, after: After, through: Option<Rc<Routine>>) -> Result<(), BoundsError> {
        if self.is_other_program(address) {
            return Ok(());
        }
        let After { mut known, cycles } = after;
        known.restarts |= address == self.program.elf.start;
        let (length, constants) = (self.known[from].pair(20), known.constants());
        let to = self.reach(address, known)?;
        self.routine.nodes[from].edges.push(Edge { to, cycles, through, length, constants });
        Ok(())
    }

    /// Whether another program starts at this address: from a bootloader at address 0.
    fn is_other_program(&self, address: u32) -> bool {
        address == 0 && self.program.elf.start > 0
    }

    /// Continues at every target of an indirect call or jump.
    fn lead(&mut self, from: usize, targets: Where, after: After) -> Result<(), BoundsError> {
        let Node { place, instruction, .. } = self.routine.nodes[from];
        // A pointer that the program has not set is null.
        let null = (targets.found == Found::Taken).then_some(&0);
        for &target in targets.addresses.iter().chain(null) {
            if matches!(instruction.operation, Rcall | Call | Icall | Eicall) {
                self.call(from, target, after.clone())?;
            } else {
                self.go(from, target, after.clone(), None)?;
            }
        }
        self.program.indirect.insert(place.address, targets);
        Ok(())
    }

    /// Calls a function and continues after it.
    fn call(&mut self, from: usize, address: u32, mut after: After) -> Result<(), BoundsError> {
        let Entry { interrupts: at_entry, active, .. } = self.routine.entry;
        let interrupts = after.known.interrupts;
        if self.is_other_program(address) {
            return Ok(());
        }
        if address == self.program.elf.start {
            after.known.stack.extend(vec![Value::Unknown; self.program.elf.chip.return_address_bytes()]);
            return self.go(from, address, after, None);
        }
        let Some(active) = self.program.enter(address, active) else { return Ok(()) };
        let called = self.program.follow(Entry { address, interrupts, kind: Kind::Function, active })?;
        if self.routine.enables.is_none() && at_entry == Interrupts::Off && interrupts == Interrupts::Off {
            self.routine.enables = called.enables;
        }
        after.known.after(called.keeps);
        after.known.kept = [Value::Unknown; 3];
        // The calling convention, which is checked at the function's return.
        if called.leaves_zero && !called.keeps.has(1) {
            after.known.registers[1] = Value::Constant(0);
        }
        let next = self.routine.nodes[from].instruction.next();
        for &interrupts in &called.returns {
            after.known.interrupts = interrupts;
            self.go(from, next, after.clone(), Some(Rc::clone(&called)))?;
        }
        if called.returns.is_empty() {
            self.routine.nodes[from].ends_in.push((after.cycles, called));
        }
        Ok(())
    }
}
