//! All texts, packed into one table in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, which has 2 KiB. So the table is in flash, and a [`Text`] is an offset in it. `texts`
//! lists the texts.
//!
//! # How it works
//!
//! A byte of a packed text is a code. The first codes are the characters that occur in texts. Each further code is a fragment: a
//! pair of earlier codes. The compiler finds the fragments: it gives the most frequent pair a code, replaces the pair by this code
//! everywhere, and repeats this while codes are free ([`PACKED`]). So unpacking needs no search. [`Characters`] splits a code until
//! its first half is a character. The second halves wait on a small stack.

use crate::say::texts::{GROUPS, UNPACKED};

/// A text in flash: its offset in the table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Text(u16);

/// Most digits and second halves on the stack during unpacking; a power of two, for short arithmetic.
const WAITING: usize = 16;

/// Digits and sign of the longest number.
const DIGITS: usize = "-2147483648".len();

/// Most steps from a code to its first character.
pub const HALVINGS: usize = 4;

/// Bits of a text's header with its packed length. The other two are its [`mark`], which excludes most words in a search without
/// unpacking them.
const LENGTH: u8 = 0x3F;

/// No code: it ends a text during packing.
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

/// The table: the fragments, the characters, and the texts, each after a byte with its mark and packed length.
struct Packed {
    /// It is longer than needed.
    table: [u8; 4096],
    length: usize,
    /// Offset of the characters.
    letters: usize,
    /// Offsets of the texts, group by group.
    starts: [u16; 1024],
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
                codes[length + at] = code[text[at] as usize];
                at += 1;
            }
            length += text.len() + 1;
            place += 1;
        }
        group += 1;
    }
    // Those of the version, at the end, stay as they are. So all else is the same for each commit.
    let unpacked = UNPACKED.len() + 1;
    // No half of a fragment: a text's end, and a word, which stands between two codes of its line.
    let word = code[b'@' as usize];
    // For each code its halves, the second halves that wait while it is split, the steps to its first character, and whether it may
    // be a first half.
    let (mut halves, mut waiting, mut steps, mut splits) = ([[0; 2]; 256], [0; 256], [0; 256], [true; 256]);
    (splits[END as usize], splits[word as usize]) = (false, false);
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
                if counts[second] > most && second != END as usize && second != word as usize {
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
    let (mut starts, mut number, mut group, mut at) = ([0; 1024], 0, 0, 0);
    while group < GROUPS.len() {
        let mut place = 0;
        while place < GROUPS[group].len() {
            let start = end;
            end += 1;
            while codes[at] != END {
                (table[end], end, at) = (codes[at], end + 1, at + 1);
            }
            assert!(end - start - 1 <= LENGTH as usize, "six bits tell a text's packed length");
            table[start] = mark(GROUPS[group][place].as_bytes()) | (end - start - 1) as u8;
            (starts[number], number, place, at) = (start as u16, number + 1, place + 1, at + 1);
        }
        group += 1;
    }
    Packed { table, length: end, letters, starts }
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

impl Text {
    /// No text, before there is one.
    pub(crate) const NONE: Self = Self(0);

    /// The first text of a group. For the compiler alone: the chip does not have the offsets.
    pub(crate) const fn first_of(group: &[&str]) -> Self {
        let (mut first, mut place) = (0, 0);
        while !is_same_group(GROUPS[place], group) {
            first += GROUPS[place].len();
            place += 1;
        }
        Self(PACKED.starts[first])
    }

    /// A text of the groups. For the compiler alone too.
    pub(crate) const fn of(text: &str) -> Self {
        let (mut number, mut group) = (0, 0);
        loop {
            let mut place = 0;
            while place < GROUPS[group].len() {
                if is_same(GROUPS[group][place], text) {
                    return Self(PACKED.starts[number]);
                }
                (number, place) = (number + 1, place + 1);
            }
            group += 1;
        }
    }

    /// The text this many places after this one.
    #[inline(never)]
    pub(crate) fn after(self, places: u8) -> Self {
        let mut start = self.0;
        for _ in 0..places {
            start += 1 + u16::from(byte(start.into()) & LENGTH);
        }
        Self(start)
    }

    /// The index of `word` among `count` texts from this one on; `count` if it is not among them.
    #[inline(never)]
    pub(crate) fn find(self, count: u8, word: &[u8]) -> u8 {
        if word.is_empty() {
            return count;
        }
        let mark = mark(word);
        let mut text = self;
        let mut characters = Characters::NONE;
        for place in 0..count {
            let header = byte(text.0.into());
            if header & !LENGTH == mark {
                characters.begin(text);
                if word.iter().all(|&character| characters.next() == Some(character)) && characters.next().is_none() {
                    return place;
                }
            }
            // The next text follows directly.
            text.0 += 1 + u16::from(header & LENGTH);
        }
        count
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

const fn is_same(one: &str, other: &str) -> bool {
    let (one, other, mut same) = (one.as_bytes(), other.as_bytes(), 0);
    while same < one.len() && same < other.len() && one[same] == other[same] {
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
    pub(super) next: u16,
    pub(super) left: u8,
    /// A stack of digits and second halves of fragments, last one first; and its depth.
    waiting: [u8; WAITING],
    halves: u8,
}

impl Characters {
    /// No characters.
    pub(crate) const NONE: Self = Self { next: 0, left: 0, waiting: [0; WAITING], halves: 0 };

    /// Starts a text, and drops the rest of another.
    #[inline(never)]
    pub(crate) fn begin(&mut self, text: Text) {
        (self.next, self.left, self.halves) = (text.0 + 1, byte(text.0.into()) & LENGTH, 0);
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
            byte(usize::from(self.next) - 1)
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
    use std::string::String;

    #[test]
    fn every_text_reads_as_it_was_written() {
        for group in GROUPS {
            for (place, written) in (0..).zip(*group) {
                let text = Text::first_of(group).after(place);
                assert_eq!(String::from_utf8(text.bytes().collect()).expect("ASCII"), **written);
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
        for group in GROUPS.iter().filter(|group| group.iter().all(|word| !word.is_empty() && !word.contains(' '))) {
            let first = Text::first_of(group);
            for (place, word) in (0..).zip(*group) {
                assert_eq!(first.find(group.len() as u8, word.as_bytes()), place);
                assert_eq!(first.find(place, word.as_bytes()), place, "the group ends before it");
                for no_word in [&word.as_bytes()[1..], &[word.as_bytes(), b"_"].concat()] {
                    assert_eq!(first.find(group.len() as u8, no_word), group.len() as u8);
                }
            }
        }
    }
}
