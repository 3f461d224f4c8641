//! The simulated field: what stands in the row, the machine that rolls past it, who weeds it, and what became of each plant.
//!
//! - **The row**: [`row`] says what stands in it, [`planting`] grows one by chance, [`ground`] counts which ground is covered. Under
//!   some [`conditions`], [`stand`] grows what beam and tools meet, [`sight`] says what a beam sees of it, [`driving`] rolls through it
//!   and [`steering`] off its line.
//! - **The machine**: [`motion`] is how it rolls, [`machine`] turns motion and row into levels on the Uno's pins, [`servo`] is
//!   what pulses do to the tool, and [`wiring`] says which pin is wired to what. In a [`rolling`] machine they are joined, for as long
//!   as it rolls.
//! - **Who weeds**: a [`trial`] is a row, a machine and the firmware's settings. The [`native`] run weeds it by the firmware's own decisions,
//!   compiled for the host, and its [`baselines`] are models.
//! - **What became of it**: [`verdict`] judges canopies and margins, [`tool_path`] counts stems and weeds, and [`optimum`] says what no
//!   controller can do better.
//!
//! The firmware's ELF is not run here, and no file is opened: texts are given, and the crate is at home in a browser as well.

pub mod baselines;
pub mod budget;
pub mod conditions;
pub mod driving;
pub mod ground;
pub mod machine;
pub mod motion;
pub mod native;
pub mod optimum;
pub mod planting;
pub mod rolling;
pub mod row;
pub mod servo;
pub mod sight;
pub mod stand;
pub mod steering;
pub mod tool_path;
pub mod trial;
pub mod verdict;
pub mod wheel;
pub mod wiring;
mod words;

pub use conditions::Conditions;
pub use machine::Machine;
pub use motion::Motion;
pub use row::{Kind, Row, Thing};
pub use servo::Servo;
pub use trial::{Start, Trial};
pub use verdict::{Judgement, Timing, Verdict, judge};
pub use words::counted;
