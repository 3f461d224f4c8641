//! All that the machine says, packed into one table in flash, and read from there.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. So the table lies in flash, and a [`Text`] is no more
//! than its number there: one byte. What the table is made of stands in `texts`.
//!
//! The texts are packed: `FRAGMENTS` that come again and again are one byte each. A fragment is a pair of bytes, each of
//! which is a character or stands for another fragment, so that nothing is searched where one is unpacked. The compiler
//! packs, and [`Characters`] unpacks.

use crate::say::texts::{COUNT, GROUPS, Text};

/// Fragments of what is said, sorted, each of which stands for itself as a byte from 0x80 on. They come from joining the most
/// frequent pair again and again; any others would do that can be split into two.
const FRAGMENTS: &[&str] = &[
    " m", " mm", " p", " the ", ", ", "0 ", ":#", "; ", "=#", "=# ", "_m", "_mm", "a ", "ac", "ad", "al", "alar",
    "alarm", "all", "am", "an", "an ", "and ", "ar", "as ", "at ", "be", "beam", "beam_", "br", "cal", "cali",
    "calibr", "calibra", "ch", "ck", "co", "comm", "d ", "de", "e ", "e the ", "ed", "ee", "eed", "el", "en", "enco",
    "encod", "er", "er ", "es ", "ex", "exam", "examp", "example", "fi", "fir", "first", "for", "fr", "ge", "gr",
    "hol", "in", "ing", "is ", "it", "la", "lan", "lant", "le", "lead", "lead_", "li", "lo", "mm", "nam", "nd ", "no",
    "not ", "of", "ok", "ol", "on", "or", "or ", "ou", "out", "ow", "re", "row", "s ", "s, ", "s=# ", "s_", "sa",
    "sav", "se", "ser", "servo", "set", "sett", "setting", "sp", "st", "st ", "sta", "star", "sw", "t ", "ta", "tak",
    "te", "th", "the ", "ti", "tick", "to", "to ", "tool", "tool ", "tu", "ul", "um", "un", "vo", "wh",
];

/// The first byte that stands for a fragment.
const FIRST_FRAGMENT: u8 = 0x80;

/// Characters and second halves of fragments that wait while others are unpacked, at most; a power of two, for short arithmetic.
const WAITING: usize = 16;

/// Of these, the longest number may have so many.
const DIGITS: usize = "-2147483648".len();

/// How often a byte is halved at most until its first half is a character.
pub const HALVINGS: usize = 4;

/// Texts from one entry of the index to the next; from there on, a text is found by the lengths of those before it.
const STRIDE: u8 = 16;

/// The bits of a text's header that tell its packed length. The others are its [`mark`], by which most of the words that are not
/// the one looked for are passed over without being unpacked.
const LENGTH: u8 = 0x3F;

/// Where the index begins in the table, behind the fragments, and where the texts do.
const INDEX: usize = 2 * FRAGMENTS.len();
const TEXTS: usize = INDEX + 2 * (COUNT as usize).div_ceil(STRIDE as usize);

avr_progmem::progmem! {
    static progmem TABLE: [u8; table::<4096>().1] = table().0;
}

/// A byte of the table.
#[inline(never)]
fn byte(place: usize) -> u8 {
    flash::byte(&TABLE, place)
}

impl Text {
    /// The characters, ASCII.
    pub fn bytes(self) -> Characters {
        let mut characters = Characters::NONE;
        characters.begin(self);
        characters
    }
}

/// Which of `count` texts from `first` on reads as `word`; `count` where none does.
#[inline(never)]
pub(crate) fn find(first: Text, count: u8, word: &[u8]) -> u8 {
    if word.is_empty() {
        return count;
    }
    let mark = mark(word);
    let mut start = start(first);
    let mut characters = Characters::NONE;
    for place in 0..count {
        let header = byte(start);
        if header & !LENGTH == mark {
            characters.begin_at(start);
            if word.iter().all(|&character| characters.next() == Some(character)) && characters.next().is_none() {
                return place;
            }
        }
        // The texts lie one behind the other.
        start += 1 + usize::from(header & LENGTH);
    }
    count
}

/// Where a text begins in the table.
#[inline(never)]
fn start(text: Text) -> usize {
    let entry = INDEX + 2 * usize::from(text.number() / STRIDE);
    let mut start = usize::from(u16::from_le_bytes([byte(entry), byte(entry + 1)]));
    for _ in 0..text.number() % STRIDE {
        start += 1 + usize::from(byte(start) & LENGTH);
    }
    start
}

