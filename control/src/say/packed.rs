//! All that the machine says, packed into one table in flash, and read from there.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. So the table lies in flash, and a [`Text`] is no more
//! than its number there: one byte. What the table is made of stands in `texts`.
//!
//! The texts are packed: fragments that come again and again are one byte each. A fragment is a pair of bytes, each of
//! which is a character or stands for another fragment, so that nothing is searched where one is unpacked. The compiler
//! packs, and [`Characters`] unpacks. A test finds the fragments (`fragments.rs`).

mod fragments;

use self::fragments::FRAGMENTS;
use crate::say::texts::{COUNT, GROUPS, Text};

/// The characters in the texts, each of which stands for itself as a byte: its place here.
const CHARACTERS: ([u8; 128], usize) = {
    let said = said();
    let (mut characters, mut count, mut character) = ([0; 128], 0, 0);
    while character < said.len() {
        if said[character] {
            (characters[count], count) = (character as u8, count + 1);
        }
        character += 1;
    }
    (characters, count)
};

/// The first byte that stands for a fragment.
const FIRST_FRAGMENT: u8 = CHARACTERS.1 as u8;

/// The byte that stands for the digit 0. The others stand behind it.
const ZERO: u8 = place_of(b'0');
const _: () = assert!(place_of(b'9') == ZERO + 9);

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

/// Where the characters begin in the table, behind the fragments, where the index does, and where the texts do.
const LETTERS: usize = 2 * FRAGMENTS.len();
const INDEX: usize = LETTERS + CHARACTERS.1;
const TEXTS: usize = INDEX + 2 * (COUNT as usize).div_ceil(STRIDE as usize);

/// The table with room behind it, and its length.
#[allow(long_running_const_eval, reason = "it packs hundreds of texts, and ends")]
const PACKED: ([u8; 4096], usize) = table();

avr_progmem::progmem! {
    static progmem TABLE: [u8; PACKED.1] = {
        let (mut table, mut place) = ([0; PACKED.1], 0);
        while place < table.len() {
            table[place] = PACKED.0[place];
            place += 1;
        }
        table
    };
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
            self.wait((rest as u8).wrapping_sub((tenth as u8).wrapping_mul(10)) + ZERO);
            rest = tenth;
            if rest == 0 {
                break;
            }
        }
        if number < 0 {
            self.wait(const { place_of(b'-') });
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
        Some(byte(LETTERS + usize::from(code)))
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
const fn table() -> ([u8; 4096], usize) {
    let mut table = [0; 4096];
    let mut place = 0;
    while place < FRAGMENTS.len() {
        [table[2 * place], table[2 * place + 1]] = split(FRAGMENTS[place].as_bytes());
        place += 1;
    }
    place = 0;
    while place < FRAGMENTS.len() {
        let (waiting, halvings) = depth(FIRST_FRAGMENT + place as u8, &table);
        assert!(waiting + DIGITS < WAITING && halvings <= HALVINGS);
        place += 1;
    }
    let mut character = 0;
    while character < CHARACTERS.1 {
        table[LETTERS + character] = CHARACTERS.0[character];
        character += 1;
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
        best[at] = (place_of(text[at]), 1, best[at + 1].2 + 1);
        let [mut place, behind] = beginning_with(text[at]);
        while place < behind {
            let fragment = FRAGMENTS[place].as_bytes();
            if begins(text, at, fragment) && best[at + fragment.len()].2 + 1 < best[at].2 {
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
        return Some(place_of(*character));
    }
    let [mut place, behind] = beginning_with(part[0]);
    while place < behind {
        if FRAGMENTS[place].len() == part.len() && begins(part, 0, FRAGMENTS[place].as_bytes()) {
            return Some(FIRST_FRAGMENT + place as u8);
        }
        place += 1;
    }
    None
}

/// Second halves that wait at once while a byte is unpacked, and how often it is halved until its first half is a character.
const fn depth(code: u8, table: &[u8]) -> (usize, usize) {
    let Some(fragment) = code.checked_sub(FIRST_FRAGMENT) else { return (0, 0) };
    let pair = 2 * fragment as usize;
    let ((first, halvings), (second, _)) = (depth(table[pair], table), depth(table[pair + 1], table));
    (if first + 1 > second { first + 1 } else { second }, halvings + 1)
}

/// Whether a character is in a text, or in a number, or may be in the commit of a release.
const fn said() -> [bool; 128] {
    let (mut said, mut character) = ([false; 128], 0);
    while character < 128 {
        // Those of every number and of every commit, that of a changed clone too.
        said[character as usize] = matches!(character, b'0'..=b'9' | b'a'..=b'f' | b'-' | b'(' | b')' | b'+');
        character += 1;
    }
    let mut group = 0;
    while group < GROUPS.len() {
        let mut place = 0;
        while place < GROUPS[group].len() {
            let (text, mut at) = (GROUPS[group][place].as_bytes(), 0);
            while at < text.len() {
                said[text[at] as usize] = true;
                at += 1;
            }
            place += 1;
        }
        group += 1;
    }
    said
}

/// For each character, the byte that stands for it.
const PLACES: [u8; 128] = {
    let (mut places, mut place) = ([u8::MAX; 128], 0);
    while place < CHARACTERS.1 {
        places[CHARACTERS.0[place] as usize] = place as u8;
        place += 1;
    }
    places
};

/// The byte that stands for a character.
const fn place_of(character: u8) -> u8 {
    PLACES[character as usize]
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
    assert!(FRAGMENTS.len() + CHARACTERS.1 <= 256 && place == FRAGMENTS.len());
    starts
};

/// Whether a part begins at a place in a text.
const fn begins(text: &[u8], at: usize, part: &[u8]) -> bool {
    let mut same = 0;
    while same < part.len() && at + same < text.len() && text[at + same] == part[same] {
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
