//! Why nothing could be proved of a firmware, and where.

use crate::elf::ImageError;
use std::fmt;

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