/// Off the chip, where there is room for `core::fmt`.
#[cfg(not(target_arch = "avr"))]
impl core::fmt::Display for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.bytes().try_for_each(|byte| core::fmt::Write::write_char(f, char::from(byte)))
    }
}

/// The characters of a text that are still to be unpacked.
#[derive(Clone, Debug)]
pub struct Characters {
    /// Where the next byte lies, and how many there are.
    next: usize,
    left: u8,
    /// What waits, the last one first: digits, and second halves of fragments; and how many they are.
    waiting: [u8; WAITING],
    halves: u8,
}

impl Characters {
    /// None at all.
    pub(crate) const NONE: Self = Self { next: 0, left: 0, waiting: [0; WAITING], halves: 0 };

    /// Begins a text; what is left of another is dropped.
    pub(crate) fn begin(&mut self, text: Text) {
        self.begin_at(start(text));
    }

    /// Inserts a number before what is left of the text.
    #[inline(never)]
    pub(crate) fn insert(&mut self, number: i32) {
        let mut rest = number.unsigned_abs();
        loop {
            let tenth = tenth(rest);
            // The remainder is less than 10, so that eight bits of it are enough. What waits last comes first.
            self.wait((rest as u8).wrapping_sub((tenth as u8).wrapping_mul(10)) + b'0');
            rest = tenth;
            if rest == 0 {
                break;
            }
        }
        if number < 0 {
            self.wait(b'-');
        }
    }

    #[inline(never)]
    fn wait(&mut self, code: u8) {
        self.waiting[usize::from(self.halves) % WAITING] = code;
        self.halves += 1;
    }

    /// Begins the text at this place in the table.
    #[inline(never)]
    fn begin_at(&mut self, start: usize) {
        (self.next, self.left, self.halves) = (start + 1, byte(start) & LENGTH, 0);
    }
}

/// A tenth, rounded down: in a function of its own, as the division needs most of the chip's registers.
#[inline(never)]
fn tenth(number: u32) -> u32 {
    number / 10
}

impl Iterator for Characters {
    type Item = u8;

    #[inline(never)]
    fn next(&mut self) -> Option<u8> {
        let mut code = if self.halves > 0 {
            self.halves -= 1;
            self.waiting[usize::from(self.halves) % WAITING]
        } else {
            self.left = self.left.checked_sub(1)?;
            self.next += 1;
            byte(self.next - 1)
        };
        while let Some(fragment) = code.checked_sub(FIRST_FRAGMENT) {
            let pair = 2 * usize::from(fragment);
            self.wait(byte(pair + 1));
            code = byte(pair);
        }
        Some(code)
    }
}

/// Two bits that words differ in, at the place that the length leaves.
const fn mark(word: &[u8]) -> u8 {
    match word.last() {
        Some(&last) => last.wrapping_add(word.len() as u8) << LENGTH.count_ones(),
        None => 0,
    }
}

/// The table and its length: the fragments, the index, and the texts, each behind a byte with its mark and packed length.
const fn table<const SIZE: usize>() -> ([u8; SIZE], usize) {
    let mut table = [0; SIZE];
    let mut place = 0;
    while place < FRAGMENTS.len() {
        let [first, second] = split(FRAGMENTS[place].as_bytes());
        (table[2 * place], table[2 * place + 1]) = (first, second);
        assert!(waiting(first) + DIGITS < WAITING && waiting(second) + DIGITS <= WAITING);
        assert!(halvings(first) < HALVINGS);
        place += 1;
    }
    let (mut number, mut end, mut group) = (0, TEXTS, 0);
    while group < GROUPS.len() {
        let mut place = 0;
        while place < GROUPS[group].len() {
            if number % STRIDE as usize == 0 {
                let entry = INDEX + 2 * (number / STRIDE as usize);
                [table[entry], table[entry + 1]] = (end as u16).to_le_bytes();
            }
            let start = end + 1;
            end = pack(GROUPS[group][place], &mut table, start);
            assert!(end - start <= LENGTH as usize, "six bits tell a text's packed length");
            table[start - 1] = mark(GROUPS[group][place].as_bytes()) | (end - start) as u8;
            number += 1;
            place += 1;
        }
        group += 1;
    }
    (table, end)
}

