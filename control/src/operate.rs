//! What the operator does with the machine, and what shows it: [`state`] and lamp, the settings and how they are saved
//! ([`configuration`], [`saved`]), what is tried by hand ([`mod@bench`], [`calibration`], [`rehearsal`]), the [`tool`] and its [`servo`],
//! and what waits to be told or looked at ([`event`], [`plot`], [`objects`]). Each keeps its own; [`weeder`](crate::weeder) has them
//! work together.

pub mod bench;
pub mod calibration;
pub mod configuration;
pub mod event;
pub mod lamp;
pub mod objects;
pub mod plot;
pub mod refusal;
pub mod rehearsal;
pub mod saved;
pub mod servo;
pub mod state;
pub mod tool;
