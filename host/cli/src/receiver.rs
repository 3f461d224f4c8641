//! A satellite receiver for a log: its options, and its port, which is opened again after a loss.
//!
//! [`gps`] interprets its lines. A file can replace the port: it is read at the pace of its times.

use crate::numbers::{number_within, whole_within};
use crate::ports::{Chosen, Named, named};
use anyhow::{Result, anyhow, bail, ensure};
use clap::Args;
use gps::recorder::Lines;
use gps::sentence::{DAY_MS, Line};
use gps::{Antenna, Recorder};
use link::LinkError;
use link::session::Happening;
use std::collections::VecDeque;
use std::fs;
use std::io::{self, ErrorKind, Read};
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two tries to open the port again.
const RETRY: Duration = Duration::from_secs(1);

/// The measured positions of beam and tool relative to the antenna.
#[derive(Args)]
pub struct AntennaArguments {
    /// Distance from the antenna forward to the beam in mm, -20000 to 20000; negative behind it. Default: 0.
    #[arg(long, value_name = "MM", value_parser = number_within(-20_000.0..=20_000.0))]
    beam_ahead: Option<f64>,
    /// Distance from the antenna right to the beam's crossing of the row in mm, -20000 to 20000; negative to the
    /// left. Default: 0.
    #[arg(long, value_name = "MM", value_parser = number_within(-20_000.0..=20_000.0))]
    beam_right: Option<f64>,
    /// Distance forward to the tool in mm, -20000 to 20000. Default: `beam_to_tool_mm` behind the beam.
    #[arg(long, value_name = "MM", value_parser = number_within(-20_000.0..=20_000.0))]
    tool_ahead: Option<f64>,
    /// Distance right to the tool in mm, -20000 to 20000. Default: as for the beam.
    #[arg(long, value_name = "MM", value_parser = number_within(-20_000.0..=20_000.0))]
    tool_right: Option<f64>,
    /// Delay of a fix in ms, 0 to 2000. Default: 0.
    #[arg(long, value_name = "MS", value_parser = number_within(0.0..=2000.0))]
    gps_delay: Option<f64>,
    /// Standard deviation of a fix in mm, 1 to 20000. Default: the usual one of its quality.
    #[arg(long, value_name = "MM", value_parser = number_within(1.0..=20_000.0))]
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

    /// The receiver, if the user named one, and the first lines of the record.
    ///
    /// # Errors
    /// If its row is not recorded, or its port cannot be opened now. A later loss of the port is no error.
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
            Some(name) => chosen.find(name)?,
            None if chosen.rows.len() == 1 => 0,
            None => bail!(
                "with several rows, name the row that records the receiver, as in `--gps {}={port}`",
                chosen.names().join("|")
            ),
        };
        let (mut recorder, mut lines) = Recorder::new(&antenna);
        let source = open(port, self.gps_baud)?;
        lines.extend(recorder.found(0, port));
        let gps = Gps { row, port: port.clone(), baud: self.gps_baud, source: Some(source), retry_at: None, recorder };
        Ok(Some((gps, lines)))
    }
}

/// A receiver at its port.
pub struct Gps {
    /// The row whose log has its lines.
    pub row: usize,
    port: String,
    baud: u32,
    /// `None` while it is lost.
    source: Option<Box<dyn Read + Send>>,
    retry_at: Option<Instant>,
    recorder: Recorder,
}

impl Gps {
    /// The machine's side of the record.
    pub fn happened(&mut self, time_ms: u64, happening: &Happening) {
        self.recorder.happened(time_ms, happening);
    }

