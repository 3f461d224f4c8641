//! `cargo sim`: `weeder sim` without the other commands.

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use sim::{finding, numbers, row};
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
    let found = numbers::with_negative_numbers(Arguments::command()).get_matches();
    match Arguments::from_arg_matches(&found) {
        Ok(Arguments { command: Command::Sim(arguments) }) => finding::exit(row::run(&arguments)),
        Err(error) => error.exit(),
    }
}
