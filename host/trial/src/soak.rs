//! The soak: hours of field work with everything going wrong now and then.
//!
//! [`hours`] has the decision core, the code of the firmware with its real classifier, work rows by chance for simulated hours
//! on the host; in each hour its clock and its count run over their ends. [`minutes`] does the same for minutes with the real ELF
//! on the virtual Uno. Both have faults injected by chance, and an operator who clears what is latched and starts again.
//!
//! Each hour of the decisions and each row of the firmware has random numbers of its own, from the seed and its number, so that [`hour`] and
//! [`row`] can be called anywhere: [`total`] of all of them is the same.
//!
//! A plant is *harmed* where the tool was not fully out over its canopy although the firmware could know of it: this must not
//! be, and it ends the soak with the seed and the time at which it can be seen again. Excused are, and counted apart:
//! - *mistaken*: plants that the classifier took for weeds;
//! - *blind*: on the host, plants reached while the count was off by a quarter of the margin because the encoder had lied, or
//!   within a swing and a tenth of a second of the lie; on the virtual Uno all of a row in which both channels jumped
//!   at once, and those reached within 0.7 s of a reset.

mod core;
mod elf;
mod tally;

pub use self::core::{hour, hours};
pub use self::elf::{minutes, row, rows};
pub use self::tally::{Plan, SoakError, Tally, total};
