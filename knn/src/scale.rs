//! From measured integers to bytes: a scale for each feature, so that none drowns another.
//!
//! A distance adds up differences of unlike things, millimetres and millimetres a second. Each feature is therefore
//! mapped from a [`Range`] of its own onto 0..=255. The mapping is one subtraction, one shift and one 16 x 16 bit
//! multiplication; what lies outside the range saturates. There is no division and no float, and the host and the
//! microcontroller get the same byte from the same number.

/// The values of one feature, in its own unit, that map onto 0 and 255.
///
/// A range whose `highest` is not above its `lowest` maps every value onto 0: a feature that never changes tells
/// nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Range {
    /// Maps onto 0, as does everything below it.
    pub lowest: i32,
    /// Maps onto 255, as does everything above it.
    pub highest: i32,
}

/// A scale for each of `FEATURES` features.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Scale<const FEATURES: usize> {
    features: [FeatureScale; FEATURES],
}

impl<const FEATURES: usize> Scale<FEATURES> {
    /// The scale that maps each feature's range onto 0..=255.
    ///
    /// ```
    /// use knn::{Range, Scale};
    ///
    /// const SCALE: Scale<2> = Scale::new([Range { lowest: 0, highest: 1000 }, Range { lowest: -50, highest: 50 }]);
    /// assert_eq!(SCALE.quantise(&[500, 0]), [127, 127]);
    /// assert_eq!(SCALE.quantise(&[i32::MAX, i32::MIN]), [255, 0]);
    /// ```
    #[must_use]
    pub const fn new(ranges: [Range; FEATURES]) -> Self {
        let mut features = [FeatureScale { offset: 0, shift: 0, factor: 0 }; FEATURES];
        let mut feature = 0;
        while feature < FEATURES {
            features[feature] = FeatureScale::new(ranges[feature]);
            feature += 1;
        }
        Self { features }
    }

    /// The ranges that make features comparable, learned from the rows of a training table; `None` without a row.
    ///
    /// Each feature's values, from its smallest to its largest, are given the middle half of the bytes (about 64 to 192).
    /// The quarter on either side is kept for what the training has not seen, so that a stranger stays far from every
    /// example instead of saturating onto the outermost one. A single wild value stretches its feature's range and
    /// makes the others finer: take outliers out before.
    #[must_use]
    pub const fn learn_ranges(rows: &[[i32; FEATURES]]) -> Option<[Range; FEATURES]> {
        let Some((first, others)) = rows.split_first() else {
            return None;
        };
        let mut ranges = [Range { lowest: 0, highest: 0 }; FEATURES];
        let mut feature = 0;
        while feature < FEATURES {
            let mut smallest = first[feature];
            let mut largest = smallest;
            let mut row = 0;
            while row < others.len() {
                let value = others[row][feature];
                if value < smallest {
                    smallest = value;
                }
                if value > largest {
                    largest = value;
                }
                row += 1;
            }
            ranges[feature] = Range { lowest: smallest, highest: largest }.with_room();
            feature += 1;
        }
        Some(ranges)
    }

    /// The scale of [`learn_ranges`](Self::learn_ranges); `None` without a row.
    ///
    /// ```
    /// use knn::Scale;
    ///
    /// // A leaf's length in micrometres would drown the number of its teeth; scaled, both count alike.
    /// let scale = Scale::learn(&[[51_000, 2], [70_000, 14], [63_000, 26]]).expect("there are rows");
    /// assert_eq!(scale.quantise(&[51_000, 2]), [63, 63]);
    /// assert_eq!(scale.quantise(&[70_000, 26]), [191, 191]);
    /// ```
    #[must_use]
    pub const fn learn(rows: &[[i32; FEATURES]]) -> Option<Self> {
        match Self::learn_ranges(rows) {
            Some(ranges) => Some(Self::new(ranges)),
            None => None,
        }
    }

    /// The features as bytes. Never overflows: values outside their range become 0 or 255.
    #[must_use]
    pub const fn quantise(&self, values: &[i32; FEATURES]) -> [u8; FEATURES] {
        let mut bytes = [0; FEATURES];
        let mut feature = 0;
        while feature < FEATURES {
            bytes[feature] = self.features[feature].quantise(values[feature]);
            feature += 1;
        }
        bytes
    }
}

impl Range {
    /// The range widened by half its width on either side, as far as `i32` reaches.
    const fn with_room(self) -> Self {
        let width = self.highest.abs_diff(self.lowest);
        // Rounded up, so that even two neighbouring values keep room; a width of 0 stays 0.
        let room = width.div_ceil(2);
        Self { lowest: self.lowest.saturating_sub_unsigned(room), highest: self.highest.saturating_add_unsigned(room) }
    }
}

/// `byte = ((value - offset) >> shift) * factor >> 8`, held to 0..=255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct FeatureScale {
    offset: i32,
    /// Brings the range's width below 512: a byte needs no finer step.
    shift: u8,
    /// Bytes a step, with 8 fractional bits; 0 for a feature that tells nothing.
    factor: u16,
}

impl FeatureScale {
    const fn new(range: Range) -> Self {
        if range.highest <= range.lowest {
            return Self { offset: range.lowest, shift: 0, factor: 0 };
        }
        let width = range.highest.abs_diff(range.lowest);
        // At most 23, as the width has 32 bits and 9 are kept.
        let shift = 23_u32.saturating_sub(width.leading_zeros());
        // From 1 to 511, so the factor is from 128 to 65,280 and fits. Rounded up, it takes `highest` to 255.
        let steps = width >> shift;
        Self { offset: range.lowest, shift: shift as u8, factor: (255_u32 * 256).div_ceil(steps) as u16 }
    }

    const fn quantise(self, value: i32) -> u8 {
        if value <= self.offset {
            return 0;
        }
        // Above the offset, the wrapped difference is the true one.
        let steps = (value as u32).wrapping_sub(self.offset as u32) >> self.shift;
        // 511 steps of the smallest factor, 128, are already 255: holding the steps to 16 bits changes nothing, and
        // the product of two 16-bit numbers fits 32 bits.
        let steps = if steps > u16::MAX as u32 { u16::MAX as u32 } else { steps };
        let byte = (steps * self.factor as u32) >> 8;
        if byte > 255 { 255 } else { byte as u8 }
    }
}
