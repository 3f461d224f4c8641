//! The real firmware in the simulated field: its ELF on the virtual Uno, with a machine around it that rolls along a row.
//!
//! - [`run()`] has the firmware, which [`firmware`] builds, weed the row of a [`Trial`]; [`report`], [`picture`] and [`animation`] show the [`Outcome`].
//!   [`replay`] plays a recording to it instead of a row.
//! - [`console`] talks to it as an operator would, and [`port`] makes it a port for the [`link`].
//! - [`live`] runs it in real time, at a serial port that other programs open; a [`receiver`] on the machine is at another.
//! - [`by_the_manual`] sets the simulated machine up as the manual has it, and measures what a user would.
//! - [`soak`] has everything go wrong now and then, for hours; [`mod@bench`] counts cycles and bytes.
//!
//! What the machine does and what a verdict is stands in [`field`], how the chip works in [`uno`]. Many rows are not compared here.

pub mod animation;
pub mod bench;
pub mod by_the_manual;
pub mod console;
pub mod firmware;
pub mod live;
pub mod picture;
pub mod port;
pub mod receiver;
pub mod replay;
pub mod report;
mod run;
pub mod soak;

pub use field::trial::{Start, Trial};
pub use port::UnoPort;
pub use run::{Outcome, TrialError, boot, power_up, run, set_up};
