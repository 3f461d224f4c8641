//! The log of a session: one line for each input and output, as a CSV file for any program and for the replay.
//!
//! The columns are `time_ms` since the log was opened, `kind` and `line`. `line` is the firmware's own text. The log
//! also holds the machine's version, settings and examples at each connection, so that it can be replayed alone. It
//! holds the output of a satellite receiver as lines whose kind begins with `gps`. Each line is written before the next
//! is read, and saved to the disk within about a second. So a power failure costs at most the last lines. A reader
//! leaves out one that is cut off, and the next session removes it.

use crate::disk::Disk;
use files::bounded_file::RECORDED_MIB;
use files::{CsvTable, FileError, in_a_line, whole_file};
use link::session::{HOLD, Happening};
use same_file::Handle;
use std::fs::{File, OpenOptions};
use std::io::{self, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;
use strum::{EnumString, IntoStaticStr, VariantNames};
use thiserror::Error;

/// The kind of a line in a log.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, EnumString, IntoStaticStr, VariantNames)]
#[strum(serialize_all = "snake_case")]
pub enum Kind {
    /// The Uno is connected; the version.
    Connected,
    /// The firmware has started; its greeting, with the cause.
    Started,
    /// The Uno is gone; why.
    Lost,
    /// One of its settings, `name=value`.
    Setting,
    /// One of its examples.
    Example,
    /// Its status.
    Status,
    /// An event.
    Event,
    /// A typed command.
    Command,
    /// A line of its answer.
    Answer,
    /// Positions of beam and tool relative to a satellite receiver's antenna.
    Antenna,
    /// The receiver's port was opened, and its name; or the receiver sends again.
    GpsFound,
    /// The receiver's port is gone, or silent; why.
    GpsLost,
    /// A sentence of the receiver.
    Gps,
    /// A line of the receiver that came damaged.
    GpsDamaged,
    /// A fault in the receiver's fixes.
    GpsMark,
}

impl Kind {
    /// Whether a log that is continued may go on with such a line. Its clock then begins again. A hold is typed before the
    /// machine has answered.
    fn may_begin(self, text: &str) -> bool {
        let is_held = self == Self::Command && text == HOLD;
        is_held || matches!(self, Self::Connected | Self::Started | Self::Lost | Self::Antenna)
    }
}

pub(crate) const HEADER: &str = "time_ms,kind,line";

/// The bytes that may end a line. A spreadsheet may have saved the log with another line end.
pub(crate) const ENDS: &[u8] = b"\r\n";

/// A longer log is not continued, in bytes. A day with a receiver of 10 Hz adds some 230 MiB.
const LONGEST: u64 = 192 << 20;

/// A log is not written any farther from here on, in bytes. A longer one might not be read.
const FULL: u64 = (RECORDED_MIB - 1) << 20;

/// Why a log cannot be written.
#[derive(Debug, Error)]
pub enum LogError {
    /// The file cannot be written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file is no log.
    #[error("{0} exists already, and is no log that can be continued: choose another name")]
    NoLog(PathBuf),
    /// The file would soon be too long to be read.
    #[error("{0} is longer than 192 MiB, and is not continued: choose another name")]
    Long(PathBuf),
    /// With more lines, the file could not be read.
    #[error("{0} is full: no further line is written; write another log")]
    Full(PathBuf),
    /// The file has no name any more, or its name leads to another file.
    #[error("{0} is gone, because it was moved, deleted or replaced meanwhile")]
    Gone(PathBuf),
    /// Another program has written the file, so lines of it may be missing.
    #[error("{0} was changed by another program meanwhile, and may lack lines")]
    Changed(PathBuf),
    /// The lines of two programs would damage each other.
    #[error("another program writes {0}: end that one, or choose another name")]
    Shared(PathBuf),
}

/// The end of the last whole line. One of these bytes ends a line.
pub(crate) fn end(bytes: &[u8], ends: &[u8]) -> usize {
    bytes.iter().rposition(|byte| ends.contains(byte)).map_or(0, |end| end + 1)
}

/// Opens the file of a log. Fails with [`ErrorKind::WouldBlock`] if another program writes it.
fn open_alone(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    #[cfg(windows)]
    {
        use std::os::windows::fs::OpenOptionsExt;
        /// Others may read. A lock of Windows would keep them out too.
        const FILE_SHARE_READ: u32 = 1;
        const ERROR_SHARING_VIOLATION: i32 = 32;
        options.share_mode(FILE_SHARE_READ).open(path).map_err(|error| match error.raw_os_error() {
            Some(ERROR_SHARING_VIOLATION) => ErrorKind::WouldBlock.into(),
            _ => error,
        })
    }
    #[cfg(not(windows))]
    {
        let file = options.open(path)?;
        // Some file systems have no locks.
        match file.try_lock() {
            Err(std::fs::TryLockError::WouldBlock) => Err(ErrorKind::WouldBlock.into()),
            _ => Ok(file),
        }
    }
}

/// Writes a log.
pub struct LogWriter {
    path: PathBuf,
    file: File,
    disk: Disk,
    began: Instant,
    /// Lines below the header that were found at opening.
    found: u64,
    /// Lines that were written since.
    pub added: u64,
    /// The file's end behind them, and whether another program has written the file since.
    end: u64,
    is_changed: bool,
}

impl LogWriter {
    /// Opens a log. An existing one is continued.
    ///
    /// # Errors
    /// If the file cannot be written, is something else, is too long, or is written by another program.
    pub fn open(path: &Path) -> Result<Self, LogError> {
        let failed = |source| FileError::unwritten(path, source);
        // A device or a pipe may have no end.
        if path.metadata().is_ok_and(|found| !found.is_file()) {
            return Err(LogError::NoLog(path.into()));
        }
        let mut file = open_alone(path).map_err(|error| match error.kind() {
            ErrorKind::WouldBlock => LogError::Shared(path.into()),
            _ => failed(error).into(),
        })?;
        if file.metadata().map_err(failed)?.len() > LONGEST {
            return Err(LogError::Long(path.into()));
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let text = bytes.strip_prefix("\u{feff}".as_bytes()).unwrap_or(&bytes);
        // A further column would be missing in new lines.
        if !bytes.is_empty() && text.split(|byte| ENDS.contains(byte)).next() != Some(HEADER.as_bytes()) {
            return Err(LogError::NoLog(path.into()));
        }
        // Removes a last line that a power failure has cut off. It would damage the next line.
        let whole = end(&bytes, ENDS);
        file.set_len(whole as u64).and_then(|()| file.seek(SeekFrom::End(0))).map_err(failed)?;
        let lines = bytes[..whole].split(|byte| ENDS.contains(byte)).filter(|line| !line.is_empty());
        let found = lines.count().saturating_sub(1) as u64;
        let saved = file.try_clone().map_err(failed)?;
        let disk = Disk::new(move || whole_file::saved(saved.sync_data())).map_err(failed)?;
        let (began, end) = (Instant::now(), whole as u64);
        let mut log = Self { path: path.into(), file, disk, began, found, added: 0, end, is_changed: false };
        if whole == 0 {
            log.write_at(0, format!("{HEADER}\n").as_bytes()).map_err(failed)?;
        }
        Ok(log)
    }

    /// The time of a line written now, in milliseconds.
    pub fn now_ms(&self) -> u64 {
        u64::try_from(self.began.elapsed().as_millis()).unwrap_or(u64::MAX)
    }

    /// Writes an event of the session, with this time.
    ///
    /// # Errors
    /// If the file cannot be written, or is full.
    pub fn write(&mut self, time_ms: u64, happening: &Happening) -> Result<(), LogError> {
        match happening {
            Happening::Connected { version, shown, examples, .. } => {
                self.line(time_ms, Kind::Connected, version)?;
                // As they came: a newer firmware has settings, or values, that this program does not know.
                for line in shown.iter().filter(|line| line.contains('=')) {
                    let value = line.split([' ', ',']).next().unwrap_or_default();
                    self.line(time_ms, Kind::Setting, value)?;
                }
                examples.iter().try_for_each(|example| self.line(time_ms, Kind::Example, example))
            }
            Happening::Started { greeting, .. } => self.line(time_ms, Kind::Started, greeting),
            Happening::Lost(why) => self.line(time_ms, Kind::Lost, why),
            Happening::Status(_, line) => self.line(time_ms, Kind::Status, line),
            Happening::Event(_, line) => self.line(time_ms, Kind::Event, line),
            Happening::Command(line) => self.line(time_ms, Kind::Command, line),
            Happening::Answer(line) => self.line(time_ms, Kind::Answer, line),
            // What `revert` restored, or another session set, follows from no other line.
            Happening::Settings(_, lines) => lines.iter().try_for_each(|line| self.line(time_ms, Kind::Answer, line)),
            // They follow from other lines.
            Happening::Unanswered { .. }
            | Happening::Answered { .. }
            | Happening::Examples(_)
            | Happening::Warning(_) => Ok(()),
        }
    }

    /// Writes lines that do not come from a session, with this time.
    ///
    /// # Errors
    /// If the file cannot be written, or is full.
    pub fn lines_at(&mut self, time_ms: u64, lines: &[(Kind, String)]) -> Result<(), LogError> {
        lines.iter().try_for_each(|(kind, line)| self.line(time_ms, *kind, line))
    }

    /// Lines in the file, without the header.
    pub fn lines(&self) -> u64 {
        self.found + self.added
    }

    fn line(&mut self, time_ms: u64, kind: Kind, line: &str) -> Result<(), LogError> {
        if self.file.metadata().is_ok_and(|there| there.len() >= FULL) {
            return Err(LogError::Full(self.path.clone()));
        }
        self.added += 1;
        // A record is one line of the table, even if the system's message about a lost port has several.
        self.record([time_ms.to_string().as_str(), kind.into(), &in_a_line(line)])
    }

    fn record<'a>(&mut self, fields: impl IntoIterator<Item = &'a str>) -> Result<(), LogError> {
        let written = self.append(fields).and_then(|()| self.disk.written());
        Ok(written.map_err(|source| FileError::unwritten(&self.path, source))?)
    }

    /// Writes a record directly. A buffer would keep a line that a full disk has cut, and write it again later.
    fn append<'a>(&mut self, fields: impl IntoIterator<Item = &'a str>) -> io::Result<()> {
        let mut record = csv::Writer::from_writer(Vec::new());
        record.write_record(fields)?;
        let mut bytes = record.into_inner().map_err(csv::IntoInnerError::into_error)?;
        // Another program may have cut the file: at the old place, the line would stand behind a hole.
        let end = self.file.seek(SeekFrom::End(0)).unwrap_or(self.end);
        self.is_changed |= end != self.end;
        if end == 0 {
            bytes.splice(..0, format!("{HEADER}\n").into_bytes());
        } else if end != self.end {
            // It may end within a line.
            bytes.insert(0, b'\n');
        }
        self.write_at(end, &bytes)
    }

    fn write_at(&mut self, end: u64, bytes: &[u8]) -> io::Result<()> {
        let written = self.file.write_all(bytes);
        // A full disk may have taken a part: that is no change by another program.
        self.end = self.file.stream_position().unwrap_or(end + bytes.len() as u64);
        written
    }

    /// Whether the file still has its name.
    fn is_there(&self) -> bool {
        let Ok(opened) = self.file.try_clone().and_then(Handle::from_file) else { return self.path.exists() };
        Handle::from_path(&self.path).map_or_else(|error| error.kind() != ErrorKind::NotFound, |named| named == opened)
    }

    /// Checks that the file has its name and its length still.
    ///
    /// # Errors
    /// If another program has moved, replaced, cut or lengthened it.
    pub fn check(&self) -> Result<(), LogError> {
        let is_changed = self.is_changed || self.file.metadata().is_ok_and(|there| there.len() != self.end);
        match (self.is_there(), is_changed) {
            (false, _) => Err(LogError::Gone(self.path.clone())),
            (true, true) => Err(LogError::Changed(self.path.clone())),
            (true, false) => Ok(()),
        }
    }
}

