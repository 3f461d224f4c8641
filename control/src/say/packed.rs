//! All texts, packed into one table in flash.
//!
//! # How it works
//!
//! An AVR keeps Rust's string literals in SRAM, which has 2 KiB. So the table is in flash, and a [`Text`] is a place in
//! it. `texts` lists the texts in groups, and the table has an index of the groups. In a group, [`Text`] finds a text
//! by the lengths of the texts before it. A text with words is several texts here: its parts before, between and behind
//! the words.
//!
//! A byte of a packed text is a code. The first codes are the characters that occur in texts. Each further code is a
//! fragment: a pair of earlier codes. The compiler finds the fragments (`PACKED`):
//!
//! 1. It gives the most frequent pair a code.
//! 2. It replaces the pair by this code everywhere.
//! 3. It repeats this while codes are free, and a fragment saves more bytes than it takes.
//!
//! So unpacking needs no search. [`Characters`] splits a code until its first half is a character. The second halves
//! wait on a small stack. `HALVINGS` limits the steps of a code, and `WAITING` the stack.
//!
//! # Limits
//!
//! - The compiler refuses a text that is not ASCII. It refuses a part of a text with more than 63 codes.
//! - All texts together have at most 16,000 characters and ends (`LONGEST`).
//! - No fragment comes from the version. So all else is the same for each commit.
//! - Nothing proves that these fragments give the smallest table. A test holds that packing saves at least a third.
//! - Two simulators have printed the console's answers. No real board has.

use crate::say::texts::{GROUPS, NamedText, UNPACKED, WORD, is_same, parts};

/// A text in flash: its group, and its place there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text {
    group: u8,
    place: u8,
}

/// Most digits and second halves on the stack during unpacking; a power of two, for short arithmetic.
const WAITING: usize = 16;

/// Digits and sign of the longest number.
const DIGITS: usize = "-2147483648".len();

/// Most steps from a code to its first character.
pub const HALVINGS: usize = 4;

/// Bits of a text's header with its packed length. The other two are its [`mark`], which excludes most words in a search without
/// unpacking them.
const LENGTH: u8 = 0x3F;

/// No code: during packing it ends a text, or the part of a text before a word.
const END: u8 = u8::MAX;

/// Most characters of all texts together, with an end each. No value for the chip may have 32 KiB, and an
/// array has two bytes for each.
const LONGEST: usize = 16_000;

/// The characters in the texts, and their number. Each is stored as its index here.
const CHARACTERS: ([u8; 128], usize) = {
    let (mut said, mut group) = ([false; 128], 0);
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
    let (mut characters, mut count, mut character) = ([0; 128], 0, 0);
    while character < 128 {
        // Those of numbers and commits, with the `+` of a changed checkout, are always there.
        if said[character as usize] || matches!(character, b'0'..=b'9' | b'a'..=b'f' | b'-' | b'(' | b')' | b'+') {
            (characters[count], count) = (character, count + 1);
        }
        character += 1;
    }
    (characters, count)
};

/// For each character, its code.
const CODES: [u8; 128] = {
    let (characters, mut codes, mut code) = (CHARACTERS.0, [END; 128], 0);
    while code < CHARACTERS.1 {
        codes[characters[code] as usize] = code as u8;
        code += 1;
    }
    codes
};

/// The first code of a fragment.
const FIRST_FRAGMENT: u8 = CHARACTERS.1 as u8;

/// The code of the digit 0. The other digits follow it.
const ZERO: u8 = CODES[b'0' as usize];
const _: () = assert!(CODES[b'9' as usize] == ZERO + 9);

/// The table: the fragments, the characters, the index, and the texts, each after a byte with its mark and packed length.
struct Packed {
    /// It is longer than needed.
    table: [u8; 4096],
    length: usize,
    /// Offsets of the characters and of the index.
    letters: usize,
    index: usize,
}

