//! Narrow detections that follow each other: a crop of stalks, which the examples do not know, or weeds in a gap of the stand.
//!
//! Both are narrow, and neither is taken for a plant. What stood before them tells them apart. A stand has shown a plant before its
//! gap, and then it takes `TRUST` more of them: so many weeds stand in no gap. A crop of stalks has shown none. A stalk that has
//! grown together with another, or with a weed, is wider than either, but not as wide as a plant: it counts for nothing, and ends
//! nothing. How regularly they stand would tell no more: five are few, and maize has gaps and weeds of its own.
//!
//! `cargo test --release -p field --test crop_unknown` measures how often that errs.

use crate::ground::{class::Class, examples::NARROW_MM};

/// As wide as the narrowest plant among the examples.
const WIDE_MM: i16 = 2 * NARROW_MM;

/// So many more prove a crop of stalks where the stand has shown a plant since work began.
const TRUST: i8 = 4;

/// Detections as narrow as a weed since the last plant, or since one was labelled, or since work began.
///
/// Those that are unknown are kept, and count nevertheless: a stalk far behind the last plant is like no example, be it crop or weed.
#[derive(Clone, Debug)]
pub struct UnknownRun {
    /// Below 0 behind a plant.
    count: i8,
    /// Whether any of them was taken for a weed: else nothing is lost.
    any_weed: bool,
}

impl UnknownRun {
    /// No detections.
    pub const NONE: Self = Self { count: 0, any_weed: false };

    /// Counts a detection; whether these are `enough` now, or more; zero never.
    pub fn count(&mut self, class: Class, width_mm: i16, enough: u8) -> bool {
        if class == Class::Plant || class == Class::Unknown && width_mm >= WIDE_MM {
            (self.count, self.any_weed) = (-TRUST, false);
        } else if (1..NARROW_MM).contains(&width_mm) {
            // A leaf that moves while the machine stands has no width.
            self.any_weed |= class == Class::Weed;
            self.count = self.count.saturating_add(1);
        }
        self.any_weed && enough > 0 && self.count >= enough as i8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which detection raises the alarm at `misfit_after` 3, of these and as many weeds behind them as it takes.
    fn alarm_at(before: &[(Class, i16)]) -> usize {
        let mut misfits = UnknownRun::NONE;
        let weeds = core::iter::repeat(&(Class::Weed, 10));
        let mut detections = (1..).zip(before.iter().chain(weeds));
        detections
            .find(|&(_, &(class, width_mm))| misfits.count(class, width_mm, 3))
            .map(|(place, _)| place)
            .expect("weeds without an end")
    }

    #[test]
    fn a_plant_or_what_is_as_wide_ends_the_count_of_misfits_and_is_a_reason_to_believe_the_stand() {
        let two = [(Class::Weed, 10); 2];
        assert_eq!(alarm_at(&[]), 3);
        assert_eq!(alarm_at(&two), 3);
        for plant in [(Class::Plant, 150), (Class::Plant, NARROW_MM - 1), (Class::Unknown, WIDE_MM)] {
            assert_eq!(alarm_at(&[two[0], two[1], plant]), 3 + 3 + TRUST as usize, "{plant:?}");
        }
    }

    #[test]
    fn what_is_neither_narrow_nor_as_wide_as_a_plant_counts_for_nothing_and_ends_nothing() {
        for between in
            [(Class::Unknown, NARROW_MM), (Class::Unknown, WIDE_MM - 1), (Class::Weed, 2 * WIDE_MM), (Class::Weed, 0)]
        {
            assert_eq!(alarm_at(&[(Class::Weed, 10), between]), 4, "{between:?}");
        }
    }
}
