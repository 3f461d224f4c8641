//! The simulated field: the row, the machine that rolls past it, the controllers that weed it, and the result for each
//! plant.
//!
//! - **The row**: [`row`] is its content, [`planting`] grows a random one, and [`ground`] measures covered ground.
//!   Under some [`conditions`], [`stand`] grows everything that beam and tools meet. [`sight`] calculates what a beam
//!   sees, and [`driving`] rolls along the row and strays from its line.
//! - **The machine**: [`motion`] is its motion. [`machine`] converts motion and row into levels on the Uno's pins.
//!   [`servo`] converts pulses into the tool's angle. [`wiring`] assigns wires to pins. A [`rolling`] machine joins
//!   these parts, without an end.
//! - **The controllers**: a [`pass`] is a row, a machine and the firmware's settings. The [`native`] run weeds it by
//!   the firmware's own decisions, compiled for the PC. The [`baselines`] are models.
//! - **The result**: [`verdict`] judges canopies and margins, [`tool_path`] counts stems and weeds, and [`optimum`] is
//!   the upper bound for every controller.
//!
//! This crate does not run the firmware's ELF and opens no file: the caller passes texts. It also compiles for a
//! browser.

pub mod baselines;
pub mod budget;
mod chance;
pub mod conditions;
pub mod driving;
pub mod ground;
pub mod machine;
pub mod motion;
pub mod native;
pub mod optimum;
pub mod pass;
pub mod planting;
pub mod rolling;
pub mod row;
pub mod servo;
pub mod sight;
pub mod stand;
pub mod tool_path;
pub mod verdict;
pub mod wheel;
pub mod wiring;

/// A number and a noun, such as `1 plant` and `2 plants`.
pub fn counted(number: impl std::fmt::Display, noun: &str) -> String {
    let number = number.to_string();
    let plural = if number == "1" { "" } else { "s" };
    format!("{number} {noun}{plural}")
}
