//! A log in pieces, for a reader that has no room for the whole text.

use crate::log::{self, ENDS, Entry, end};
use files::FileError;
use files::csv_table::is_above_header;
use std::path::{Path, PathBuf};

/// Reads a log in pieces, so that the whole text is not in memory.
#[derive(Default)]
pub struct Pieces {
    path: PathBuf,
    /// The lines down to the header, and below it the wanted lines of a piece.
    table: String,
    /// Lines down to the header; 0 before it was read.
    head: usize,
    /// The number of each of these lines in the log.
    numbers: Vec<u64>,
    /// The beginning of an incomplete line.
    cut: Vec<u8>,
    /// Lines that were read.
    lines: u64,
    has_entries: bool,
}

impl Pieces {
    /// A log before its first line. The path is for error messages.
    pub fn new(path: &Path) -> Self {
        Self { path: path.into(), ..Self::default() }
    }

    /// Parses the lines that end in the next bytes of the log, without the unwanted ones.
    ///
    /// # Errors
    /// As [`log::read`], except for a log without lines.
    pub fn take(&mut self, bytes: &[u8], is_wanted: impl FnMut(&str) -> bool) -> Result<Vec<Entry>, FileError> {
        let (whole, rest) = bytes.split_at(end(bytes, b"\n"));
        self.cut.extend_from_slice(whole);
        let mut text = if whole.is_empty() { Vec::new() } else { std::mem::take(&mut self.cut) };
        // The last line is complete only when the next one shows that no quotation mark is open.
        let last = end(&text[..text.len().saturating_sub(1)], b"\n");
        if text[last..].iter().filter(|&&byte| byte == b'"').count() % 2 == 1 {
            self.cut = text.split_off(last);
        }
        self.cut.extend_from_slice(rest);
        self.lines(text, is_wanted)
    }

    /// Parses the last lines, as far as they are whole.
    ///
    /// # Errors
    /// As [`log::read`].
    pub fn end(mut self, is_wanted: impl FnMut(&str) -> bool) -> Result<Vec<Entry>, FileError> {
        let mut last = std::mem::take(&mut self.cut);
        last.truncate(end(&last, ENDS));
        let entries = self.lines(last, is_wanted)?;
        // For an empty log this returns the error for a missing header.
        if self.has_entries { Ok(entries) } else { self.parse() }
    }

    fn lines(&mut self, text: Vec<u8>, mut is_wanted: impl FnMut(&str) -> bool) -> Result<Vec<Entry>, FileError> {
        let no_text = "this is not text: a log is a CSV file in UTF-8".to_owned();
        let failed = |_| FileError::Line { path: self.path.clone(), line: self.lines + 1, problem: no_text };
        let text = String::from_utf8(text).map_err(failed)?;
        let text = if text.contains('\r') { text.replace("\r\n", "\n").replace('\r', "\n") } else { text };
        for line in text.split_inclusive('\n') {
            self.lines += 1;
            let is_text = line != "\n" && !line.starts_with('#');
            if is_text && (self.head == 0 || is_wanted(line)) {
                self.table.push_str(line);
                self.numbers.push(self.lines);
                if self.head == 0 && !is_above_header(line) {
                    self.head = self.numbers.len();
                }
            }
        }
        if self.numbers.len() == self.head || self.head == 0 {
            return Ok(Vec::new());
        }
        self.has_entries = true;
        let entries = self.parse();
        self.table.truncate(self.table.split_inclusive('\n').take(self.head).map(str::len).sum());
        self.numbers.truncate(self.head);
        entries
    }

    /// Parses the table. Entries and errors have the numbers of the log's lines.
    fn parse(&self) -> Result<Vec<Entry>, FileError> {
        let numbered = |line: u64| self.numbers.get((line as usize).wrapping_sub(1)).copied().unwrap_or(line);
        let entries = log::parse(&self.path, self.table.clone().into_bytes()).map_err(|error| match error {
            FileError::Line { path, line, problem } => FileError::Line { path, line: numbered(line), problem },
            file @ FileError::File { .. } => file,
        })?;
        Ok(entries.into_iter().map(|entry| Entry { number: numbered(entry.number), ..entry }).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::{HEADER, Kind};

    #[test]
    fn a_log_in_pieces_is_that_log_and_its_errors_are_in_the_same_lines() {
        let whole = "# monday\n\nkind,time_ms,line\n# early\nlost,0,\"a, b\"\n\nstatus,1,x\nstatus,2,y\nevent,3,z";
        let declared = format!("\u{feff}sep=;\n;;\n\"# a; note\";;\n{}", whole.replace(',', ";"));
        for text in [whole.to_owned(), whole.replace('\n', "\r\n"), whole.replace('\n', "\r"), declared] {
            for text in [text.clone(), format!("{text}\n"), text.replace("lost", "gossip"), text.replace("y", "\"y")] {
                let as_one = log::parse(Path::new("log"), text.clone().into_bytes()).map_err(|error| error.to_string());
                for length in [1, 2, 7, 40, 1000] {
                    let mut pieces = Pieces::new(Path::new("log"));
                    let in_pieces = || {
                        let mut entries = Vec::new();
                        for piece in text.as_bytes().chunks(length) {
                            entries.extend(pieces.take(piece, |_| true)?);
                        }
                        entries.extend(pieces.end(|_| true)?);
                        Ok(entries)
                    };
                    let in_pieces = in_pieces().map_err(|error: FileError| error.to_string());
                    assert_eq!(in_pieces, as_one, "{text:?} by {length}");
                }
            }
        }
        for nothing in ["", "# a comment\n", "time_ms,kind,line\n#\n"] {
            let mut pieces = Pieces::new(Path::new("log"));
            assert!(pieces.take(nothing.as_bytes(), |_| true).unwrap().is_empty());
            assert!(pieces.end(|_| true).is_err(), "{nothing:?}");
        }
    }

    #[test]
    fn the_lines_left_after_filtering_keep_their_numbers() {
        let mut pieces = Pieces::new(Path::new("log"));
        let is_wanted = |line: &str| !line.contains(",status,");
        let text = format!("{HEADER}\n0,status,a\n1,event,b\n2,status,c\n3,event,d\n");
        let taken = pieces.take(text.as_bytes(), is_wanted).unwrap();
        assert_eq!(taken.iter().map(|entry| entry.number).collect::<Vec<_>>(), [3, 5]);
        assert!(pieces.end(is_wanted).unwrap().is_empty());
    }

    #[test]
    fn a_last_line_that_a_power_failure_has_cut_is_left_out() {
        for cut in ["4", "43,s", "43,status,state=ho", "43,gps,\"$GPGGA,09", "43,event,pos=1\0\0\0", "\0\0"] {
            for end in ["\n", "\r\n", "\r"] {
                let text = format!("{HEADER}\n0,connected,0.2.0\n").replace('\n', end) + cut;
                let entries = log::parse(Path::new("log"), text.clone().into_bytes()).unwrap();
                assert_eq!(entries.iter().map(|entry| entry.kind).collect::<Vec<_>>(), [Kind::Connected], "{text:?}");
                let mut pieces = Pieces::new(Path::new("log"));
                let first = pieces.take(text.as_bytes(), |_| true).unwrap();
                assert_eq!([first, pieces.end(|_| true).unwrap()].concat(), entries, "{text:?}");
            }
        }
    }
}
