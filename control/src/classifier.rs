//! What an object is: the vote of the nearest labelled examples.
//!
//! The examples are feature vectors in bytes, scaled by [`examples::scale`] and searched by the
//! crate `knn` wherever they lie. Whatever the answer leaves open, a tie, a stranger, a table with fewer examples than
//! are to vote, is [`Class::Unknown`], which everyone treats as a plant.

use crate::{
    examples,
    features::{self, Features},
    memory::Memory,
    taught::{self, FieldExamples},
};
use knn::{Answer, Example, Examples, Kind, Neighbour};

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
pub struct Full;

/// Tells plants from weeds, and may be taught.
pub trait Classifier {
    /// Looks what was kept over the loss of power; to be called once, before anything else.
    fn wake_up(&mut self);

    /// Classifies an object by its `k` nearest examples.
    fn classify(&self, features: &Features, k: u8) -> Vote;

    /// What the built-in examples alone take an object for; [`Class::Unknown`] where there are none.
    fn built_in_class(&self, features: &Features) -> Class;

    /// Adds an object as an example of the class `label`, to be kept over a loss of power.
    ///
    /// # Errors
    /// [`Full`]; one has to be forgotten first.
    fn teach(&mut self, features: &Features, label: u8) -> Result<(), Full>;

    /// Forgets the example from the field with this number; whether there was one.
    fn forget(&mut self, number: u8) -> bool;

    /// The first example from `place` on in the list of all, and the place behind it.
    fn listed(&self, place: u8) -> Option<(Listed, u8)>;

    /// Examples that were found spoiled, and dropped, when the machine woke up.
    fn spoiled(&self) -> u8;

    /// Carries on with what is being kept for good, without waiting; whether all has been written.
    fn carry_on(&mut self) -> bool;
}

/// Classifies by the nearest of the built-in examples in `B` and those taught in the field, kept in `M`.
#[derive(Clone, Debug)]
pub struct Nearest<B, M> {
    built_in: B,
    field: FieldExamples<M>,
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Nearest<B, M> {
    /// A classifier with the built-in examples and those that the memory holds.
    pub fn new(built_in: B, memory: M) -> Self {
        let mut nearest = Self::asleep(built_in, memory);
        nearest.wake_up();
        nearest
    }

    /// A classifier that has not looked at its memory yet.
    pub const fn asleep(built_in: B, memory: M) -> Self {
        Self { built_in, field: FieldExamples::asleep(memory) }
    }

    /// Asks the `k` nearest of the built-in examples and, `with_field`, of those from the field.
    #[inline(never)]
    fn vote(&self, features: &Features, k: u8, with_field: bool) -> Vote {
        let query = examples::scale().quantise(&features.values());
        let all = (&self.built_in, FromField { examples: &self.field, vote: with_field });
        let answer = knn::classify::<{ features::COUNT }, { label::COUNT }>(&all, &query, k, examples::RADIUS);
        let Ok(Answer { label, votes, kind, .. }) = answer else {
            return Vote { class: Class::Unknown, votes: 0 };
        };
        let class = match (kind, label) {
            (Kind::Known, label::PLANT) => Class::Plant,
            (Kind::Known, label::WEED) => Class::Weed,
            _ => Class::Unknown,
        };
        let votes = votes.get(usize::from(label)).copied().unwrap_or(0);
        Vote { class, votes: votes as u8 }
    }
}

/// The examples from the field, which may have no vote.
struct FromField<'a, M> {
    examples: &'a FieldExamples<M>,
    vote: bool,
}

impl<M: Memory> Examples<{ features::COUNT }> for FromField<'_, M> {
    fn len(&self) -> usize {
        if self.vote { self.examples.len() } else { 0 }
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        self.examples.example(index).filter(|_| self.vote)
    }

    fn keep_nearest(
        &self,
        query: &[u8; features::COUNT],
        nearest: &mut [Neighbour],
        level: &mut impl FnMut(Neighbour),
    ) {
        if self.vote {
            self.examples.keep_nearest(query, nearest, level);
        }
    }
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Classifier for Nearest<B, M> {
    fn wake_up(&mut self) {
        self.field.wake_up();
    }

    fn classify(&self, features: &Features, k: u8) -> Vote {
        self.vote(features, k, true)
    }

    fn built_in_class(&self, features: &Features) -> Class {
        // As many vote as when they were trained, whatever the settings say for all together.
        self.vote(features, examples::K, false).class
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), Full> {
        let example = Example::new(examples::scale().quantise(&features.values()), label);
        self.field.add(example).map(|_| ()).map_err(|_| Full)
    }

    fn forget(&mut self, number: u8) -> bool {
        self.field.forget(number)
    }

    fn listed(&self, place: u8) -> Option<(Listed, u8)> {
        let built_in = self.built_in.len() as u8;
        if let Some(example) = self.built_in.example(usize::from(place)) {
            return Some((Listed { from_field: false, number: place, example }, place + 1));
        }
        for number in place - built_in..taught::CAPACITY {
            if let Some(example) = self.field.slot(number) {
                return Some((Listed { from_field: true, number, example }, built_in + number + 1));
            }
        }
        None
    }

    fn spoiled(&self) -> u8 {
        self.field.spoiled()
    }

    fn carry_on(&mut self) -> bool {
        self.field.carry_on()
    }
}

const _: () = assert!(examples::COUNT + taught::CAPACITY as usize <= u8::MAX as usize, "a byte counts the examples");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Volatile;

    #[test]
    fn examples_in_flash_and_from_the_field_are_searched_as_one_set() {
        // As many of both as there may ever be: weeds built in, and the field teaches that the same object is a plant.
        let features = Features::describe(556, 300, 60);
        let bytes = examples::scale().quantise(&features.values());
        let mut nearest = Nearest::new([Example::new(bytes, label::WEED); examples::CAPACITY], Volatile::new());
        assert_eq!(nearest.classify(&features, 3), Vote { class: Class::Weed, votes: examples::CAPACITY as u8 });
        for _ in 0..taught::CAPACITY {
            assert_eq!(nearest.teach(&features, label::PLANT), Ok(()));
        }
        assert_eq!(nearest.teach(&features, label::PLANT), Err(Full));
        let mut listed = 0;
        let mut place = 0;
        while let Some((example, next)) = nearest.listed(place) {
            assert_eq!(example.from_field, example.example.label == label::PLANT);
            (listed, place) = (listed + 1, next);
        }
        assert_eq!(listed, examples::CAPACITY + usize::from(taught::CAPACITY));
        // All are level with the k-th nearest, so all vote, those from the field too.
        let all = (&nearest.built_in, &nearest.field);
        let answer = knn::classify::<{ features::COUNT }, { label::COUNT }>(&all, &bytes, 3, examples::RADIUS).unwrap();
        assert_eq!(answer.votes.map(usize::from), [examples::CAPACITY, usize::from(taught::CAPACITY)]);
    }
}
