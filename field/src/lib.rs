//! The field on a desk: the simulated row and machine, the virtual Uno that runs the real firmware, and their reports.
//!
//! [`row`] says what stands in the row, [`machine`] how the weeder rolls past it and what its servo makes of the pulses,
//! [`uno`] runs the firmware's ELF on simavr, and [`trial`] joins them and judges what happened to each plant.

pub mod capture;
pub mod firmware;
pub mod ground;
pub mod machine;
pub mod motion;
pub mod planting;
pub mod row;
pub mod servo;
pub mod signal;
pub mod uno;
pub mod verdict;
pub mod waveform;
