//! Expected plants: guards the ground where a plant is due at the planting distance, if the beam has seen none.
//!
//! The last plant's middle plus the spacing gives the next expected middle, within the crop's scatter. A kept detection within that
//! stretch is the expected plant, and the count continues from it. A kept detection outside, such as a double or a weed like a
//! plant, changes nothing. Once the beam has passed the whole stretch, the stretch becomes a keep-out zone for good. After
//! `IN_A_ROW` of these the row has ended, and no plant is expected until the beam sees one.
//!
//! What it does not do: tell a missed plant from a gap. Gaps are guarded too, and weeds in them stay.

use super::{detection::Detection, keep_out::Canopy, reach::Geometry};
use crate::units::{Length, WrappedPosition};

/// Consecutive missed plants. If the next does not come either, the row has ended.
const IN_A_ROW: u8 = 3;

/// Where the next plant is expected.
#[derive(Clone, Debug)]
pub struct Guard {
    /// The middle of the expected plant.
    due: WrappedPosition,
    /// Plants still expected, this one included; 0 if no position is known.
    left: u8,
}

impl Guard {
    /// No plant is expected.
    pub const NONE: Self = Self { due: WrappedPosition::new(0), left: 0 };

    /// Takes a kept detection.
    pub fn see(&mut self, plant: &Detection, geometry: &Geometry) {
        let (spacing, scatter) = (geometry.guard_spacing(), geometry.guard_scatter());
        // A cut detection has no known middle.
        if spacing == Length::ZERO || plant.cut {
            return;
        }
        let is_due = self.due - plant.leading >= -scatter && plant.trailing - self.due >= -scatter;
        if self.left == 0 || is_due {
            self.due = plant.leading + Length(plant.width().0 >> 1) + spacing;
            self.left = IN_A_ROW;
        }
    }

    /// The ground to guard once the beam has passed an expected plant. `seen_to` is how far the ground is seen and classified.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn pass(&mut self, seen_to: WrappedPosition, geometry: &Geometry) -> Option<Canopy> {
        let (due, guarded) = (self.due, geometry.guarded);
        if self.left == 0 || !seen_to.is_ahead_of(due + guarded) {
            return None;
        }
        self.left -= 1;
        self.due = due + geometry.guard_spacing();
        Some(Canopy { leading: due - guarded, trailing: due + guarded, trim: Length::ZERO })
    }

    /// Where the stretch of an expected plant begins, if the beam has reached it.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn awaited(&self, frontier: WrappedPosition, geometry: &Geometry) -> Option<WrappedPosition> {
        let from = self.due - geometry.guarded;
        (self.left > 0 && frontier.is_ahead_of(from)).then_some(from)
    }
}
