//! What a firmware for the ATmega328P can need at most, proved from its ELF: stack, handlers, stretches without interrupts, and how
//! fast the edges of an input may follow each other.
//!
//! [`prove`] follows every path of the program in flash (`flow`), from the reset vector and from every interrupt's, and
//! takes the deepest and the longest (`cycles`). Nothing is run and nothing is sampled, so what it says holds for every input,
//! every phase and every layout. It knows nothing of what the firmware is for.
//!
//! What it takes for granted: a program without indirect calls, without recursion and without handlers that turn interrupts on
//! (all three are checked, and refused), and stores that keep off return addresses and saved registers, which is what Rust's
//! rules are for. A path that the program never takes is followed like any other, so a bound can be larger than
//! what ever happens, never smaller.
//!
//! Values in registers are proved to last over calls and handlers as well (`registers`), since the compiler chooses their registers by
//! what the called functions happen to leave alone.
//!
//! # The rate that is never lost
//!
//! An edge asks for a handler, and the handler looks at the pins. From an edge that comes right behind one look to the next look
//! pass, at most: the chip's synchroniser; the longest other handler, or what is left of this one behind its look; the longest
//! stretch of the main program in which no interrupt comes in, since after each handler the program is given one
//! instruction, and that one may turn interrupts off; the interrupt's response; the handler up to its look. While no more
//! edges come in that time than the decoder can tell apart, none is ever lost, however long it goes on. It holds for the
//! vectors that go before all others that the firmware uses, which is checked.

mod budget;
mod cycles;
mod decode;
mod effects;
mod error;
mod flow;
mod loops;
mod proved;
mod registers;
mod values;

pub use self::budget::{Budgets, BudgetsError, BudgetsProblem, Held};
use self::cycles::{Passes, Stretch, Time, Timer};
use self::decode::{Instruction, Operation};
pub use self::error::{BoundsError, Spoilt};
use self::flow::{Entry, Kind, Node, Program, Routine, bytes};
pub use self::loops::{LoopBound, LoopBounds, records};
pub use self::proved::{Bounds, EdgeBounds, Frame, Handler, Input, Lasting, TurnBound};
use self::values::Interrupts;
use crate::elf::Image;
use signal::CYCLES_PER_SECOND;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::rc::Rc;

/// Cycles from the end of an instruction to the first one of the vector (data sheet, section 7.7.1).
const RESPONSE_CYCLES: u64 = 4;

/// Cycles from an edge at a pin until it asks for its interrupt, at most, and by which it may come before a look and not be seen
/// (data sheet, pin change interrupt timing, and reading the pin value).
const SYNCHRONISER_CYCLES: u64 = 3;

/// Bytes that an interrupt puts onto the stack: where it came in.
const RETURN_ADDRESS_BYTES: usize = 2;

/// Interrupt vectors, without the reset's, and bytes of each (data sheet, table 12-6).
const VECTORS: u8 = 25;
const VECTOR_BYTES: u32 = 4;

/// The instruction at an address of flash, as the proof takes it: its length in bytes and what a disassembler calls it. None where
/// no instruction of the ATmega328P stands.
pub fn instruction_at(flash: &[u8], address: u32) -> Option<(u32, String)> {
    Instruction::at(flash, address).map(|found| (found.bytes(), found.mnemonic()))
}

