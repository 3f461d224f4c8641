//! The errors of the analysis: the reason why no proof was possible, the address, and what to write in the budgets.

use crate::elf::ElfError;
use crate::proved::Place;
use std::fmt;

/// Why no proof was possible.
#[derive(Debug, thiserror::Error)]
pub enum BoundsError {
    /// The ELF cannot be read.
    #[error(transparent)]
    Elf(#[from] ElfError),
    /// The budgets name functions that the program does not have.
    #[error(
        "no function of the program is called {}, which the budgets name in [{table}]: take the names that `avr-objdump -dC` shows",
        names.join(" or ")
    )]
    NoSuchFunction {
        /// The table in the budgets.
        table: &'static str,
        /// Their names in the budgets.
        names: Vec<String>,
    },
    /// The program has an instruction that cannot be followed.
    #[error("{} {problem}, at {:#06x}{}{}", place.function, place.address, Line(place), problem.advice(place))]
    At {
        /// The address.
        place: Place,
        /// The instruction's effect.
        problem: Problem,
    },
    /// Functions that call each other in a circle.
    #[error(
        "there is recursion, which has no deepest stack: {} calls itself: set in the budgets how many calls are active at once, \
         as in [recursion] {:?} = {{ depth = 3, because = \"..\" }}; if a call by a pointer only seems to be one of these, link with \
         -Wl,--emit-relocs, which lists the functions whose address is taken",
        circle.join(", which calls "),
        circle.first().map_or("", String::as_str)
    )]
    Recursion {
        /// The functions, with the first one repeated at the end.
        circle: Vec<String>,
    },
    /// A handler turns interrupts on.
    #[error(
        "the handler of vector {vector} turns interrupts on at {:#06x}{}, in {}: handlers could nest without an end",
        place.address, Line(place), place.function
    )]
    HandlerEnables {
        /// The vector.
        vector: u8,
        /// The address.
        place: Place,
    },
    /// A loop without a bound, where the time must have one.
    #[error(
        "{what} has a loop without a bound, at {:#06x}{} in {}: give its bound, by a record in .loop_bounds or for the function, \
         as in [loops] {:?} = {{ passes = 9, because = \"..\" }}",
        place.address, Line(place), place.function, place.function
    )]
    Unbounded {
        /// The quantity without a bound.
        what: String,
        /// The loop's first address.
        place: Place,
    },
    /// A function breaks the calling convention.
    #[error(
        "{function} does not preserve {registers}, which the calling convention asks of every function: mend it, or write \
         `registers = \"unchecked\"` into the budgets"
    )]
    NotPreserved {
        /// The function.
        function: String,
        /// The registers.
        registers: String,
    },
    /// A handler changes registers or flags.
    #[error("the handler of vector {vector}, {function}, does not restore {registers}")]
    HandlerSpoils {
        /// The vector.
        vector: u8,
        /// The handler.
        function: String,
        /// The registers and flags.
        registers: String,
    },
    /// The input's vectors do not rank before all others.
    #[error(
        "vector {other} has priority over vector {vector} and is no vector of the input, so an edge's longest wait has no bound"
    )]
    NotFirst {
        /// One that is watched.
        vector: u8,
        /// The one before it.
        other: u8,
    },
    /// A vector of the input has no handler, or its handler does not read the port exactly once.
    #[error(
        "the handler of vector {vector} is missing, or does not read the port at {port:#04x} exactly once on every path"
    )]
    DoesNotLook {
        /// The vector.
        vector: u8,
        /// The port's address in the data space.
        port: u16,
    },
}

/// A place's source line, in brackets.
struct Line<'a>(&'a Place);

impl fmt::Display for Line<'_> {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        self.0.source.iter().try_for_each(|source| write!(to, " ({source})"))
    }
}

/// Why the analysis stops.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Problem {
    /// A word that is no instruction of this chip.
    NoInstruction,
    /// A call or a jump to a computed address.
    Indirect,
    /// The status register gets a value that is not known.
    UnknownStatus,
    /// The stack pointer gets a value that is not known.
    UnknownStack,
    /// An interrupt could come between the two halves of the stack pointer.
    HalfAStackPointer,
    /// A stack that grows without an end.
    GrowsForEver,
    /// A function that pops more than it has pushed.
    TakesTooMuch,
    /// A return to an address that the function has pushed.
    ReturnsElsewhere,
    /// `ret` in a handler, or `reti` elsewhere.
    WrongReturn,
    /// The register for long indirect jumps gets a value other than 0.
    LongIndirect,
}

impl fmt::Display for Problem {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        to.write_str(match self {
            Problem::NoInstruction => "reaches an address without an instruction of the chip",
            Problem::Indirect => "calls or jumps to an address that it works out",
            Problem::UnknownStatus => "sets the interrupt flag by a value that is not a saved SREG",
            Problem::UnknownStack => "sets the stack pointer to an unknown value",
            Problem::HalfAStackPointer => "lets an interrupt come in between the two halves of the stack pointer",
            Problem::GrowsForEver => "puts more onto the stack in every turn of a loop",
            Problem::TakesTooMuch => "takes more from the stack than it has put there",
            Problem::ReturnsElsewhere => "returns with a stack that is not as it found it",
            Problem::WrongReturn => "ends a handler by `ret`, or a function by `reti`, or the program",
            Problem::LongIndirect => "sets EIND to something else than 0",
        })
    }
}

impl Problem {
    /// The advice, after a colon.
    fn advice(self, place: &Place) -> String {
        match self {
            Problem::Indirect => {
                format!(": list the functions in the budgets, as in [calls] {:?} = [\"..\"]", place.function)
            }
            Problem::UnknownStack => {
                ": alloca and arrays of unknown length have no bound, take an array of fixed length".into()
            }
            Problem::NoInstruction => ": check that the program was built for the chip of --chip".into(),
            _ => String::new(),
        }
    }
}
