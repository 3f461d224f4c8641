//! The last classified detections, for the console and for labels.

use crate::ground::{
    class::{Class, Vote},
    features::Features,
};

/// Detections remembered; a power of two, for short arithmetic.
const CAPACITY: usize = 16;

/// A classified detection: the values from which its features are calculated, which take less room.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Classified {
    pub(crate) speed_class_mm_s: i16,
    pub(crate) spacing_mm: i16,
    pub(crate) width_mm: i16,
    /// The classifier's vote.
    pub vote: Vote,
    /// The operator's label, one of [`label`](crate::ground::class::label).
    pub label: Option<u8>,
}

impl Classified {
    /// A free slot: zeros, which need no copy in flash.
    const NONE: Self = Self {
        speed_class_mm_s: 0,
        spacing_mm: 0,
        width_mm: 0,
        vote: Vote { class: Class::Plant, votes: 0 },
        label: None,
    };

    /// Its features.
    pub fn features(&self) -> Features {
        Features::describe(self.speed_class_mm_s, self.spacing_mm, self.width_mm)
    }
}

/// The last detections.
#[derive(Clone, Debug)]
pub struct Detections {
    detections: [Classified; CAPACITY],
    len: u8,
    /// The index of the oldest, which the next one replaces if there is no room.
    oldest: u8,
}

impl Detections {
    /// No detections.
    pub const NONE: Self = Self { detections: [Classified::NONE; CAPACITY], len: 0, oldest: 0 };

    /// Adds a detection, and drops the oldest if there is no room.
    pub fn remember(&mut self, detection: Classified) {
        self.detections[self.place(self.len)] = detection;
        if usize::from(self.len) < CAPACITY {
            self.len += 1;
        } else {
            self.oldest = (self.oldest + 1) % CAPACITY as u8;
        }
    }

    /// Whether there are no detections.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The number of detections.
    pub fn len(&self) -> u8 {
        self.len
    }

    /// A detection, counted from the oldest.
    pub fn get(&self, number: u8) -> Option<&Classified> {
        (number < self.len).then(|| &self.detections[self.place(number)])
    }

    /// The last detection.
    pub fn last(&self) -> Option<&Classified> {
        self.get(self.len.checked_sub(1)?)
    }

    /// The last detection, to change.
    pub fn newest(&mut self) -> Option<&mut Classified> {
        let last = self.place(self.len.checked_sub(1)?);
        Some(&mut self.detections[last])
    }

    /// The index of a detection.
    fn place(&self, number: u8) -> usize {
        usize::from(self.oldest + number) % CAPACITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::class::Class;
    use std::vec::Vec;

    fn classified(width_mm: i16) -> Classified {
        let vote = Vote { class: Class::Plant, votes: 3 };
        Classified { speed_class_mm_s: 556, spacing_mm: 300, width_mm, vote, label: None }
    }

    #[test]
    fn the_newest_detections_are_kept_in_their_order() {
        let mut detections = Detections::NONE;
        assert!(detections.newest().is_none());
        for seen in 1..=40_i16 {
            detections.remember(classified(seen));
            let oldest = (seen - CAPACITY as i16).max(0) + 1;
            let widths: Vec<_> =
                (0..detections.len()).filter_map(|number| detections.get(number)).map(|o| o.width_mm).collect();
            assert_eq!(widths, (oldest..=seen).collect::<Vec<_>>());
            assert_eq!(detections.get(detections.len()), None);
            let last = detections.newest().expect("it was remembered");
            assert_eq!(last.width_mm, seen);
            last.label = Some(1);
        }
    }
}