#[allow(long_running_const_eval, reason = "it packs hundreds of texts, and ends")]
const PACKED: Packed = {
    // The codes of all texts, which become fewer.
    let (code, mut codes, mut length, mut group) = (CODES, [END; LONGEST], 0, 0);
    while group < GROUPS.len() {
        let mut place = 0;
        while place < GROUPS[group].len() {
            assert!(GROUPS[group][place].is_ascii(), "a serial monitor can be trusted with ASCII alone");
            let (text, mut at) = (GROUPS[group][place].as_bytes(), 0);
            while at < text.len() {
                codes[length + at] = if text[at] == WORD { END } else { code[text[at] as usize] };
                at += 1;
            }
            length += text.len() + 1;
            place += 1;
        }
        group += 1;
    }
    // Those of the version, at the end, stay as they are. So all else is the same for each commit.
    let unpacked = UNPACKED.len() + 1;
    // For each code its halves, the second halves that wait while it is split, the steps to its first character, and whether it may
    // be a first half.
    let (mut halves, mut waiting, mut steps, mut splits) = ([[0; 2]; 256], [0; 256], [0; 256], [true; 256]);
    splits[END as usize] = false;
    let mut fragment = FIRST_FRAGMENT as usize;
    while fragment < END as usize {
        // For each code the place behind its first one, and from there to the next: a pair's second code is there.
        let mut next = [0; LONGEST];
        let (mut places, mut at) = ([0; 256], length - unpacked - 1);
        while at > 0 {
            at -= 1;
            let code = codes[at] as usize;
            (next[at], places[code]) = (places[code], at as u16 + 1);
        }
        // The most frequent pair. A fragment takes two bytes, so it has to save three.
        let (mut most, mut pair, mut first) = (2, [END; 2], 0);
        while first < fragment {
            let (mut counts, mut at) = ([0; 256], if splits[first] { places[first] as usize } else { 0 });
            while at > 0 {
                let second = codes[at] as usize;
                counts[second] += 1;
                if counts[second] > most && second != END as usize {
                    (most, pair) = (counts[second], [first as u8, second as u8]);
                }
                at = next[at - 1] as usize;
            }
            first += 1;
        }
        let [first, second] = pair;
        if first == END {
            break;
        }
        halves[fragment] = pair;
        let [waits, also_waits] = [waiting[first as usize] + 1, waiting[second as usize]];
        waiting[fragment] = if waits > also_waits { waits } else { also_waits };
        steps[fragment] = steps[first as usize] + 1;
        splits[fragment] = waiting[fragment] + 1 + DIGITS < WAITING && steps[fragment] < HALVINGS;
        let (mut from, mut to) = (0, 0);
        while from < length {
            let is_pair = from + 1 < length - unpacked && codes[from] == first && codes[from + 1] == second;
            codes[to] = if is_pair { fragment as u8 } else { codes[from] };
            (from, to) = (from + if is_pair { 2 } else { 1 }, to + 1);
        }
        length = to;
        fragment += 1;
    }
    let (mut table, mut end) = ([0; 4096], 0);
    while end < 2 * (fragment - FIRST_FRAGMENT as usize) {
        table[end] = halves[FIRST_FRAGMENT as usize + end / 2][end % 2];
        end += 1;
    }
    let letters = end;
    while end < letters + CHARACTERS.1 {
        table[end] = CHARACTERS.0[end - letters];
        end += 1;
    }
    let index = end;
    end += 2 * GROUPS.len();
    let (mut group, mut at) = (0, 0);
    while group < GROUPS.len() {
        let mut place = 0;
        [table[index + 2 * group], table[index + 2 * group + 1]] = (end as u16).to_le_bytes();
        while place < GROUPS[group].len() {
            let (text, mut to) = (GROUPS[group][place].as_bytes(), 0);
            while to <= text.len() {
                let from = to;
                while to < text.len() && text[to] != WORD {
                    to += 1;
                }
                let start = end;
                end += 1;
                while codes[at] != END {
                    (table[end], end, at) = (codes[at], end + 1, at + 1);
                }
                assert!(end - start - 1 <= LENGTH as usize, "six bits tell a text's packed length");
                table[start] = mark(text.split_at(to).0.split_at(from).1) | (end - start - 1) as u8;
                (at, to) = (at + 1, to + 1);
            }
            place += 1;
        }
        group += 1;
    }
    Packed { table, length: end, letters, index }
};

/// The number of texts in the largest group.
pub const LARGEST_GROUP: usize = {
    let (mut largest, mut group) = (0, 0);
    while group < GROUPS.len() {
        let (mut texts, mut place) = (0, 0);
        while place < GROUPS[group].len() {
            (texts, place) = (texts + parts(GROUPS[group][place]), place + 1);
        }
        (largest, group) = (if texts > largest { texts } else { largest }, group + 1);
    }
    largest
};

/// Two bits that differ between words, above the length's bits.
const fn mark(word: &[u8]) -> u8 {
    match word.last() {
        Some(&last) => last.wrapping_add(word.len() as u8) << LENGTH.count_ones(),
        None => 0,
    }
}

