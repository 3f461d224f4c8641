//! Text that lies in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. `text!` lays a literal into flash instead and
//! gives a [`Text`], which is no more than its address and length: all texts share one piece of code that writes them.
//! `list!` lays many literals behind each other, so that a number chooses one, which takes far less code than a match.
//! `words!` makes an enum whose variants are words.

use avr_progmem::wrapper::ProgMem;

/// A text in flash, ASCII.
#[derive(Clone, Copy)]
pub struct Text(ProgMem<[u8]>);

impl Text {
    /// The text whose characters lie in `flash`; made by `text!`.
    pub(crate) const fn new(flash: ProgMem<[u8]>) -> Self {
        Self(flash)
    }

    /// The characters.
    pub fn bytes(self) -> impl Iterator<Item = u8> {
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

    /// The characters of the text at a place.
    pub fn bytes(self, place: u8) -> impl Iterator<Item = u8> {
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
        list.bytes(place)
    }
}

/// A literal's characters; stops the compiler unless they are ASCII, which is all a serial monitor can be trusted with.
pub(crate) const fn ascii<const LENGTH: usize>(literal: &str) -> [u8; LENGTH] {
    assert!(literal.is_ascii());
    let mut bytes = [0; LENGTH];
    bytes.copy_from_slice(literal.as_bytes());
    bytes
}

/// A literal as a [`Text`].
macro_rules! text {
    ($literal:expr) => {{
        avr_progmem::progmem! {
            static progmem CHARACTERS: [u8; $literal.len()] = $crate::text::ascii($literal);
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

/// Literals as a [`List`].
macro_rules! list {
    ($($literal:expr),* $(,)?) => {{
        const LITERALS: &[&str] = &[$($literal),*];
        avr_progmem::progmem! {
            static progmem LIST: [u8; $crate::text::list_length(LITERALS)] = $crate::text::list_bytes(LITERALS);
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
                $crate::text::list!($($word),*)
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
