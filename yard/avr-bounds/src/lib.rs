//! Upper bounds for an AVR program, proved from its ELF: stack, handlers, stretches without interrupts, and the rate of
//! an input's edges.
//!
//! [`prove`] follows every path of the program in flash, from the reset vector and from every interrupt vector. It
//! takes the deepest and the longest path. The program is not run, and nothing is sampled. So the bounds hold for every
//! input and every phase.
//!
//! ```no_run
//! use avr_bounds::{Budgets, Program, prove};
//!
//! let program = Program::read("blink.elf".as_ref(), None)?;
//! let bounds = prove(&program, &Budgets::default())?;
//! println!("{} bytes of stack", bounds.stack_bytes);
//! # Ok::<(), avr_bounds::BoundsError>(())
//! ```
//!
//! Handlers do not turn interrupts on; the analysis checks this and refuses a program that does. The README lists what is
//! taken for granted. The analysis also follows paths that the program never takes. So a bound can be larger than any
//! real value, but never smaller.
//!
//! # The response of a handler
//!
//! A request waits for the longest other handler of lower rank, or for its own handler. It also waits once for each
//! handler of higher rank. In front of each handler it waits for the longest stretch of the main program in which no
//! interrupt is served. After each handler the main program executes one instruction, and that instruction may turn
//! interrupts off. A handler that is requested more than once in this time makes the wait longer.
//!
//! # The rate that is never lost
//!
//! An edge requests a handler, and the handler reads the pins. The worst edge comes directly after one read. The time
//! to the next read is at most the sum of:
//!
//! - the chip's synchroniser;
//! - the longest other handler, or the rest of this handler after its read;
//! - the longest stretch of the main program in which no interrupt is served, with a wake-up from sleep;
//! - the interrupt response;
//! - the handler up to its read.
//!
//! While no more edges come in that time than the decoder can tell apart, no edge is lost, for any duration. This holds
//! for the vectors that rank before all others that the program uses. The analysis checks their rank.

mod budget;
mod chip;
#[cfg(feature = "cli")]
pub mod command;
mod concrete;
mod counted;
mod cycles;
mod decode;
mod effects;
mod elf;
mod error;
mod file;
mod flow;
mod loops;
mod order;
mod paths;
mod proved;
mod reach;
mod registers;
mod routine;
mod targets;
mod values;

pub use self::budget::{Budgets, Depth, Held, RegisterRule};
pub use self::chip::{CHIPS, Chip};
use self::cycles::{Passes, Stretch, Time, Timer, longer};
use self::decode::{Instruction, Operation};
pub use self::elf::{Program, Symbol};
pub use self::error::BoundsError;
use self::flow::Code;
pub use self::loops::{LoopBound, LoopBounds};
pub use self::order::order;
pub use self::proved::{Bounds, EdgeBounds, Found, Frame, FunctionBounds, Handler, Indirect, Input, Longest, Place};
use self::routine::{Entry, Kind, Node, Routine, bytes};
use self::values::Interrupts;
use std::collections::{BTreeMap, BTreeSet};
use std::rc::Rc;

/// The most cycles from an edge at a pin to its interrupt request. An edge that comes up to this time before a read may
/// also be missed by that read (data sheet, pin change interrupt timing, and reading the pin value).
const SYNCHRONISER_CYCLES: u64 = 3;

