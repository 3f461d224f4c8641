//! What the tests of the decisions share: readings, and a classifier that knows the truth.

mod readings;

pub use readings::{readings, woken_up};

use control::{
    ground::{
        class::{Class, Classifier, ExamplesFull, Listed, Vote},
        features::Features,
    },
    measure::reset::Cause,
    memory::Volatile,
    weeder::Controller,
};
use knn::Example;

/// Takes for a weed what is narrower than 60 mm.
#[derive(Clone, Debug)]
pub struct ByWidth;

impl Classifier for ByWidth {
    fn wake_up(&mut self) {}

    fn classify(&self, features: &Features, _: u8) -> Vote {
        let class = if features.hold_mm < 160 { Class::Weed } else { Class::Plant };
        Vote { class, votes: 1 }
    }

    fn built_in_class(&self, _: &Features) -> Class {
        Class::Unknown
    }

    fn teach(&mut self, _: &Features, _: u8) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
    }

    fn keep(&mut self, _: Example<5>) -> Result<(), ExamplesFull> {
        Err(ExamplesFull)
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

    fn carry_on(&mut self) -> bool {
        true
    }
}

/// A machine in HOLD that woke up without saved settings and was told that this is right.
pub fn machine() -> Machine {
    let mut machine = Controller::new(ByWidth, Volatile::new(), woken_up(Cause::PowerOn));
    machine.clear();
    machine
}

/// A machine as the tests have it.
pub type Machine = Controller<ByWidth, Volatile>;
