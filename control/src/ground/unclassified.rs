//! The complete detection that waits for its class, and what it becomes: a canopy, or nothing.

use super::{
    Ground,
    class::Class,
    detection::Detection,
    keep_out::{Canopy, Plan, ScheduleFull},
};
use crate::units::{Length, WrappedPosition};

/// The complete detection that is being classified, if any.
#[derive(Clone, Copy, Debug)]
pub struct Unclassified {
    /// The detection.
    pub detection: Detection,
    /// What both beams have seen of it so far.
    pub(super) canopy: Canopy,
    /// Whether the second beam reports it. The first beam may have reported it already.
    pub of_second: bool,
    pub(super) known: Known,
}

/// What is known of a detection without a class. `Nothing` is 0, so [`Ground::NONE`] is all zeros and needs no copy in flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Known {
    /// There is no detection.
    Nothing,
    /// Its ground is forgotten.
    Detection,
    /// Its ground is known.
    Canopy,
}

impl Ground {
    /// Closes the ground from the start of a detection until it is classified.
    pub fn await_class(&mut self, detection: Detection, of_second: bool) {
        // What only one beam saw is not certain to be a single plant.
        let is_single = !(of_second || self.detector.take_parted());
        let canopy = Canopy::of(&detection, self.geometry.stem_zone(), is_single);
        self.unclassified = Unclassified { detection, canopy, of_second, known: Known::Canopy };
        // A wide detection reaches the second beam before the first has seen its end.
        if let Some(begin) = self.second_beam.open() {
            self.widen(begin, begin);
        }
    }

    /// The detection that is being classified.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn unclassified(&self) -> Option<&Unclassified> {
        Some(&self.unclassified).filter(|unclassified| unclassified.known != Known::Nothing)
    }

    /// Takes the class of that detection, and remembers a plant or an unknown.
    ///
    /// # Errors
    /// [`ScheduleFull`] if more canopies stand between beam and tool than can be remembered.
    pub fn classified(&mut self, class: Class) -> Result<(), ScheduleFull> {
        let Unclassified { detection, canopy, known, .. } = &mut self.unclassified;
        let was_known = core::mem::replace(known, Known::Nothing);
        if class == Class::Weed || was_known == Known::Nothing {
            return Ok(());
        }
        if detection.leading.is_ahead_of(self.last_plant) {
            self.last_plant = detection.leading;
        }
        if was_known != Known::Canopy {
            return Ok(());
        }
        // An unknown detection may be several plants: it keeps its full width.
        if class != Class::Plant {
            canopy.keep_leaves();
        }
        self.guard.see(detection, &self.geometry);
        self.keep_out.push(&self.unclassified.canopy, self.tool(), self.geometry.margin())
    }

    /// Where the first detection begins that has no end yet, or no class.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub(super) fn open(&self) -> Option<WrappedPosition> {
        let Unclassified { canopy, known, .. } = &self.unclassified;
        if *known == Known::Canopy { Some(canopy.leading) } else { self.detector.open() }
    }

    /// From the last plant's leading edge, or from where detection began, to the detection's. At most the memory length.
    pub fn spacing(&self, detection: &Detection) -> Length {
        detection.leading - self.last_plant
    }

    /// The paper's schedule for a detection.
    pub fn plan(&self, detection: &Detection) -> Plan {
        Plan::new(&self.geometry, detection.width())
    }
}

#[cfg(test)]
mod tests {
    use crate::ground::tests::{ground, pass};
    use crate::units::Position;

    #[test]
    fn the_spacing_is_at_most_the_remembered_length() {
        let (mut ground, _) = ground();
        for position in (1400..200_000).step_by(50) {
            ground.roll_to(Position::new(position));
        }
        let canopy = pass(&mut ground, 200_000, 200_300);
        assert!((14_800..15_280).contains(&ground.spacing(&canopy).0), "{:?}", ground.spacing(&canopy));
    }
}
