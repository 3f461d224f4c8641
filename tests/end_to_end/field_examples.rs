//! Examples taught in the field: they change the class of later detections, and survive a power failure.

use crate::common::{ask, elf, refusal, run_for_ms, started};
use control::ground::field_examples::{self, FieldExamples};
use control::memory::{ERASED, SIZE, Volatile};
use field::machine::Machine;
use field::motion::Motion;
use field::row::{Canopy, Row};
use field::wiring;
use knn::Example;
use uno::CYCLES_PER_SECOND;
use uno::Uno;

/// The address of the example slots in the EEPROM.
const SLOTS_BEGIN: usize = SIZE;

/// A width that is neither a plant's nor a weed's to the built-in examples.
const ODD_WIDTH_MM: f64 = 55.0;

/// Rolls past `count` unusual objects, in hold.
fn roll_past_odd_objects(uno: &mut Uno, count: usize) {
    let canopies = (0..count).map(|index| Canopy::weed(300.0 + 300.0 * index as f64, ODD_WIDTH_MM)).collect();
    let row = Row::new(canopies).expect("the objects stand apart");
    let motion = Motion::steady(0.0, 3000.0, 500.0, 300.0 * (count as f64 + 1.0));
    let start = uno.cycle();
    uno.drive(Machine::default().pin_changes(&row, &motion, start));
    run_for_ms(uno, (motion.duration_s() * 1000.0) as u64 + 50);
}

/// An Uno that wakes up with this in its EEPROM.
fn started_with(eeprom: &[u8]) -> Uno {
    let mut uno = Uno::boot_with_eeprom(&elf(), eeprom).expect("the firmware wakes up").wired(&wiring::WIRES);
    greeted(&mut uno);
    uno
}

fn greeted(uno: &mut Uno) {
    uno.run_until_serial("\n", CYCLES_PER_SECOND).expect("the firmware greets");
}

/// An EEPROM with an example in every slot.
fn full_eeprom() -> Vec<u8> {
    let mut store = FieldExamples::new(Volatile::new());
    for number in 0..field_examples::CAPACITY {
        assert!(store.add(Example::new([number, 1, 2, 3, 4], number % 2)), "there is room");
        while !store.carry_on() {}
    }
    let mut eeprom = vec![ERASED; SLOTS_BEGIN];
    eeprom.extend(store.into_memory().bytes);
    eeprom
}

fn answers(uno: &mut Uno) -> Vec<String> {
    let objects = ask(uno, "dump");
    let (heading, objects) = objects.split_first().expect("a heading");
    assert_eq!(heading, "speed_mm_s,spacing_mm,delay_mm,hold_mm,actuation_mm,answer,votes,label");
    objects.to_vec()
}

fn field_examples(uno: &mut Uno) -> Vec<String> {
    let mut examples = ask(uno, "examples");
    examples.retain(|line| line.starts_with("field "));
    examples
}

#[test]
fn an_object_that_was_labelled_is_known_when_it_comes_again() {
    let mut uno = started();
    roll_past_odd_objects(&mut uno, 1);
    let seen = answers(&mut uno);
    assert_eq!(seen.len(), 1);
    assert!(seen[0].contains(",unknown,") && seen[0].ends_with(','), "{seen:?}");

    ask(&mut uno, "label weed");
    let seen = answers(&mut uno);
    assert!(seen[0].ends_with(",weed"), "{seen:?}");
    assert_eq!(
        refusal(&mut uno, "label weed"),
        "error: there is no detection without a label, let the beam see one first"
    );
    assert_eq!(field_examples(&mut uno).len(), 1);

    // One neighbour decides: the next detection is like the taught one.
    uno.power_cycle();
    greeted(&mut uno);
    ask(&mut uno, "set k 1");
    roll_past_odd_objects(&mut uno, 1);
    let seen = answers(&mut uno);
    assert!(seen.len() == 1 && seen[0].contains(",weed,1,"), "{seen:?}");
}

#[test]
fn a_label_that_the_built_in_examples_contradict_wants_force() {
    let mut uno = started();
    let row = Row::new(vec![Canopy::plant(600.0, 150.0)]).expect("a plant is a row");
    let motion = Motion::steady(0.0, 3000.0, 500.0, 900.0);
    let start = uno.cycle();
    uno.drive(Machine::default().pin_changes(&row, &motion, start));
    run_for_ms(&mut uno, (motion.duration_s() * 1000.0) as u64 + 50);
    assert!(answers(&mut uno)[0].contains(",plant,3,"));
    assert_eq!(refusal(&mut uno, "label weed"), "error: the built-in examples say plant, look again, or add force");
    assert!(answers(&mut uno)[0].ends_with(','), "it has no label yet");
    assert!(field_examples(&mut uno).is_empty());
    ask(&mut uno, "label weed force");
    assert!(answers(&mut uno)[0].ends_with(",weed"));
}

#[test]
fn taught_examples_survive_a_power_loss_unless_corrupted() {
    let mut uno = started();
    roll_past_odd_objects(&mut uno, 1);
    ask(&mut uno, "label plant");
    let taught = field_examples(&mut uno);
    assert_eq!(taught.len(), 1);
    assert!(taught[0].starts_with("field 0 plant "), "{taught:?}");
    uno.power_cycle();
    greeted(&mut uno);
    assert_eq!(field_examples(&mut uno), taught);
    assert!(ask(&mut uno, "examples").contains(&"spoiled=0".to_owned()));

    let mut eeprom = uno.eeprom();
    eeprom[SLOTS_BEGIN + 2] ^= 0x10;
    let mut uno = started_with(&eeprom);
    assert!(field_examples(&mut uno).is_empty());
    assert!(ask(&mut uno, "examples").contains(&"spoiled=1".to_owned()));
}

#[test]
fn examples_are_forgotten_one_by_one_or_all_at_once() {
    let mut uno = started_with(&full_eeprom());
    assert_eq!(field_examples(&mut uno).len(), usize::from(field_examples::CAPACITY));
    ask(&mut uno, "forget 31");
    assert_eq!(refusal(&mut uno, "forget 31"), "error: no field example has this number, examples lists them");
    assert_eq!(field_examples(&mut uno).len(), usize::from(field_examples::CAPACITY) - 1);
    ask(&mut uno, "forget all");
    assert!(field_examples(&mut uno).is_empty());
    assert!(uno.eeprom()[SLOTS_BEGIN..SLOTS_BEGIN + 256].iter().all(|&byte| byte == 0xFF));
}

#[test]
fn a_full_store_refuses_to_learn_until_something_is_forgotten() {
    let mut uno = started_with(&full_eeprom());
    roll_past_odd_objects(&mut uno, 1);
    assert_eq!(refusal(&mut uno, "label plant"), "error: all 32 places are taken, forget one first");
    ask(&mut uno, "forget 5");
    ask(&mut uno, "label plant");
    assert!(field_examples(&mut uno)[5].starts_with("field 5 plant "));
}

#[test]
fn without_an_object_there_is_nothing_to_label() {
    let mut uno = started();
    let none = "error: there is no detection without a label, let the beam see one first";
    assert_eq!(refusal(&mut uno, "label plant"), none);
    assert_eq!(answers(&mut uno), [""; 0]);
}

#[test]
fn the_last_sixteen_objects_are_dumped() {
    let mut uno = started();
    roll_past_odd_objects(&mut uno, 18);
    assert_eq!(answers(&mut uno).len(), 16);
}
