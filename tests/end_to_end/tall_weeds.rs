//! Weeds tall enough for the beam, and canopies with gaps: what breaks the beam is not always a plant, or one plant.

use crate::common::{Run, assert_a_swing_each, assert_all_kept};
use field::machine::Machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::trial::Trial;
use field::verdict::Timing;

fn roll_along(planting: Planting, seed: u64, speed_km_h: f64) -> Run {
    let row = planting.grow(seed).expect("everything has room");
    let mut run = Run::begin(Trial::at_speed(row, Machine::default(), Timing::default(), mm_s(speed_km_h)), &[]);
    run.roll_to_the_end();
    run
}

#[test]
fn a_tall_weed_does_not_lift_the_tool() {
    // Weeds of 12 to 20 mm, one in every gap.
    let planting = Planting { plants: 7, spacing_mm: 550.0, weeds: 6, ..Planting::default() };
    for (seed, speed_km_h) in [(1, 1.0), (2, 1.5), (3, 2.0), (4, 2.5)] {
        let mut run = roll_along(planting, seed, speed_km_h);
        let judgement = run.judgement();
        assert_all_kept(&judgement);
        assert_a_swing_each(&judgement, &run.commands());
        assert_eq!(run.events("weed").len(), planting.weeds, "{:#?}", run.lines());
        assert_eq!(run.events("plant").len() + run.events("unknown").len(), planting.plants);
        assert!(judgement.weeds.iter().any(|weed| weed.cut), "{:#?}", judgement.weeds);
    }
}

#[test]
fn a_ragged_canopy_is_one_plant() {
    let planting = Planting { plants: 6, spacing_mm: 600.0, ragged: true, ..Planting::default() };
    for (seed, speed_km_h) in [(1, 1.0), (2, 1.5), (3, 2.0), (4, 2.5)] {
        let mut run = roll_along(planting, seed, speed_km_h);
        let judgement = run.judgement();
        assert_all_kept(&judgement);
        assert_a_swing_each(&judgement, &run.commands());
        assert_eq!(run.events("plant").len() + run.events("unknown").len(), planting.plants, "{:#?}", run.lines());
        assert_eq!(run.events("weed"), [""; 0]);
    }
}