/// Proves what the firmware at `elf` needs at most, and how fast the edges of `input` may come, if one is asked for. `loops` says how
/// often the loops of some functions turn.
///
/// # Errors
/// Where the ELF cannot be read, or its program cannot be followed.
pub fn prove(elf: &Path, input: Option<&Input>, loops: &LoopBounds) -> Result<Bounds, BoundsError> {
    let image = Image::read(elf)?;
    let known: BTreeSet<_> = image.functions.keys().map(|name| without_types(name)).collect();
    let gone: Vec<_> = loops.keys().filter(|name| !known.contains(*name)).cloned().collect();
    if !gone.is_empty() {
        return Err(BoundsError::NoSuchFunction { names: gone });
    }
    // Of two names for one place, always the same.
    let mut functions: Vec<_> = image.functions.iter().collect();
    functions.sort_by_key(|&(name, _)| std::cmp::Reverse(name));
    let names = functions.into_iter().map(|(name, address)| (*address, without_types(name))).collect();
    let mut program = Program::new(&image.flash, &names);
    let main = program.follow(Entry { address: 0, interrupts: Interrupts::Off, kind: Kind::Reset })?;
    let mut handlers = BTreeMap::new();
    for vector in 1..=VECTORS {
        if let Some(address) = handler_of(&program, vector)? {
            let handler = program.follow(Entry { address, interrupts: Interrupts::Off, kind: Kind::Handler })?;
            if let Some(address) = handler.enables {
                return Err(BoundsError::HandlerEnables { vector, address, function: program.name(address) });
            }
            handlers.insert(vector, handler);
        }
    }

    let functions = image.functions.iter();
    let by_length = functions.filter(|(name, _)| loops.get(&without_types(name)).is_some_and(|bound| bound.by_length));
    let by_length = by_length.map(|(_, address)| *address).collect();
    let places = program.routines().flat_map(|routine| &routine.nodes).map(|node| node.place.address);
    let of_heads = places.filter_map(|place| Some((place, loops.get(&program.name(place))?.passes.clone()))).collect();
    let mut timer = Timer::new(Passes { stated: loops::records(elf)?, of_heads, by_length });
    let mut of_handlers = Vec::new();
    for (&vector, handler) in &handlers {
        let what = format!("the handler of vector {vector}");
        let longest = timer.longest(handler).map(|time| time.bound(&what, &program));
        of_handlers.push(Handler {
            vector,
            function: program.name_of(handler.entry),
            cycles: longest.transpose()?.map(|cycles| RESPONSE_CYCLES + cycles),
            stack_bytes: RETURN_ADDRESS_BYTES + bytes(&handler.deepest),
        });
    }
    let mut longest_stretch = |kind| {
        let longest =
            timer.longest_stretch(&main, kind).map(|time| time.bound("a stretch without interrupts", &program));
        longest.transpose().map(Option::unwrap_or_default)
    };
    let critical_section_cycles = longest_stretch(Stretch::FlagClear)?;
    let closed_cycles = longest_stretch(Stretch::Closed)?;

    let edges =
        input.map(|input| watch(input, &program, &handlers, &of_handlers, &mut timer, closed_cycles)).transpose()?;

    let feeds = |node: &Node| {
        program.instruction(node.place.address).is_ok_and(|instruction| instruction.operation == Operation::Wdr)
    };
    let turns = program.routines().filter(|routine| routine.entry.kind != Kind::Handler);
    let turns: Vec<Time> = turns.filter_map(|routine| timer.turn(routine, feeds)).collect();
    let turn = turns.into_iter().reduce(|longest, turn| longest.or(&turn)).map(|turn| TurnBound {
        cycles: turn.is_bound().then_some(turn.cycles),
        without_bound: turn.unbounded.iter().map(|&address| (address, program.name(address))).collect(),
    });

    let lasting = registers::prove(&program, &main, handlers.iter().map(|(&vector, handler)| (vector, handler)))?;
    let stack = deepest(&main, handlers.values());
    Ok(Bounds {
        stack_bytes: bytes(&stack),
        stack,
        handlers: of_handlers,
        critical_section_cycles,
        closed_cycles,
        edges,
        turn,
        lasting,
    })
}

/// How long an edge of an input waits for a look, and how fast its edges may come. `of_handlers` are all handlers with their times.
fn watch(
    input: &Input,
    program: &Program,
    handlers: &BTreeMap<u8, Rc<Routine>>,
    of_handlers: &[Handler],
    timer: &mut Timer,
    closed_cycles: u64,
) -> Result<EdgeBounds, BoundsError> {
    let is_before_last = |other: u8| input.vectors.last().filter(|last| other < **last).copied();
    for &other in handlers.keys().filter(|other| !input.vectors.contains(other)) {
        if let Some(vector) = is_before_last(other) {
            return Err(BoundsError::NotFirst { vector, other });
        }
    }
    let looks = |node: &Node| program.instruction(node.place.address).is_ok_and(|found| found.reads(input.port));
    let (mut to_look, mut busy) = (0, 0);
    for &vector in &input.vectors {
        let look = handlers.get(&vector).and_then(|handler| timer.around(handler, looks));
        let (to, behind) = look.ok_or(BoundsError::DoesNotLook { vector, port: input.port })?;
        to_look = to_look.max(RESPONSE_CYCLES + to.bound("the way to a look", program)?);
        busy = busy.max(behind.bound("the way from a look", program)?);
    }
    let others = of_handlers.iter().filter(|handler| !input.vectors.contains(&handler.vector));
    let busy = others.filter_map(|handler| handler.cycles).fold(busy, u64::max);
    let wait_cycles = SYNCHRONISER_CYCLES + busy + closed_cycles + to_look;
    Ok(EdgeBounds { wait_cycles, never_lost_per_s: input.edges_between_looks * CYCLES_PER_SECOND / wait_cycles })
}

