//! The benchmark's tasks, for the chip and for the host.
//!
//! The chip (`main.rs`) raises D13 before each measured call and lowers it after. The host counts the cycles between the edges, in
//! the order of [`Task::ALL`], with [`QUERIES`] for each.

#![no_std]
#![forbid(unsafe_code)]

use control::ground::features;
use knn::Example;

/// Queries of each task.
pub const QUERIES: usize = 256;

/// Neighbours that vote.
pub const K: u8 = 3;

/// Classes among the examples.
pub const CLASSES: usize = 2;

/// A measured task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// `Scale::quantise`: the five features to bytes.
    Quantise,
    /// A search and its vote among this many random examples in flash.
    Classify(u8),
    /// The same for detections of a row among the firmware's own examples.
    ClassifyObjects,
}

impl Task {
    /// All tasks, in the order in which the chip runs them.
    pub const ALL: [Self; 7] = [
        Self::Quantise,
        Self::Classify(8),
        Self::Classify(16),
        Self::Classify(32),
        Self::Classify(64),
        Self::Classify(128),
        Self::ClassifyObjects,
    ];
}

/// Random bytes from a 32-bit xorshift: the same on the chip, on the host, and in constants.
#[derive(Clone, Debug)]
pub struct Random(u32);

impl Random {
    /// The bytes of a seed other than 0.
    #[must_use]
    pub const fn new(seed: u32) -> Self {
        Self(seed)
    }

    /// The next byte.
    pub const fn byte(&mut self) -> u8 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 17;
        self.0 ^= self.0 << 5;
        (self.0 >> 24) as u8
    }

    /// Features of uniformly distributed bytes.
    pub const fn features(&mut self) -> [u8; features::COUNT] {
        [self.byte(), self.byte(), self.byte(), self.byte(), self.byte()]
    }
}

/// `N` random examples of two classes.
#[must_use]
pub const fn examples<const N: usize>() -> [Example<{ features::COUNT }>; N] {
    let mut random = Random::new(0x9E37_79B9 ^ N as u32);
    let mut examples = [Example::new([0; features::COUNT], 0); N];
    let mut index = 0;
    while index < N {
        examples[index] = Example::new(random.features(), random.byte() % CLASSES as u8);
        index += 1;
    }
    examples
}
