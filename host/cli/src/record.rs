//! `weeder record`: logs the machine's output to a file, or each row's to its own file.

use crate::ctrl_c;
use crate::ports::{Chosen, Ports};
use crate::receiver::GpsArguments;
use anyhow::{Result, bail, ensure};
use clap::Args;
use frame::{Messages, OutName, Printed, Replace, printing_aside};
use link::advice;
use link::rows::{Heard, Rows, What};
use link::session::Happening;
use link::settings::other_version;
use logbook::log::{Kind, LogError, LogWriter};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

const LOOK: Duration = Duration::from_millis(20);

#[derive(Args)]
#[command(after_help = "\
It records plants, swings and alarms, and the status ten times a second, until Ctrl-C.\n\
It continues after a pulled cable, and records the other rows meanwhile.\n\
Opening the port resets most Unos: start before you work.\n\
With a satellite receiver, `weeder map` draws a map of one row; see docs/map.md.\n\n\
Examples:\n  \
    weeder record --out row.csv                          then compare it: weeder replay row.csv\n  \
    weeder record --out field --all                      every row, a log for each in the folder field\n  \
    weeder record --out field --all --gps left=/dev/ttyUSB0    with a receiver in left.csv\n  \
    weeder record --out field.csv --gps /dev/ttyUSB0 --gps-baud 38400 --beam-ahead 620")]
pub struct Arguments {
    /// The log; an existing one is continued. With several rows, a folder with a log for each row.
    #[arg(long, value_name = "FILE.csv|FOLDER")]
    out: PathBuf,
    #[command(flatten)]
    ports: Ports,
    #[command(flatten)]
    gps: GpsArguments,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    // A terminal that takes nothing delays no line of a log.
    printing_aside(&mut io::sink(), |lines| record(arguments, &|line| drop(lines.send(line))))
}

fn record(arguments: &Arguments, tell: &dyn Fn(Printed)) -> Result<()> {
    let chosen = arguments.ports.choose(arguments.gps.port())?;
    let gps = arguments.gps.open(&chosen)?;
    let mut logs = Logs::open(&arguments.out, &chosen)?;
    if let Some((receiver, lines)) = &gps {
        let time_ms = logs.time_ms(receiver.row, Instant::now());
        logs.write(receiver.row, |log| log.lines_at(time_ms, lines))?;
    }
    let mut gps = gps.map(|(receiver, _)| receiver);
    let (rows, _) = open(&chosen)?;
    let stop = ctrl_c()?;
    tell(Printed::Message(format!("Recording into {}, Ctrl-C ends it", arguments.out.display())));
    let mut is_over = false;
    while !is_over {
        // What has come until then is written.
        is_over = stop.load(Ordering::Relaxed);
        if let Some(gps) = &mut gps {
            let time_ms = logs.time_ms(gps.row, Instant::now());
            let said = gps.turn(time_ms, Instant::now());
            let written = logs.write(gps.row, |log| log.lines_at(time_ms, &said));
            logs.go_on_after(written, gps.row, &chosen, tell)?;
            for (kind, line) in &said {
                if let Kind::GpsFound | Kind::GpsLost | Kind::GpsMark = kind {
                    tell(Printed::Message(format!("Receiver: {line}")));
                }
            }
        }
        // All that waits: a read of the receiver may take 16 ms on Windows, and a busy disk seconds, in which many events come.
        // The receiver's next line is later than these.
        let mut patience = LOOK;
        while let Some(heard) = rows.next(patience) {
            patience = Duration::ZERO;
            let written = logs.take(&heard);
            logs.go_on_after(written, heard.row, &chosen, tell)?;
            let What::Happened(happening) = heard.what else { continue };
            if let Some(gps) = gps.as_mut().filter(|gps| gps.row == heard.row) {
                gps.happened(logs.time_ms(heard.row, heard.at), &happening);
            }
            tell_of(&chosen, heard.row, happening, tell);
        }
    }
    if let Some(gps) = &gps {
        tell(Printed::Message(gps.summary().to_string()));
    }
    logs.end(tell)
}

fn tell_of(chosen: &Chosen, row: usize, happening: Happening, tell: &dyn Fn(Printed)) {
    let say = |what: &str| tell(Printed::Message(chosen.under_name(row, what)));
    match happening {
        Happening::Connected { version, shown, .. } => {
            say(&format!("weeder {version} is there"));
            if let Some(other) = other_version(&version, &shown) {
                say(&other);
            }
        }
        Happening::Started { while_at_work: Some(cause), .. } => {
            tell(Printed::Bell);
            say(&advice::restarted(&cause));
        }
        Happening::Lost(why) => say(&why),
        _ => {}
    }
}

