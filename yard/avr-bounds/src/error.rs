//! The error of the analysis: the reason why no proof was possible, the address, and what to write in the budgets.

use crate::proved::Place;

/// Why no proof was possible, in words for the user. Names and lines come from files, so their control characters are
/// not printed as such.
#[derive(Debug, thiserror::Error)]
#[error("{}", printable(.0))]
pub struct BoundsError(pub(crate) String);

/// A text whose control characters, except line ends, are written as escapes.
pub(crate) fn printable(text: &str) -> String {
    let is_printed = |letter: char| letter == '\n' || !letter.is_control();
    let letter =
        |letter: char| if is_printed(letter) { letter.to_string() } else { letter.escape_default().to_string() };
    text.chars().map(letter).collect()
}

impl BoundsError {
    /// An instruction that cannot be followed.
    pub(crate) fn at(place: &Place, problem: Problem) -> BoundsError {
        let function = &place.function;
        let advice = match problem {
            Problem::Indirect => format!(": list the functions in the budgets, as in [calls] {function:?} = [\"..\"]"),
            Problem::UnknownStack => {
                ": alloca and arrays of unknown length have no bound, take an array of fixed length".into()
            }
            Problem::StartsDeeper => {
                ": set the stack pointer in the start-up code, or list the functions that calls by pointer lead to, in [calls]"
                    .into()
            }
            Problem::NoInstruction => ": check that the program was built for the chip of --chip".into(),
            _ => String::new(),
        };
        BoundsError(format!("{function} {problem}, at {}{advice}", place.address_and_line()))
    }
}

/// Why the analysis stops at an instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub(crate) enum Problem {
    #[error("reaches an address without an instruction of the chip")]
    NoInstruction,
    #[error("calls or jumps to an address that it works out")]
    Indirect,
    #[error("sets the interrupt flag by a value that is not a saved SREG")]
    UnknownStatus,
    #[error("sets the stack pointer to an unknown value")]
    UnknownStack,
    #[error("lets an interrupt come in between the two halves of the stack pointer")]
    HalfAStackPointer,
    #[error("puts more onto the stack in every turn of a loop")]
    GrowsForEver,
    #[error("takes more from the stack than it has put there")]
    TakesTooMuch,
    #[error("returns with a stack that is not as it found it")]
    ReturnsElsewhere,
    #[error("ends a handler by `ret`, or a function by `reti`, or the program")]
    WrongReturn,
    #[error("sets EIND to something else than 0")]
    LongIndirect,
    #[error("writes to a register by its address in memory")]
    RegisterInMemory,
    #[error("starts the program again, by address 0 or a null pointer, with what is on the stack")]
    StartsDeeper,
    #[error("goes on after a jump to address 0 in another state than after a reset")]
    StartsDifferently,
}
