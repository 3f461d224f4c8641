//! A detection: a stretch of ground over which the beam was broken.

use crate::units::{Length, WrappedPosition};

/// A stretch of ground over which the beam was broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Detection {
    /// Where the beam broke.
    pub leading: WrappedPosition,
    /// Where the beam cleared, at or ahead of `leading`.
    pub trailing: WrappedPosition,
    /// Whether the beginning was not seen. The detection may then be the rest of something wider.
    pub cut: bool,
}

impl Detection {
    /// No detection.
    pub const NONE: Self = Self { leading: WrappedPosition::new(0), trailing: WrappedPosition::new(0), cut: false };

    /// A detection whose beginning was seen.
    #[cfg(test)]
    pub(super) const fn whole(leading: i16, trailing: i16) -> Self {
        Self { leading: WrappedPosition::new(leading), trailing: WrappedPosition::new(trailing), cut: false }
    }

    /// An empty detection at the border of unseen ground: a plant there may reach into seen ground.
    pub(super) const fn cut_at(position: WrappedPosition) -> Self {
        Self { leading: position, trailing: position, cut: true }
    }

    /// How far the machine rolled while the beam was broken, the paper's `t S`.
    pub fn width(&self) -> Length {
        self.trailing - self.leading
    }

    /// Whether a cut detection turned out to be empty.
    pub(super) fn is_empty(&self) -> bool {
        self.cut && self.leading == self.trailing
    }
}