/// Proves what a program needs at most, and how fast the edges of an input may come, if the budgets name one. The facts of the budgets are
/// used: how often loops turn, where calls lead, how deep recursion goes. Their limits are not ([`Budgets::hold`]).
///
/// # Errors
/// If the program cannot be followed.
pub fn prove(elf: &Program, budgets: &Budgets) -> Result<Bounds, BoundsError> {
    let known: BTreeSet<&String> = elf.functions.values().map(|symbol| &symbol.name).collect();
    let tables: [(_, Vec<&String>); 3] = [
        ("loops", budgets.loops.keys().collect()),
        ("recursion", budgets.recursion.keys().collect()),
        ("calls", budgets.calls.iter().flat_map(|(caller, called)| called.iter().chain([caller])).collect()),
    ];
    for (table, mut names) in tables {
        names.retain(|name| !known.contains(name));
        if !names.is_empty() {
            let names = names.into_iter().map(String::as_str).collect::<Vec<_>>().join(" or ");
            return Err(BoundsError(format!(
                "no function of the program is called {names}, which the budgets name in [{table}]: take the names that \
                 `avr-objdump -dC` shows, or name the budgets of this program"
            )));
        }
    }
    let mut code = Code::new(elf, budgets);
    let entry = |address, kind| Entry { address, interrupts: Interrupts::Off, kind, active: 0 };
    let main = code.follow(entry(elf.start, Kind::Reset))?;
    let mut handlers = BTreeMap::new();
    let vectors = if code.vectors.is_some() { elf.chip.vectors } else { 0 };
    for vector in 1..vectors {
        if let Some(address) = handler_of(&code, vector)? {
            let handler = code.follow(entry(address, Kind::Handler))?;
            if let Some(address) = handler.enables {
                let place = code.place(address);
                return Err(BoundsError(format!(
                    "the handler of vector {vector} turns interrupts on at {}, in {}: handlers could nest without an end",
                    place.address_and_line(),
                    place.function
                )));
            }
            handlers.insert(vector, handler);
        }
    }
    code.check_restarts(&main)?;
    let code = code;
    if let Some(open) = main.deepest_interrupted.as_ref().filter(|_| code.vectors.is_none()) {
        let function = open.last().map_or("the program", |frame| frame.function.as_str());
        return Err(BoundsError(format!(
            "{function} runs with interrupts on, and no interrupt vectors were found: nothing at {:#06x}, where the program begins, is \
             called __vectors; tell the vectors' address in the budgets, as in `vectors = {:#06x}`",
            elf.start, elf.start
        )));
    }
    let mut timer = Timer::new(passes(&code, budgets), elf.chip.wake_up_cycles() as u32);
    let (critical_section, closed) = [Stretch::FlagClear, Stretch::Closed]
        .map(|kind| timer.stretches(&main, kind).inner.map(|time| time.longest(&code)))
        .map(|longest| longest.unwrap_or(Longest { cycles: Some(0), without_bound: Vec::new() }))
        .into();
    let of_handlers = time_handlers(&code, &handlers, &mut timer, &closed);
    let edges = (budgets.input.as_ref())
        .map(|input| watch(input, &code, &handlers, &of_handlers, &mut timer, &closed))
        .transpose()?;

    let feeds = |node: &Node| node.instruction.operation == Operation::Wdr;
    let turns = code.routines().filter(|routine| routine.entry.kind != Kind::Handler);
    let turn = turns.map(|routine| timer.turn(routine, feeds)).fold(None, longer).map(|turn| turn.longest(&code));
    let loops: BTreeSet<u32> = code.routines().flat_map(|routine| timer.loops_without_bound(routine)).collect();

    if budgets.registers == RegisterRule::Convention {
        registers::prove(&code, &handlers)?;
    }

    let stack = deepest(&main, handlers.values(), elf.chip.return_address_bytes());
    Ok(Bounds {
        chip: elf.chip.name,
        stack_bytes: bytes(&stack),
        stack,
        handlers: of_handlers,
        critical_section,
        closed,
        edges,
        turn,
        all_loops_without_bound: loops.into_iter().map(|address| code.place(address)).collect(),
        indirect: indirect(&code),
        functions: functions(&code, &mut timer),
    })
}

/// The stated loop bounds.
fn passes(code: &Code, budgets: &Budgets) -> Passes {
    let places = code.routines().flat_map(|routine| &routine.nodes).map(|node| node.place.address);
    let bound = |place| Some((place, budgets.loops.get(code.name_for_facts(place)?)?));
    let bounds: BTreeMap<u32, &LoopBound> = places.filter_map(bound).collect();
    let by_length = bounds.iter().filter(|(_, bound)| bound.by_length).map(|(place, _)| *place).collect();
    let of_heads = bounds.into_iter().map(|(place, bound)| (place, bound.passes.clone())).collect();
    Passes { stated: code.elf.records.clone(), of_heads, by_length }
}

/// Every handler with its times.
fn time_handlers(
    code: &Code,
    handlers: &BTreeMap<u8, Rc<Routine>>,
    timer: &mut Timer,
    closed: &Longest,
) -> Vec<Handler> {
    let mut nodes = code.routines().flat_map(|routine| &routine.nodes);
    let sleeps = nodes.any(|node| node.instruction.operation == Operation::Sleep);
    let response = code.elf.chip.response_cycles() + if sleeps { code.elf.chip.wake_up_cycles() } else { 0 };
    let longest = |(&vector, handler): (&u8, &Rc<Routine>)| {
        let longest = timer.longest(handler).map(|time| time.and(&Time::of(response)).longest(code));
        (vector, longest.unwrap_or_default())
    };
    let longest: BTreeMap<u8, Longest> = handlers.iter().map(longest).collect();
    // A handler that never returns delays no other: the program ends in it.
    let time = |longest: &Longest| longest.or_refuse("").ok();
    let response_of = |vector: u8| {
        let closed = closed.cycles?;
        let running = longest.range(vector..).try_fold(0, |most, (_, other)| Some(time(other)?.max(most)))?;
        let before = longest.range(..vector).try_fold(0, |sum, (_, other)| Some(sum + time(other)? + closed))?;
        Some(running + before + closed + response)
    };
    (handlers.iter())
        .map(|(&vector, handler)| Handler {
            vector,
            function: code.name_of(handler.entry),
            longest: longest[&vector].clone(),
            response_cycles: response_of(vector),
            stack_bytes: code.elf.chip.return_address_bytes() + bytes(&handler.deepest),
        })
        .collect()
}

