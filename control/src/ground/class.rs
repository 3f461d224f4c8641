//! Classes, and the trait of a classifier.
//!
//! A detection without a clear class is [`Class::Unknown`], and every caller treats that as a plant. The firmware's classifier uses
//! the [nearest examples](super::nearest). Tests may use another.

use super::features::{self, Features};
use knn::Example;

/// The class of a detection.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// A crop plant: the tool leaves the row for it.
    Plant,
    /// A tall weed: the tool keeps working.
    Weed,
    /// Like no example, or like both classes: treated as a plant.
    Unknown,
}

/// A class and the votes for it among the k nearest examples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vote {
    /// The class that won.
    pub class: Class,
    /// Nearest examples of that class; of the strongest class for [`Class::Unknown`].
    pub votes: u8,
}

impl Vote {
    /// Unknown, without a vote.
    pub const UNKNOWN: Self = Self { class: Class::Unknown, votes: 0 };
}

/// Labels in an example table.
pub mod label {
    /// A tall weed.
    pub const WEED: u8 = 0;
    /// A crop plant.
    pub const PLANT: u8 = 1;
    /// The number of labels.
    pub const COUNT: usize = 2;
}

/// An example in the list of all examples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Whether it was taught in the field, and can be forgotten.
    pub from_field: bool,
    /// Its number within its source.
    pub number: u8,
    /// The example.
    pub example: Example<{ features::COUNT }>,
}

/// All places for field examples are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExamplesFull;

/// Classifies detections, and learns from examples. By default it has no examples, and can be taught none.
pub trait Classifier {
    /// Classifies a detection by its `k` nearest examples.
    fn classify(&self, features: &Features, k: u8) -> Vote;

    /// Starts to classify a detection as [`classify`](Self::classify) does, within the time of one turn. Returns the vote if it is
    /// already certain. Otherwise the caller calls [`go_on`](Self::go_on) until it returns the vote.
    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        Some(self.classify(features, k))
    }

    /// Runs the next step, within the time of one turn. Returns the vote once it is certain. Examples added since the start do not
    /// count.
    fn go_on(&mut self) -> Option<Vote> {
        Some(Vote::UNKNOWN)
    }

    /// The class by the built-in examples alone; [`Class::Unknown`] if there are none. Ends a classification that has begun.
    fn built_in_class(&mut self, _features: &Features) -> Class {
        Class::Unknown
    }

    /// Adds a detection as an example of the class `label`, and starts to save it.
    ///
    /// # Errors
    /// [`ExamplesFull`]; the operator has to forget an example first.
    fn teach(&mut self, _features: &Features, _label: u8) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
    }

    /// Adds a complete example, and starts to save it.
    ///
    /// # Errors
    /// [`ExamplesFull`]; the operator has to forget an example first.
    fn keep(&mut self, _example: Example<{ features::COUNT }>) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
    }

    /// Forgets a field example. Returns whether it existed.
    fn forget(&mut self, _number: u8) -> bool {
        false
    }

    /// Forgets all field examples.
    fn forget_all(&mut self) {}

    /// The first example from an index on in the list of all, and the index behind it.
    fn listed(&self, _from: u8) -> Option<(Listed, u8)> {
        None
    }

    /// Saved examples that are invalid, and do not count.
    fn spoiled(&self) -> u8 {
        0
    }

    /// Runs one step of saving, without waiting. Returns whether all is written.
    fn carry_on(&mut self) -> bool {
        true
    }
}
