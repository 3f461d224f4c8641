//! An example in a search: its distance and its label.
//!
//! The label stands below the distance, as its complement. So one comparison orders neighbours by distance, and those at the same
//! distance by label, the greatest first.

/// An example in a search: its squared distance, and its label. The nearer of two is the smaller.
///
/// Two numbers of 16 bits, because an 8-bit processor compares them in half the time of one of 32.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Neighbour {
    /// The upper 16 bits of the distance.
    far: u16,
    /// Its lower 8 bits, and the complement of the label.
    near: u16,
}

impl Neighbour {
    /// No example: farther than any.
    pub const NONE: Self = Self { far: u16::MAX, near: u16::MAX };

    /// A place before a search: zeros, which a `static` holds without a copy in flash.
    pub const VACANT: Self = Self { far: 0, near: 0 };

    /// An example at a squared distance; 24 bits of it are kept.
    #[inline]
    #[must_use]
    pub const fn new(distance: u32, label: u8) -> Self {
        Self::of_parts((distance >> 8) as u16, (distance as u16) << 8 | !label as u16)
    }

    /// The neighbour with these parts: the upper 16 bits of the distance, then its lower 8 bits and the complement of the label.
    #[inline]
    #[must_use]
    pub const fn of_parts(far: u16, near: u16) -> Self {
        Self { far, near }
    }

    /// The parts, see [`of_parts`](Self::of_parts).
    #[inline]
    #[must_use]
    pub const fn parts(self) -> (u16, u16) {
        (self.far, self.near)
    }

    /// The squared distance.
    #[inline]
    #[must_use]
    pub const fn distance(self) -> u32 {
        (self.far as u32) << 8 | (self.near >> 8) as u32
    }

    /// The class.
    #[inline]
    #[must_use]
    pub const fn label(self) -> u8 {
        !self.near as u8
    }
}