/// Opens all rows, and returns the first that is connected. The others may not be tried yet: their events say how it
/// ends. Missing rows are tried again. Fails if no row is connected.
pub fn open(chosen: &Chosen) -> Result<(Rows, usize)> {
    let (rows, first_tries) = Rows::open(chosen.openers());
    let mut missing = Vec::new();
    for (row, why) in first_tries {
        match why {
            None => return Ok((rows, row)),
            Some(why) if !chosen.are_several => return Err(why.into()),
            Some(why) => missing.push((row, why)),
        }
    }
    missing.sort_by_key(|(row, _)| *row);
    for (row, why) in missing {
        writeln!(Messages, "{}", chosen.under_name(row, &format!("{:#}", anyhow::Error::from(why))));
    }
    bail!("none of the {} rows is there", rows.count());
}

pub struct Logs(Vec<Log>);

struct Log {
    path: PathBuf,
    writer: LogWriter,
    is_written: bool,
    last_ms: u64,
}

impl Logs {
    /// Opens them all, so that their times begin together. Fails if one cannot be written, or is something else.
    pub fn open(out: &Path, chosen: &Chosen) -> Result<Self> {
        if chosen.are_several {
            // An existing log is continued, so no name is checked.
            OutName::from(out.as_os_str().to_owned()).folder([""; 0], Replace::default())?.make()?;
        }
        let path = |row| if chosen.are_several { Chosen::file_in(out, row, "csv") } else { out.to_owned() };
        let paths = chosen.rows.iter().map(path);
        let log = |path: PathBuf| Ok(Log { writer: LogWriter::open(&path)?, path, is_written: true, last_ms: 0 });
        Ok(Self(paths.map(log).collect::<Result<_, LogError>>()?))
    }

    /// Writes into a row's log. Fails at the first failure of the log, which is not written again.
    fn write(&mut self, row: usize, work: impl FnOnce(&mut LogWriter) -> Result<(), LogError>) -> Result<(), LogError> {
        let log = &mut self.0[row];
        let written = if log.is_written { work(&mut log.writer) } else { Ok(()) };
        written.inspect_err(|_| log.is_written = false)
    }

    /// Writes a row's event, with the time at which it came.
    pub fn take(&mut self, heard: &Heard) -> Result<(), LogError> {
        let What::Happened(happening) = &heard.what else { return Ok(()) };
        let time_ms = self.time_ms(heard.row, heard.at);
        self.write(heard.row, |log| log.write(time_ms, happening))
    }

    /// The time of a row's line that came at `at`, in milliseconds. It never goes back: readers would take that for a
    /// log that was opened again.
    fn time_ms(&mut self, row: usize, at: Instant) -> u64 {
        let log = &mut self.0[row];
        let age_ms = u64::try_from(at.elapsed().as_millis()).unwrap_or(u64::MAX);
        log.last_ms = log.last_ms.max(log.writer.now_ms().saturating_sub(age_ms));
        log.last_ms
    }

    /// Reports a log that could not be written. The other rows' logs continue. Fails if no log is left.
    fn go_on_after(
        &self,
        written: Result<(), LogError>,
        row: usize,
        chosen: &Chosen,
        tell: &dyn Fn(Printed),
    ) -> Result<()> {
        if let Err(error) = written {
            tell(Printed::Message(format!(
                "error: {}",
                chosen.under_name(row, &format!("{:#}", anyhow::Error::from(error)))
            )));
            ensure!(self.0.iter().any(|log| log.is_written), "no log can be written any more");
        }
        Ok(())
    }

    /// Says what is in them, and fails if one could not be written.
    fn end(&self, tell: &dyn Fn(Printed)) -> Result<()> {
        for Log { path, writer, .. } in &self.0 {
            let now = match writer.check() {
                Ok(()) => format!("{} has {} now", path.display(), writer.lines()),
                Err(why) => why.to_string(),
            };
            tell(Printed::Message(format!("{} lines were added: {now}", writer.added)));
        }
        self.check()?;
        Ok(self.0.iter().try_for_each(|log| log.writer.check())?)
    }

    /// Fails if one could not be written.
    pub fn check(&self) -> Result<()> {
        match self.0.iter().find(|log| !log.is_written) {
            Some(log) => bail!("{} is not whole: it could not be written", log.path.display()),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use link::row_names::{Board, Row};
    use std::thread::sleep;

    #[test]
    fn a_line_has_the_time_at_which_it_came_and_none_before_the_last() {
        let folder = tempfile::tempdir().unwrap();
        let row = Row { name: "Uno".to_owned(), board: Board::Only { beside: None } };
        let chosen = Chosen { rows: vec![row], are_several: false };
        let mut logs = Logs::open(&folder.path().join("log.csv"), &chosen).unwrap();
        let at = Instant::now();
        sleep(Duration::from_millis(50));
        let came_ms = logs.time_ms(0, at);
        // Each of both times may be rounded by a millisecond.
        assert!(came_ms + 48 <= logs.0[0].writer.now_ms(), "{came_ms}");
        let later_ms = logs.time_ms(0, Instant::now());
        assert_eq!(logs.time_ms(0, at), later_ms);
    }
}
