//! Reads CSV tables that people made, with errors that name the file, the line, and what would be right.
//!
//! The columns may be in any order, with other columns between. Lines whose first cell begins with `#` are notes. Line
//! ends may be those of any system or serial monitor. Spreadsheets have habits of their own, and what they add is
//! dropped: a byte order mark, a line `sep=;`, rows and cells at the edge without text. Half the world writes decimal
//! commas and separates by semicolons, so semicolons and tabs separate where commas do not give the columns. The caller
//! interprets the values.

use super::{FileError, bounded_file};
use csv::StringRecord;
use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// A table: some lines of text in columns.
pub struct CsvTable {
    path: PathBuf,
    separator: u8,
    header: StringRecord,
    lines: Vec<(u64, StringRecord)>,
    /// Whether a comma of a number can only be a decimal one.
    has_decimal_comma: bool,
}

/// What may separate the cells of a line, the usual one first.
const SEPARATORS: [u8; 3] = *b",;\t";

impl CsvTable {
    /// Reads a file as [`parse`](Self::parse) parses its text.
    ///
    /// # Errors
    /// As [`parse`](Self::parse), and if the file cannot be read.
    pub fn read(path: &Path, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse(path, bounded_file::bytes(path)?, columns)
    }

    /// Reads a file in which cells may be empty: a spreadsheet leaves out the last ones of a line.
    ///
    /// # Errors
    /// As [`read`](Self::read), but a short line is none.
    pub fn read_with_gaps(path: &Path, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse_lines(path, bounded_file::bytes(path)?, columns, true)
    }

    /// Parses a file's text. The table must have these columns and at least one line below its header.
    ///
    /// A last line `ok` is ignored: the firmware's console ends its answers with it, and tables are pasted from there.
    ///
    /// # Errors
    /// Names the file, the line and what would be right.
    pub fn parse(path: &Path, text: Vec<u8>, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse_lines(path, text, columns, false)
    }

    /// As [`parse`](Self::parse). A line may end before the last column if `may_be_short`.
    fn parse_lines(path: &Path, text: Vec<u8>, columns: &[&str], may_be_short: bool) -> Result<Self, FileError> {
        let at = |line: u64, problem: String| FileError::Line { path: path.into(), line, problem };
        let text = decoded(text).map_err(|(line, problem)| at(line, problem))?;
        let text = text.trim_end();
        let mut text = text.strip_suffix("\nok").unwrap_or(text).to_owned() + "\n";
        let declared = declared_separator(&text);
        if declared.is_some() {
            // Its line stays, without text, so that lines are counted right.
            text.replace_range(..text.find('\n').unwrap_or_default(), "");
        }
        let separator = declared.unwrap_or_else(|| guessed_separator(&text, columns));

        // The lengths of lines are looked at below.
        let mut builder = csv::ReaderBuilder::new();
        let builder = builder.flexible(true).trim(csv::Trim::All).comment(Some(b'#')).has_headers(false);
        let mut reader = builder.delimiter(separator).from_reader(text.as_bytes());
        let mut header: Option<(u64, StringRecord)> = None;
        let mut lines = Vec::new();
        let mut before = 0;
        let mut record = StringRecord::new();
        while reader.read_record(&mut record).map_err(|error| at(before + 1, error.to_string()))? {
            if let Some(line) = opened(&text, before, &record) {
                return Err(at(line, UNCLOSED.to_owned()));
            }
            // The reader is at the line after the record. A record's own position may be a comment's.
            let line = reader.position().line() - 1;
            before = line;
            // A spreadsheet quotes a note that has a comma.
            let is_note = record.get(0).is_some_and(|cell| cell.starts_with('#'));
            if is_note || record.iter().all(str::is_empty) {
                continue;
            }
            let Some((_, header)) = &header else {
                header = Some((line, checked_header(&record, columns).map_err(|problem| at(line, problem))?));
                continue;
            };
            let (found, right) = (record.len(), header.len());
            let has_more = record.iter().skip(right).any(|cell| !cell.is_empty());
            if has_more || (found < right && !may_be_short) {
                let hint = if has_more && separator == b',' {
                    "; numbers with decimal commas need semicolons or tabs between the fields, or a point"
                } else {
                    ""
                };
                let problem =
                    format!("fields: {found}, where the header has {right}: each line has one field a column{hint}");
                return Err(at(line, problem));
            }
            lines.push((line, record.iter().take(right).collect()));
        }
        let Some((header_line, header)) = header else {
            return Err(at(1, missing(columns.first().unwrap_or(&""), &StringRecord::new(), columns)));
        };
        if lines.is_empty() {
            return Err(at(header_line, "no line is below the header: add at least one".to_owned()));
        }
        let is_decimal = |cell: &str| with_point(cell) != cell && !may_be_thousands(cell);
        let has_decimal_comma = separator != b',' && lines.iter().flat_map(|(_, line)| line).any(is_decimal);
        Ok(Self { path: path.into(), separator, header, lines, has_decimal_comma })
    }

