//! The design calculations of an intra-row weeder, for any machine: the required engine, servo, shanks, chain, wheels
//! and handle, and whether the given ones suffice.
//!
//! A [`machine::Machine`] is the paper's or comes from a [`mod@file`]. It is checked against its ranges. The
//! [`equations`] give its [`design::Design`]. [`sense`] interprets the design, and [`report`] prints it. [`paper`]
//! compares the paper's printed figures with these results. All quantities are those of `uom`, in f64.
//!
//! The equations are the paper's, Eq. 4 to 21, 24 and 25. They give first dimensions, without fatigue, slopes, or the
//! effect of speed on the soil.
//!
//! ```
//! use mechanics::{design::Design, machine::Machine, unit::{KG, NEWTON}};
//!
//! let mut machine = Machine::default();
//! machine.weeder.mass = KG.of(40.0);
//! let design = Design::of(&machine)?;
//! assert!(NEWTON.value(design.tractive_force) < 536.6);
//! # Ok::<(), mechanics::machine::MachineError>(())
//! ```

pub mod arm;
pub mod design;
pub mod equations;
pub mod figure;
pub mod file;
pub mod machine;
pub mod paper;
pub mod report;
pub mod sense;
pub mod swing;
pub mod unit;
