//! The classifier: the vote of the nearest labelled examples.
//!
//! Examples are feature vectors in bytes, scaled by [`examples::scale`]. They are searched in flash and in the EEPROM, some in each
//! turn, with the crate `knn`. Three cases give [`Class::Unknown`], which counts as a plant: a tie, a detection far from all
//! examples of the class with the most votes, and fewer than k examples. Of a plant and a weed at the same distance, the plant is
//! nearer.

use crate::{
    ground::{
        class::{Class, Classifier, ExamplesFull, Listed, Vote, label},
        examples,
        features::{self, Features},
        field_examples::{self, FieldExamples},
    },
    memory::Memory,
};
use knn::{Answer, Example, Examples, Kind, MAX_K, Neighbour};

/// Examples searched in one turn.
pub const AT_ONCE: u8 = 8;

/// The nearest examples found so far.
type Found<Places> = knn::Nearest<{ label::COUNT }, Places>;

// Of two examples at the same distance, `knn` takes that with the greater label.
const _: () = assert!(label::PLANT > label::WEED);

/// Classifies by the nearest of the built-in examples in `B` and the field examples in `M`.
#[derive(Clone, Debug)]
pub struct Nearest<B, M> {
    built_in: B,
    field: FieldExamples<M>,
    /// The detection that is being classified.
    query: [u8; features::COUNT],
    found: Found<[Neighbour; MAX_K as usize]>,
    /// The index of the example that is asked next: the built-in ones come first, then the slots of field examples.
    asked: u8,
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Nearest<B, M> {
    /// A classifier with the built-in examples and those in the memory.
    pub const fn new(built_in: B, memory: M) -> Self {
        Self {
            built_in,
            field: FieldExamples::new(memory),
            query: [0; features::COUNT],
            // Zeros take no flash, and `begin` clears the places.
            found: Found::new([Neighbour::VACANT; MAX_K as usize]),
            asked: 0,
        }
    }

    /// The number of built-in examples.
    fn built_in(&self) -> u8 {
        self.built_in.len() as u8
    }

    /// The number of examples and free slots.
    fn all(&self) -> u8 {
        self.built_in() + field_examples::CAPACITY
    }

    /// The example at an index, if there is one.
    fn at(&self, index: u8) -> Option<Example<{ features::COUNT }>> {
        match index.checked_sub(self.built_in()) {
            None => self.built_in.example(index.into()),
            Some(slot) => self.field.slot(slot),
        }
    }

    /// Asks the next examples, up to an index.
    #[inline(never)]
    fn ask(&mut self, end: u8) {
        let found: &mut Found<[Neighbour]> = &mut self.found;
        let built_in = self.built_in.len() as u8;
        self.built_in.join(self.asked.into()..end.min(built_in).into(), &self.query, found);
        self.asked = self.asked.max(end.min(built_in));
        while self.asked < end {
            if let Some(example) = &self.field.slot(self.asked - built_in) {
                found.join(example.neighbour_of(&self.query));
            }
            self.asked += 1;
        }
    }

    /// The vote of the examples found, as [`knn::Nearest::answer`] counts it, for the two labels here.
    #[inline(never)]
    fn vote(&self) -> Vote {
        let found: &Found<[Neighbour]> = &self.found;
        let voters = found.places();
        if voters.first().is_none_or(|farthest| *farthest == Neighbour::NONE) {
            return Vote::UNKNOWN;
        }
        let plants: u8 = voters.iter().map(|example| example.label()).sum();
        let weeds = voters.len() as u8 - plants;
        let (class, label, votes) =
            if plants > weeds { (Class::Plant, label::PLANT, plants) } else { (Class::Weed, label::WEED, weeds) };
        // Far weeds that outvote a plant at hand, which was just taught, are not believed.
        let beyond = const { Neighbour::new(examples::RADIUS + 1, u8::MAX) };
        let is_known = plants != weeds && voters.iter().any(|voter| voter.label() == label && *voter < beyond);
        Vote { class: if is_known { class } else { Class::Unknown }, votes }
    }
}

/// The features in bytes, on the scale of the examples.
#[inline(never)]
fn scaled(features: &Features) -> [u8; features::COUNT] {
    examples::scale().quantise(features.values())
}

impl<B: Examples<{ features::COUNT }>, M: Memory> Classifier for Nearest<B, M> {
    fn classify(&self, features: &Features, k: u8) -> Vote {
        let answer = knn::classify::<{ features::COUNT }, { label::COUNT }>(
            &(&self.built_in, &self.field),
            &scaled(features),
            k,
            examples::RADIUS,
        );
        let Ok(Answer { label, votes, kind, .. }) = answer else { return Vote::UNKNOWN };
        let class = match (kind, label) {
            (Kind::Known, label::PLANT) => Class::Plant,
            (Kind::Known, _) => Class::Weed,
            _ => Class::Unknown,
        };
        Vote { class, votes: votes[usize::from(label)] }
    }

    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        self.query = scaled(features);
        self.asked = 0;
        let found: &mut Found<[Neighbour]> = &mut self.found;
        found.begin(k).is_err().then_some(Vote::UNKNOWN)
    }

    fn go_on(&mut self) -> Option<Vote> {
        if self.asked == self.all() {
            return Some(self.vote());
        }
        // During a write the memory cannot be read.
        if self.field.is_ready() {
            self.ask(self.all().min(self.asked + AT_ONCE));
        }
        None
    }

