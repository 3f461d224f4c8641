//! The benchmark: the firmware's limits and costs, counted on the virtual Uno. The same sources give the same figures
//! on every machine.
//!
//! Each file beside this one measures one subject: [`classifier()`] the classifier's cycles, [`encoder`] the highest rate without a
//! lost count, [`servo`] the jitter of the pulses, [`swings`] how late the commands of many rows come to the pin. [`table`] shows
//! them to people, beside those of others. `weeder bounds` proves the most that an interrupt and the stack take.

mod classifier;
pub mod encoder;
mod load;
pub mod servo;
pub mod swings;
pub mod table;

pub use self::classifier::{ClassifierCosts, Cycles, classifier};
