//! The operator's labels and entered examples, compared with the built-in examples.

use control::{
    ground::{
        class::{Class, Classifier},
        examples::EXAMPLES,
        nearest::Nearest,
    },
    memory::Volatile,
    settings::Setting,
};
use rig::{Beams, ByExamples, Rig};

/// A tick at 2 km/h.
const TICK_US: u32 = 942;

/// A machine that rolls at 2 km/h, in hold.
struct Rolling {
    machine: Rig<ByExamples>,
    /// Where the last detection began.
    leading: i32,
}

impl Rolling {
    fn new() -> Self {
        let nearest = Nearest::new(&EXAMPLES[..], Volatile::new());
        Self { machine: Rig::new(nearest), leading: 0 }
    }

    /// Rolls past a detection, `spacing_mm` behind the last one's leading edge. Returns its class.
    fn past(&mut self, spacing_mm: u16, width_mm: u16) -> Class {
        let wheel = self.machine.settings().wheel();
        let leading = self.leading + wheel.ticks(spacing_mm).0;
        let trailing = leading + wheel.ticks(width_mm).0;
        self.roll_to(leading);
        self.machine.see(Beams::one(true));
        self.roll_to(trailing);
        self.machine.see(Beams::one(false));
        self.roll_to(trailing + wheel.ticks(40).0);
        self.leading = leading;
        self.machine.detections().last().expect("the object was seen").vote.class
    }

    fn roll_to(&mut self, count: i32) {
        for count in self.machine.readings.position.count() + 1..=count {
            self.machine.at(count).turn_after(TICK_US);
        }
    }

    /// Enters a line. Returns the last line of its answer.
    fn ask(&mut self, line: &str) -> String {
        self.machine.ask(line).pop().expect("an answer")
    }

    fn label(&self) -> Option<u8> {
        self.machine.detections().last().expect("an object").label
    }
}

#[test]
fn a_label_against_the_built_in_examples_needs_force() {
    for (width_mm, class, wrong, right) in [(150, Class::Plant, "weed", "plant"), (16, Class::Weed, "plant", "weed")] {
        let mut rolling = Rolling::new();
        assert_eq!(rolling.past(540, width_mm), class);
        let refusal = format!("error: the built-in examples say {right}, look again, or add force");
        assert_eq!(rolling.ask(&format!("label {wrong}")), refusal);
        assert_eq!(rolling.label(), None, "it can still be labelled");
        assert_eq!(rolling.ask(&format!("label {right}")), "ok");
        rolling.past(540, width_mm);
        assert_eq!(rolling.ask(&format!("label {wrong} force")), "ok");
        assert!(rolling.label().is_some());
    }
}

#[test]
fn two_wrong_labels_do_not_make_weeds_of_the_plants_that_follow() {
    for k in [1, 3] {
        let mut rolling = Rolling::new();
        rolling.machine.set(Setting::K, k).expect("within its range");
        for _ in 0..2 {
            rolling.past(540, 150);
            assert!(rolling.ask("label weed").starts_with("error: "));
        }
        assert_eq!(rolling.past(540, 150), Class::Plant, "k {k}");
    }
}

#[test]
fn field_examples_do_not_change_the_built_in_class() {
    let mut rolling = Rolling::new();
    rolling.machine.set(Setting::K, 1).expect("within its range");
    assert_eq!(rolling.past(540, 150), Class::Plant);
    assert_eq!(rolling.ask("label weed force"), "ok");
    assert_eq!(rolling.past(540, 150), Class::Weed, "the label was forced");
    assert!(rolling.ask("label weed").starts_with("error: the built-in examples say plant"));
}

#[test]
fn a_detection_unknown_to_the_built_in_examples_is_taught_without_force() {
    for label in ["plant", "weed"] {
        let mut rolling = Rolling::new();
        assert_eq!(rolling.past(540, 55), Class::Unknown);
        assert_eq!(rolling.ask(&format!("label {label}")), "ok");
    }
}

#[test]
fn a_detection_whose_start_was_not_seen_takes_no_label() {
    let mut rolling = Rolling::new();
    rolling.machine.see(Beams::one(true));
    rolling.ask("start");
    rolling.ask("hold");
    assert_eq!(rolling.past(0, 150), Class::Unknown);
    for line in ["label plant", "label weed force"] {
        assert_eq!(rolling.ask(line), "error: there is no detection without a label, let the beam see one first");
    }
    assert_eq!(rolling.label(), None);
    rolling.past(500, 150);
    assert_eq!(rolling.ask("label plant"), "ok");
}

#[test]
fn a_wrong_example_is_forgotten_by_its_number_or_with_all_others() {
    for command in ["forget 0", "forget all"] {
        let mut rolling = Rolling::new();
        rolling.machine.set(Setting::K, 1).expect("within its range");
        rolling.past(540, 150);
        assert_eq!(rolling.ask("label weed force"), "ok");
        assert_eq!(rolling.ask(command), "ok");
        assert_eq!(rolling.past(540, 150), Class::Plant, "{command}");
        let refusal = rolling.ask("forget 0");
        assert!(refusal.starts_with("error: "), "it is already forgotten: {refusal}");
    }
}

#[test]
fn an_example_entered_by_its_features_equals_a_labelled_one() {
    let mut rolling = Rolling::new();
    rolling.past(540, 150);
    rolling.past(540, 55);
    assert_eq!(rolling.ask("label weed"), "ok");
    let listed = rolling.machine.classifier().listed(EXAMPLES.len() as u8).expect("it was taught").0.example;
    assert_eq!(rolling.ask("forget all"), "ok");
    for round in 0..2 {
        for feature in listed.features {
            assert_eq!(rolling.ask(&format!("teach {feature}")), "ok");
        }
        assert_eq!(rolling.ask("teach weed"), "ok", "{round}");
    }
    let taught = (0..2).map(|place| rolling.machine.classifier().listed(EXAMPLES.len() as u8 + place));
    assert!(taught.into_iter().all(|taught| taught.expect("it was taught").0.example == listed));
}

#[test]
fn an_example_with_a_wrong_number_of_features_is_refused() {
    for features in (0..20).filter(|&features| features != 5).chain([255, 256, 261, 600]) {
        let mut rolling = Rolling::new();
        for feature in 0..features {
            assert_eq!(rolling.ask(&format!("teach {}", feature % 256)), "ok");
        }
        assert!(rolling.ask("teach plant").starts_with("error: tell its 5 features first"), "{features}");
        for feature in 0..5 {
            assert_eq!(rolling.ask(&format!("teach {feature}")), "ok");
        }
        assert_eq!(rolling.ask("teach plant"), "ok", "{features}");
    }
}

#[test]
fn examples_are_entered_in_hold_only() {
    let mut rolling = Rolling::new();
    for feature in 0..5 {
        assert_eq!(rolling.ask(&format!("teach {feature}")), "ok");
    }
    assert_eq!(rolling.ask("start"), "ok");
    assert!(rolling.ask("teach plant").starts_with("error: "), "it is at work");
    assert_eq!(rolling.ask("hold"), "ok");
    assert_eq!(rolling.ask("teach plant"), "ok");
}
