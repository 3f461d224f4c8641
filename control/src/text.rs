//! Text that lies in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. `text!` lays a literal into flash instead and
//! gives a [`Text`], which is no more than its address and length: all texts share one piece of code that writes them.
//! `list!` lays many literals behind each other, so that a number chooses one, which takes far less code than a match.
//! `words!` makes an enum whose variants are words.
//!
//! What is said is packed: [`FRAGMENTS`] that come again and again are one byte each. The compiler packs, and whoever reads
//! the characters unpacks. Words are not packed, since they are also read.

use avr_progmem::wrapper::ProgMem;

/// Fragments of what is said, each of which stands for itself as a byte from 0x80 on. They are those that save most, found
/// by trying; any others would do.
const FRAGMENTS: &[&str] = &[
    " the ", "s ", ", ", "e ", "t ", "an", "tool", "d ", "setting", "er", "calibrat", "in", "or", "th", "st", "alarm",
    "ou", "exampl", "ee", "ea", "on", "take", "se", "o ", "a ", "el", "mm", "ar", "ch", "ro", "of", "at", "hol",
    " pos=", "ame", "sav", "fir", "objec", "wh", "co", "ac", "es", "no", "pl", "all", "it", "m ", "0 ", "; ", "en",
    "sp", "re", "ed", "d_", "sw", "vo", "lo", "ti", "gr", "y ", "la", "is", "de", "et",
];

avr_progmem::progmem! {
    static progmem FRAGMENT_LIST: [u8; list_length(FRAGMENTS)] = list_bytes(FRAGMENTS);
}

/// The first byte that stands for a fragment.
const FIRST_FRAGMENT: u8 = 0x80;

/// The fragment that a packed byte stands for, if it is not a character.
pub(crate) fn fragment(byte: u8) -> Option<Listed> {
    byte.checked_sub(FIRST_FRAGMENT).map(|place| Listed(List::new(FRAGMENT_LIST.as_slice()), place))
}

/// A text in flash, ASCII.
#[derive(Clone, Copy)]
pub struct Text(ProgMem<[u8]>);

impl Text {
    /// The text whose characters lie in `flash`; made by `text!`.
    pub(crate) const fn new(flash: ProgMem<[u8]>) -> Self {
        Self(flash)
    }

    /// The packed bytes.
    pub(crate) fn packed_bytes(self) -> impl Iterator<Item = u8> {
        self.0.wrapper_iter().map(|byte| byte.load())
    }
}

/// Texts behind each other in flash, each behind a byte with its length; made by `list!`.
#[derive(Clone, Copy)]
pub struct List(ProgMem<[u8]>);

impl List {
    pub(crate) const fn new(flash: ProgMem<[u8]>) -> Self {
        Self(flash)
    }

    /// The place of the text that reads as `word`.
    #[inline(never)]
    pub(crate) fn find(self, word: &[u8]) -> Option<u8> {
        let mut start = 0;
        let mut place = 0;
        while start < self.0.len() {
            let length = usize::from(self.byte(start));
            start += 1;
            if length == word.len() && word.iter().zip(start..).all(|(&character, at)| character == self.byte(at)) {
                return Some(place);
            }
            start += length;
            place += 1;
        }
        None
    }

    /// The packed bytes of the text at a place.
    pub(crate) fn packed_bytes(self, place: u8) -> impl Iterator<Item = u8> {
        let mut start = 0;
        for _ in 0..place {
            start += 1 + usize::from(self.byte(start));
        }
        let end = start + 1 + usize::from(self.byte(start));
        (start + 1..end).map(move |at| self.byte(at))
    }

    #[inline(never)]
    fn byte(self, at: usize) -> u8 {
        self.0.load_at(at)
    }
}

/// The text at a place in a list.
#[derive(Clone, Copy)]
pub struct Listed(pub(crate) List, pub(crate) u8);

impl Listed {
    /// The characters.
    pub fn bytes(self) -> impl Iterator<Item = u8> {
        let Self(list, place) = self;
        list.packed_bytes(place).flat_map(|byte| {
            let literal = fragment(byte).is_none().then_some(byte);
            let fragment = fragment(byte).map(|Self(list, place)| list.packed_bytes(place));
            literal.into_iter().chain(fragment.into_iter().flatten())
        })
    }
}

/// The byte that stands for a literal's characters from `at` on, and how many of them: the longest fragment, or one.
const fn pack(literal: &str, at: usize) -> (u8, usize) {
    let characters = literal.as_bytes();
    let mut packed = (characters[at], 1);
    let mut place = 0;
    while place < FRAGMENTS.len() {
        let fragment = FRAGMENTS[place].as_bytes();
        let mut same = 0;
        while same < fragment.len() && at + same < characters.len() && characters[at + same] == fragment[same] {
            same += 1;
        }
        if same == fragment.len() && same > packed.1 {
            packed = (FIRST_FRAGMENT + place as u8, same);
        }
        place += 1;
    }
    packed
}

/// Bytes that a literal takes when it is packed.
pub(crate) const fn packed_length(literal: &str) -> usize {
    let (mut length, mut at) = (0, 0);
    while at < literal.len() {
        at += pack(literal, at).1;
        length += 1;
    }
    length
}

