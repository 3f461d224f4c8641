//! Text that lies in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. [`text!`] lays a literal into flash instead and
//! gives a [`Text`], which is no more than its address and length: all texts share one piece of code that writes them.
//! [`words!`] makes an enum whose variants are words.

use avr_progmem::wrapper::ProgMem;

/// A text in flash, ASCII.
#[derive(Clone, Copy)]
pub struct Text(ProgMem<[u8]>);

impl Text {
    /// The text whose characters lie in `flash`; made by [`text!`].
    pub(crate) const fn new(flash: ProgMem<[u8]>) -> Self {
        Self(flash)
    }

    /// The characters.
    pub fn bytes(self) -> impl Iterator<Item = u8> {
        self.0.wrapper_iter().map(|byte| byte.load())
    }

    /// Whether the text reads as `word`.
    #[inline(never)]
    pub fn is(self, word: &[u8]) -> bool {
        self.bytes().eq(word.iter().copied())
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

            /// The word for it.
            #[inline(never)]
            pub fn text(self) -> $crate::text::Text {
                match self {
                    $(Self::$Variant => $crate::text::text!($word),)*
                }
            }

            /// The one that `word` stands for.
            pub fn find(word: &[u8]) -> Option<Self> {
                (0..Self::COUNT).filter_map(Self::from_index).find(|candidate| candidate.text().is(word))
            }
        }
    };
}
pub(crate) use words;
