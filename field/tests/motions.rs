//! The real firmware on motions that are not steady: what the row needs is the same.

use field::firmware;
use field::machine::Machine;
use field::motion::{Motion, mm_s};
use field::planting::Planting;
use field::row::{Row, Thing};
use field::trial::{Outcome, Start, Trial};
use field::verdict::{Timing, Verdict};

/// Three plants far enough apart that each has a swing of its own.
fn row() -> Row {
    let plants = [800.0, 1500.0, 2200.0];
    Row::new(plants.map(|place_mm| Thing::plant(place_mm, 150.0)).to_vec()).expect("the plants stand apart")
}

/// Rolls past `row` and returns what came of it.
fn outcome(row: Row, motion: Motion) -> Outcome {
    let trial = Trial { row, machine: Machine::default(), motion, timing: Timing::default(), start: Start::Switch };
    let elf = firmware::build().expect("the firmware builds");
    trial.run(&elf, |_| {}).expect("the firmware runs")
}

/// No plant damaged, and the firmware's place right.
#[track_caller]
fn assert_unharmed(outcome: &Outcome) {
    for plant in &outcome.judgement.plants {
        assert_ne!(plant.verdict, Verdict::Damaged, "{plant:?}");
    }
    assert_eq!(outcome.status.position_ticks, outcome.true_ticks);
    assert_eq!(outcome.status.lost_ticks, 0);
    assert!(outcome.judgement.weeded_share > 0.1, "the tool was in the row at all");
}

#[test]
fn slow_at_the_beam_and_fast_at_the_tool_harms_no_plant() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(1.0), 1000.0)
        .roll_to(950.0)
        .change_speed(mm_s(2.5), 3000.0)
        .roll_to(2900.0);
    assert_unharmed(&outcome(row(), motion));
}

#[test]
fn a_stop_over_a_plant_keeps_the_tool_out_of_it() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(1900.0, 1000.0)
        .go_on_for(2.0)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2900.0);
    let outcome = outcome(row(), motion);
    assert_unharmed(&outcome);
    assert_eq!(outcome.judgement.plants[1].swings, 1);
}

#[test]
fn rolling_back_over_a_plant_and_forward_again_harms_none_and_counts_none_twice() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(2250.0, 1000.0)
        .change_speed(-mm_s(1.0), 1000.0)
        .stop_at(1650.0, 1000.0)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2900.0);
    assert_unharmed(&outcome(row(), motion));
}

#[test]
fn a_ragged_canopy_is_one_plant() {
    let planting = Planting { plants: 5, spacing_mm: 700.0, ragged: true, ..Planting::default() };
    let row = planting.grow(4).expect("the plants have room");
    let steady = Trial::at_speed(row, Machine::default(), Timing::default(), mm_s(2.0));
    let outcome = outcome(steady.row, steady.motion);
    assert_unharmed(&outcome);
    assert!(outcome.judgement.plants.iter().all(|plant| plant.swings == 1));
    assert_eq!(outcome.judgement.idle_swings, 0);
}
