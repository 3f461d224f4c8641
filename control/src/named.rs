//! Enums whose variants each have a text on the console.

/// Defines an enum, with a text for each variant. `say::texts` lists the group of texts, and `say::names` reads it from flash.
macro_rules! named {
    ($(#[$about:meta])* $Name:ident { $($(#[$doc:meta])* $Variant:ident = $word:literal,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(u8)]
        pub enum $Name {
            $($(#[$doc])* $Variant,)*
        }

        impl $Name {
            /// The texts, in the order of declaration.
            pub(crate) const WORDS: &[&str] = &[$($word),*];

            /// The number of variants.
            pub const COUNT: u8 = Self::WORDS.len() as u8;

            /// The variant at an index in the order of declaration.
            pub const fn from_index(index: u8) -> Option<Self> {
                match index {
                    $(index if index == Self::$Variant as u8 => Some(Self::$Variant),)*
                    _ => None,
                }
            }
        }
    };
}
pub(crate) use named;
