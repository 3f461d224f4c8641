//! Reads CSV tables that people made, with errors that name the file, the line, and what would be right.
//!
//! The columns may be in any order, with other columns between. Lines that begin with `#` are comments. Line ends may
//! be those of any system or serial monitor. The caller interprets the values.

use super::FileError;
use csv::StringRecord;
use std::fs;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A table: some lines of text in columns.
pub struct CsvTable {
    path: PathBuf,
    header: StringRecord,
    lines: Vec<(u64, StringRecord)>,
}

impl CsvTable {
    /// Reads a file as [`parse`](Self::parse) parses its text.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and if the file cannot be read.
    pub fn read(path: &Path, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse(path, bytes(path)?, columns)
    }

    /// Parses a file's text. The table must have these columns and at least one line below its header.
    ///
    /// A last line `ok` is ignored: the firmware's console ends its answers with it, and tables are pasted from there.
    ///
    /// # Errors
    /// Names the file, the line and what would be right.
    pub fn parse(path: &Path, text: Vec<u8>, columns: &[&str]) -> Result<Self, FileError> {
        let at = |line: u64, problem: String| FileError::Line { path: path.into(), line, problem };
        let text = String::from_utf8(text)
            .map_err(|_| at(1, "this is not text: a table is a CSV file in UTF-8".to_owned()))?;
        // The reader counts line feeds, so each line must have exactly one.
        let text = text.replace("\r\n", "\n").replace('\r', "\n");
        let text = text.trim_end();
        let text = text.strip_suffix("\nok").unwrap_or(text).to_owned() + "\n";

        // The lengths of lines are looked at below.
        let mut builder = csv::ReaderBuilder::new();
        let mut reader = builder.flexible(true).trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        let header = reader.headers().map_err(|error| at(1, error.to_string()))?.clone();
        if let Some(line) = opened(&text, 0, &header) {
            return Err(at(line, UNCLOSED.to_owned()));
        }
        // The reader is at the line after the record. A record's own position may be a comment's.
        let header_line = reader.position().line() - 1;
        if let Some(missing) = columns.iter().find(|&column| !header.iter().any(|name| name == *column)) {
            let semicolons = header.iter().any(|name| name.contains(';'));
            let hint = if semicolons { "; fields are separated by commas, not by semicolons" } else { "" };
            let problem = format!("the column `{missing}` is missing: the header has to name {}", columns.join(","));
            return Err(at(header_line, problem + hint));
        }
        let is_twice = |column: &&&str| header.iter().filter(|name| name == *column).count() > 1;
        if let Some(twice) = columns.iter().find(is_twice) {
            return Err(at(header_line, format!("the column `{twice}` occurs twice: each column needs its own name")));
        }
        let mut lines = Vec::new();
        let mut before = header_line;
        let mut record = StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| at(before + 1, error.to_string()))? {
            if let Some(line) = opened(&text, before, &record) {
                return Err(at(line, UNCLOSED.to_owned()));
            }
            let line = reader.position().line() - 1;
            let (found, right) = (record.len(), header.len());
            if found != right {
                let problem =
                    format!("fields: {found}, where the header has {right}: each line has one field a column");
                return Err(at(line, problem));
            }
            lines.push((line, record.clone()));
            before = line;
        }
        if lines.is_empty() {
            return Err(at(header_line, "no line is below the header: add at least one".to_owned()));
        }
        Ok(Self { path: path.into(), header, lines })
    }

    /// The lines below the header, at least one.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        self.lines.iter().map(|(number, record)| Line { table: self, number: *number, record })
    }
}

/// The error for a field over several lines: it contains the lines after an open quotation mark.
const UNCLOSED: &str = "a quotation mark is opened and not closed: a field ends on its own line";

/// The line after `before` on which this record opens a quotation mark that is not closed on the same line.
fn opened(text: &str, before: u64, record: &StringRecord) -> Option<u64> {
    let goes_on = record.iter().any(|field| field.contains('\n'));
    let mut behind = (1..).zip(text.lines()).skip(before as usize);
    let is_odd = |line: &str| !line.starts_with('#') && line.matches('"').count() % 2 == 1;
    goes_on.then(|| behind.find(|(_, line)| is_odd(line)).map_or(before + 1, |(number, _)| number))
}

/// The content of a file.
///
/// # Errors
/// If it cannot be read.
pub fn bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    fs::read(path).map_err(|source| FileError::unread(path, source))
}

/// A line of a table.
#[derive(Clone, Copy)]
pub struct Line<'a> {
    table: &'a CsvTable,
    number: u64,
    record: &'a StringRecord,
}

