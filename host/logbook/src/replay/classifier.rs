//! The classifier of a replay. It uses the votes in the log for inputs that the log lacks.
//!
//! A detection's class depends on its width, its distance from the plant before, and the machine's speed class at that
//! moment. The log's line has the first two. It has the speed only ten times a second, so near the limit of two speed
//! classes both are possible. So the replay classifies a detection in every possible speed class. It accepts the log's
//! vote if one of them gives it.

use control::ground::features::{self, Features};
use control::ground::{
    class::{Class, Classifier, ExamplesFull, Vote},
    nearest::Nearest,
};
use control::memory::Volatile;
use link::examples::Taught;
use std::cell::{Cell, RefCell};
use std::collections::VecDeque;

/// Tolerance of the machine's own speed against the log's speeds around it, in mm/s.
const SPEED_SLACK_MM_S: i32 = 25;

/// Detections that a label may still refer to: as many as the firmware stores.
const OBJECTS: usize = 16;

/// The log's values for the detection in the beam.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) vote: Vote,
    /// Distance from the leading edge of the plant before, in mm.
    pub(super) spacing_mm: i16,
    pub(super) width_mm: i16,
    /// Whether to accept the log's vote: it depends on ground from before the log.
    pub(super) is_given: bool,
}

/// The firmware's classifier, with values from the log. A replay lists no examples, and ends where one is forgotten.
pub(super) struct ReplayClassifier<'a> {
    nearest: Nearest<&'a [Taught], Volatile>,
    /// The log's values for the detection that was in the beam last.
    pub(super) seen: Cell<Option<Seen>>,
    /// The machine's slowest and fastest speed about here, in mm/s.
    pub(super) speeds_mm_s: Cell<(i32, i32)>,
    /// The last detections: the replay's features, and the machine's features.
    described: RefCell<VecDeque<(Features, Features)>>,
}

impl<'a> ReplayClassifier<'a> {
    /// A classifier with a log's built-in examples and those from the field.
    pub(super) fn new(built_in: &'a [Taught], field: &[Taught]) -> Self {
        let mut nearest = Nearest::new(built_in, Volatile::new());
        for &example in field {
            // Any machine has room for as many.
            let _ = nearest.keep(example);
            while !nearest.carry_on() {}
        }
        Self { nearest, seen: Cell::default(), speeds_mm_s: Cell::default(), described: RefCell::default() }
    }

    fn speed_classes(&self) -> impl Iterator<Item = i16> {
        let class = |speed: i32| features::speed_class(speed.clamp(i16::MIN.into(), i16::MAX.into()) as i16);
        let (slowest, fastest) = self.speeds_mm_s.get();
        let slowest = class(slowest.saturating_sub(SPEED_SLACK_MM_S));
        let fastest = class(fastest.saturating_add(SPEED_SLACK_MM_S));
        features::SPEED_CLASSES_MM_S.into_iter().filter(move |class| (slowest..=fastest).contains(class))
    }

    /// The machine's features for a detection with these features in the replay.
    fn by_machine(&self, features: &Features) -> Features {
        let described = self.described.borrow();
        described.iter().find(|(by_replay, _)| by_replay == features).map_or(*features, |&(_, by_machine)| by_machine)
    }
}

impl Classifier for ReplayClassifier<'_> {
    fn classify(&self, features: &Features, k: u8) -> Vote {
        let Some(seen) = self.seen.get() else { return self.nearest.classify(features, k) };
        let describe = |class| Features::describe(class, seen.spacing_mm, seen.width_mm);
        let as_logged =
            self.speed_classes().map(describe).find(|features| self.nearest.classify(features, k) == seen.vote);
        let by_machine = as_logged.unwrap_or_else(|| describe(features.speed_mm_s()));
        let mut described = self.described.borrow_mut();
        described.truncate(OBJECTS - 1);
        described.push_front((*features, by_machine));
        if seen.is_given { seen.vote } else { self.nearest.classify(&by_machine, k) }
    }

    fn built_in_class(&mut self, features: &Features) -> Class {
        self.nearest.built_in_class(&self.by_machine(features))
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), ExamplesFull> {
        self.nearest.teach(&self.by_machine(features), label)
    }

    fn keep(&mut self, example: Taught) -> Result<(), ExamplesFull> {
        self.nearest.keep(example)
    }

    fn carry_on(&mut self) -> bool {
        self.nearest.carry_on()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use control::ground::class::label;
    use control::ground::examples::EXAMPLES;
    use knn::Example;

    #[test]
    fn a_label_is_refused_by_the_built_in_examples_alone() {
        let plant = Features::describe(556, 500, 150);
        let taught = Example::new(control::ground::examples::scale().quantise(plant.values()), label::WEED);
        let mut classifier = ReplayClassifier::new(&EXAMPLES, &[taught; 5]);
        assert_eq!(classifier.classify(&plant, 3).class, Class::Weed, "the field has taught it so");
        assert_eq!(classifier.built_in_class(&plant), Class::Plant);
    }
}