    fn built_in_class(&mut self, features: &Features) -> Class {
        // With the k of the training, because the setting `k` is meant for all examples together.
        match self.begin(features, examples::K) {
            Some(vote) => vote.class,
            None => {
                self.ask(self.built_in());
                self.vote().class
            }
        }
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), ExamplesFull> {
        self.keep(Example::new(scaled(features), label))
    }

    fn keep(&mut self, example: Example<{ features::COUNT }>) -> Result<(), ExamplesFull> {
        if self.field.add(example) { Ok(()) } else { Err(ExamplesFull) }
    }

    fn forget(&mut self, number: u8) -> bool {
        self.field.forget(number)
    }

    fn forget_all(&mut self) {
        self.field.forget_all();
    }

    fn listed(&self, from: u8) -> Option<(Listed, u8)> {
        (from..self.all()).find_map(|index| {
            let example = self.at(index)?;
            let slot = index.checked_sub(self.built_in());
            Some((Listed { from_field: slot.is_some(), number: slot.unwrap_or(index), example }, index + 1))
        })
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
        let bytes = examples::scale().quantise(features.values());
        let mut nearest = Nearest::new([Example::new(bytes, label::WEED); examples::CAPACITY], Volatile::new());
        assert_eq!(nearest.classify(&features, 3), Vote { class: Class::Weed, votes: 3 });
        for _ in 0..field_examples::CAPACITY {
            assert_eq!(nearest.teach(&features, label::PLANT), Ok(()));
            while !nearest.carry_on() {}
        }
        assert_eq!(nearest.teach(&features, label::PLANT), Err(ExamplesFull));
        let listed = listed(&nearest);
        assert!(listed.iter().all(|&(from_field, _, label)| from_field == (label == label::PLANT)));
        assert_eq!(listed.len(), examples::CAPACITY + usize::from(field_examples::CAPACITY));
        // All are at the same distance, and the plants are nearer.
        assert_eq!(nearest.classify(&features, 3), Vote { class: Class::Plant, votes: 3 });
    }

    #[test]
    fn a_detection_that_was_unknown_is_no_weed_after_its_label_plant() {
        let mut unknown = 0;
        for (speed_mm_s, width_mm) in
            features::SPEED_CLASSES_MM_S.iter().flat_map(|speed| (20..100).map(|mm| (*speed, mm)))
        {
            let features = Features::describe(speed_mm_s, 500, width_mm);
            for k in 1..=MAX_K {
                let mut nearest = Nearest::new(examples::EXAMPLES, Volatile::new());
                if nearest.classify(&features, k).class == Class::Unknown {
                    unknown += 1;
                    assert_eq!(nearest.teach(&features, label::PLANT), Ok(()));
                    while !nearest.carry_on() {}
                    assert!(nearest.begin(&features, k).is_none());
                    let stepped = core::iter::repeat_with(|| nearest.go_on()).flatten().next();
                    assert_eq!(stepped, Some(nearest.classify(&features, k)), "{width_mm} mm, k {k}");
                    assert_ne!(nearest.classify(&features, k).class, Class::Weed, "{width_mm} mm, k {k}");
                }
            }
        }
        assert!(unknown > 500, "{unknown}");
    }

    #[test]
    fn invalid_field_examples_are_counted() {
        let mut memory = Volatile::new();
        (memory.bytes[5], memory.bytes[8 * 12 + 5]) = (0, 1);
        let nearest = Nearest::new([Example::new([0; features::COUNT], label::WEED); 1], memory);
        assert_eq!(nearest.spoiled(), 2);
    }

    #[test]
    fn a_forgotten_example_is_not_listed_and_does_not_vote() {
        let features = Features::describe(556, 300, 60);
        let bytes = examples::scale().quantise(features.values());
        let mut nearest = Nearest::new([Example::new(bytes, label::WEED); 2], Volatile::new());
        for label in [label::PLANT, label::WEED, label::PLANT] {
            assert_eq!(nearest.teach(&features, label), Ok(()));
            while !nearest.carry_on() {}
        }
        let [built_in, second] = [(false, 0, label::WEED), (false, 1, label::WEED)];
        let field = [(true, 0, label::PLANT), (true, 1, label::WEED), (true, 2, label::PLANT)];
        assert_eq!(listed(&nearest), [built_in, second, field[0], field[1], field[2]]);
        assert_eq!(nearest.classify(&features, 5), Vote { class: Class::Weed, votes: 3 });
        assert!(nearest.forget(1));
        while !nearest.carry_on() {}
        assert!(!nearest.forget(1), "only the first call forgets it");
        assert_eq!(listed(&nearest), [built_in, second, field[0], field[2]]);
        assert_eq!(nearest.classify(&features, 4).class, Class::Unknown, "two against two");
        assert!(nearest.forget(0));
        while !nearest.carry_on() {}
        assert_eq!(listed(&nearest), [built_in, second, field[2]]);
        assert_eq!(nearest.classify(&features, 3), Vote { class: Class::Weed, votes: 2 });
        assert!(!nearest.forget(field_examples::CAPACITY));
        assert_eq!(nearest.built_in_class(&features), Class::Unknown, "fewer examples than k");
    }
}
