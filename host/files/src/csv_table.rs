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
use std::sync::OnceLock;

/// A table: some lines of text in columns.
pub struct CsvTable {
    path: PathBuf,
    separator: u8,
    header: StringRecord,
    header_line: u64,
    /// Where the columns are that every such table has.
    columns: Vec<usize>,
    lines: Vec<(u64, StringRecord)>,
    /// See [`decimal`](Self::decimal).
    decimal: OnceLock<Option<char>>,
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
        Self::parse_lines(path, bounded_file::bytes(path)?, columns, true, 1)
    }

    /// Reads a file that may have only its header.
    ///
    /// # Errors
    /// As [`read`](Self::read), but a table without lines is none.
    pub fn read_or_empty(path: &Path, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse_lines(path, bounded_file::bytes(path)?, columns, false, 0)
    }

    /// Parses a file's text. The table must have these columns and at least one line below its header.
    ///
    /// Lines `ok` are ignored: the firmware's console ends its answers with it, and tables are pasted from there.
    ///
    /// # Errors
    /// Names the file, the line and what would be right.
    pub fn parse(path: &Path, text: Vec<u8>, columns: &[&str]) -> Result<Self, FileError> {
        Self::parse_lines(path, text, columns, false, 1)
    }

    /// As [`parse`](Self::parse), with `fewest` lines. A line may end before the last column if `may_be_short`.
    fn parse_lines(
        path: &Path,
        text: Vec<u8>,
        columns: &[&str],
        may_be_short: bool,
        fewest: usize,
    ) -> Result<Self, FileError> {
        let at = |line: u64, problem: String| FileError::Line { path: path.into(), line, problem };
        let text = decoded(text).map_err(|(line, problem)| at(line, problem))?;
        // A quotation mark that is open in the last line then has line breaks in its field, as in any other.
        let mut text = text.trim_end().to_owned() + "\n#\n#\n";
        let declared = declared_separator(&text);
        if declared.is_some() {
            // Its line stays, without text, so that lines are counted right.
            text.replace_range(..text.find('\n').unwrap_or_default(), "");
        }
        let separator = declared.unwrap_or_else(|| guessed_separator(&text, columns));
        let first_cells = text.lines().map(|line| line.split(char::from(separator)).next().unwrap_or_default());
        let mut first_cells = (1..).zip(first_cells.map(|cell| cell.trim_matches(['"', ' '])));
        if let Some((line, cell)) = first_cells.find(|(_, cell)| is_failed_formula(cell)) {
            return Err(at(line, format!("the formula of the first cell failed, `{cell}`: enter its value")));
        }

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
            let is_end = record.get(0) == Some("ok") && record.iter().skip(1).all(str::is_empty);
            if is_note || is_end || record.iter().all(str::is_empty) {
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
        if lines.len() < fewest {
            return Err(at(header_line, "no line is below the header: add at least one".to_owned()));
        }
        let columns = columns.iter().filter_map(|column| header.iter().position(|name| name == *column)).collect();
        Ok(Self { path: path.into(), separator, header, header_line, columns, lines, decimal: OnceLock::new() })
    }

    /// Checks the columns that a table may lack. A heading such as `Plot no` may mean `plot`.
    ///
    /// # Errors
    /// Names a heading that may mean a missing column.
    pub fn with_optional(self, columns: &[&str]) -> Result<Self, FileError> {
        /// Endings of a column's name that leave its meaning. `plot_area` is another column.
        const ENDINGS: [&str; 7] = ["", "s", "no", "nr", "num", "number", "id"];
        let is_ending = |rest: &str| ENDINGS.contains(&rest.trim_matches(|letter: char| !letter.is_alphanumeric()));
        for column in columns.iter().filter(|column| !self.header.iter().any(|name| name == **column)) {
            let may_mean = |name: &&str| name.to_lowercase().strip_prefix(*column).is_some_and(is_ending);
            if let Some(near) = self.header.iter().find(may_mean) {
                let problem = format!(
                    "the column `{column}` is missing: did you mean {column} by `{near}`? If not, name it otherwise"
                );
                return Err(FileError::Line { path: self.path, line: self.header_line, problem });
            }
        }
        Ok(self)
    }

    /// The lines below the header. At least one, unless the caller allows none.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        self.lines.iter().map(|(number, record)| Line { table: self, number: *number, record })
    }

    /// The mark that is certainly decimal in some number of the columns that every such table has: comma or point.
    /// `None` if neither is, or both.
    fn decimal(&self) -> Option<char> {
        *self.decimal.get_or_init(|| {
            let cells = self.lines.iter().flat_map(|(_, line)| self.columns.iter().filter_map(move |&at| line.get(at)));
            let marks = cells.filter_map(mark).filter(|(_, may_be_thousands)| !may_be_thousands);
            let mut decimal = marks.map(|(mark, _)| mark);
            let first = decimal.next()?;
            decimal.all(|mark| mark == first).then_some(first)
        })
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

/// Whether a cell is a spreadsheet's answer to a formula that failed, such as `#REF!`. It begins no note. Most end
/// with `!` or `?`. "Not available" may be two initials, such as `#N/A` or `#I/T`, or a word. Other words are notes:
/// `#P7` is a plot that is left out.
fn is_failed_formula(cell: &str) -> bool {
    /// "Not available" in German, Turkish, Hungarian, Slovak and Czech, and a value that is not loaded.
    const WORDS: [&str; 6] = ["NV", "YOK", "HIÁNYZIK", "NEDOSTUPNÝ", "NENÍ_K_DISPOZICI", "GETTING_DATA"];
    let Some(word) = cell.strip_prefix('#') else { return false };
    let is_shouted = !word.contains(|letter: char| letter.is_lowercase() || letter.is_whitespace());
    let is_error = word.ends_with(['!', '?']) && is_shouted && word.contains(char::is_uppercase);
    let letters: Vec<char> = word.chars().collect();
    let is_initials = matches!(letters[..], [one, '/', other] if one.is_uppercase() && other.is_uppercase());
    is_error || is_initials || WORDS.contains(&word)
}

/// The error for a field over several lines: it has a line break, or the lines after an open quotation mark.
const UNCLOSED: &str = "a cell has a line break, or a quotation mark that is not closed: each cell stands on one line";

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
    /// If the text is none. Also if its comma or point may be one of thousands, and no other number shows that it is
    /// decimal. Where commas separate the fields, this holds for the point of a whole number only.
    pub fn value<T: FromStr>(&self, column: &str, right: &str) -> Result<T, FileError> {
        let text = self.text(column);
        let commas_separate = self.table.separator == b',';
        let point = if commas_separate { text.into() } else { with_point(text) };
        let whole =
            || point.split_once('.').filter(|(_, zeros)| zeros.bytes().all(|digit| digit == b'0'))?.0.parse().ok();
        // R writes 100000 as 1e+05.
        let with_exponent = || {
            let value = point.parse::<f64>().ok().filter(|_| point.contains(['e', 'E']))?;
            format!("{value}").parse().ok()
        };
        let unclear =
            mark(text).filter(|(mark, may_be_thousands)| *may_be_thousands && self.table.decimal() != Some(*mark));
        let value = match unclear {
            None => point.parse().ok().or_else(whole).or_else(with_exponent),
            Some(_) if commas_separate => point.parse().ok(),
            Some(_) => None,
        };
        value.ok_or_else(|| {
            let is_whole = "0.5".parse::<T>().is_err();
            let hint = match unclear {
                Some(_) if is_whole => "; its comma or point may be one of thousands: leave it out",
                Some((',', _)) if commas_separate => {
                    "; its comma may be one of thousands: leave it out, or write a point"
                }
                Some((',', _)) => "; its comma may be one of thousands: leave it out, or write four decimals",
                Some(_) => "; its point may be one of thousands: leave it out, or write four decimals",
                None if commas_separate && with_point(text) != text => {
                    "; decimal commas need semicolons or tabs between the fields"
                }
                None => "",
            };
            self.error(format!("{column} is `{text}`: it has to be {right}{hint}"))
        })
    }

    /// The error that this line has a problem.
    pub fn error(&self, problem: impl Into<String>) -> FileError {
        FileError::Line { path: self.table.path.clone(), line: self.number, problem: short(problem.into()) }
    }
}

/// A problem without its middle if it quotes a long cell. The advice at its end stays.
fn short(problem: String) -> String {
    const KEPT: usize = 200;
    let length = problem.chars().count();
    if length <= 2 * KEPT {
        return problem;
    }
    let begin: String = problem.chars().take(KEPT).collect();
    let end: String = problem.chars().skip(length - KEPT).collect();
    format!("{begin} ... {end}")
}

/// A number with a decimal comma, with a point instead; other text as it is.
fn with_point(text: &str) -> Cow<'_, str> {
    if matches!(mark(text), Some((',', _))) { text.replace(',', ".").into() } else { text.into() }
}

/// The comma or point of a number, and whether the number may be from 1,000 to 999,999 and have no decimals.
fn mark(text: &str) -> Option<(char, bool)> {
    let number = text.strip_prefix(['-', '+']).unwrap_or(text);
    let (whole, rest) = number.split_once([',', '.'])?;
    let is_digits = |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_digit());
    let may_be_thousands = whole.len() <= 3 && rest.len() == 3 && !whole.starts_with('0');
    let mark = if number.contains(',') { ',' } else { '.' };
    (is_digits(whole) && is_digits(rest)).then_some((mark, may_be_thousands))
}

#[cfg(test)]
mod tests;
