//! Shared code of the decisions' tests: a machine with a classifier that knows the true classes.

use control::ground::{
    class::{Class, Classifier, Vote},
    features::Features,
};
use rig::Rig;

/// The least hold of a plant that is 60 mm wide, in mm.
pub const LEAST_HOLD_MM: i16 = 160;

/// Classifies detections with a shorter hold as weeds.
#[derive(Clone, Debug)]
pub struct ByWidth {
    least_hold_mm: i16,
    /// Additional turns for each classification.
    turns: u16,
    /// The pending vote, and the turns until it.
    vote: (Vote, u16),
}

impl ByWidth {
    /// A classifier with this least hold of a plant that answers `turns` turns later. With 0 mm all detections are plants, as after
    /// teaching a crop of stalks.
    pub fn new(least_hold_mm: i16, turns: u16) -> Self {
        Self { least_hold_mm, turns, vote: (Vote::UNKNOWN, 0) }
    }
}

impl Classifier for ByWidth {
    fn begin(&mut self, features: &Features, k: u8) -> Option<Vote> {
        self.vote = (self.classify(features, k), self.turns);
        (self.turns == 0).then_some(self.vote.0)
    }

    fn go_on(&mut self) -> Option<Vote> {
        let (vote, turns) = &mut self.vote;
        *turns -= 1;
        (*turns == 0).then_some(*vote)
    }

    fn classify(&self, features: &Features, _: u8) -> Vote {
        let class = if features.hold_mm() < self.least_hold_mm { Class::Weed } else { Class::Plant };
        Vote { class, votes: 1 }
    }
}

/// A machine in HOLD that started without saved settings; the operator has cleared that alarm.
pub fn machine() -> Machine {
    Rig::new(ByWidth::new(LEAST_HOLD_MM, 0))
}

/// A machine as the tests have it.
pub type Machine = Rig<ByWidth>;