    /// The lines below the header, at least one.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        self.lines.iter().map(|(number, record)| Line { table: self, number: *number, record })
    }
}

/// The text of a file with one line feed behind each line, or the line that has none and why.
fn decoded(bytes: Vec<u8>) -> Result<String, (u64, String)> {
    /// Zeros in so many first bytes show text in two bytes a letter.
    const BEGINNING: usize = 64;
    let is_wide = bytes.starts_with(b"\xFF\xFE") || bytes.starts_with(b"\xFE\xFF");
    if is_wide || bytes.iter().take(BEGINNING).filter(|&&byte| byte == 0).count() > bytes.len().min(BEGINNING) / 4 {
        return Err((1, "the file is saved as UTF-16: save it as CSV in UTF-8".to_owned()));
    }
    let text = String::from_utf8(bytes).map_err(|error| {
        let (good, bad) = error.as_bytes().split_at(error.utf8_error().valid_up_to());
        // A line ends with a carriage return, a line feed, or both.
        let ends = good.iter().enumerate().filter(|&(at, &byte)| {
            byte == b'\n' && (at == 0 || good[at - 1] != b'\r') || byte == b'\r'
        });
        let byte = bad.first().copied().unwrap_or_default();
        let problem = format!(
            "the byte {byte:#04X} is not UTF-8: the file is saved in an older encoding, such as Windows-1252; save it as CSV in UTF-8"
        );
        (1 + ends.count() as u64, problem)
    })?;
    // The reader counts line feeds, so each line must have exactly one.
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

/// The separator that the first line declares for Excel: `sep=;`, perhaps quoted, or with separators behind it.
fn declared_separator(text: &str) -> Option<u8> {
    let first = text.lines().next()?.trim_start_matches('"');
    let (key, value) = first.split_at_checked(4)?;
    let separator = *value.as_bytes().first().filter(|byte| byte.is_ascii())?;
    let is_rest_empty = value[1..].bytes().all(|byte| byte == separator || matches!(byte, b'"' | b',' | b';' | b' '));
    (key.eq_ignore_ascii_case("sep=") && is_rest_empty).then_some(separator)
}

/// Whether a line may stand above the header: a note, a line without text, or one that declares the separator.
pub fn is_above_header(line: &str) -> bool {
    let line = line.trim_start_matches('\u{feff}').trim_end();
    line.trim_start_matches(['"', ' ']).starts_with('#')
        || line.trim_matches([',', ';', '\t', '"', ' ']).is_empty()
        || declared_separator(line).is_some()
}

/// The separator with which the header has most of the columns, or at least most cells.
fn guessed_separator(text: &str, columns: &[&str]) -> u8 {
    let header = text.lines().find(|line| !is_above_header(line)).unwrap_or_default();
    let named = |separator: u8| {
        let cells: Vec<&str> =
            header.split(char::from(separator)).map(|cell| cell.trim().trim_matches('"').trim()).collect();
        (columns.iter().filter(|column| cells.contains(column)).count(), cells.len())
    };
    // The last of equals is taken, so the usual one comes last.
    SEPARATORS.into_iter().rev().max_by_key(|&separator| named(separator)).unwrap_or(b',')
}

/// The header without the cells at its end that have no text.
fn checked_header(record: &StringRecord, columns: &[&str]) -> Result<StringRecord, String> {
    let named = record.iter().zip(1..).filter(|(name, _)| !name.is_empty());
    let count = named.last().map_or(0, |(_, number)| number);
    let header: StringRecord = record.iter().take(count).collect();
    if let Some(name) = columns.iter().find(|&column| !header.iter().any(|name| name == *column)) {
        return Err(missing(name, &header, columns));
    }
    let is_twice = |column: &&&str| header.iter().filter(|name| name == *column).count() > 1;
    match columns.iter().find(is_twice) {
        Some(twice) => Err(format!("the column `{twice}` occurs twice: each column needs its own name")),
        None => Ok(header),
    }
}

/// The error for a missing column, with the name in the header that is nearest.
fn missing(column: &str, header: &StringRecord, columns: &[&str]) -> String {
    /// Letters that may differ in a name that was meant.
    const SLIPS: usize = 2;
    let plain = |name: &str| name.to_lowercase().replace([' ', '-', '.'], "_");
    let is_near = |name: &&str| strsim::damerau_levenshtein(&plain(name), column) <= SLIPS;
    match header.iter().filter(|name| !columns.contains(name)).find(is_near) {
        Some(near) => format!("the column `{column}` is missing: did you mean {column} by `{near}`?"),
        None => format!("the column `{column}` is missing: the header has to name {}", columns.join(",")),
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

/// A line of a table.
#[derive(Clone, Copy)]
pub struct Line<'a> {
    table: &'a CsvTable,
    /// Its number in the file, counted from 1.
    pub number: u64,
    record: &'a StringRecord,
}

impl Line<'_> {
    /// The text in a column; empty if the table has no such column.
    pub fn text(&self, column: &str) -> &str {
        let place = self.table.header.iter().position(|name| name == column);
        place.and_then(|place| self.record.get(place)).unwrap_or_default()
    }

    /// The value in a column. `right` says what it has to be. A whole number may be written as `200.0`. Where commas do
    /// not separate the fields, a number may have a decimal comma.
    ///
    /// # Errors
    /// If the text is none, or if its comma may be one of thousands, and no number of the table has another comma.
    pub fn value<T: FromStr>(&self, column: &str, right: &str) -> Result<T, FileError> {
        let text = self.text(column);
        let point = if self.table.separator == b',' { text.into() } else { with_point(text) };
        let whole =
            || point.split_once('.').filter(|(_, zeros)| zeros.bytes().all(|digit| digit == b'0'))?.0.parse().ok();
        let is_unclear = may_be_thousands(text) && !self.table.has_decimal_comma;
        let value = if is_unclear { None } else { point.parse().ok().or_else(whole) };
        value.ok_or_else(|| {
            let hint = if is_unclear {
                "; its comma may be one of thousands: write the number without it, or with a decimal point"
            } else if self.table.separator == b',' && with_point(text) != text {
                "; decimal commas need semicolons or tabs between the fields"
            } else {
                ""
            };
            self.error(format!("{column} is `{text}`: it has to be {right}{hint}"))
        })
    }

    /// The error that this line has a problem.
    pub fn error(&self, problem: impl Into<String>) -> FileError {
        FileError::Line { path: self.table.path.clone(), line: self.number, problem: problem.into() }
    }
}

/// A number with a decimal comma, with a point instead; other text as it is.
fn with_point(text: &str) -> Cow<'_, str> {
    let is_number = |(whole, decimals): (&str, &str)| {
        let digits = whole.strip_prefix(['-', '+']).unwrap_or(whole);
        let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
        is_digits(digits) && is_digits(decimals)
    };
    if text.split_once(',').is_some_and(is_number) { text.replace(',', ".").into() } else { text.into() }
}

