//! A satellite receiver for a log: its options, and its port, which is opened again after a loss.
//!
//! [`gps`] interprets its bytes. A file can replace the port: it is read at the pace of its times.

use crate::ports::{Chosen, Named, find, named};
use anyhow::{Error, Result, anyhow, bail, ensure};
use clap::Args;
use files::bounded_file;
use frame::{number_within, whole_within};
use gps::playback::{self, Piece};
use gps::recorder::Lines;
use gps::{Antenna, Recorder};
use link::LinkError;
use link::session::Happening;
use logbook::log::Kind;
use std::collections::VecDeque;
use std::io::{ErrorKind, Read};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// The measured positions of beam and tool relative to the antenna.
#[derive(Args)]
pub struct AntennaArguments {
    /// Distance from the antenna forward to the beam in mm, -20000 to 20000; negative behind it. Default: 0.
    #[arg(long, value_name = "MM", value_parser = number_within(-Antenna::FARTHEST_MM..=Antenna::FARTHEST_MM))]
    beam_ahead: Option<f64>,
    /// Distance from the antenna right to the beam's crossing of the row in mm, -20000 to 20000; negative to the
    /// left. Default: 0.
    #[arg(long, value_name = "MM", value_parser = number_within(-Antenna::FARTHEST_MM..=Antenna::FARTHEST_MM))]
    beam_right: Option<f64>,
    /// Distance forward to the tool in mm, -20000 to 20000. Default: `beam_to_tool_mm` behind the beam.
    #[arg(long, value_name = "MM", value_parser = number_within(-Antenna::FARTHEST_MM..=Antenna::FARTHEST_MM))]
    tool_ahead: Option<f64>,
    /// Distance right to the tool in mm, -20000 to 20000. Default: as for the beam.
    #[arg(long, value_name = "MM", value_parser = number_within(-Antenna::FARTHEST_MM..=Antenna::FARTHEST_MM))]
    tool_right: Option<f64>,
    /// Delay of a fix in ms, 0 to 2000. Default: 0.
    #[arg(long, value_name = "MS", value_parser = number_within(0.0..=Antenna::LATEST_MS))]
    gps_delay: Option<f64>,
    /// Standard deviation of a fix in mm, 1 to 20000. Default: the usual one of its quality.
    #[arg(long, value_name = "MM", value_parser = number_within(1.0..=Antenna::FARTHEST_MM))]
    gps_error: Option<f64>,
}

impl AntennaArguments {
    /// The user's values, and those of `antenna` for the rest.
    pub fn over(&self, antenna: Antenna) -> Antenna {
        Antenna {
            beam_ahead_mm: self.beam_ahead.unwrap_or(antenna.beam_ahead_mm),
            beam_right_mm: self.beam_right.unwrap_or(antenna.beam_right_mm),
            tool_ahead_mm: self.tool_ahead.or(antenna.tool_ahead_mm),
            tool_right_mm: self.tool_right.or(antenna.tool_right_mm),
            delay_ms: self.gps_delay.unwrap_or(antenna.delay_ms),
            error_mm: self.gps_error.or(antenna.error_mm),
        }
    }
}

/// The receiver beside a record.
#[derive(Args)]
pub struct GpsArguments {
    /// Record the satellite receiver (NMEA 0183) at this port, or a file of its lines at their pace. With several
    /// rows, put the row's name before it: left=PORT.
    #[arg(long, value_name = "[ROW=]PORT", value_parser = named)]
    gps: Option<Named>,
    /// Its baud rate, 300 to 4000000.
    #[arg(long, value_name = "BAUD", default_value = "9600", value_parser = whole_within(300..=4_000_000_u32), requires = "gps")]
    gps_baud: u32,
    #[command(flatten)]
    antenna: AntennaArguments,
}

impl GpsArguments {
    /// The receiver's port, if the user named one.
    pub fn port(&self) -> Option<&str> {
        self.gps.as_ref().map(|gps| gps.port.as_str())
    }

