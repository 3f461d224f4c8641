//! Text that lies in flash.
//!
//! An AVR keeps Rust's string literals in SRAM, of which there are 2 KiB. Names and help therefore stand in tables of
//! fixed-width [`Text`]s behind `avr_progmem`, from which one entry at a time is copied to the stack. [`words!`] makes
//! such a table together with the enum that it names.

use ufmt::{Formatter, uDisplay, uWrite};

/// At most `WIDTH` ASCII characters, padded with zeros.
#[derive(Clone, Copy)]
pub struct Text<const WIDTH: usize>([u8; WIDTH]);

impl<const WIDTH: usize> Text<WIDTH> {
    /// The text, at compile time.
    ///
    /// # Panics
    /// When it does not fit or is not ASCII, which in a constant stops the compiler.
    pub const fn new(text: &str) -> Self {
        let bytes = text.as_bytes();
        assert!(bytes.len() <= WIDTH, "this text is longer than its table is wide");
        let mut padded = [0; WIDTH];
        let mut index = 0;
        while index < bytes.len() {
            assert!(
                bytes[index].is_ascii(),
                "a serial monitor can only be trusted with ASCII"
            );
            padded[index] = bytes[index];
            index += 1;
        }
        Self(padded)
    }

    /// The characters, without the padding.
    pub fn bytes(&self) -> impl Iterator<Item = u8> + '_ {
        self.0.iter().copied().take_while(|&byte| byte != 0)
    }

    /// Whether the text reads as `word`.
    pub fn is(&self, word: &[u8]) -> bool {
        self.bytes().eq(word.iter().copied())
    }
}

impl<const WIDTH: usize> uDisplay for Text<WIDTH> {
    fn fmt<W: uWrite + ?Sized>(&self, f: &mut Formatter<'_, W>) -> Result<(), W::Error> {
        self.bytes().try_for_each(|byte| f.write_char(char::from(byte)))
    }
}

/// An enum whose variants are words, with the words in flash: `text` writes one, `find` reads one.
macro_rules! words {
    (
        $(#[$enum_doc:meta])*
        $visibility:vis enum $Name:ident, $TABLE:ident: $width:literal {
            $($(#[$doc:meta])* $Variant:ident = $word:literal,)*
        }
    ) => {
        $(#[$enum_doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        $visibility enum $Name {
            $($(#[$doc])* $Variant,)*
        }

        avr_progmem::progmem! {
            static progmem $TABLE: [$crate::text::Text<$width>; [$($word),*].len()] =
                [$($crate::text::Text::new($word)),*];
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
            pub fn text(self) -> $crate::text::Text<$width> {
                $TABLE.load_at(self as usize)
            }

            /// The one that `word` stands for.
            pub fn find(word: &[u8]) -> Option<Self> {
                (0..Self::COUNT).filter_map(Self::from_index).find(|candidate| candidate.text().is(word))
            }
        }
    };
}
pub(crate) use words;
