//! Splits bytes into lines. Any bytes are accepted.
//!
//! A line ends with CR, LF or both, or when it is longer than any line of the firmware. Every byte that is not
//! printable ASCII becomes [`STRANGE`]. So noise can be shown, and cannot move a terminal's cursor.

use std::collections::VecDeque;

/// Replaces a byte that is no printable character.
pub(super) const STRANGE: char = '\u{FFFD}';

/// The longest line in bytes. The firmware's own lines are shorter than 128.
const LIMIT: usize = 256;

/// Most lines that wait to be taken. A further line drops the oldest.
const WAITING: usize = 1024;

/// Collects bytes to lines.
#[derive(Clone, Debug, Default)]
pub struct LineReader {
    partial: String,
    complete: VecDeque<String>,
}

impl LineReader {
    /// Takes bytes as they come.
    pub fn take(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            match byte {
                b'\r' | b'\n' => self.end(),
                b'\t' => self.push(' '),
                b' '..=b'~' => self.push(char::from(byte)),
                _ => self.push(STRANGE),
            }
        }
    }

    /// The oldest complete line that was not taken yet, without its line end. Empty lines are dropped.
    pub fn next_line(&mut self) -> Option<String> {
        self.complete.pop_front()
    }

    /// The line that is not complete yet.
    pub fn partial(&self) -> &str {
        &self.partial
    }

    fn push(&mut self, character: char) {
        self.partial.push(character);
        if self.partial.len() >= LIMIT {
            self.end();
        }
    }

    fn end(&mut self) {
        let line = std::mem::take(&mut self.partial);
        if line.is_empty() {
            return;
        }
        if self.complete.len() == WAITING {
            self.complete.pop_front();
        }
        self.complete.push_back(line);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(bytes: &[u8]) -> Vec<String> {
        let mut reader = LineReader::default();
        reader.take(bytes);
        std::iter::from_fn(|| reader.next_line()).collect()
    }

    #[test]
    fn lines_end_by_carriage_return_line_feed_or_both() {
        assert_eq!(lines(b"one\rtwo\nthree\r\n\r\nfour"), ["one", "two", "three"]);
    }

    #[test]
    fn a_line_that_comes_in_pieces_is_one_line() {
        let mut reader = LineReader::default();
        reader.take(b"swing tool=");
        assert_eq!((reader.next_line(), reader.partial()), (None, "swing tool="));
        reader.take(b"out pos=7\r");
        assert_eq!(reader.next_line().as_deref(), Some("swing tool=out pos=7"));
    }

    #[test]
    fn bytes_that_are_no_text_cannot_reach_the_terminal() {
        assert_eq!(lines(b"a\x1B[2J\xFF\0b\tc\n"), ["a\u{FFFD}[2J\u{FFFD}\u{FFFD}b c"]);
    }

    #[test]
    fn a_line_without_an_end_is_cut_and_the_buffer_is_bounded() {
        let mut reader = LineReader::default();
        for _ in 0..10_000 {
            reader.take(&[b'x'; 1000]);
        }
        let kept: usize = std::iter::from_fn(|| reader.next_line()).map(|line| line.len()).sum();
        assert_eq!(kept, LIMIT * WAITING);
        assert!(reader.partial().len() < LIMIT);
    }
}
