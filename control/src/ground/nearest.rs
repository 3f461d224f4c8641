//! The classifier: the vote of the nearest labelled examples.
//!
//! Examples are feature vectors in bytes, scaled by [`examples::scale`]. The crate `knn` searches them, in flash and in SRAM. Three
//! cases give [`Class::Unknown`], which counts as a plant: a tie, a detection far from all examples, and fewer than k examples.

use crate::{
    ground::{
        class::{Class, Classifier, ExamplesFull, Listed, Vote, label},
        examples,
        features::{self, Features},
        field_examples::{self, FieldExamples},
    },
    memory::Memory,
};
use knn::{Answer, ClassifyError, Example, Examples, Kind, MAX_K, Neighbour};

/// Field examples searched in one turn. This takes half a millisecond if each one is nearer than all before it.
pub const AT_ONCE: usize = 16;

/// The nearest examples found so far.
type Found<Places> = knn::Nearest<{ label::COUNT }, Places>;

/// Classifies by the nearest of the built-in examples in `B` and the field examples in `M`.
#[derive(Clone, Debug)]
pub struct Nearest<B, M> {
    built_in: B,
    field: FieldExamples<M>,
    /// The detection that is being classified.
    query: [u8; features::COUNT],
    found: Found<[Neighbour; MAX_K as usize]>,
    asked: Asked,
}

