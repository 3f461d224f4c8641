//! The benchmark: the firmware's limits and costs, counted on the virtual Uno. The same sources give the same figures
//! on every machine.
//!
//! Each module measures one subject. [`classifier()`] counts the classifier's cycles. [`weeding()`] measures
//! interrupts, turns of the loop and memory while a row is weeded. [`encoder`] finds the highest rate without a lost
//! count, [`servo`] the jitter of the pulses, and [`swings`] the timing errors of commands in many rows. [`table`]
//! prints the results beside published figures.

mod classifier;
pub mod encoder;
mod error;
mod load;
pub mod servo;
pub mod swings;
pub mod table;
mod weeding;

pub use self::classifier::{ClassifierCosts, Cycles, classifier};
pub use self::error::BenchError;
pub use self::weeding::{FirmwareCosts, weeding};