/// Writes a text into the table, in as few bytes as the fragments allow; returns where it ends.
const fn pack(text: &str, table: &mut [u8], mut end: usize) -> usize {
    assert!(text.is_ascii(), "a serial monitor can be trusted with ASCII alone");
    let text = text.as_bytes();
    // From the text's end forward: with which byte the rest of it is shortest, how long that byte reads, and how long the rest is.
    let mut best = [(0, 0, 0); 128];
    let mut at = text.len();
    while at > 0 {
        at -= 1;
        best[at] = (text[at], 1, best[at + 1].2 + 1);
        let [mut place, behind] = beginning_with(text[at]);
        while place < behind {
            let fragment = FRAGMENTS[place].as_bytes();
            if begins(text.split_at(at).1, fragment) && best[at + fragment.len()].2 + 1 < best[at].2 {
                best[at] = (FIRST_FRAGMENT + place as u8, fragment.len(), best[at + fragment.len()].2 + 1);
            }
            place += 1;
        }
    }
    while at < text.len() {
        table[end] = best[at].0;
        at += best[at].1;
        end += 1;
    }
    end
}

/// The two bytes that a fragment stands for.
const fn split(fragment: &[u8]) -> [u8; 2] {
    let mut at = 1;
    while at < fragment.len() {
        let (first, second) = fragment.split_at(at);
        if let (Some(first), Some(second)) = (code(first), code(second)) {
            return [first, second];
        }
        at += 1;
    }
    panic!("a fragment consists of two characters or other fragments");
}

/// The byte that stands for a part of a text, if one does.
const fn code(part: &[u8]) -> Option<u8> {
    if let [character] = part {
        return Some(*character);
    }
    let [mut place, behind] = beginning_with(part[0]);
    while place < behind {
        if FRAGMENTS[place].len() == part.len() && begins(part, FRAGMENTS[place].as_bytes()) {
            return Some(FIRST_FRAGMENT + place as u8);
        }
        place += 1;
    }
    None
}

/// Second halves that wait at once while a byte is unpacked.
const fn waiting(code: u8) -> usize {
    if code < FIRST_FRAGMENT {
        return 0;
    }
    let [first, second] = split(FRAGMENTS[(code - FIRST_FRAGMENT) as usize].as_bytes());
    let (first, second) = (waiting(first) + 1, waiting(second));
    if first > second { first } else { second }
}

/// How often a byte is halved until its first half is a character.
const fn halvings(code: u8) -> usize {
    if code < FIRST_FRAGMENT {
        return 0;
    }
    let [first, _] = split(FRAGMENTS[(code - FIRST_FRAGMENT) as usize].as_bytes());
    1 + halvings(first)
}

/// Where the fragments stand that begin with a character: the first one's place, and the place behind the last one.
const fn beginning_with(character: u8) -> [usize; 2] {
    [STARTS[character as usize], STARTS[character as usize + 1]]
}

/// For each character, how many fragments begin with one before it.
const STARTS: [usize; 129] = {
    let mut starts = [0; 129];
    let (mut character, mut place) = (0, 0);
    while character < starts.len() {
        while place < FRAGMENTS.len() && (FRAGMENTS[place].as_bytes()[0] as usize) < character {
            place += 1;
        }
        starts[character] = place;
        character += 1;
    }
    assert!(FRAGMENTS.len() <= 128 && place == FRAGMENTS.len());
    starts
};

const fn begins(text: &[u8], part: &[u8]) -> bool {
    let mut same = 0;
    while same < part.len() && same < text.len() && text[same] == part[same] {
        same += 1;
    }
    same == part.len()
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::string::String;

    #[test]
    fn every_text_reads_as_it_was_written() {
        let mut text = Text::FIRST;
        for written in GROUPS.iter().copied().flatten() {
            assert_eq!(String::from_utf8(text.bytes().collect()).expect("ASCII"), **written);
            text = text.plus(1);
        }
        assert_eq!(text.number(), COUNT);
    }

    #[test]
    fn texts_are_packed_to_two_thirds_at_most() {
        let written: usize = GROUPS.iter().copied().flatten().map(|text| text.len()).sum();
        assert!(3 * TABLE.len() < 2 * written, "{} of {written}", TABLE.len());
    }

    #[test]
    fn a_word_is_found_among_its_own_group_and_as_a_whole_only() {
        let group = GROUPS.last().expect("there are groups");
        let first = Text::first_of(group);
        for (place, word) in (0..).zip(*group) {
            assert_eq!(find(first, group.len() as u8, word.as_bytes()), place);
            assert_eq!(find(first, place, word.as_bytes()), place, "the group ends before it");
            for no_word in [&word.as_bytes()[1..], &[word.as_bytes(), b"_"].concat()] {
                assert_eq!(find(first, group.len() as u8, no_word), group.len() as u8);
            }
        }
    }
}
