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
mod flow;
mod loops;
mod registers;
mod values;

pub use self::budget::{Budgets, BudgetsError, BudgetsProblem, Held};
use self::cycles::{Passes, Stretch, Time, Timer};
use self::decode::{Instruction, Operation};
use self::flow::{Entry, Kind, Node, Program, Routine, bytes};
pub use self::loops::{LoopBound, LoopBounds, records};
use self::values::Interrupts;
use crate::elf::{Image, ImageError};
use serde::{Deserialize, Serialize};
use signal::CYCLES_PER_SECOND;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
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

/// Why nothing could be proved.
#[derive(Debug, thiserror::Error)]
pub enum BoundsError {
    /// The ELF cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// It is said how often loops turn of functions that the program does not have.
    #[error(
        "no function of the firmware is called {}: say how often loops turn by the names of the functions that have them",
        names.join(" or ")
    )]
    NoSuchFunction {
        /// What they are said to be called.
        names: Vec<String>,
    },
    /// A word that is no instruction.
    #[error("{function} comes to {address:#06x}, where there is no instruction of the ATmega328P")]
    NoInstruction {
        /// Where, in bytes of flash.
        address: u32,
        /// In which function.
        function: String,
    },
    /// A call or a jump to an address that is worked out.
    #[error(
        "{function} calls or jumps to an address that it works out, at {address:#06x}: call functions by their names"
    )]
    Indirect {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// Functions that call each other in a circle.
    #[error("there is recursion, which has no deepest stack: {} calls itself", circle.join(", which calls "))]
    Recursion {
        /// The functions, the first once more at the end.
        circle: Vec<String>,
    },
    /// A handler that lets others come in.
    #[error(
        "the handler of vector {vector} turns interrupts on at {address:#06x}, in {function}: handlers could nest without an end"
    )]
    HandlerEnables {
        /// The vector.
        vector: u8,
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// The status register gets a value that is not known.
    #[error("{function} sets the interrupt flag by a value that is not a saved SREG, at {address:#06x}")]
    UnknownStatus {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// The stack pointer gets a value that is not known.
    #[error(
        "{function} sets the stack pointer to what cannot be followed, at {address:#06x}: arrays of unknown length have no bound"
    )]
    UnknownStack {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// An interrupt could come between the two halves of the stack pointer.
    #[error("{function} lets an interrupt come in between the two halves of the stack pointer, at {address:#06x}")]
    HalfAStackPointer {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// A stack that grows without an end.
    #[error("{function} puts more onto the stack in every turn of a loop, at {address:#06x}")]
    GrowsForEver {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// A function that takes what is not its own from the stack.
    #[error("{function} takes more from the stack than it has put there, at {address:#06x}")]
    TakesTooMuch {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// A return to an address that the function has put onto the stack.
    #[error("{function} returns with a stack that is not as it found it, at {address:#06x}")]
    ReturnsElsewhere {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// `ret` in a handler, or `reti` elsewhere.
    #[error("{function} ends a handler by `ret`, or a function by `reti`, or the program, at {address:#06x}")]
    WrongReturn {
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// An instruction whose time is not known.
    #[error("{function} has `{what}` at {address:#06x}, which has no fixed time")]
    NoTime {
        /// The instruction.
        what: String,
        /// Where.
        address: u32,
        /// In which function.
        function: String,
    },
    /// A loop where time has to have a bound.
    #[error(
        "{what} has a loop without a bound, at {address:#06x} in {function}: say how often it turns, by a record in .loop_bounds or for the function"
    )]
    Unbounded {
        /// What has no bound.
        what: String,
        /// Where the loop begins.
        address: u32,
        /// In which function.
        function: String,
    },
    /// Functions change registers that are needed behind their calls.
    #[error("a value is needed behind a call that spoils it:{}", all.iter().map(Spoilt::to_string).collect::<String>())]
    Spoilt {
        /// Every call that does.
        all: Vec<Spoilt>,
    },
    /// A handler leaves something else in registers or flags than it found there.
    #[error("the handler of vector {vector}, {function}, does not put back what it found in {registers}")]
    HandlerSpoils {
        /// The vector.
        vector: u8,
        /// The handler.
        function: String,
        /// The registers and flags.
        registers: String,
    },
    /// The watched vectors do not come before all others.
    #[error(
        "vector {other} goes before vector {vector} and is not among those whose edges are watched, so their longest wait is not bounded"
    )]
    NotFirst {
        /// One that is watched.
        vector: u8,
        /// The one before it.
        other: u8,
    },
    /// A watched vector has no handler, or one that does not look once.
    #[error(
        "the handler of vector {vector} does not read the port at {port:#04x} exactly once on every path, or there is none"
    )]
    DoesNotLook {
        /// The vector.
        vector: u8,
        /// The port's address in the data space.
        port: u16,
    },
}

/// A call behind which registers are needed that the function changes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Spoilt {
    /// The call's address.
    pub address: u32,
    /// The function that calls.
    pub function: String,
    /// The function that is called.
    pub called: String,
    /// The registers.
    pub registers: String,
}

impl fmt::Display for Spoilt {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        let Spoilt { address, function, called, registers } = self;
        write!(to, "\n  {address:#06x} {function} calls {called}, which spoils {registers}")
    }
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

    let places = program.routines().flat_map(|routine| &routine.nodes).map(|node| node.place.address);
    let of_heads = places.filter_map(|place| Some((place, loops.get(&program.name(place))?.passes.clone()))).collect();
    let mut timer = Timer::new(Passes { stated: loops::records(elf)?, of_heads });
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

    let edges = input.map(|input| watch(input, &program, &handlers, &of_handlers, &mut timer, closed_cycles)).transpose()?;

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
