//! An object: a stretch of ground that stood in the beam.

use crate::units::{Length, Place};

/// A stretch of ground over which the beam was broken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Object {
    /// Where the beam broke.
    pub leading: Place,
    /// Where the beam cleared, at or ahead of `leading`.
    pub trailing: Place,
    /// Whether its beginning was not seen, so that it may be the rest of something wider.
    pub cut: bool,
}

impl Object {
    /// None.
    pub const NONE: Self = Self { leading: Place::new(0), trailing: Place::new(0), cut: false };

    /// What may stand at a place of which nothing has been seen.
    pub(super) const fn cut_at(place: Place) -> Self {
        Self { leading: place, trailing: place, cut: true }
    }

    /// How far the machine rolled while the beam was broken, the paper's `t S`.
    pub fn width(&self) -> Length {
        self.trailing - self.leading
    }

    /// If it reaches to within a distance of a place, it goes as far as the place.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub(super) fn widen(&mut self, place: Place, within: Length) {
        let (before, behind) = (self.leading - place, place - self.trailing);
        if before > within || behind > within {
            return;
        }
        if before > Length::ZERO {
            self.leading = place;
        }
        if behind > Length::ZERO {
            self.trailing = place;
        }
    }

    /// Whether nothing was there after all.
    pub(super) fn is_nothing(&self) -> bool {
        self.cut && self.leading == self.trailing
    }
}
