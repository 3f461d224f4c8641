//! The built-in examples: plants and tall weeds at the paper's four speeds.
//!
//! The table is worked out by the compiler from a handful of canopies and weeds as they stand in a row of 500 to 600 mm
//! spacing. It is a plain constant, so that it costs nothing where it is not used: the firmware lays it into flash, the
//! host reads it as it is.

use crate::{
    classifier::label,
    features::{self, Features, SPEED_CLASSES_MM_S},
};
use knn::{Example, Range, Scale};

avr_progmem::progmem! {
    static progmem SCALE_IN_FLASH: Scale<{ features::COUNT }> = SCALE;
}

/// [`SCALE`], from where it costs no SRAM.
pub fn scale() -> Scale<{ features::COUNT }> {
    SCALE_IN_FLASH.load()
}

/// From a feature's value to a byte. A width counts most, through hold and actuation; the ranges leave room for beams
/// broken far longer than by any example.
pub const SCALE: Scale<{ features::COUNT }> = Scale::new([
    Range { lowest: 0, highest: 1000 },
    Range { lowest: 0, highest: 1800 },
    Range { lowest: 0, highest: 500 },
    Range { lowest: 80, highest: 400 },
    Range { lowest: 400, highest: 800 },
]);

/// Squared distance beyond which an object is like no example: about 20 mm of width with nothing else changed.
pub const RADIUS: u32 = 450;

/// Spacing, width and label of the examples, at each speed.
const TAUGHT: [(i16, i16, u8); 16] = [
    (60, 14, label::WEED),
    (150, 18, label::WEED),
    (240, 12, label::WEED),
    (330, 20, label::WEED),
    (420, 16, label::WEED),
    (530, 20, label::WEED),
    (650, 14, label::WEED),
    (800, 18, label::WEED),
    (490, 105, label::PLANT),
    (590, 120, label::PLANT),
    (500, 135, label::PLANT),
    (600, 150, label::PLANT),
    (510, 165, label::PLANT),
    (610, 180, label::PLANT),
    (1050, 125, label::PLANT),
    (1150, 160, label::PLANT),
];

/// Examples in the table.
pub const COUNT: usize = TAUGHT.len() * SPEED_CLASSES_MM_S.len();

/// The table.
pub const EXAMPLES: [Example<{ features::COUNT }>; COUNT] = {
    let mut examples = [Example::new([0; features::COUNT], label::WEED); COUNT];
    let mut index = 0;
    while index < COUNT {
        let speed = SPEED_CLASSES_MM_S[index / TAUGHT.len()];
        let (spacing_mm, width_mm, label) = TAUGHT[index % TAUGHT.len()];
        let features = Features::describe(speed, spacing_mm, width_mm);
        examples[index] = Example::new(SCALE.quantise(&features.values()), label);
        index += 1;
    }
    examples
};

#[cfg(test)]
mod tests {
    use super::*;
    use crate::classifier::{Class, Classifier, Nearest};

    fn class(speed: i16, spacing_mm: i16, width_mm: i16) -> Class {
        Nearest(EXAMPLES).classify(&Features::describe(speed, spacing_mm, width_mm), 3).class
    }

    #[test]
    fn plants_of_every_canopy_at_every_speed_are_plants() {
        for speed in SPEED_CLASSES_MM_S {
            for width_mm in 95..=190 {
                for spacing_mm in (470..=1240).step_by(10) {
                    assert_ne!(class(speed, spacing_mm, width_mm), Class::Weed, "{speed} {spacing_mm} {width_mm}");
                }
            }
        }
    }

    #[test]
    fn tall_weeds_between_the_plants_are_weeds() {
        for speed in SPEED_CLASSES_MM_S {
            for width_mm in 12..=20 {
                for spacing_mm in 60..=700 {
                    assert_eq!(class(speed, spacing_mm, width_mm), Class::Weed, "{speed} {spacing_mm} {width_mm}");
                }
            }
        }
    }

    #[test]
    fn what_is_neither_is_never_taken_for_a_weed() {
        for speed in SPEED_CLASSES_MM_S {
            for width_mm in (50..=90).chain([250, 400, 1000, 30_000]) {
                for spacing_mm in (0..=2000).step_by(10) {
                    assert_ne!(class(speed, spacing_mm, width_mm), Class::Weed, "{speed} {spacing_mm} {width_mm}");
                }
            }
        }
    }
}
