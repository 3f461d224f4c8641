//! What the operator does with the machine, and what shows it: [`state`] and lamp, the settings, how they are saved and what follows
//! from them ([`configuration`], [`saved`], [`limits`]), what is tried by hand ([`mod@bench`], [`calibration`], [`rehearsal`]) and what is
//! taught by it ([`told_example`]), the [`tool`] and its [`servo`], what looks as if the machine had left its crop ([`no_plants`],
//! [`misfits`]), and what waits to be told or looked at ([`event`], [`plot`], [`objects`]). Each keeps its own;
//! [`weeder`](crate::weeder) has them work together.

pub mod bench;
pub mod calibration;
pub mod configuration;
pub mod event;
pub mod lamp;
pub mod limits;
pub mod misfits;
pub mod no_plants;
pub mod objects;
pub mod plot;
pub mod refusal;
pub mod rehearsal;
pub mod saved;
pub mod servo;
pub mod state;
pub mod told_example;
pub mod tool;
