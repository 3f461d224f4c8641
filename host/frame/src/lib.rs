//! The simulated row of `weeder sim`, and what all commands of `weeder` share.
//!
//! It is a crate of its own so that `cargo sim` compiles no other command: the program `weeder-sim` has [`row`] alone. The crate
//! `weeder-cli` has it beside all others.

// Results are printed by one function, which handles a closed pipe and a full disk.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod course;
pub mod destination;
pub mod numbers;
pub mod output;
pub mod program;
pub mod progress;
pub mod row;
pub mod source;