/// A line of a log.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Entry {
    /// The line in the file, counted from 1.
    pub number: u64,
    /// The PC's time since the log was opened.
    pub time_ms: u64,
    /// Its kind.
    pub kind: Kind,
    /// Its text.
    pub text: String,
}

/// Reads a log.
///
/// # Errors
/// Names the file, the line and what would be right.
pub fn read(path: &Path) -> Result<Vec<Entry>, FileError> {
    parse(path, files::bounded_file::recorded(path)?)
}

/// The lines in a log's text. A last line without its end is left out: it is cut off, and so may be its values.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, mut text: Vec<u8>) -> Result<Vec<Entry>, FileError> {
    text.truncate(end(&text, ENDS));
    let table = CsvTable::parse(path, text, &HEADER.split(',').collect::<Vec<_>>())?;
    let mut last_ms = 0;
    table
        .lines()
        .map(|line| {
            let kind: Kind = line.text("kind").parse().map_err(|_| {
                let known = Kind::VARIANTS.join(", ");
                line.error(format!("kind is `{}`: it has to be one of {known}", line.text("kind")))
            })?;
            let time_ms = line.value("time_ms", "a whole number of milliseconds")?;
            if time_ms < last_ms && !kind.may_begin(line.text("line")) {
                let why = format!("time_ms goes back from {last_ms} to {time_ms}: lines have to stand as recorded");
                return Err(line.error(why));
            }
            last_ms = time_ms;
            Ok(Entry { number: line.number, time_ms, kind, text: line.text("line").to_owned() })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn a_log_is_read_back_and_continued_after_a_cut_line() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let path = file.path();
        let answer = "speed_mm_s,spacing_mm \"quoted\"";
        for end in ["\n", "\r\n", "\r"] {
            fs::write(path, "").unwrap();
            LogWriter::open(path).unwrap().write(0, &Happening::Answer(answer.to_owned())).unwrap();
            let cut = fs::read_to_string(path).unwrap().replace('\n', end) + "17,sta";
            fs::write(path, cut).unwrap();
            let mut log = LogWriter::open(path).unwrap();
            log.write(0, &Happening::Lost("no\nport".to_owned())).unwrap();
            assert_eq!(log.lines(), 2, "{end:?}");
            let entries: Vec<(u64, Kind, String)> =
                read(path).unwrap().into_iter().map(|entry| (entry.number, entry.kind, entry.text)).collect();
            assert_eq!(entries, [(2, Kind::Answer, answer.to_owned()), (3, Kind::Lost, r"no\nport".to_owned())]);
        }
    }

    #[test]
    fn a_log_has_one_writer_and_any_readers() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut log = LogWriter::open(file.path()).unwrap();
        assert!(matches!(LogWriter::open(file.path()), Err(LogError::Shared(_))));
        log.write(0, &Happening::Lost("no port".to_owned())).unwrap();
        assert_eq!(read(file.path()).unwrap().len(), 1);
        drop(log);
        assert_eq!(LogWriter::open(file.path()).unwrap().lines(), 1);
    }

    #[test]
    fn a_log_that_the_disk_does_not_take_is_an_error() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut log = LogWriter::open(file.path()).unwrap();
        log.disk = Disk::new(|| Err(io::Error::other("the card is out"))).unwrap();
        let lost = Happening::Lost("no port".to_owned());
        let error = (0..1000).find_map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(10));
            log.write(0, &lost).err()
        });
        let Some(LogError::File(error)) = error else { panic!("{error:?}") };
        assert_eq!(std::error::Error::source(&error).unwrap().to_string(), "the card is out");
        assert!(log.write(0, &lost).is_err());
    }

    #[cfg(unix)]
    #[test]
    fn nothing_is_written_behind_a_line_that_a_full_disk_has_cut() {
        use std::os::fd::OwnedFd;
        use std::os::unix::net::UnixStream;
        let file = tempfile::NamedTempFile::new().unwrap();
        let mut log = LogWriter::open(file.path()).unwrap();
        // A full stream takes a part of a line, as a full disk does.
        let (full, mut read) = UnixStream::pair().unwrap();
        full.set_nonblocking(true).unwrap();
        log.file = OwnedFd::from(full).into();
        let (short, long) = (Happening::Lost("short".to_owned()), Happening::Lost("long".repeat(1 << 20)));
        log.write(0, &short).unwrap();
        assert!(matches!(log.write(0, &long), Err(LogError::File(_))));
        read.set_nonblocking(true).unwrap();
        let mut written = Vec::new();
        assert_eq!(read.read_to_end(&mut written).unwrap_err().kind(), ErrorKind::WouldBlock);
        assert!(written.starts_with(b"0,lost,short\n0,lost,longlong") && !written.ends_with(b"\n"));
        drop(log);
        assert_eq!(read.read_to_end(&mut written).unwrap(), 0, "the disk has room again");
    }

    #[test]
    fn what_the_machine_shows_after_a_change_is_in_the_log() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let line = "wheel_mm=410 mm from 200 to 800, default 400, saved 410".to_owned();
        let shown = Happening::Settings(link::settings::Settings::new(), vec![line.clone()]);
        LogWriter::open(file.path()).unwrap().write(7, &shown).unwrap();
        assert_eq!(read(file.path()).unwrap(), [Entry { number: 2, time_ms: 7, kind: Kind::Answer, text: line }]);
    }

    #[test]
    fn another_file_is_not_written_over_and_no_log_grows_too_long() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for other in ["my diary\n", "time_ms,kind,line,notes\n0,lost,gone,\n"] {
            fs::write(file.path(), other).unwrap();
            assert!(matches!(LogWriter::open(file.path()), Err(LogError::NoLog(_))));
            assert_eq!(fs::read_to_string(file.path()).unwrap(), other);
        }
        let folder = tempfile::tempdir().unwrap();
        for no_file in [folder.path(), Path::new("/dev/null")].into_iter().filter(|path| path.exists()) {
            assert!(matches!(LogWriter::open(no_file), Err(LogError::NoLog(_))), "{}", no_file.display());
        }
        fs::write(file.path(), format!("\u{feff}{HEADER}\r\n0,lost,gone\r\n")).unwrap();
        assert_eq!(LogWriter::open(file.path()).unwrap().lines(), 1);
        file.as_file().set_len(LONGEST + 1).unwrap();
        assert!(matches!(LogWriter::open(file.path()), Err(LogError::Long(_))));
        file.as_file().set_len(0).unwrap();
        let mut log = LogWriter::open(file.path()).unwrap();
        for (length, is_taken) in [(FULL - 1, true), (FULL, false)] {
            file.as_file().set_len(length).unwrap();
            assert_eq!(log.write(0, &Happening::Lost("no port".to_owned())).is_ok(), is_taken, "{length}");
        }
    }

    #[test]
    fn a_log_cut_or_replaced_by_another_program_stays_readable() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("log.csv");
        let lost = || Happening::Lost("no port".to_owned());
        for (kept, cut) in [(0, ""), (1, ""), (2, ""), (2, "0,lost,no po")] {
            let mut log = LogWriter::open(&path).unwrap();
            for _ in 0..3 {
                log.write(0, &lost()).unwrap();
            }
            log.check().unwrap();
            // As an editor saves it, in place: the heading and some lines.
            let text = fs::read_to_string(&path).unwrap();
            fs::write(&path, text.split_inclusive('\n').take(kept).collect::<String>() + cut).unwrap();
            assert!(log.check().is_err(), "before a further line too");
            log.write(0, &lost()).unwrap();
            assert_eq!(read(&path).unwrap().len(), kept.saturating_sub(1) + 1 + usize::from(!cut.is_empty()));
            assert!(log.check().unwrap_err().to_string().ends_with("may lack lines"));
            drop(log);
            fs::remove_file(&path).unwrap();
        }
        let mut log = LogWriter::open(&path).unwrap();
        let copy = folder.path().join("copy.csv");
        fs::copy(&path, &copy).unwrap();
        fs::rename(&copy, &path).unwrap();
        log.write(0, &lost()).unwrap();
        let refused = log.check().unwrap_err();
        assert!(refused.to_string().contains("moved, deleted or replaced"), "{refused}");
    }

    #[test]
    fn a_heading_without_its_end_is_written_again() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for begun in [HEADER.to_owned(), format!("\u{feff}{HEADER}"), format!("{HEADER}\n0,lost,no po")] {
            fs::write(file.path(), begun).unwrap();
            LogWriter::open(file.path()).unwrap().write(0, &Happening::Lost("no port".to_owned())).unwrap();
            assert_eq!(fs::read_to_string(file.path()).unwrap(), format!("{HEADER}\n0,lost,no port\n"));
        }
    }

    #[test]
    fn a_line_that_is_none_of_a_log_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        for (line, wrong) in [
            ("0,gossip,hello", "line 2: kind is `gossip`: it has to be one of connected, started, lost, setting"),
            ("soon,event,swing", "line 2: time_ms is `soon`: it has to be a whole number of milliseconds"),
        ] {
            fs::write(file.path(), format!("{HEADER}\n{line}\n")).unwrap();
            let error = read(file.path()).unwrap_err().to_string();
            assert!(error.contains(wrong), "{error}");
        }
    }
}
