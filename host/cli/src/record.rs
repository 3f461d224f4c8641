//! `weeder record`: what the machine does, in a file.

use crate::output::tell;
use crate::settings::Port;
use anyhow::{Context, Result};
use clap::Args;
use link::Link;
use link::log::LogWriter;
use link::session::{Happening, Session};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// What the user asks of the recording.
#[derive(Args)]
#[command(after_help = "\
Plants, swings and alarms are written down as they come, and the status ten times a second, until Ctrl-C. A cable that is pulled \
and plugged in again does not end it. On most Unos opening the port is a reset: begin before you work.\n\n\
Example:\n  weeder record --out row.csv && weeder replay row.csv")]
pub struct Arguments {
    /// The log; one that is there is gone on with.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    #[command(flatten)]
    port: Port,
}

/// Records until Ctrl-C.
///
/// # Errors
/// Where there is no Uno to begin with, or the file cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut log = LogWriter::open(&arguments.out)?;
    let port = arguments.port.port.clone();
    let mut session = Session::open(move || Link::open(port.as_deref()))?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked_to_stop = Arc::clone(&stop);
    ctrlc::set_handler(move || asked_to_stop.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be caught")?;
    tell!("Recording into {}, Ctrl-C ends it", arguments.out.display());
    while !stop.load(Ordering::Relaxed) {
        for happening in session.turn(Instant::now()) {
            log.write(&happening)?;
            match happening {
                Happening::Connected { version, .. } => tell!("weeder {version} is there"),
                Happening::Lost(why) => tell!("{why}"),
                _ => {}
            }
        }
    }
    tell!("{} lines were added: {} has {} now", log.added(), arguments.out.display(), log.lines());
    Ok(())
}
