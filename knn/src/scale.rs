//! From measured integers to bytes: one scale for each feature, so that no feature outweighs another.
//!
//! A distance adds differences in different units, such as mm and mm/s. So each feature is mapped from its own [`Range`] onto
//! 0..=255. This takes one subtraction, one shift and one 16 x 16 bit multiplication. Values outside the range saturate. There is
//! no division and no float, so host and microcontroller get the same byte from the same number.

/// The values of one feature, in its own unit, that map onto 0 and 255.
///
/// If `highest` is not above `lowest`, each value maps onto 0: a constant feature does not count.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Range {
    /// Maps onto 0, as does everything below it.
    pub lowest: i16,
    /// Maps onto 255, as does everything above it.
    pub highest: i16,
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
    /// assert_eq!(SCALE.quantise(&[i16::MAX, i16::MIN]), [255, 0]);
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

    /// Learns the ranges from the rows of a training table; `None` without a row.
    ///
    /// Each feature's values, from the smallest to the largest, take the middle half of the bytes (about 64 to 192). The quarters
    /// on either side are for values outside the training. So a stranger stays far from all examples, instead of saturating onto
    /// the outermost. One extreme value stretches its feature's range and compresses the other values: remove outliers first.
    #[must_use]
    pub const fn learn_ranges(rows: &[[i16; FEATURES]]) -> Option<[Range; FEATURES]> {
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
    /// // A leaf's length in hundredths of a millimetre would drown the number of its teeth; scaled, both count alike.
    /// let scale = Scale::learn(&[[5100, 2], [7000, 14], [6300, 26]]).expect("there are rows");
    /// assert_eq!(scale.quantise(&[5100, 2]), [63, 63]);
    /// assert_eq!(scale.quantise(&[7000, 26]), [191, 191]);
    /// ```
    #[must_use]
    pub const fn learn(rows: &[[i16; FEATURES]]) -> Option<Self> {
        match Self::learn_ranges(rows) {
            Some(ranges) => Some(Self::new(ranges)),
            None => None,
        }
    }

    /// The features as bytes. Values outside their range become 0 or 255.
    #[must_use]
    pub const fn quantise(&self, values: &[i16; FEATURES]) -> [u8; FEATURES] {
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
    /// The range widened by half its width on either side, within `i16`.
    const fn with_room(self) -> Self {
        let width = self.highest.abs_diff(self.lowest);
        // Rounded up, so that a width of 1 gets room too; a width of 0 stays 0.
        let room = width.div_ceil(2);
        Self { lowest: self.lowest.saturating_sub_unsigned(room), highest: self.highest.saturating_add_unsigned(room) }
    }
}

/// `byte = ((value - offset) >> shift) * factor >> 8`, limited to 0..=255.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
struct FeatureScale {
    offset: i16,
    /// Brings the range's width below 512: a byte needs no finer step.
    shift: u8,
    /// Bytes a step, with 8 fractional bits; 0 for a constant feature.
    factor: u16,
}

impl FeatureScale {
    const fn new(range: Range) -> Self {
        if range.highest <= range.lowest {
            return Self { offset: range.lowest, shift: 0, factor: 0 };
        }
        let width = range.highest.abs_diff(range.lowest);
        // At most 7, because the width has 16 bits and 9 are kept.
        let shift = 7_u32.saturating_sub(width.leading_zeros());
        // From 1 to 511, so the factor is from 128 to 65,280 and fits. Rounded up, it takes `highest` to 255.
        let steps = width >> shift;
        Self { offset: range.lowest, shift: shift as u8, factor: (255_u32 * 256).div_ceil(steps as u32) as u16 }
    }

    const fn quantise(self, value: i16) -> u8 {
        if value <= self.offset {
            return 0;
        }
        // Above the offset, the wrapped difference is exact.
        let steps = (value as u16).wrapping_sub(self.offset as u16) >> self.shift;
        let byte = (steps as u32 * self.factor as u32) >> 8;
        if byte > 255 { 255 } else { byte as u8 }
    }
}
