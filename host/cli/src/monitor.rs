//! `weeder monitor`: what the machine does, as it does it, with its console below.
//!
//! A [`Session`] talks to the machine, [`model`] keeps what is known of it, [`view`] draws that, and [`terminal`] joins them with
//! the keyboard. [`plain`] does without a screen: lines in, lines out.

mod command_line;
mod model;
mod plain;
mod terminal;
mod view;

use crate::Finding;
use crate::settings::Port;
use anyhow::Result;
use clap::Args;
use link::Link;
use link::log::LogWriter;
use link::session::Session;
use std::path::PathBuf;

/// What the user asks of the monitor.
#[derive(Args)]
#[command(after_help = "Keys: Tab completes, Up and Down go through the history, Ctrl-C ends.\n\nExamples:\n  \
    weeder monitor                                     watch the only Uno, and type commands\n  \
    weeder monitor --log row.csv                       and keep a log, for `weeder replay row.csv`\n  \
    echo status | weeder monitor --plain               one command from a script; status 1 if it is refused")]
pub struct Arguments {
    #[command(flatten)]
    port: Port,
    /// Lines in, lines out, for pipes; ends when the input does and the last answer has come.
    #[arg(long)]
    plain: bool,
    /// Write all that happens to this log.
    #[arg(long, value_name = "FILE.csv")]
    log: Option<PathBuf>,
}

/// Watches until the user has seen enough.
///
/// # Errors
/// Where there is no Uno to begin with, or terminal or log fail.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let log = arguments.log.as_deref().map(LogWriter::open).transpose()?;
    let port = arguments.port.port.clone();
    let session = Session::open(move || Link::open(port.as_deref()))?;
    if arguments.plain { plain::run(session, log) } else { terminal::run(session, log).map(|()| Finding::Good) }
}
