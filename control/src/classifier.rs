//! What an object is: the vote of the nearest labelled examples.
//!
//! The examples are feature vectors in bytes, scaled by [`examples::scale`] and searched by the
//! crate `knn` wherever they lie. Whatever the answer leaves open, a tie, a stranger, a table with fewer examples than
//! are to vote, is [`Class::Unknown`], which everyone treats as a plant.

use crate::{
    examples,
    features::{self, Features},
};
use knn::{Answer, Examples, Kind};

/// What an object is taken for.
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

/// Tells plants from weeds.
pub trait Classifier {
    /// Classifies an object by its `k` nearest examples.
    fn classify(&self, features: &Features, k: u8) -> Vote;
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

/// Classifies by the nearest of the examples that `E` holds.
#[derive(Clone, Debug)]
pub struct Nearest<E>(pub E);

impl<E: Examples<{ features::COUNT }>> Classifier for Nearest<E> {
    fn classify(&self, features: &Features, k: u8) -> Vote {
        let query = examples::scale().quantise(&features.values());
        let answer = knn::classify::<{ features::COUNT }, { label::COUNT }>(&self.0, &query, k, examples::RADIUS);
        let Ok(Answer { label, votes, kind, .. }) = answer else {
            return Vote { class: Class::Unknown, votes: 0 };
        };
        let class = match (kind, label) {
            (Kind::Known, label::PLANT) => Class::Plant,
            (Kind::Known, label::WEED) => Class::Weed,
            _ => Class::Unknown,
        };
        let votes = votes.get(usize::from(label)).copied().unwrap_or(0);
        Vote { class, votes: votes.min(usize::from(u8::MAX)) as u8 }
    }
}