impl Line<'_> {
    /// Its number in the file, counted from 1.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// The text in a column; empty if the table has no such column.
    pub fn text(&self, column: &str) -> &str {
        let place = self.table.header.iter().position(|name| name == column);
        place.and_then(|place| self.record.get(place)).unwrap_or_default()
    }

    /// The value in a column. `right` says what it has to be.
    ///
    /// # Errors
    /// If the text is none.
    pub fn value<T: FromStr>(&self, column: &str, right: &str) -> Result<T, FileError> {
        let text = self.text(column);
        text.parse().map_err(|_| self.error(format!("{column} is `{text}`: it has to be {right}")))
    }

    /// The error that this line has a problem.
    pub fn error(&self, problem: impl Into<String>) -> FileError {
        FileError::Line { path: self.table.path.clone(), line: self.number, problem: problem.into() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of the column `place_mm` with their lines, or the error for a file with this text.
    fn read(text: impl AsRef<[u8]>) -> Result<Vec<(u64, i16)>, String> {
        let table = CsvTable::parse(Path::new("table.csv"), text.as_ref().to_owned(), &["place_mm"]);
        let values = table.and_then(|table| {
            table.lines().map(|line| Ok((line.number, line.value("place_mm", "a whole number")?))).collect()
        });
        values.map_err(|error: FileError| error.to_string())
    }

    #[test]
    fn lines_are_counted_alike_however_they_end() {
        let text = "# measured in May\nplace_mm,width_mm\n\n7,1\n# a gap\n\n8,1\n";
        for end in ["\n", "\r\n", "\r"] {
            assert_eq!(read(text.replace('\n', end)), Ok(vec![(4, 7), (7, 8)]), "{end:?}");
            let wrong = "table.csv, line 8: place_mm is `far`: it has to be a whole number";
            assert_eq!(read(format!("{text}far,1").replace('\n', end)), Err(wrong.to_owned()), "{end:?}");
            let short = "table.csv, line 8: fields: 1, where the header has 2: each line has one field a column";
            assert_eq!(read(format!("{text}9").replace('\n', end)), Err(short.to_owned()), "{end:?}");
        }
    }

    #[test]
    fn a_wrong_table_is_refused_with_the_line_and_what_would_be_right() {
        let missing = "the column `place_mm` is missing: the header has to name place_mm";
        for (text, line, problem) in [
            ("# measured in May\nwidth_mm\n7\n", 2, missing),
            ("", 1, missing),
            ("place_mm;width_mm\n7;1\n", 1, &format!("{missing}; fields are separated by commas, not by semicolons")),
            (
                "place_mm,width_mm,place_mm\n7,1,8\n",
                1,
                "the column `place_mm` occurs twice: each column needs its own name",
            ),
            ("place_mm,width_mm\n7,1\n# 5\" pot\n8,\"1\n9,1\n", 4, UNCLOSED),
            ("place_mm,width_mm\n7,1\n\n8,\"1\n9,1\n10,1\n\"11,1", 4, UNCLOSED),
            ("\"place_mm,width_mm\n7,1\n", 1, UNCLOSED),
            ("place_mm,\"width_mm\n7,1\n", 1, UNCLOSED),
        ] {
            assert_eq!(read(text), Err(format!("table.csv, line {line}: {problem}")), "{text:?}");
        }
        let no_text = "table.csv, line 1: this is not text: a table is a CSV file in UTF-8";
        assert_eq!(read(b"place_mm\n\xFF\n"), Err(no_text.to_owned()));
        assert_eq!(read("place_mm,width_mm,width_mm\n7,1,8\n"), Ok(vec![(2, 7)]), "it is not read");
        assert_eq!(read("place_mm,pot\n7,\"5\"\", clay\"\n8,5\" clay\n"), Ok(vec![(2, 7), (3, 8)]));
    }

    #[test]
    fn the_console_s_ok_at_the_end_is_no_line_of_the_table() {
        for end in ["ok", "ok\n", "ok\n\n"] {
            for between in ["\n", "\r\n"] {
                let text = format!("place_mm,width_mm\n7,1\n{end}").replace('\n', between);
                assert_eq!(read(&text), Ok(vec![(2, 7)]), "{text:?}");
            }
        }
        assert!(read("place_mm,width_mm\nok\n7,1\n").unwrap_err().starts_with("table.csv, line 2: fields: 1"));
        assert!(read("place_mm,width_mm\nok\n").unwrap_err().starts_with("table.csv, line 1: no line is below"));
    }
}