/// How far a search has come.
#[derive(Clone, Copy, Debug)]
enum Asked {
    Nobody,
    /// Finished: the built-in examples, and the field examples before this slot.
    FieldBefore(u8),
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Nearest<B, M> {
    /// A classifier with the built-in examples and those in the memory.
    pub fn new(built_in: B, memory: M) -> Self {
        let mut nearest = Self::uninit(built_in, memory);
        nearest.init();
        nearest
    }

    /// A classifier that has not read its memory yet.
    pub const fn uninit(built_in: B, memory: M) -> Self {
        Self {
            built_in,
            field: FieldExamples::uninit(memory),
            query: [0; features::COUNT],
            found: Found::new([Neighbour::NONE; MAX_K as usize]),
            asked: Asked::Nobody,
        }
    }

    /// Adds the nearest built-in examples to those found.
    fn search_built_in(&mut self) {
        self.built_in.keep_nearest(&self.query, &mut self.found);
        self.asked = Asked::FieldBefore(0);
    }

    /// The vote of the examples found.
    #[inline(never)]
    fn vote(&self) -> Vote {
        let found: &Found<[Neighbour]> = &self.found;
        vote(found.answer(examples::RADIUS))
    }
}

/// The features in bytes, on the scale of the examples.
#[inline(never)]
fn scaled(features: &Features) -> [u8; features::COUNT] {
    examples::scale().quantise(&features.values())
}

/// Turns an answer into a vote.
fn vote(answer: Result<Answer<{ label::COUNT }>, ClassifyError>) -> Vote {
    let Ok(Answer { label, votes, kind, .. }) = answer else { return Vote::UNKNOWN };
    let class = match (kind, label) {
        (Kind::Known, label::PLANT) => Class::Plant,
        (Kind::Known, label::WEED) => Class::Weed,
        _ => Class::Unknown,
    };
    let votes = votes.get(usize::from(label)).copied().unwrap_or(0);
    Vote { class, votes: votes as u8 }
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Classifier for Nearest<B, M> {
    fn init(&mut self) {
        self.field.init();
    }

    fn classify(&self, features: &Features, k: u8) -> Vote {
        vote(knn::classify(&(&self.built_in, &self.field), &scaled(features), k, examples::RADIUS))
    }

    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        self.query = scaled(features);
        self.asked = Asked::Nobody;
        let found: &mut Found<[Neighbour]> = &mut self.found;
        found.begin(k).is_err().then_some(Vote::UNKNOWN)
    }

    fn go_on(&mut self) -> Option<Vote> {
        let Asked::FieldBefore(slot) = self.asked else {
            self.search_built_in();
            return None;
        };
        let (_, rest) = self.field.places().split_at_checked(slot.into()).unwrap_or_default();
        if rest.is_empty() {
            return Some(self.vote());
        }
        let next = rest.get(..AT_ONCE).unwrap_or(rest);
        self.built_in.keep_nearest_of(next, &self.query, &mut self.found);
        self.asked = Asked::FieldBefore(slot + next.len() as u8);
        None
    }

    fn built_in_class(&mut self, features: &Features) -> Class {
        // With the k of the training, because the setting `k` is meant for all examples together.
        match self.begin(features, examples::K) {
            Some(vote) => vote.class,
            None => {
                self.search_built_in();
                self.vote().class
            }
        }
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), ExamplesFull> {
        self.keep(Example::new(scaled(features), label))
    }

    fn keep(&mut self, example: Example<{ features::COUNT }>) -> Result<(), ExamplesFull> {
        self.field.add(example).map(|_| ()).map_err(|_| ExamplesFull)
    }

    fn forget(&mut self, number: u8) -> bool {
        self.field.forget(number)
    }

    fn listed(&self, place: u8) -> Option<(Listed, u8)> {
        let built_in = self.built_in.len() as u8;
        if let Some(example) = self.built_in.example(usize::from(place)) {
            return Some((Listed { from_field: false, number: place, example }, place + 1));
        }
        for number in place - built_in..field_examples::CAPACITY {
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

const _: () =
    assert!(examples::COUNT + field_examples::CAPACITY as usize <= u8::MAX as usize, "a byte counts the examples");

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Volatile;
    use std::vec::Vec;

    /// The listed examples: whether each is from the field, its number and its label.
    fn listed(nearest: &Nearest<impl Examples<{ features::COUNT }>, Volatile>) -> Vec<(bool, u8, u8)> {
        let (mut listed, mut place) = (Vec::new(), 0);
        while let Some((entry, next)) = nearest.listed(place) {
            listed.push((entry.from_field, entry.number, entry.example.label));
            place = next;
        }
        listed
    }

    #[test]
    fn examples_in_flash_and_from_the_field_are_searched_as_one_set() {
        // Both tables full: weeds built in, and field examples that call the same detection a plant.
        let features = Features::describe(556, 300, 60);
        let bytes = examples::scale().quantise(&features.values());
        let mut nearest = Nearest::new([Example::new(bytes, label::WEED); examples::CAPACITY], Volatile::new());
        assert_eq!(nearest.classify(&features, 3), Vote { class: Class::Weed, votes: examples::CAPACITY as u8 });
        for _ in 0..field_examples::CAPACITY {
            assert_eq!(nearest.teach(&features, label::PLANT), Ok(()));
        }
        assert_eq!(nearest.teach(&features, label::PLANT), Err(ExamplesFull));
        let listed = listed(&nearest);
        assert!(listed.iter().all(|&(from_field, _, label)| from_field == (label == label::PLANT)));
        assert_eq!(listed.len(), examples::CAPACITY + usize::from(field_examples::CAPACITY));
        // All are as near as the k-th nearest, so all vote, field examples too.
        let all = (&nearest.built_in, &nearest.field);
        let answer = knn::classify::<{ features::COUNT }, { label::COUNT }>(&all, &bytes, 3, examples::RADIUS).unwrap();
        assert_eq!(answer.votes.map(usize::from), [examples::CAPACITY, usize::from(field_examples::CAPACITY)]);
    }

    #[test]
    fn invalid_field_examples_are_counted_at_start_up() {
        let mut memory = Volatile::new();
        (memory.bytes[0], memory.bytes[100]) = (0, 0);
        let mut nearest = Nearest::new([Example::new([0; features::COUNT], label::WEED); 1], memory);
        nearest.init();
        assert_eq!(nearest.spoiled(), 2);
    }

    #[test]
    fn a_forgotten_example_is_not_listed_and_does_not_vote() {
        let features = Features::describe(556, 300, 60);
        let bytes = examples::scale().quantise(&features.values());
        let mut nearest = Nearest::new([Example::new(bytes, label::WEED); 2], Volatile::new());
        for label in [label::PLANT, label::WEED, label::PLANT] {
            assert_eq!(nearest.teach(&features, label), Ok(()));
        }
        let [built_in, second] = [(false, 0, label::WEED), (false, 1, label::WEED)];
        let field = [(true, 0, label::PLANT), (true, 1, label::WEED), (true, 2, label::PLANT)];
        assert_eq!(listed(&nearest), [built_in, second, field[0], field[1], field[2]]);
        assert_eq!(nearest.classify(&features, 1), Vote { class: Class::Weed, votes: 3 });
        assert!(nearest.forget(1) && !nearest.forget(1), "only the first call forgets it");
        assert_eq!(listed(&nearest), [built_in, second, field[0], field[2]]);
        assert_eq!(nearest.classify(&features, 1).class, Class::Unknown, "two against two");
        assert!(nearest.forget(0));
        assert_eq!(listed(&nearest), [built_in, second, field[2]]);
        assert_eq!(nearest.classify(&features, 1), Vote { class: Class::Weed, votes: 2 });
        assert!(!nearest.forget(field_examples::CAPACITY));
        assert_eq!(nearest.built_in_class(&features), Class::Unknown, "fewer examples than k");
    }
}
