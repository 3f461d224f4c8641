//! `weeder monitor`: what the machine does, as it does it, with its console below; of several rows all at a glance.
//!
//! [`Rows`](link::rows::Rows) talk to the machine, [`model`] keeps what is known of it, [`view`] draws that, and
//! [`terminal`] joins them with the keyboard. [`plain`] does without a screen: lines in, lines out.

mod command_line;
mod model;
mod plain;
mod terminal;
mod view;

use crate::finding::Finding;
use crate::ports::Ports;
use crate::record::{self, Logs};
use anyhow::Result;
use clap::Args;
use std::path::PathBuf;

/// What the user asks of the monitor.
#[derive(Args)]
#[command(after_help = "\
Keys: Esc has every row hold, whatever is being typed; Page Up and Page Down choose the row to which commands go, or all; Tab completes, \
Up and Down go through the history, Ctrl-C ends. It is no emergency stop: that one cuts the power.\n\nExamples:\n  \
    weeder monitor                                     watch the only Uno, and type commands\n  \
    weeder monitor --log row.csv                       and keep a log, for `weeder replay row.csv`\n  \
    weeder monitor --all                               every row of a machine at a glance\n  \
    echo status | weeder monitor --plain               one command from a script; status 1 if it is refused\n  \
    echo left: status | weeder monitor --plain --all   to one row; without a name and a colon to all")]
pub struct Arguments {
    #[command(flatten)]
    ports: Ports,
    /// Lines in, lines out, for pipes; ends when the input does and the last answer has come.
    #[arg(long)]
    plain: bool,
    /// Write all that happens to this log; with several rows, to a folder in which each has a log of its name.
    #[arg(long, value_name = "FILE.csv|FOLDER")]
    log: Option<PathBuf>,
}

/// Watches until the user has seen enough.
///
/// # Errors
/// Where there is no Uno to begin with, or terminal or log fail.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let chosen = arguments.ports.choose()?;
    let logs = arguments.log.as_deref().map(|out| Logs::open(out, &chosen)).transpose()?;
    let (rows, are_there) = record::open(&chosen)?;
    match arguments.plain {
        true => plain::run(&rows, &are_there, &chosen, logs),
        false => terminal::run(&rows, chosen.names(), logs).map(|()| Finding::Good),
    }
}
