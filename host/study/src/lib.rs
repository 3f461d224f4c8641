//! Studies of many rows, and their evaluation.
//!
//! - **Field trials**: [`experiment`] compares controllers on the same plots, on the virtual Uno or as the firmware's
//!   native run. [`sweep`] maps a result against parameters. [`plan`] creates the plan of a real field trial.
//!   [`evaluation`] evaluates the plots of a real or simulated trial, with [`statistics`], and [`page`] shows them in a
//!   browser.
//! - **Several machines**: [`shard`] divides a study's plots, points or runs between machines, and joins their parts.
//! - **Training**: [`training`] makes the firmware's example table from labelled detections.
//!
//! [`field`] and [`uno_run`] simulate the single row.

pub mod evaluation;
pub mod experiment;
pub mod page;
pub mod plan;
pub mod shard;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod training;
