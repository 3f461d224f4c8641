//! `cargo sim`: `weeder sim` without the other commands.

use clap::{Parser, Subcommand};
use frame::{program, row};
use std::process::ExitCode;

/// Weeds a simulated row with the intra-row weeder's firmware.
#[derive(Parser)]
#[command(
    name = "weeder",
    max_term_width = 100,
    after_help = "All other commands: cargo install --locked --path host/cli"
)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Weed a simulated row with the real firmware on a virtual Uno.
    Sim(Box<row::Arguments>),
}

fn main() -> ExitCode {
    program::main(|Arguments { command: Command::Sim(arguments) }| row::run(&arguments))
}