    /// The received input, as lines of the log. Waits for a millisecond at most.
    pub fn turn(&mut self, time_ms: u64, now: Instant) -> Lines {
        let Some(source) = &mut self.source else {
            if self.retry_at.is_some_and(|at| now < at) {
                return Lines::new();
            }
            self.retry_at = Some(now + RETRY);
            // The reason for a failure was reported when it was lost.
            self.source = open(&self.port, self.baud).ok();
            return if self.source.is_some() { self.recorder.found(time_ms, &self.port) } else { Lines::new() };
        };
        let mut bytes = [0; 4096];
        let read = match source.read(&mut bytes) {
            Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
            Err(error) if matches!(error.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => Ok(0),
            read => read,
        };
        match read {
            Ok(count) => self.recorder.take(time_ms, &bytes[..count]),
            Err(error) => {
                self.source = None;
                self.retry_at = Some(now + RETRY);
                self.recorder.lost(&format!("the receiver's port is gone: {error}"))
            }
        }
    }

    /// The summary of the receiver at the end.
    pub fn summary(&self) -> String {
        let counts = self.recorder.counts();
        format!(
            "The receiver gave {} fixes, {} that had jumped, {} damaged lines, and had lost its fix {} times",
            counts.fixes, counts.jumps, counts.damaged, counts.losses
        )
    }
}

/// Opens a port, or the file that replaces it.
fn open(name: &str, baud: u32) -> Result<Box<dyn Read + Send>> {
    let path = Path::new(name);
    if path.metadata().is_ok_and(|there| there.is_file()) {
        return Ok(Box::new(Paced::new(&String::from_utf8_lossy(&fs::read(path)?))));
    }
    link::listen(name, baud).map_err(|error| match error {
        LinkError::Absent(port) => {
            anyhow!("there is no port {port} for --gps: plug the receiver in, and name its port")
        }
        LinkError::Busy(port) => {
            anyhow!("{port} is in use: end the other program that reads the receiver, such as gpsd")
        }
        other => other.into(),
    })
}

/// The lines of a file, each at its due time.
struct Paced {
    began: Instant,
    /// Milliseconds since the first time, and the bytes of the line.
    lines: VecDeque<(u64, Vec<u8>)>,
}

impl Paced {
    fn new(text: &str) -> Self {
        let (mut due_ms, mut last_ms) = (0, None::<i64>);
        let line = |line: &str| {
            if let Line::Report(report) = Line::parse(line)
                && let Some(time_ms) = report.time_ms
            {
                // The time of day restarts at 0 at midnight.
                due_ms += last_ms.map_or(0, |last_ms| (time_ms - last_ms).rem_euclid(DAY_MS)).unsigned_abs();
                last_ms = Some(time_ms);
            }
            (due_ms, format!("{line}\n").into_bytes())
        };
        Self { began: Instant::now(), lines: text.lines().map(line).collect() }
    }

    /// The lines that are due after this time, as far as there is room for them.
    fn read_due(&mut self, elapsed: Duration, bytes: &mut [u8]) -> usize {
        let mut count = 0;
        while let Some((due_ms, line)) = self.lines.front()
            && Duration::from_millis(*due_ms) <= elapsed
            && count + line.len() <= bytes.len()
        {
            bytes[count..count + line.len()].copy_from_slice(line);
            count += line.len();
            self.lines.pop_front();
        }
        count
    }
}

impl Read for Paced {
    /// Times out, as a port does, if no line is due.
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        match self.read_due(self.began.elapsed(), bytes) {
            0 => Err(ErrorKind::TimedOut.into()),
            count => Ok(count),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_at_the_pace_of_its_times_over_midnight_too() {
        let lines = ["$GPRMC,235959.00,V,,,,,,,311226,,,N*79", "noise", "$GPRMC,000000.50,V,,,,,,,010127,,,N*7D"];
        let mut file = Paced::new(&lines.join("\r\n"));
        let mut at = |ms| {
            let mut bytes = [0; 4096];
            let count = file.read_due(Duration::from_millis(ms), &mut bytes);
            String::from_utf8_lossy(&bytes[..count]).lines().count()
        };
        assert_eq!([at(0), at(1499), at(1500), at(9999)], [2, 0, 1, 0]);
    }
}