avr_progmem::progmem! {
    static progmem TABLE: [u8; PACKED.length] = {
        let (mut table, mut place) = ([0; PACKED.length], 0);
        while place < table.len() {
            table[place] = PACKED.table[place];
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

impl NamedText {
    /// The same text.
    pub(crate) const fn text(self) -> Text {
        Text::FIRST.after(self.0)
    }
}

impl Text {
    /// The first text of the table.
    pub(crate) const FIRST: Self = Self { group: 0, place: 0 };

    /// The first text of a group.
    pub(crate) const fn first_of(group: &[&str]) -> Self {
        let mut number = 0;
        while !is_same_group(GROUPS[number], group) {
            number += 1;
        }
        assert!(group.len() <= u8::MAX as usize, "a byte is the place in a group");
        Self { group: number as u8, place: 0 }
    }

    /// The text this many places after this one.
    pub(crate) const fn after(self, places: u8) -> Self {
        Self { group: self.group, place: self.place + places }
    }

    /// The index of `word` among `count` texts from this one on; `count` if it is not among them.
    #[inline(never)]
    pub(crate) fn find(self, count: u8, word: &[u8]) -> u8 {
        if word.is_empty() {
            return count;
        }
        let mark = mark(word);
        let mut start = self.start();
        let mut characters = Characters::NONE;
        for place in 0..count {
            let header = byte(start);
            if header & !LENGTH == mark {
                characters.begin_at(start);
                if word.iter().all(|&character| characters.next() == Some(character)) && characters.next().is_none() {
                    return place;
                }
            }
            // The next text follows directly.
            start += 1 + usize::from(header & LENGTH);
        }
        count
    }

    /// Its offset in the table.
    #[inline(never)]
    fn start(self) -> usize {
        let entry = PACKED.index + 2 * usize::from(self.group);
        let mut start = usize::from(u16::from_le_bytes([byte(entry), byte(entry + 1)]));
        for _ in 0..self.place {
            start += 1 + usize::from(byte(start) & LENGTH);
        }
        start
    }

    /// The characters, ASCII.
    pub fn bytes(self) -> Characters {
        let mut characters = Characters::NONE;
        characters.begin(self);
        characters
    }
}

const fn is_same_group(one: &[&str], other: &[&str]) -> bool {
    let mut same = 0;
    while same < one.len() && same < other.len() && is_same(one[same], other[same]) {
        same += 1;
    }
    same == one.len() && same == other.len()
}

/// On the host only, where `core::fmt` has room.
#[cfg(not(target_arch = "avr"))]
impl core::fmt::Display for Text {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        self.bytes().try_for_each(|byte| core::fmt::Write::write_char(f, char::from(byte)))
    }
}

/// The characters of a text that are still to be unpacked.
#[derive(Clone, Debug)]
pub struct Characters {
    /// The next byte's offset, and how many bytes are left.
    next: usize,
    left: u8,
    /// A stack of digits and second halves of fragments, last one first; and its depth.
    waiting: [u8; WAITING],
    halves: u8,
}

impl Characters {
    /// No characters.
    pub(crate) const NONE: Self = Self { next: 0, left: 0, waiting: [0; WAITING], halves: 0 };

    /// Starts a text, and drops the rest of another.
    pub(crate) fn begin(&mut self, text: Text) {
        self.begin_at(text.start());
    }

    /// Starts the text at an offset of the table.
    #[inline(never)]
    fn begin_at(&mut self, start: usize) {
        (self.next, self.left, self.halves) = (start + 1, byte(start) & LENGTH, 0);
    }

    /// Inserts a number before the rest of the text.
    #[inline(never)]
    pub(crate) fn insert(&mut self, number: i32) {
        let mut rest = number.unsigned_abs();
        loop {
            let tenth = tenth(rest);
            // The remainder is below 10, so eight bits of it are enough. The stack reverses the digits.
            self.wait((rest as u8).wrapping_sub((tenth as u8).wrapping_mul(10)) + ZERO);
            rest = tenth;
            if rest == 0 {
                break;
            }
        }
        if number < 0 {
            self.wait(const { CODES[b'-' as usize] });
        }
    }

    #[inline(never)]
    fn wait(&mut self, code: u8) {
        self.waiting[usize::from(self.halves) % WAITING] = code;
        self.halves += 1;
    }
}

/// A tenth, rounded down. A separate function, because the division needs most of the chip's registers.
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
        Some(byte(PACKED.letters + usize::from(code)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        alarm::Alarm,
        say::words::{Argument, Word},
        settings::Setting,
    };
    use std::string::String;

    #[test]
    fn every_text_reads_as_it_was_written() {
        for group in GROUPS {
            let mut text = Text::first_of(group);
            for part in group.iter().flat_map(|text| text.split('@')) {
                assert_eq!(String::from_utf8(text.bytes().collect()).expect("ASCII"), part);
                text = text.after(1);
            }
        }
    }

    #[test]
    fn packing_saves_at_least_a_third() {
        let written: usize = GROUPS.iter().copied().flatten().map(|text| text.len()).sum();
        assert!(3 * TABLE.len() < 2 * written, "{} of {written}", TABLE.len());
    }

    #[test]
    fn only_a_whole_word_of_the_group_is_found() {
        for group in [Setting::WORDS, Word::WORDS, Argument::WORDS, Alarm::WORDS] {
            let first = Text::first_of(group);
            for (place, word) in (0..).zip(group) {
                assert_eq!(first.find(group.len() as u8, word.as_bytes()), place);
                assert_eq!(first.find(place, word.as_bytes()), place, "the group ends before it");
                for no_word in [&word.as_bytes()[1..], &[word.as_bytes(), b"_"].concat()] {
                    assert_eq!(first.find(group.len() as u8, no_word), group.len() as u8);
                }
            }
        }
    }
}