/// A literal, packed; stops the compiler unless it is ASCII, which is all a serial monitor can be trusted with.
pub(crate) const fn packed<const LENGTH: usize>(literal: &str) -> [u8; LENGTH] {
    assert!(literal.is_ascii());
    let mut bytes = [0; LENGTH];
    let (mut length, mut at) = (0, 0);
    while at < literal.len() {
        let (byte, characters) = pack(literal, at);
        bytes[length] = byte;
        at += characters;
        length += 1;
    }
    bytes
}

/// A literal as a [`Text`].
macro_rules! text {
    ($literal:expr) => {{
        avr_progmem::progmem! {
            static progmem CHARACTERS: [u8; $crate::text::packed_length($literal)] = $crate::text::packed($literal);
        }
        $crate::text::Text::new(CHARACTERS.as_slice())
    }};
}
pub(crate) use text;

/// Bytes that a list of literals takes.
pub(crate) const fn list_length(literals: &[&str]) -> usize {
    let mut length = 0;
    let mut place = 0;
    while place < literals.len() {
        length += 1 + literals[place].len();
        place += 1;
    }
    length
}

/// Literals, each behind its length.
pub(crate) const fn list_bytes<const LENGTH: usize>(literals: &[&str]) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let (mut place, mut start) = (0, 0);
    while place < literals.len() {
        let literal = literals[place];
        assert!(literal.is_ascii() && literal.len() <= u8::MAX as usize);
        bytes[start] = literal.len() as u8;
        let (_, behind) = bytes.split_at_mut(start + 1);
        behind.split_at_mut(literal.len()).0.copy_from_slice(literal.as_bytes());
        start += 1 + literal.len();
        place += 1;
    }
    bytes
}

/// Bytes that a list of literals takes when they are packed.
pub(crate) const fn packed_list_length(literals: &[&str]) -> usize {
    let mut length = 0;
    let mut place = 0;
    while place < literals.len() {
        length += 1 + packed_length(literals[place]);
        place += 1;
    }
    length
}

/// Literals, packed, each behind its length.
pub(crate) const fn packed_list<const LENGTH: usize>(literals: &[&str]) -> [u8; LENGTH] {
    let mut bytes = [0; LENGTH];
    let (mut place, mut length) = (0, 0);
    while place < literals.len() {
        let literal = literals[place];
        assert!(literal.is_ascii());
        bytes[length] = packed_length(literal) as u8;
        length += 1;
        let mut at = 0;
        while at < literal.len() {
            let (byte, characters) = pack(literal, at);
            bytes[length] = byte;
            at += characters;
            length += 1;
        }
        place += 1;
    }
    bytes
}

/// Literals as a [`List`], packed.
macro_rules! list {
    ($($literal:expr),* $(,)?) => {{
        const LITERALS: &[&str] = &[$($literal),*];
        avr_progmem::progmem! {
            static progmem LIST: [u8; $crate::text::packed_list_length(LITERALS)] =
                $crate::text::packed_list(LITERALS);
        }
        $crate::text::List::new(LIST.as_slice())
    }};
}
pub(crate) use list;

/// An enum whose variants are words: `text` writes one, `find` reads one.
macro_rules! words {
    (
        $(#[$enum_doc:meta])*
        $visibility:vis enum $Name:ident {
            $($(#[$doc:meta])* $Variant:ident = $word:literal,)*
        }
    ) => {
        $(#[$enum_doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        $visibility enum $Name {
            $($(#[$doc])* $Variant,)*
        }

        impl $Name {
            /// How many there are.
            pub const COUNT: u8 = [$($word),*].len() as u8;

            /// The one at a place in the order of declaration.
            pub const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $(index if index == Self::$Variant as u8 => Some(Self::$Variant),)*
                    _ => None,
                }
            }

            fn words() -> $crate::text::List {
                const WORDS: &[&str] = &[$($word),*];
                avr_progmem::progmem! {
                    static progmem LIST: [u8; $crate::text::list_length(WORDS)] = $crate::text::list_bytes(WORDS);
                }
                $crate::text::List::new(LIST.as_slice())
            }

            /// The word for it.
            pub fn text(self) -> $crate::text::Listed {
                $crate::text::Listed(Self::words(), self as u8)
            }

            /// The one that `word` stands for.
            pub fn find(word: &[u8]) -> Option<Self> {
                Self::words().find(word).and_then(Self::from_index)
            }
        }
    };
}
pub(crate) use words;

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{string::String, vec::Vec};

    fn read(bytes: impl Iterator<Item = u8>) -> String {
        String::from_utf8(bytes.collect()).expect("ASCII")
    }

    #[test]
    fn what_is_packed_reads_as_it_was_written() {
        let list = list!("", "calibrate the tool", "0123456789_=");
        let said = [0, 1, 2].map(|place| read(Listed(list, place).bytes()));
        assert_eq!(said, ["", "calibrate the tool", "0123456789_="]);
        assert!(packed_length("calibrate the tool") < 9);
    }

    #[test]
    fn every_fragment_reads_as_itself() {
        let fragments = (0..FRAGMENTS.len() as u8).map(|place| fragment(FIRST_FRAGMENT + place).expect("a fragment"));
        let fragments: Vec<String> = fragments.map(|fragment| read(fragment.bytes())).collect();
        assert_eq!(fragments, FRAGMENTS);
    }
}
