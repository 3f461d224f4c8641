//! Narrow objects that follow each other: a crop of stalks, which the examples do not know.

use crate::ground::{class::Class, examples::NARROW_MM};

/// Objects as narrow as a weed since the last one that was wider or taken for a plant, or that was labelled, or since work began.
///
/// Those that are unknown are kept, and count nevertheless: a stalk far behind the last plant is like no example, be it crop or weed.
#[derive(Clone, Debug)]
pub struct Misfits {
    count: u8,
    /// Whether any of them was taken for a weed: else nothing is lost.
    any_weed: bool,
}

impl Misfits {
    /// No objects.
    pub const NONE: Self = Self { count: 0, any_weed: false };

    /// Counts an object; whether these are so many now, or more; zero never.
    pub fn count(&mut self, class: Class, width_mm: i16, enough: u8) -> bool {
        if class == Class::Plant || width_mm >= NARROW_MM {
            *self = Self::NONE;
        } else if width_mm > 0 {
            // A leaf that moves while the machine stands has no width.
            self.count = self.count.saturating_add(1);
            self.any_weed |= class == Class::Weed;
        }
        self.any_weed && self.count > enough.wrapping_sub(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plant_however_narrow_and_whatever_is_wide_end_the_count_of_misfits() {
        for (class, width_mm, ends) in [
            (Class::Plant, NARROW_MM - 1, true),
            (Class::Weed, NARROW_MM, true),
            (Class::Unknown, NARROW_MM, true),
            (Class::Unknown, NARROW_MM - 1, false),
            (Class::Weed, 0, false),
        ] {
            let mut misfits = Misfits::NONE;
            assert!(!misfits.count(Class::Weed, 10, 3) && !misfits.count(Class::Weed, 10, 3));
            misfits.count(class, width_mm, 3);
            assert_eq!(misfits.count(Class::Weed, 10, 3), !ends, "{class:?} {width_mm} mm");
        }
    }
}
