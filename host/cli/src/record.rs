//! `weeder record`: what the machine does, in a file.

use crate::gps::GpsArguments;
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
and plugged in again does not end it. On most Unos opening the port is a reset: begin before you work. With a satellite receiver, \
`weeder map` draws a map of it; docs/map.md says how the antenna is measured.\n\n\
Examples:\n  weeder record --out row.csv && weeder replay row.csv
  weeder record --out field.csv --gps /dev/ttyUSB0 --gps-baud 38400 --beam-ahead 620 --beam-right -40")]
pub struct Arguments {
    /// The log; one that is there is gone on with.
    #[arg(long, value_name = "FILE.csv")]
    out: PathBuf,
    #[command(flatten)]
    port: Port,
    #[command(flatten)]
    gps: GpsArguments,
}

/// Records until Ctrl-C.
///
/// # Errors
/// Where there is no Uno or no receiver to begin with, or the file cannot be written.
pub fn run(arguments: &Arguments) -> Result<()> {
    let mut log = LogWriter::open(&arguments.out)?;
    let mut gps = None;
    if let Some((receiver, lines)) = arguments.gps.open()? {
        log.lines_at(log.now_ms(), &lines)?;
        gps = Some(receiver);
    }
    let port = arguments.port.port.clone();
    let mut session = Session::open(move || Link::open(port.as_deref()))?;
    let stop = Arc::new(AtomicBool::new(false));
    let asked_to_stop = Arc::clone(&stop);
    ctrlc::set_handler(move || asked_to_stop.store(true, Ordering::Relaxed)).context("Ctrl-C cannot be caught")?;
    tell!("Recording into {}, Ctrl-C ends it", arguments.out.display());
    while !stop.load(Ordering::Relaxed) {
        for happening in session.turn(Instant::now()) {
            log.write(&happening)?;
            if let Some(gps) = &mut gps {
                gps.happened(log.now_ms(), &happening);
            }
            match happening {
                Happening::Connected { version, .. } => tell!("weeder {version} is there"),
                Happening::Lost(why) => tell!("{why}"),
                _ => {}
            }
        }
        if let Some(gps) = &mut gps {
            let time_ms = log.now_ms();
            let lines = gps.turn(time_ms, Instant::now());
            for (_, line) in lines.iter().filter(|(kind, _)| kind.is_for_the_operator()) {
                tell!("Receiver: {line}");
            }
            log.lines_at(time_ms, &lines)?;
        }
    }
    if let Some(gps) = &gps {
        tell!("{}", gps.summary());
    }
    tell!("{} lines were added: {} has {} now", log.added(), arguments.out.display(), log.lines());
    Ok(())
}
