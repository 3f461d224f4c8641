//! The question what a detection is, plant or weed, and who answers it.
//!
//! Whatever an answer leaves open is [`Class::Unknown`], which everyone treats as a plant. The machine asks the [nearest
//! examples](super::nearest); a test may ask something else.

use super::features::{self, Features};
use knn::Example;

/// What a detection is taken for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Class {
    /// A crop plant: the tool leaves the row for it.
    Plant,
    /// A tall weed: the tool keeps working.
    Weed,
    /// Like nothing that was taught, or like both: treated as a plant.
    Unknown,
}

/// A class and the votes for it among the k nearest examples.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Vote {
    /// The class that won.
    pub class: Class,
    /// Examples of that class among the nearest; of the strongest class where the answer is unknown.
    pub votes: u8,
}

impl Vote {
    /// Nobody knows, and nobody has voted.
    pub const UNKNOWN: Self = Self { class: Class::Unknown, votes: 0 };
}

/// Labels in an example table.
pub mod label {
    /// A tall weed.
    pub const WEED: u8 = 0;
    /// A crop plant.
    pub const PLANT: u8 = 1;
    /// How many labels there are.
    pub const COUNT: usize = 2;
}

/// An example as it stands in the list of all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Listed {
    /// Whether it was taught in the field, and can be forgotten.
    pub from_field: bool,
    /// Its number among those of its source.
    pub number: u8,
    /// The example.
    pub example: Example<{ features::COUNT }>,
}

/// All places for examples from the field are taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExamplesFull;

/// Tells plants from weeds, and may be taught.
pub trait Classifier {
    /// Looks what was kept over the loss of power; to be called once, before anything else.
    fn init(&mut self);

    /// Classifies a detection by its `k` nearest examples.
    fn classify(&self, features: &Features, k: u8) -> Vote;

    /// Begins to classify a detection as [`classify`](Self::classify) does, but takes no longer than a turn of the loop may; the vote, if
    /// that was enough. Otherwise [`go_on`](Self::go_on) is called until it has the vote.
    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        Some(self.classify(features, k))
    }

    /// Goes on with what was begun, for no longer than a turn of the loop may take; the vote, if that was enough. The examples are those
    /// that there were when it began.
    fn go_on(&mut self) -> Option<Vote> {
        Some(Vote::UNKNOWN)
    }

    /// What the built-in examples alone take a detection for; [`Class::Unknown`] where there are none. What was begun is dropped.
    fn built_in_class(&mut self, features: &Features) -> Class;

    /// Adds a detection as an example of the class `label`, to be kept over a loss of power.
    ///
    /// # Errors
    /// [`ExamplesFull`]; one has to be forgotten first.
    fn teach(&mut self, features: &Features, label: u8) -> Result<(), ExamplesFull>;

    /// Adds an example that is known already, to be kept over a loss of power.
    ///
    /// # Errors
    /// [`ExamplesFull`]; one has to be forgotten first.
    fn keep(&mut self, example: Example<{ features::COUNT }>) -> Result<(), ExamplesFull>;

    /// Forgets the example from the field with this number; whether there was one.
    fn forget(&mut self, number: u8) -> bool;

    /// The first example from `place` on in the list of all, and the place behind it.
    fn listed(&self, place: u8) -> Option<(Listed, u8)>;

    /// Examples that were found spoiled, and dropped, when the machine woke up.
    fn spoiled(&self) -> u8;

    /// Carries on with what is being kept for good, without waiting; whether all has been written.
    fn carry_on(&mut self) -> bool;
}