/// The deepest stack: the main program where a handler comes in, and that handler, or with interrupts off the main program alone.
fn deepest<'a>(main: &Routine, handlers: impl Iterator<Item = &'a Rc<Routine>>) -> Vec<Frame> {
    let handler = handlers.map(|handler| &handler.deepest).max_by_key(|frames| bytes(frames));
    let interrupted = main.deepest_interrupted.clone().zip(handler).map(|(mut frames, handler)| {
        frames.extend_from_slice(handler);
        let handler = frames.len() - handler.len();
        if let Some(first) = frames.get_mut(handler) {
            first.bytes += RETURN_ADDRESS_BYTES;
        }
        frames
    });
    interrupted.into_iter().chain([main.deepest.clone()]).max_by_key(|frames| bytes(frames)).unwrap_or_default()
}

impl Time {
    /// A time that has to have a bound; `what` it is the time of.
    fn bound(&self, what: &str, program: &Program) -> Result<u64, BoundsError> {
        match self.unbounded.first() {
            None => Ok(self.cycles),
            Some(&address) => {
                Err(BoundsError::Unbounded { what: what.into(), address, function: program.name(address) })
            }
        }
    }
}

/// Where the handler of a vector is entered: at the vector itself. `None` where the vector's jumps lead to the reset, as
/// they do for a vector that is not used.
fn handler_of(program: &Program, vector: u8) -> Result<Option<u32>, BoundsError> {
    let start = u32::from(vector) * VECTOR_BYTES;
    let mut address = start;
    // Two jumps, and the one in the vector.
    for _ in 0..3 {
        let instruction = program.instruction(address)?;
        match instruction.target(crate::elf::FLASH_BYTES as u32) {
            Some(0) => return Ok(None),
            Some(target) if matches!(instruction.operation, Operation::Jmp | Operation::Rjmp) => address = target,
            _ => break,
        }
    }
    Ok(Some(start))
}

/// A function's path without the types that it is made for: of `<a::B<c::D> as e::F>::g::<h>` remains `a::B::g`.
fn without_types(name: &str) -> String {
    let Some(inner) = name.strip_prefix('<') else {
        let mut depth = 0;
        let kept = name.replace("::<", "<").replace("->", "");
        return kept
            .chars()
            .filter(|&letter| {
                depth += i32::from(letter == '<');
                let is_kept = depth == 0;
                depth -= i32::from(letter == '>');
                is_kept
            })
            .collect();
    };
    let mut depth = 1;
    let end = inner.char_indices().find(|(_, letter)| {
        depth += i32::from(*letter == '<') - i32::from(*letter == '>');
        depth == 0
    });
    let Some((end, _)) = end else { return name.to_owned() };
    let (of, method) = (without_types(&inner[..end]), without_types(&inner[end + 1..]));
    let of = of.split(" as ").next().unwrap_or_default();
    format!("{of}{method}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_paths_without_types() {
        for (name, short) in [
            ("weeder_firmware::run", "weeder_firmware::run"),
            ("control::say::say_numbers::<weeder_firmware::serial::Serial>", "control::say::say_numbers"),
            (
                "<control::taught::FieldExamples<weeder_firmware::eeprom::Half>>::slot",
                "control::taught::FieldExamples::slot",
            ),
            ("<a::Half as control::memory::Memory>::read", "a::Half::read"),
            ("knn::search::<5, 2, (&a::B, &c::D<e::F>)>::{closure#0}", "knn::search::{closure#0}"),
        ] {
            assert_eq!(without_types(name), short);
        }
    }
}