/// The longest wait of an input's edge for a read, and the highest rate of its edges.
fn watch(
    input: &Input,
    code: &Code,
    handlers: &BTreeMap<u8, Rc<Routine>>,
    of_handlers: &[Handler],
    timer: &mut Timer,
    closed: &Longest,
) -> Result<EdgeBounds, BoundsError> {
    let last = input.vectors.last().copied().unwrap_or_default();
    if let Some(other) = handlers.keys().find(|other| **other < last && !input.vectors.contains(other)) {
        return Err(BoundsError(format!(
            "vector {other} has priority over vector {last} and is no vector of the input, so an edge's longest wait has no bound"
        )));
    }
    let looks = |node: &Node| node.instruction.reads(input.port);
    let (mut to_look, mut busy) = (0, 0);
    for &vector in &input.vectors {
        let look = handlers.get(&vector).and_then(|handler| timer.around(handler, looks));
        let (to, behind) = look.ok_or_else(|| {
            let port = input.port;
            BoundsError(format!(
                "the handler of vector {vector} is missing, or does not read the port at {port:#04x} exactly once on every path"
            ))
        })?;
        let to = to.longest(code).or_refuse("the path to a read")?;
        to_look = to_look.max(code.elf.chip.response_cycles() + to);
        busy = busy.max(behind.longest(code).or_refuse("the path from a read")?);
    }
    for other in of_handlers.iter().filter(|handler| !input.vectors.contains(&handler.vector)) {
        busy = busy.max(other.longest.or_refuse(&format!("the handler of vector {}", other.vector))?);
    }
    let closed = closed.or_refuse("a stretch without interrupts")?;
    let wait_cycles = SYNCHRONISER_CYCLES + busy + closed + to_look;
    Ok(EdgeBounds { wait_cycles, never_lost_per_s: input.edges_between_looks * input.clock_hz / wait_cycles })
}

/// The deepest stack: the main program with interrupts on plus a handler, or with interrupts off alone.
fn deepest<'a>(
    main: &Routine,
    handlers: impl Iterator<Item = &'a Rc<Routine>>,
    return_address_bytes: usize,
) -> Vec<Frame> {
    let handler = handlers.map(|handler| &handler.deepest).max_by_key(|frames| bytes(frames));
    let interrupted = main.deepest_interrupted.clone().zip(handler).map(|(frames, handler)| {
        let mut handler = handler.clone();
        if let Some(first) = handler.first_mut() {
            first.bytes += return_address_bytes;
        }
        [frames, handler].concat()
    });
    interrupted.into_iter().chain([main.deepest.clone()]).max_by_key(|frames| bytes(frames)).unwrap_or_default()
}

/// Every function that the program reaches, with interrupts on or off.
fn functions(code: &Code, timer: &mut Timer) -> Vec<FunctionBounds> {
    // They are in the order of their addresses.
    let routines: Vec<_> = code.routines().collect();
    let functions = routines.chunk_by(|one, next| one.entry.address == next.entry.address);
    let bounds = |same: &[&Rc<Routine>]| {
        let time = same.iter().map(|routine| timer.longest(routine)).fold(None, longer);
        let called = same.iter().flat_map(|routine| &routine.nodes).flat_map(Node::called);
        FunctionBounds {
            function: code.name_of(same[0].entry),
            address: same[0].entry.address,
            stack_bytes: same.iter().map(|routine| bytes(&routine.deepest)).max().unwrap_or_default(),
            longest: time.map(|time| time.longest(code)),
            calls: called.map(|called| (called.entry.address, code.name_of(called.entry))).collect(),
        }
    };
    functions.map(bounds).collect()
}

/// Every indirect call and jump.
fn indirect(code: &Code) -> Vec<Indirect> {
    let all = code.indirect.iter();
    all.map(|(&address, leads)| Indirect {
        place: code.place(address),
        found: leads.found,
        targets: leads.addresses.iter().map(|&target| code.place(target).to_string()).collect(),
    })
    .collect()
}

impl Time {
    /// The time with its unbounded places.
    fn longest(&self, code: &Code) -> Longest {
        let without_bound = self.unbounded.iter().map(|&address| code.place(address)).collect();
        Longest { cycles: self.unbounded.is_empty().then_some(self.cycles), without_bound }
    }
}

/// The entry of a vector's handler: the vector itself. `None` if the vector's jumps lead to the reset, or where the
/// reset's own jump leads, as for unused vectors.
fn handler_of(code: &Code, vector: u8) -> Result<Option<u32>, BoundsError> {
    let first = code.vectors.unwrap_or(code.elf.start);
    let start = first + u32::from(vector) * code.elf.chip.vector_bytes;
    let flash_bytes = code.elf.chip.flash_bytes;
    let of_reset = code.instruction(code.elf.start)?;
    let is_jump = |instruction: &Instruction| matches!(instruction.operation, Operation::Jmp | Operation::Rjmp);
    let of_reset = Some(of_reset).filter(is_jump).and_then(|jump| jump.target(flash_bytes));
    let is_reset = |target: u32| target == code.elf.start || target == 0 || Some(target) == of_reset;
    let mut address = start;
    // Two jumps, and the one in the vector.
    for _ in 0..3 {
        let instruction = code.instruction(address)?;
        match instruction.target(flash_bytes) {
            Some(target) if is_reset(target) => return Ok(None),
            Some(target) if is_jump(&instruction) => address = target,
            _ => break,
        }
    }
    Ok(Some(start))
}