/// Whether this may be an English number from 1,000 to 999,999, and is not certain to have decimals.
fn may_be_thousands(text: &str) -> bool {
    let digits = text.trim_start_matches(['-', '+']);
    let groups = digits.split_once(',').map(|(thousands, rest)| (thousands.len(), rest.len()));
    matches!(groups, Some((1..=3, 3))) && !digits.starts_with('0') && with_point(text) != text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    /// The values of the column `place_mm` with their lines, or the error for a file with this text.
    fn read(text: impl AsRef<[u8]>) -> Result<Vec<(u64, i16)>, String> {
        let table = CsvTable::parse(Path::new("table.csv"), text.as_ref().to_owned(), &["place_mm"]);
        let values = table.and_then(|table| {
            table.lines().map(|line| Ok((line.number, line.value("place_mm", "a whole number")?))).collect()
        });
        values.map_err(|error: FileError| error.to_string())
    }

    #[test]
    fn a_first_line_that_no_separator_follows_declares_none() {
        for text in ["sep=\u{2028}", "sep=", "sep", "abcd\u{2028}x", ""] {
            assert_eq!(declared_separator(text), None, "{text:?}");
        }
        assert_eq!(declared_separator("sep=;"), Some(b';'));
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
            ("Place mm,width_mm\n7,1\n", 1, "the column `place_mm` is missing: did you mean place_mm by `Place mm`?"),
            ("plase_mm;width_mm\n7;1\n", 1, "the column `place_mm` is missing: did you mean place_mm by `plase_mm`?"),
            (
                "place_mm,width_mm\n7,0,4\n",
                2,
                "fields: 3, where the header has 2: each line has one field a column; numbers with decimal commas need \
                 semicolons or tabs between the fields, or a point",
            ),
            (
                "place_mm,width_mm\n\"7,5\",1\n",
                2,
                "place_mm is `7,5`: it has to be a whole number; decimal commas need semicolons or tabs between the fields",
            ),
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
        for text in [
            "place_mm,x\n7,a\n8,Stra\u{df}e\n",
            "place_mm,x\r\n7,a\r\n8,Stra\u{df}e\r\n",
            "place_mm,x\r7,a\r8,Stra\u{df}e\r",
        ] {
            let latin: Vec<u8> = text.chars().map(|letter| u32::from(letter) as u8).collect();
            let error = read(latin).unwrap_err();
            assert!(error.starts_with("table.csv, line 3: the byte 0xDF is not UTF-8"), "{error}");
            let wide = |mark: &[u8], bytes: fn(u16) -> [u8; 2]| {
                [mark, &text.encode_utf16().flat_map(bytes).collect::<Vec<_>>()].concat()
            };
            for wide in
                [wide(b"\xFF\xFE", u16::to_le_bytes), wide(b"\xFE\xFF", u16::to_be_bytes), wide(b"", u16::to_le_bytes)]
            {
                let error = read(wide).unwrap_err();
                assert_eq!(error, "table.csv, line 1: the file is saved as UTF-16: save it as CSV in UTF-8");
            }
        }
        assert_eq!(read("place_mm,width_mm,width_mm\n7,1,8\n"), Ok(vec![(2, 7)]), "it is not read");
        assert_eq!(read("place_mm,pot\n7,\"5\"\", clay\"\n8,5\" clay\n"), Ok(vec![(2, 7), (3, 8)]));
    }

    #[test]
    fn a_comma_that_may_be_one_of_thousands_is_refused_unless_another_number_shows_what_it_is() {
        let read = |text: &str| {
            let table = CsvTable::parse(Path::new("table.csv"), text.into(), &["place_mm"]).unwrap();
            let places = table.lines().map(|line| line.value::<f64>("place_mm", "a number"));
            let counts = table.lines().map(|line| line.value::<u16>("count", "a whole number"));
            let values = places.zip(counts).map(|(place, count)| Ok((place?, count?)));
            values.collect::<Result<Vec<_>, FileError>>().map_err(|error| error.to_string())
        };
        for (text, values) in [
            ("place_mm;count\n12,125;1,000\n0,125;2", vec![(12.125, 1), (0.125, 2)]),
            ("place_mm;count\n12,125;1,000\n750;2,0", vec![(12.125, 1), (750.0, 2)]),
            ("place_mm\tcount\n-1200,5\t12,0", vec![(-1200.5, 12)]),
            ("place_mm\tcount\n1.200\t1000", vec![(1.2, 1000)]),
        ] {
            assert_eq!(read(text), Ok(values), "{text:?}");
        }
        for (text, wrong) in [
            ("place_mm\tcount\n750\t1\n1,250\t2", "line 3: place_mm is `1,250`: it has to be a number; its comma"),
            ("place_mm;count\n0.5;1,000", "line 2: count is `1,000`: it has to be a whole number; its comma may be"),
            ("place_mm,count\n\"-1,250\",1", "; its comma may be one of thousands: write the number without it"),
        ] {
            let error = read(text).unwrap_err();
            assert!(error.contains(wrong), "{error}");
        }
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

    /// A table as a spreadsheet may save it: the habits are bits of `habits`.
    fn saved(habits: u32) -> Vec<u8> {
        let has = |habit: u32| habits & (1 << habit) != 0;
        let separator = [",", ";", "\t", ";"][habits as usize & 3];
        let point = if separator == "," { "." } else { "," };
        let width = if has(2) { 6 } else { 3 };
        let blank = separator.repeat(width - 1);
        // Excel looks at the first 16 rows, and pads no further than these need.
        let row = |number: usize, cells: &[&str]| {
            let padded = if has(3) && number > 16 { 3 } else { width };
            cells.join(separator) + &separator.repeat(padded - 3)
        };
        let mut lines = Vec::new();
        if has(4) {
            lines.push(format!("sep={separator}{}", separator.repeat(if separator == "," { 0 } else { 2 })));
        }
        if has(5) {
            lines.push(format!("\"# counted \"\"here\"\"{separator} and there\"{}", separator.repeat(2)));
        }
        if has(6) {
            lines.push(blank.clone());
        }
        lines.push(row(0, &["place_mm", "width_mm", "kind"]));
        for number in 1..=20 {
            let decimals = if has(7) { format!("{point}0") } else { String::new() };
            let quote = if has(8) { "\"" } else { "" };
            let (whole, decimal) = (format!("{number}{decimals}"), format!("{number}{point}25"));
            let [whole, decimal] = [whole, decimal].map(|cell| format!("{quote}{cell}{quote}"));
            lines.push(row(number, &[&whole, &decimal, "plant"]));
            if has(9) && number % 7 == 0 {
                lines.push(blank.clone());
            }
        }
        if has(6) {
            lines.extend(vec![blank; 3]);
        }
        let text = lines.join(if has(10) { "\r\n" } else { "\n" });
        let mark = if has(11) { "\u{feff}" } else { "" };
        format!("{mark}{text}{}", if has(12) { "\n" } else { "" }).into_bytes()
    }

    #[test]
    fn every_mixture_of_a_spreadsheet_s_habits_gives_the_same_table() {
        // A fifth of all mixtures: each two habits meet with and without each other.
        for habits in (0..1 << 13).step_by(5) {
            let text = saved(habits);
            let shown = String::from_utf8_lossy(&text).into_owned();
            let table = CsvTable::parse(Path::new("table.csv"), text, &["place_mm", "width_mm", "kind"]);
            let table = table.unwrap_or_else(|error| panic!("{error}\n{shown}"));
            let values = table.lines().map(|line| {
                let place: i16 = line.value("place_mm", "a whole number")?;
                Ok((place, line.value::<f64>("width_mm", "a number")?, line.text("kind").to_owned()))
            });
            let values: Vec<_> =
                values.collect::<Result<_, FileError>>().unwrap_or_else(|error| panic!("{error}\n{shown}"));
            let expected: Vec<_> = (1..=20).map(|place| (place, f64::from(place) + 0.25, "plant".to_owned())).collect();
            assert_eq!(values, expected, "{shown}");
        }
    }

    #[test]
    fn a_short_line_is_filled_only_where_cells_may_be_empty() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("table.csv");
        fs::write(&path, "place_mm,width_mm\n7\n").unwrap();
        assert!(CsvTable::read(&path, &["place_mm"]).is_err());
        let table = CsvTable::read_with_gaps(&path, &["place_mm"]).unwrap();
        assert_eq!(table.lines().map(|line| line.text("width_mm").to_owned()).collect::<Vec<_>>(), [""]);
    }
}
