//! A line that is being sent: its texts, and the numbers and words for each `#` and `@` in them.
//!
//! A line's values are taken at once, so they belong to one moment. It is sent a character at a time, because a turn has little
//! time. Each call unpacks or divides only as far as the next character.

use crate::say::{
    packed::{Characters, Text},
    texts::NamedText,
};
use ufmt::{Formatter, uDisplay, uWrite};

/// Most texts of a line; a setting's line has 16. A power of two, for short arithmetic.
pub const TEXTS: usize = 16;

/// Most numbers of a line; the second line about the status has seven. A power of two too.
const NUMBERS: usize = 8;

/// A line, or the rest of it.
#[derive(Clone, Debug)]
pub struct Line {
    /// The rest of the present text, and of the number in it.
    characters: Characters,
    /// The number of texts and numbers, and how many of each have been started.
    texts: u8,
    texts_begun: u8,
    numbers: u8,
    numbers_begun: u8,
    /// The last text that the code named.
    last: NamedText,
    text: [Text; TEXTS],
    number: [i32; NUMBERS],
}

impl Line {
    /// An empty line.
    pub const fn new() -> Self {
        Self {
            characters: Characters::NONE,
            texts: 0,
            texts_begun: 0,
            numbers: 0,
            numbers_begun: 0,
            last: NamedText::FIRST,
            text: [Text::FIRST; TEXTS],
            number: [0; NUMBERS],
        }
    }

    /// Whether all of it is sent.
    pub fn is_done(&self) -> bool {
        self.texts == 0
    }

    /// Adds a text. In it each `#` stands for the line's next number, and each `@` for the line's next word.
    #[inline(never)]
    pub(crate) fn say(&mut self, text: NamedText) {
        self.last = text;
        self.add(text.text());
    }

    /// Adds a word for an `@`, and the last text's part behind it.
    #[inline(never)]
    pub(crate) fn word(&mut self, word: Text) {
        self.add(word);
        self.say(self.last.next());
    }

    /// Adds a text of any group.
    #[inline(never)]
    pub(crate) fn add(&mut self, text: Text) {
        debug_assert!(usize::from(self.texts) < TEXTS, "a line has {TEXTS} texts at most");
        self.text[usize::from(self.texts) % TEXTS] = text;
        self.texts += 1;
    }

    /// Adds a number for a `#` that is never negative.
    #[inline(never)]
    pub(crate) fn counted(&mut self, number: u16) {
        self.number(number.into());
    }

    /// Adds a number for a `#`.
    #[inline(never)]
    pub(crate) fn number(&mut self, number: i32) {
        debug_assert!(usize::from(self.numbers) < NUMBERS, "a line has {NUMBERS} numbers at most");
        self.number[usize::from(self.numbers) % NUMBERS] = number;
        self.numbers += 1;
    }
}

impl Iterator for Line {
    type Item = u8;

    /// The next character, ASCII. After the last one the line is empty and ready for another.
    #[inline(never)]
    fn next(&mut self) -> Option<u8> {
        loop {
            match self.characters.next() {
                Some(b'#') => {
                    let number = self.number[usize::from(self.numbers_begun) % NUMBERS];
                    self.numbers_begun += 1;
                    self.characters.insert(number);
                    // A number has at least one digit.
                    return self.characters.next();
                }
                Some(character) => return Some(character),
                None if self.texts_begun == self.texts => break,
                None => {
                    let text = self.text[usize::from(self.texts_begun) % TEXTS];
                    self.texts_begun += 1;
                    self.characters.begin(text);
                }
            }
        }
        (self.texts, self.texts_begun, self.numbers, self.numbers_begun) = (0, 0, 0, 0);
        None
    }
}

/// The whole rest of a line, for callers that can wait.
impl uDisplay for Line {
    fn fmt<W: uWrite + ?Sized>(&self, out: &mut Formatter<'_, W>) -> Result<(), W::Error> {
        self.clone().try_for_each(|character| out.write_char(character.into()))
    }
}

impl Default for Line {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{say::texts, settings::Setting};
    use std::string::{String, ToString};

    fn written(mut line: Line) -> String {
        let mut shown = String::new();
        ufmt::uwrite!(&mut shown, "{}", line).expect("a string takes all");
        let written = String::from_utf8(line.by_ref().collect()).expect("ASCII");
        assert_eq!(shown, written);
        assert!(line.is_done());
        written
    }

    #[test]
    fn every_number_is_written_in_decimal() {
        let powers = (0..10).map(|exponent| 10_i32.pow(exponent)).flat_map(|power| [power - 1, power, power + 1]);
        let ends = [i32::MIN, i32::MIN + 1, i32::MAX, 2_000_000_000, 65_535];
        for number in powers.chain(ends).flat_map(|number| [number, number.wrapping_neg()]) {
            let mut line = Line::new();
            line.say(texts::NUMBER);
            line.number(number);
            assert_eq!(written(line), number.to_string());
        }
    }

    #[test]
    fn a_line_replaces_each_hash_by_a_number_and_each_at_by_a_word() {
        let mut line = Line::new();
        line.add(Setting::K.text());
        line.say(texts::RANGE);
        line.say(NamedText::of(texts::LINES[2]));
        line.word(texts::NUMBER.text());
        line.say(texts::END);
        [-1, 20, 7, 8].into_iter().for_each(|number| line.number(number));
        assert!(!line.is_done());
        assert_eq!(texts::LINES[2], "swing tool=@ pos=#");
        assert_eq!(written(line), "k from -1 to 20swing tool=7 pos=8\r\n");
    }

    #[test]
    fn a_written_line_makes_room_for_the_next() {
        let mut line = Line::new();
        for _ in 0..3 {
            (0..TEXTS).for_each(|_| line.say(texts::OK));
            assert_eq!(Iterator::count(line.by_ref()), 2 * TEXTS);
        }
    }
}
