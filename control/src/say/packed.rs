//! All texts, packed into one table in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, which has 2 KiB. So the table is in flash, and a [`Text`] is one byte: its number
//! in the table. `texts` defines the texts.
//!
//! Frequent fragments take one byte each. A fragment is a pair of bytes, each a character or another fragment. So unpacking needs
//! no search. The compiler packs, and [`Characters`] unpacks. A test finds the fragments (`fragments.rs`).

mod fragments;

use self::fragments::FRAGMENTS;
use crate::say::texts::{COUNT, GROUPS, Text, begins};

/// The characters in the texts. Each is stored as its index here.
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

/// The first byte that is a fragment.
const FIRST_FRAGMENT: u8 = CHARACTERS.1 as u8;

/// The byte for the digit 0. The other digits follow it.
const ZERO: u8 = place_of(b'0');
const _: () = assert!(place_of(b'9') == ZERO + 9);

/// Most digits and second halves of fragments on the stack during unpacking; a power of two, for short arithmetic.
const WAITING: usize = 16;

/// Digits and sign of the longest number.
const DIGITS: usize = "-2147483648".len();

/// Most steps from a byte to its first character.
pub const HALVINGS: usize = 4;

/// Texts for each entry of the index. From an entry on, a text is found by the lengths of those before it.
const STRIDE: u16 = 16;

/// Bits of a text's header with its packed length. The other two are its [`mark`], which excludes most words in a search without
/// unpacking them.
const LENGTH: u8 = 0x3F;

/// Table offsets: the characters after the fragments, then the index, then the texts.
const LETTERS: usize = 2 * FRAGMENTS.len();
const INDEX: usize = LETTERS + CHARACTERS.1;
const TEXTS: usize = INDEX + 2 * (COUNT as usize).div_ceil(STRIDE as usize);

/// The table in a larger array, and its length.
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

/// The index of `word` among `count` texts from `first` on; `count` if it is not among them.
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
        // The next text follows directly.
        start += 1 + usize::from(header & LENGTH);
    }
    count
}

/// A text's offset in the table.
#[inline(never)]
fn start(text: Text) -> usize {
    let entry = INDEX + 2 * usize::from(text.number() / STRIDE);
    let mut start = usize::from(u16::from_le_bytes([byte(entry), byte(entry + 1)]));
    for _ in 0..text.number() % STRIDE {
        start += 1 + usize::from(byte(start) & LENGTH);
    }
    start
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
        self.begin_at(start(text));
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
            self.wait(const { place_of(b'-') });
        }
    }

    #[inline(never)]
    fn wait(&mut self, code: u8) {
        self.waiting[usize::from(self.halves) % WAITING] = code;
        self.halves += 1;
    }

    /// Starts the text at an offset of the table.
    #[inline(never)]
    fn begin_at(&mut self, start: usize) {
        (self.next, self.left, self.halves) = (start + 1, byte(start) & LENGTH, 0);
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
        Some(byte(LETTERS + usize::from(code)))
    }
}

/// Two bits that differ between words, above the length's bits.
const fn mark(word: &[u8]) -> u8 {
    match word.last() {
        Some(&last) => last.wrapping_add(word.len() as u8) << LENGTH.count_ones(),
        None => 0,
    }
}

/// The table and its length: fragments, characters, index, and the texts, each after a byte with its mark and packed length.
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

/// Writes a text into the table in the fewest bytes. Returns its end.
const fn pack(text: &str, table: &mut [u8], mut end: usize) -> usize {
    assert!(text.is_ascii(), "a serial monitor can be trusted with ASCII alone");
    let text = text.as_bytes();
    // From the end backwards: the byte that makes the rest shortest, the characters that this byte stands for, and the rest's
    // length.
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

/// The two bytes of a fragment.
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

/// The byte for a part of a text, if there is one.
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

/// Second halves on the stack while a byte is unpacked, and the steps to its first character.
const fn depth(code: u8, table: &[u8]) -> (usize, usize) {
    let Some(fragment) = code.checked_sub(FIRST_FRAGMENT) else { return (0, 0) };
    let pair = 2 * fragment as usize;
    let ((first, halvings), (second, _)) = (depth(table[pair], table), depth(table[pair + 1], table));
    (if first + 1 > second { first + 1 } else { second }, halvings + 1)
}

/// Which characters are in a text, in a number, or in the commit of a release.
const fn said() -> [bool; 128] {
    let (mut said, mut character) = ([false; 128], 0);
    while character < 128 {
        // Those of numbers and commits, with the `+` of a changed checkout.
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

/// For each character, its byte.
const PLACES: [u8; 128] = {
    let (mut places, mut place) = ([u8::MAX; 128], 0);
    while place < CHARACTERS.1 {
        places[CHARACTERS.0[place] as usize] = place as u8;
        place += 1;
    }
    places
};

/// A character's byte.
const fn place_of(character: u8) -> u8 {
    PLACES[character as usize]
}

/// The fragments that begin with a character: the first index, and the index after the last.
const fn beginning_with(character: u8) -> [usize; 2] {
    [STARTS[character as usize], STARTS[character as usize + 1]]
}

/// For each character, the number of fragments that begin with an earlier one.
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

#[cfg(test)]
mod tests {
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
    fn packing_saves_at_least_a_third() {
        let written: usize = GROUPS.iter().copied().flatten().map(|text| text.len()).sum();
        assert!(3 * TABLE.len() < 2 * written, "{} of {written}", TABLE.len());
    }

    #[test]
    fn only_a_whole_word_of_the_group_is_found() {
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
