//! What the operator does with the machine, and what shows it: [`state`] and lamp, the settings, how they are saved and what follows
//! from them ([`configuration`], [`saved`], [`limits`]), what is tried by hand ([`mod@bench`], [`calibration`], [`dry_run`]) and what is
//! taught by it ([`example_entry`]), the [`tool`] and its [`servo`], what looks as if the machine had left its crop ([`plant_timeout`],
//! [`unknown_run`]), and what waits to be told or looked at ([`event`], [`plot`], [`detections`]). Each keeps its own;
//! [`weeder`](crate::weeder) has them work together.

pub mod bench;
pub mod calibration;
pub mod command_error;
pub mod configuration;
pub mod detections;
pub mod dry_run;
pub mod event;
pub mod example_entry;
pub mod lamp;
pub mod limits;
pub mod plant_timeout;
pub mod plot;
pub mod saved;
pub mod servo;
pub mod state;
pub mod tool;
pub mod unknown_run;
