//! An example in a search: its distance and its label.
//!
//! A neighbour is one number, with the distance above the complement of the label. So one comparison orders neighbours by distance,
//! and those at the same distance by label, the greatest first.

/// An example in a search: its squared distance, and its label.
///
/// Stored as the bytes of its [`key`](Self::key), lowest first: an 8-bit processor reads a byte faster than a part of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Neighbour([u8; 4]);

impl Neighbour {
    /// No example: farther than any.
    pub const NONE: Self = Self([u8::MAX; 4]);

    /// An example at a squared distance; 24 bits of it are kept.
    #[inline]
    #[must_use]
    pub const fn new(distance: u32, label: u8) -> Self {
        let [low, middle, high, _] = distance.to_le_bytes();
        Self([!label, low, middle, high])
    }

    /// The neighbour with a key.
    #[inline]
    #[must_use]
    pub const fn of_key(key: u32) -> Self {
        Self(key.to_le_bytes())
    }

    /// The distance in the upper 24 bits, the complement of the label in the lower 8. The nearer of two has the smaller key.
    #[inline]
    #[must_use]
    pub const fn key(self) -> u32 {
        u32::from_le_bytes(self.0)
    }

    /// The squared distance.
    #[inline]
    #[must_use]
    pub const fn distance(self) -> u32 {
        self.key() >> 8
    }

    /// The class.
    #[inline]
    #[must_use]
    pub const fn label(self) -> u8 {
        !self.0[0]
    }
}