    /// The receiver, if the user named one, and the first lines of the record. Fails if its row is not recorded, or its
    /// port cannot be opened now. A later loss of the port is no error.
    pub fn open(&self, chosen: &Chosen) -> Result<Option<(Gps, Lines)>> {
        let antenna = self.antenna.over(Antenna::default());
        let Some(Named { name, port }) = &self.gps else {
            ensure!(
                antenna == Antenna::default(),
                "without --gps there is no antenna: name the receiver's port by --gps"
            );
            return Ok(None);
        };
        let row = match name {
            Some(name) => find(name, &chosen.names()).map_err(Error::msg)?,
            None if chosen.rows.len() == 1 => 0,
            None => bail!(
                "with several rows, name the row that records the receiver, as in `--gps {}={port}`",
                chosen.names().join("|")
            ),
        };
        let (mut recorder, mut lines) = Recorder::new(&antenna);
        let source = open(port, self.gps_baud)?;
        lines.extend(recorder.found(0, port));
        let gps = Gps { row, port: port.clone(), baud: self.gps_baud, source, recorder };
        Ok(Some((gps, lines)))
    }
}

pub struct Gps {
    /// The row whose log has its lines.
    pub row: usize,
    port: String,
    baud: u32,
    source: Source,
    recorder: Recorder,
}

enum Source {
    Port(Box<dyn Read + Send>),
    /// The port is lost. It is opened again then.
    Lost(Instant),
    /// A file's pieces, and when the first was due. `None` before the first turn.
    File(VecDeque<Piece>, Option<Instant>),
    Ended,
}

impl Gps {
    /// The machine's side of the record.
    pub fn happened(&mut self, time_ms: u64, happening: &Happening) {
        self.recorder.happened(time_ms, happening);
    }

    /// The received input, as lines of the log. Waits for a millisecond at most.
    pub fn turn(&mut self, time_ms: u64, now: Instant) -> Lines {
        let mut bytes = [0; 4096];
        match &mut self.source {
            Source::Ended => Lines::new(),
            Source::Lost(retry_at) if now < *retry_at => Lines::new(),
            Source::Lost(retry_at) => {
                *retry_at = now + RETRY;
                // The reason for a failure was reported when it was lost.
                let Ok(source) = open(&self.port, self.baud) else { return Lines::new() };
                self.source = source;
                self.recorder.found(time_ms, &self.port)
            }
            Source::File(pieces, began) => {
                let since_ms = now.duration_since(*began.get_or_insert(now)).as_millis();
                let mut lines = Lines::new();
                while let Some(piece) = pieces.pop_front_if(|piece| u128::from(piece.due_ms) <= since_ms) {
                    lines.extend(piece.note.map(|note| (Kind::GpsMark, note)));
                    lines.extend(self.recorder.take(time_ms, &piece.bytes));
                }
                if pieces.is_empty() {
                    self.source = Source::Ended;
                    lines.push((Kind::GpsMark, "the file ends here".to_owned()));
                }
                lines
            }
            Source::Port(port) => match port.read(&mut bytes) {
                Ok(count) if count > 0 => self.recorder.take(time_ms, &bytes[..count]),
                Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => {
                    self.recorder.take(time_ms, b"")
                }
                gone => {
                    let error = gone.err().unwrap_or(ErrorKind::UnexpectedEof.into());
                    self.source = Source::Lost(now + RETRY);
                    self.recorder.lost(&format!("the receiver's port is gone: {error}"))
                }
            },
        }
    }

    pub fn summary(&self) -> String {
        let counts = self.recorder.counts();
        format!(
            "The receiver gave {} fixes, {} that had jumped, {} damaged lines, and had lost its fix {} times",
            counts.fixes, counts.jumps, counts.damaged, counts.losses
        )
    }
}

/// Opens a port, or the file that replaces it.
fn open(name: &str, baud: u32) -> Result<Source> {
    let path = Path::new(name);
    if path.metadata().is_ok_and(|there| there.is_file()) {
        let file = bounded_file::recorded(path)?;
        let pieces = playback::pieces(&file).map_err(|why| anyhow!("{name} is no file for --gps: {why}"))?;
        return Ok(Source::File(pieces, None));
    }
    let port = link::listen(name, baud).map_err(|error| match error {
        LinkError::Absent(port) => {
            anyhow!("there is no port {port} for --gps: plug the receiver in, and name its port")
        }
        LinkError::Busy(port) => {
            anyhow!("{port} is in use: end the other program that reads the receiver, such as gpsd")
        }
        other => other.into(),
    })?;
    Ok(Source::Port(port))
}
