//! The design calculations of an intra-row weeder, for anyone's machine: what its engine, servo, shanks, chain, wheels
//! and handle have to be like, and whether those that it has are enough.
//!
//! The data's way: a [`machine::Machine`], the paper's or one from a [`mod@file`], is checked against its ranges and
//! becomes a [`design::Design`] by the equations of [`traction`], [`tool`], [`shank`], [`drive`], [`mod@wheel`],
//! [`handle`] and [`capacity`]; [`sense`] says what it means, and [`report`] shows it. [`paper`] holds the paper's
//! printed figures beside ours. All quantities are those of `uom`, in f64.
//!
//! The equations are the paper's, Eq. 4 to 21, 24 and 25. They are a first dimensioning: they know nothing of fatigue,
//! of slopes, or of how the soil changes with speed.
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

pub mod capacity;
pub mod design;
pub mod drive;
pub mod figure;
pub mod file;
pub mod handle;
pub mod machine;
pub mod paper;
pub mod report;
pub mod sense;
pub mod shank;
pub mod swing;
pub mod tool;
pub mod traction;
pub mod unit;
pub mod wheel;
