//! The field on a desk: the simulated row and machine, the virtual Uno that runs the real firmware, and their reports.
//!
//! [`row`] says what stands in the row and [`planting`] grows one by chance; [`motion`] is how the machine rolls, and
//! [`machine`] turns both into levels on the firmware's pins. [`uno`] runs the firmware's ELF ([`firmware`]) on simavr,
//! [`console`] talks to it, and [`servo`] is what its pulses do to the tool. [`trial`] joins them, [`verdict`] judges what
//! happened to each plant, [`report`] and [`picture`] show it. [`replay`] plays a recording ([`capture`]) instead of a row,
//! and [`waveform`] writes down what was on the pins.

pub mod bench;
pub mod capture;
pub mod console;
mod csv_table;
mod drawing;
pub mod firmware;
pub mod ground;
pub mod machine;
pub mod motion;
pub mod picture;
pub mod planting;
pub mod replay;
pub mod report;
pub mod row;
pub mod servo;
pub mod signal;
pub mod training;
pub mod trial;
pub mod uno;
pub mod verdict;
pub mod waveform;
