//! The simulated row of `weeder sim`, and what all commands of `weeder` share.
//!
//! It is a crate of its own so that `cargo sim` compiles no other command: the program `weeder-sim` has [`row`] alone. The crate
//! `weeder-cli` has it beside all others.

// `Results` prints all results, and handles a closed pipe and a full disk.
#![deny(clippy::print_stdout, clippy::print_stderr)]

mod course;
mod destination;
mod numbers;
mod output;
pub mod program;
mod progress;
pub mod row;
pub mod source;

pub use course::CourseArguments;
pub use destination::{OutFile, OutFolder, OutName, Replace, write_if_asked};
pub use numbers::{number_within, whole_within};
pub use output::{Messages, Printed, Results, command_line, printing_aside, teller};
pub use program::Finding;
pub use progress::{Show, with_bar};
