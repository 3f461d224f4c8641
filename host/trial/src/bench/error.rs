//! Why a bench has no figures.

use crate::console::ConsoleError;
use crate::run::TrialError;
use field::planting::PlantingError;
use thiserror::Error;
use uno::UnoError;
use uno::elf::ImageError;

/// Why there are no figures.
#[derive(Debug, Error)]
pub enum BenchError {
    /// The virtual Uno stopped.
    #[error(transparent)]
    Uno(#[from] UnoError),
    /// The ELF cannot be read.
    #[error(transparent)]
    Image(#[from] ImageError),
    /// The firmware did not answer.
    #[error(transparent)]
    Console(#[from] ConsoleError),
    /// A row does not grow.
    #[error(transparent)]
    Planting(#[from] PlantingError),
    /// A row was not weeded.
    #[error(transparent)]
    Trial(#[from] TrialError),
    /// The bench did not run through.
    #[error("the bench showed {seen} of {expected} calls on D13: run the ELF that `cargo bench-firmware` makes")]
    Unfinished {
        /// Calls seen.
        seen: usize,
        /// Calls that make a complete bench.
        expected: usize,
    },
    /// The search in flash is wrong.
    #[error("{0} answers of the search in flash differ from the plain search's: its cycles mean nothing")]
    Different(u16),
    /// The ELF has no such variable.
    #[error("the bench has no variable `{0}`: run the ELF that `cargo bench-firmware` makes")]
    NoVariable(&'static str),
}
