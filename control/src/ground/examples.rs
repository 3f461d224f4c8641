//! The built-in examples: plants and tall weeds at the paper's four speeds.
//!
//! They are trained on simulated rows: `weeder train --synthetic` writes `examples/table.rs`, in physical units. The compiler turns
//! the table into bytes. The result is a plain constant: the firmware puts it into flash, the host uses it directly.

mod table;

use crate::ground::{class::label, features};
use knn::{Example, Scale};

avr_progmem::progmem! {
    static progmem SCALE_IN_FLASH: Scale<{ features::COUNT }> = SCALE;
}

/// [`SCALE`], read from flash so that it takes no SRAM.
pub fn scale() -> Scale<{ features::COUNT }> {
    SCALE_IN_FLASH.load()
}

/// Maps a feature's value to a byte.
pub const SCALE: Scale<{ features::COUNT }> = Scale::new(table::RANGES);

/// The ranges of [`SCALE`] as bytes of 32-bit numbers, for the CRC of field examples: boards have stored it so.
pub const SCALE_BYTES: [u8; 8 * features::COUNT] = {
    let (mut bytes, mut place) = ([0; 8 * features::COUNT], 0);
    while place < bytes.len() {
        let knn::Range { lowest, highest } = table::RANGES[place / 8];
        bytes[place] = [(lowest as i32).to_le_bytes(), (highest as i32).to_le_bytes()][place % 8 / 4][place % 4];
        place += 1;
    }
    bytes
};

/// Squared distance beyond which no example is near enough.
pub const RADIUS: u32 = table::RADIUS;

/// k of the training.
pub const K: u8 = table::K;

/// Half the width, in mm, of the narrowest plant among the examples. A detection narrower than this has a weed's width.
pub const NARROW_MM: i16 = {
    let (mut narrowest, mut index) = (i16::MAX, 0);
    while index < COUNT {
        let ([.., hold, _], label) = table::TRAINED[index];
        let width = hold - features::HOLD_BEYOND_WIDTH_MM;
        if label == label::PLANT && width < narrowest {
            narrowest = width;
        }
        index += 1;
    }
    narrowest / 2
};

/// Most examples within the flash budget, at 6 bytes each.
pub const CAPACITY: usize = 72;

/// The number of examples.
pub const COUNT: usize = table::TRAINED.len();

const _: () = assert!(COUNT <= CAPACITY, "too many examples for the flash budget");

/// The table, shuffled: neighbours are `STEP` places apart in it. In the trained order similar examples are neighbours, and a search
/// comes ever nearer. Each example would then enter the list of the nearest for a while.
pub const EXAMPLES: [Example<{ features::COUNT }>; COUNT] = {
    let mut examples = [Example::new([0; features::COUNT], 0); COUNT];
    let mut index = 0;
    while index < COUNT {
        let (features, label) = &table::TRAINED[index * STEP % COUNT];
        examples[index] = Example::new(SCALE.quantise(features), *label);
        index += 1;
    }
    examples
};

/// Some five eighths of the table, coprime to its length, so that no example is left out.
const STEP: usize = {
    let mut step = COUNT * 5 / 8;
    while greatest_common_divisor(step, COUNT) != 1 {
        step += 1;
    }
    step
};

const fn greatest_common_divisor(one: usize, other: usize) -> usize {
    if other == 0 { one } else { greatest_common_divisor(other, one % other) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        ground::{
            class::{Class, Classifier},
            features::{Features, SPEED_CLASSES_MM_S},
            nearest::Nearest,
        },
        memory::Volatile,
        settings::Setting,
    };
    use std::vec::Vec;

    /// Checks the class of each canopy at each speed.
    fn check_classes(
        widths_mm: impl Iterator<Item = i16> + Clone,
        spacings_mm: impl Iterator<Item = i16> + Clone,
        is_right: impl Fn(Class) -> bool,
    ) {
        let nearest = Nearest::new(EXAMPLES, Volatile::new());
        for speed in SPEED_CLASSES_MM_S {
            for width_mm in widths_mm.clone() {
                for spacing_mm in spacings_mm.clone() {
                    let class = nearest.classify(&Features::describe(speed, spacing_mm, width_mm), table::K).class;
                    assert!(is_right(class), "{class:?}: {speed} {spacing_mm} {width_mm}");
                }
            }
        }
    }

    #[test]
    fn every_example_of_the_table_is_built_in() {
        for (features, label) in &table::TRAINED {
            assert!(EXAMPLES.contains(&Example::new(SCALE.quantise(features), *label)), "{features:?}");
        }
    }

    #[test]
    fn the_bytes_of_the_scale_are_the_ranges_of_all_its_features() {
        let bounds = table::RANGES.iter().flat_map(|range| [range.lowest, range.highest].map(i32::from));
        assert_eq!(SCALE_BYTES[..], bounds.flat_map(i32::to_le_bytes).collect::<Vec<u8>>());
    }

    #[test]
    fn narrow_is_half_the_width_of_the_narrowest_plant() {
        let plants = table::TRAINED.iter().filter(|(_, label)| *label == label::PLANT);
        let narrowest = plants.map(|([_, _, _, hold, _], _)| hold - features::HOLD_BEYOND_WIDTH_MM).min();
        assert_eq!(narrowest.map(|width| width / 2), Some(NARROW_MM));
        let [_, _, _, hold, _] = *Features::describe(556, 500, 40).values();
        assert_eq!(hold - features::HOLD_BEYOND_WIDTH_MM, 40);
    }

    #[test]
    fn the_default_k_is_the_k_of_the_training() {
        assert_eq!(Setting::K.default(), u16::from(K));
    }

    #[test]
    fn plants_of_every_canopy_at_every_speed_are_plants() {
        check_classes(95..=190, (470..=1240).step_by(10), |class| class != Class::Weed);
    }

    #[test]
    fn tall_weeds_between_the_plants_are_weeds() {
        check_classes(12..=20, 60..=700, |class| class == Class::Weed);
    }

    #[test]
    fn a_detection_unlike_both_classes_is_never_a_weed() {
        let widths_mm = (35..=90).chain([250, 400, 1000, 30_000]);
        check_classes(widths_mm, (0..=2000).step_by(5), |class| class != Class::Weed);
    }
}
