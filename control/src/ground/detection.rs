//! A detection: a stretch of ground that stood in the beam.

use crate::units::{Length, WrappedPosition};

/// A stretch of ground over which the beam was broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Detection {
    /// Where the beam broke.
    pub leading: WrappedPosition,
    /// Where the beam cleared, at or ahead of `leading`.
    pub trailing: WrappedPosition,
    /// Whether its beginning was not seen, so that it may be the rest of something wider.
    pub cut: bool,
}

impl Detection {
    /// None.
    pub const NONE: Self = Self { leading: WrappedPosition::new(0), trailing: WrappedPosition::new(0), cut: false };

    /// What may stand at a place of which nothing has been seen.
    pub(super) const fn cut_at(place: WrappedPosition) -> Self {
        Self { leading: place, trailing: place, cut: true }
    }

    /// How far the machine rolled while the beam was broken, the paper's `t S`.
    pub fn width(&self) -> Length {
        self.trailing - self.leading
    }

    /// Whether nothing was there after all.
    pub(super) fn is_nothing(&self) -> bool {
        self.cut && self.leading == self.trailing
    }
}

/// An end of what the second beam sees.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It may be a leaf's.
    None,
    /// Where it begins.
    Leading,
    /// Where it ends, as far as has been seen.
    Trailing,
}
