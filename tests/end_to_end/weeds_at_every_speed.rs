//! The four walking speeds over irregular rows: every plant has its own swing, at the right position, and is kept.

use crate::common::{assert_a_swing_each, assert_all_kept, assert_commands_in_place, assert_position_exact, outcome};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;
use model_test::cases;

/// Rows of 8 plants, 480 to 620 mm apart, with canopies of 100 to 180 mm.
const PLANTING: Planting = Planting {
    plants: 8,
    spacing_mm: 550.0,
    spacing_scatter_mm: 70.0,
    canopy_mm: 140.0,
    canopy_scatter_mm: 40.0,
    weeds: 0,
    ragged: false,
};

#[track_caller]
fn assert_weeds_at(speed_km_h: f64) {
    let machine = Machine::default();
    for seed in 1..=cases(4) {
        let row = PLANTING.grow(seed).expect("the plants have room");
        let outcome = outcome(&Pass::at_speed(row, machine, ZoneSettings::default(), mm_s(speed_km_h)));
        assert_all_kept(&outcome.judgement);
        assert_a_swing_each(&outcome.judgement, &machine.servo.commands(&outcome.pulses));
        assert_commands_in_place(&outcome.judgement);
        assert_position_exact(&outcome);
        assert_eq!(outcome.stray_pulses, 0);
    }
}

#[test]
fn at_1_km_h_every_plant_is_kept_by_a_swing_of_its_own() {
    assert_weeds_at(1.0);
}

#[test]
fn at_1_5_km_h_every_plant_is_kept_by_a_swing_of_its_own() {
    assert_weeds_at(1.5);
}

#[test]
fn at_2_km_h_every_plant_is_kept_by_a_swing_of_its_own() {
    assert_weeds_at(2.0);
}

#[test]
fn at_2_5_km_h_every_plant_is_kept_by_a_swing_of_its_own() {
    assert_weeds_at(2.5);
}
