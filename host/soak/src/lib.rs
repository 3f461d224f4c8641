//! The soak: hours of field work with random faults.
//!
//! It is a model-based run ([`model_test`]) of random steps, from row to row. [`run`] runs the decisions with the firmware's
//! real classifier, or the real ELF on the virtual Uno, as a [`Board`]. Both have the same rows, faults and checks. Clock
//! and count overflow soon after the start. The operator clears latched alarms and starts again.
//!
//! Each hour of the decisions and each minute of the firmware has its own random numbers, from the seed and its number.
//! So each [`part`] can run on any machine, and [`total`] of all of them is the same.
//!
//! A plant is *harmed* if the tool was not fully out over its canopy although the firmware could detect it. This ends
//! the soak as a failure, with the seed and the time to repeat it. So does any other failed check of the model. Two
//! other cases are counted separately, and are allowed:
//! - *mistaken*: plants that were classified as weeds;
//! - *blind*: plants that the firmware could not protect. A faulty encoder had the count off by a quarter of the margin,
//!   or the fault was less than a swing and a tenth of a second ago.

mod board;
mod field;
mod tally;

pub use self::board::Board;
pub use self::field::{Subject, part, run};
pub use self::tally::{Plan, SoakError, Tally, total};
