//! What the tests of the decisions share: readings, and a classifier that knows the truth.

use control::{
    classifier::{Class, Classifier, Full, Listed, Vote},
    controller::Readings,
    features::Features,
    units::{Instant, Interval, Position},
};

/// Takes for a weed what is narrower than 60 mm.
#[derive(Clone, Debug)]
pub struct ByWidth;

impl Classifier for ByWidth {
    fn classify(&self, features: &Features, _: u8) -> Vote {
        let class = if features.hold_mm < 160 { Class::Weed } else { Class::Plant };
        Vote { class, votes: 1 }
    }

    fn teach(&mut self, _: &Features, _: u8) -> Result<(), Full> {
        Err(Full)
    }

    fn forget(&mut self, _: u8) -> bool {
        false
    }

    fn listed(&self, _: u8) -> Option<(Listed, u8)> {
        None
    }

    fn spoiled(&self) -> u8 {
        0
    }
}

/// Readings of a machine at `count`, `microseconds` after the first moment.
pub fn readings(microseconds: u64, count: i32) -> Readings {
    Readings {
        now: Instant::default() + Interval::from_steps((microseconds / 4) as u32),
        position: Position::new(count),
        switch_on: false,
        lost: 0,
    }
}
