//! The soak: hours of field work with random faults.
//!
//! [`hours`] runs the decisions with the firmware's real classifier on random rows, for simulated hours on the PC: a
//! model-based run ([`model_test`]) of random steps. In each hour clock and count overflow. [`minutes`] runs the real
//! ELF on the virtual Uno for minutes. Both inject random faults. The operator clears latched alarms and starts again.
//!
//! Each hour of the decisions and each row of the firmware has its own random numbers, from the seed and its number. So
//! [`hour`] and [`row`] can run on any machine, and [`total`] of all of them is the same.
//!
//! A plant is *harmed* if the tool was not fully out over its canopy although the firmware could detect it. This ends
//! the soak as a failure, with the seed and the time to repeat it. So does any other failed check of the model. Two
//! other cases are counted separately, and are allowed:
//! - *mistaken*: plants that the classifier took for weeds;
//! - *blind*: plants that the firmware could not protect. On the PC: plants reached while a faulty encoder had the
//!   count off by a quarter of the margin, or within a swing and a tenth of a second of the fault. On the virtual Uno:
//!   all plants of a row in which both channels jumped at once, and those reached within 0.7 s of a reset.

mod decisions;
mod elf;
mod tally;

pub use self::decisions::{hour, hours};
pub use self::elf::{minutes, row, rows};
pub use self::tally::{Plan, SoakError, Tally, total};
