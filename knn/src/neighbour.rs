//! An example in a search: its distance and its label.
//!
//! A neighbour is one number, with the distance above the label. So a comparison compares distances first, then labels.

/// An example in a search: its squared distance, and its label.
///
/// Stored as the bytes of its [`key`](Self::key), the label first: an 8-bit processor reads a byte faster than a part of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Neighbour([u8; 4]);

impl Neighbour {
    /// A placeholder.
    pub const NONE: Self = Self::new(0, 0);

    /// An example at a squared distance; 24 bits of it are kept.
    #[inline]
    #[must_use]
    pub const fn new(distance: u32, label: u8) -> Self {
        let [low, middle, high, _] = distance.to_le_bytes();
        Self([label, low, middle, high])
    }

    /// The distance in the upper 24 bits, the label in the lower 8.
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
        self.0[0]
    }

    /// Whether both are at the same distance.
    #[inline(always)]
    pub(crate) const fn is_as_far_as(&self, other: &Self) -> bool {
        self.0[1] == other.0[1] && self.0[2] == other.0[2] && self.0[3] == other.0[3]
    }
}
