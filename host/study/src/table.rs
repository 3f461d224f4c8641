//! The tables of reports, for the page and for a terminal, and how numbers read in them.

use std::fmt::{self, Display, Formatter};
use std::ops::Range;
use uno_run::report::number_table;

/// A table whose first column names its rows.
#[derive(Clone, Debug)]
pub struct Table {
    /// The caption.
    pub caption: String,
    /// The heading of each column.
    pub columns: Vec<String>,
    /// The rows, with a cell a column.
    pub rows: Vec<Vec<String>>,
    /// Whether its cells are text, which is aligned left.
    pub is_prose: bool,
}

impl Table {
    /// A table of numbers.
    pub fn new(caption: impl Into<String>, columns: impl IntoIterator<Item = impl Into<String>>) -> Self {
        let columns = columns.into_iter().map(Into::into).collect();
        Self { caption: caption.into(), columns, rows: Vec::new(), is_prose: false }
    }

    /// The same table without these columns.
    pub fn without(mut self, columns: Range<usize>) -> Self {
        for cells in self.rows.iter_mut().chain([&mut self.columns]) {
            cells.drain(columns.clone());
        }
        self
    }
}

impl Display for Table {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let mut table = number_table(self.columns.iter().map(|heading| in_two_lines(heading)), 1);
        table.add_rows(&self.rows);
        write!(f, "{}\n{table}", self.caption)
    }
}

/// A heading, broken at the blank nearest to its middle.
pub fn in_two_lines(heading: &str) -> String {
    let off_middle = |(at, _): &(usize, &str)| at.abs_diff(heading.len() / 2);
    let at = heading.match_indices(' ').min_by_key(off_middle).map_or(heading.len(), |(at, _)| at);
    format!("{}\n{}", &heading[..at], heading[at..].trim_start())
}

/// The values in ascending order, each once.
pub fn distinct(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// Numbers as in a sentence: `1, 1.5 and 2`.
pub(crate) fn list(numbers: &[f64]) -> String {
    let words: Vec<String> = numbers.iter().map(f64::to_string).collect();
    in_words(&words)
}

/// Words as in a sentence.
pub(crate) fn in_words(words: &[String]) -> String {
    match words {
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        words => words.concat(),
    }
}

/// The text of a missing number.
pub const NOTHING: &str = "\u{2013}";

/// A number with `decimals` decimal places. It has a typographic minus, and never `-0`.
pub fn fixed(value: f64, decimals: usize) -> String {
    let digits = format!("{:.decimals$}", value.abs());
    let is_zero = digits.bytes().all(|digit| matches!(digit, b'0' | b'.'));
    if value < 0.0 && !is_zero { format!("\u{2212}{digits}") } else { digits }
}

/// Smaller numbers are rounding errors of 0.
const ROUNDING: f64 = 1e-12;

/// A number with `decimals` decimal places; a small one with two significant digits. Only a rounding error reads as 0.
pub fn visible(value: f64, decimals: usize) -> String {
    let places = if value.abs() < ROUNDING { 0.0 } else { 1.0 - value.abs().log10().floor() };
    let reads_as_0 = value.abs() < 0.5 * 0.1_f64.powi(decimals as i32);
    fixed(value, if reads_as_0 { decimals.max(places as usize) } else { decimals })
}

/// A number with at most six decimal places, without trailing zeros.
pub fn short(value: f64) -> String {
    let digits = fixed(value, 6);
    digits.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// A number with four significant digits, or more before the point. From 0.00001 on it has at most five decimal places. A
/// rounding error of zero reads as 0.
pub fn significant(value: f64) -> String {
    const DIGITS: f64 = 4.0;
    const DECIMALS: f64 = 5.0;
    if value.abs() < ROUNDING {
        return "0".to_owned();
    }
    let places = (DIGITS - 1.0 - value.abs().log10().floor()).max(0.0);
    fixed(value, if value.abs() < 0.1_f64.powf(DECIMALS) { places } else { places.min(DECIMALS) } as usize)
}

/// A p-value. Values below a thousandth are shown as such.
pub fn probability(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { fixed(p, 3) }
}

/// A number that may be missing.
pub fn optional(value: Option<f64>, said: impl Fn(f64) -> String) -> String {
    value.map_or_else(|| NOTHING.to_owned(), said)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_as_in_print() {
        assert_eq!(fixed(-1.255, 1), "\u{2212}1.3");
        assert_eq!(fixed(-0.01, 1), "0.0");
        assert_eq!(short(0.1 + 0.2), "0.3");
        assert_eq!(short(-2.0), "\u{2212}2");
        assert_eq!(short(120.0), "120");
        assert_eq!(significant(0.012_345_6), "0.01235");
        assert_eq!(significant(12_345.6), "12346");
        assert_eq!(significant(-0.000_000_123_456), "\u{2212}0.0000001235");
        assert_eq!(significant(-1e-17), "0");
        assert_eq!(probability(0.000_4), "< 0.001");
        assert_eq!(optional(None, short), NOTHING);
        let small = [(0.0, 1), (1e-15, 1), (0.06, 1), (0.0219, 1), (0.004, 2), (0.006, 2), (4.56e-8, 1)];
        let shown = small.map(|(value, decimals)| visible(value, decimals));
        assert_eq!(shown, ["0.0", "0.0", "0.1", "0.022", "0.0040", "0.01", "0.000000046"]);
    }
}
