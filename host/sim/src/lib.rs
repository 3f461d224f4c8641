//! The simulated row of `weeder sim`, and what all commands of `weeder` share.
//!
//! This is a crate of its own so that `cargo sim` compiles nothing else of `weeder`: its program is [`main.rs`](row::run) here. The
//! crate `weeder-cli` has the same command beside all others.

// Results are printed by one function, which handles a closed pipe and a full disk.
#![deny(clippy::print_stdout, clippy::print_stderr)]

pub mod course;
pub mod destination;
pub mod finding;
pub mod numbers;
pub mod output;
pub mod progress;
pub mod row;
pub mod source;
