//! Studies of many rows, and what is made of them.
//!
//! - **Field trials**: [`experiment`] has controllers weed the same plots, on the virtual Uno or as the firmware's native run, and
//!   [`sweep`] maps a result against parameters. [`plan`] draws a trial to be weeded in a real field, [`evaluation`]
//!   judges the plots of one, real or simulated, with the [`statistics`] that this takes, and [`page`] shows them in a browser.
//! - **Several machines**: [`shard`] says which of a study's plots, points or runs each of them has, and puts their parts together.
//! - **Training**: [`training`] makes the example table that the firmware carries, of labelled objects.
//!
//! How a single row is weeded is not here: that is for [`field`] and [`trial`].

pub mod evaluation;
pub mod experiment;
pub mod page;
pub mod plan;
pub mod shard;
pub mod statistics;
pub mod sweep;
pub mod table;
pub mod training;

pub use evaluation::{Analysis, PlotRecord};
pub use experiment::{Engine, Experiment, Treatment};
pub use sweep::Sweep;
