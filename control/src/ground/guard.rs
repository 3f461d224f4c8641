//! Ground to be guarded: in a crop that is set at even distances, where a plant is due and the beam has seen none.
//!
//! The plant seen last tells where the next is due: a spacing from its middle to the middle of that one, give or take the
//! scatter of the crop. Whatever is kept and meets that stretch is the plant, and the next is counted from it. What is kept and
//! does not, a double or a weed like a plant, changes nothing. Once the beam has seen all of the stretch, it becomes ground like
//! that of a canopy, and is no other from then on. Behind `IN_A_ROW` of these the row is at its end, and nothing is due until
//! a plant is seen.
//!
//! What it does not do: tell an unseen plant from none. Gaps are guarded too, and weeds in them stay.

use super::{detection::Detection, keep_out::Canopy, reach::Geometry};
use crate::units::{Length, WrappedPosition};

/// Plants in a row that are taken for unseen; one more that does not come, and the row is at its end.
const IN_A_ROW: u8 = 3;

/// Where a plant is due.
#[derive(Clone, Debug)]
pub struct Guard {
    /// Its middle.
    due: WrappedPosition,
    /// How many of this and the next are still waited for; none where nobody knows where any would be.
    left: u8,
}

impl Guard {
    /// No plant is due.
    pub const NONE: Self = Self { due: WrappedPosition::new(0), left: 0 };

    /// Takes a detection that is kept.
    pub fn see(&mut self, plant: &Detection, geometry: &Geometry) {
        let (spacing, scatter) = (geometry.guard_spacing, geometry.guard_scatter);
        // Of one whose beginning was not seen, nobody knows the middle.
        if spacing == Length::ZERO || plant.cut {
            return;
        }
        let is_due = self.due - plant.leading >= -scatter && plant.trailing - self.due >= -scatter;
        if self.left == 0 || is_due {
            self.due = plant.leading + Length(plant.width().0 / 2) + spacing;
            self.left = IN_A_ROW;
        }
    }

    /// The ground that is to be guarded now that the beam has seen what stands up to a place: where a plant was due.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn pass(&mut self, seen_to: WrappedPosition, geometry: &Geometry) -> Option<Canopy> {
        let (due, guarded) = (self.due, geometry.guarded);
        if self.left == 0 || !seen_to.is_ahead_of(due + guarded) {
            return None;
        }
        self.left -= 1;
        self.due = due + geometry.guard_spacing;
        Some(Canopy { leading: due - guarded, trailing: due + guarded, trim: 0 })
    }

    /// Where the ground begins on which a plant may stand that has not been seen yet, if the beam has come to it.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn awaited(&self, frontier: WrappedPosition, geometry: &Geometry) -> Option<WrappedPosition> {
        let from = self.due - geometry.guarded;
        (self.left > 0 && frontier.is_ahead_of(from)).then_some(from)
    }
}
