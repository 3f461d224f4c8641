//! The real firmware in the simulated field: its ELF on the virtual Uno, in a machine that rolls along a row.
//!
//! - [`run()`] lets the firmware weed the row of a [`Pass`](field::pass::Pass); [`firmware`] builds it. [`report`], [`picture`] and
//!   [`animation`] show the [`Outcome`]. [`replay`] plays a recording to the firmware instead of a row.
//! - [`console`] operates it as an operator would, and makes it a port for the [`link`].
//! - [`live`] runs it in real time, at a serial port for other programs. A satellite receiver on the machine
//!   has another port.
//! - [`by_the_manual`] sets up and measures the simulated machine by the manual.
//! - [`mod@bench`] counts cycles and bytes.
//!
//! [`field`] simulates the machine and gives the verdicts, and [`uno`] simulates the chip. Experiments with many rows
//! are in another crate.

pub mod animation;
pub mod bench;
pub mod by_the_manual;
pub mod console;
pub mod firmware;
pub mod live;
pub mod picture;
pub mod replay;
pub mod report;
mod run;

pub use console::UnoPort;
pub use run::{Outcome, PassError, boot, power_up, run, set_up};
