//! Consecutive narrow detections: a crop with thin stalks that the examples do not know, or weeds in a gap of the stand.
//!
//! Both are narrow, and neither is classified as a plant. The detections before tell them apart. A known crop has shown a plant
//! before its gap. The alarm then needs `TRUST` more narrow detections: no gap has so many weeds. An unknown crop has shown no
//! plant. Two stalks grown together, or a stalk and a weed, are wider than one, but narrower than a plant: they neither count nor
//! restart the count. The distances between them would not help: five are few, and maize has gaps and weeds too.
//!
//! A few taught stalks are no known crop: the others are weeds still. So a stalk that is known gives no trust. It takes back some
//! that are not.
//!
//! `cargo test --release -p field --test crop_unknown` measures the error rate.

use crate::ground::{class::Class, examples::NARROW_MM};

/// The width of the narrowest plant among the examples.
const WIDE_MM: i16 = 2 * NARROW_MM;

/// More detections needed for the alarm if work has shown a plant.
const TRUST: i8 = 4;

/// Narrow detections that a known stalk takes back: in a crop of stalks, weeds may stand closer than the crop.
const TAKEN_BACK: i8 = 2;

/// Narrow detections since the last plant, the last label, or the start of work.
///
/// Unknown detections are kept as plants, and count nevertheless. A stalk far behind the last plant is like no example, crop or
/// weed.
#[derive(Clone, Debug)]
pub struct UnknownRun {
    /// Negative after a plant.
    count: i8,
    /// Whether any was classified as a weed. Otherwise no plant was lost.
    any_weed: bool,
}

impl UnknownRun {
    /// No detections.
    pub const NONE: Self = Self { count: 0, any_weed: false };

    /// Counts a detection. True once `enough` is reached; 0 disables the check.
    pub fn count(&mut self, class: Class, width_mm: i16, enough: u8) -> bool {
        // A leaf that moves in the beam of a standing machine has width 0.
        if (1..NARROW_MM).contains(&width_mm) {
            self.any_weed |= class == Class::Weed;
            match class {
                Class::Plant if self.count > 0 => self.count = (self.count - TAKEN_BACK).max(0),
                Class::Plant => {}
                _ => self.count += i8::from(self.count < i8::MAX),
            }
        } else if class == Class::Plant || class == Class::Unknown && width_mm >= WIDE_MM {
            (self.count, self.any_weed) = (-TRUST, false);
        }
        self.any_weed && enough > 0 && self.count >= enough as i8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Which detection raises the alarm at `misfit_after` 3: these, then weeds.
    fn alarm_at(before: &[(Class, i16)]) -> usize {
        let mut run = UnknownRun::NONE;
        let weeds = core::iter::repeat(&(Class::Weed, 10));
        let mut detections = (1..).zip(before.iter().chain(weeds));
        detections
            .find(|&(_, &(class, width_mm))| run.count(class, width_mm, 3))
            .map(|(place, _)| place)
            .expect("endless weeds")
    }

    #[test]
    fn a_plant_or_a_detection_as_wide_restarts_the_count_with_trust() {
        let two = [(Class::Weed, 10); 2];
        assert_eq!(alarm_at(&[]), 3);
        assert_eq!(alarm_at(&two), 3);
        for plant in [(Class::Plant, 150), (Class::Plant, NARROW_MM), (Class::Unknown, WIDE_MM)] {
            assert_eq!(alarm_at(&[two[0], two[1], plant]), 3 + 3 + TRUST as usize, "{plant:?}");
        }
    }

    #[test]
    fn a_known_stalk_takes_back_some_that_are_not() {
        let (weed, stalk) = ((Class::Weed, 10), (Class::Plant, NARROW_MM - 1));
        assert_eq!(alarm_at(&[weed, weed, stalk]), 6);
        assert_eq!(alarm_at(&[stalk, stalk, stalk]), 6, "they give no trust");
        assert_eq!(alarm_at(&[(Class::Plant, 150), stalk]), 2 + 3 + TRUST as usize, "and take none");
        let mut run = UnknownRun::NONE;
        assert!((0..100).all(|_| !run.count(weed.0, weed.1, 3) && !run.count(stalk.0, stalk.1, 3)));
    }

    #[test]
    fn narrow_unknowns_alone_are_no_alarm() {
        for before in [&[][..], &[(Class::Weed, 10), (Class::Plant, 150)]] {
            let mut run = UnknownRun::NONE;
            for &(class, width_mm) in before {
                assert!(!run.count(class, width_mm, 3));
            }
            assert!((0..100).all(|_| !run.count(Class::Unknown, 10, 3)), "they are kept as plants");
            assert!(run.count(Class::Weed, 10, 3), "behind {before:?}");
        }
    }

    #[test]
    fn medium_widths_neither_count_nor_restart_the_count() {
        for between in
            [(Class::Unknown, NARROW_MM), (Class::Unknown, WIDE_MM - 1), (Class::Weed, 2 * WIDE_MM), (Class::Weed, 0)]
        {
            assert_eq!(alarm_at(&[(Class::Weed, 10), between]), 4, "{between:?}");
        }
    }
}
