//! Weeds tall enough for the beam, and canopies with gaps: a detection is not always a plant, or a single plant.

use crate::common::{Run, assert_a_swing_each, assert_all_kept, number, status};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::row::{Canopy, Row};
use field::verdict::ZoneSettings;

fn roll_along(planting: Planting, seed: u64, speed_km_h: f64) -> Run {
    let row = planting.grow(seed).expect("everything has room");
    let mut run = Run::begin(Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(speed_km_h)), &[]);
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
fn detections_below_the_least_width_count_only_as_dust() {
    let dust = (0..8).map(|number| Canopy::weed(450.0 + 40.0 * f64::from(number), 4.0));
    let row = Row::new(dust.chain([Canopy::plant(300.0, 150.0), Canopy::weed(800.0, 18.0)]).collect());
    let row = row.expect("all of them stand apart");
    let pass = Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(2.0));
    let mut run = Run::begin(pass, &["set min_width_mm 8"]);
    run.roll_to_the_end();
    assert_all_kept(&run.judgement());
    assert_eq!(run.events("alarm"), [""; 0]);
    let told = ["weed", "plant", "unknown"].map(|name| run.events(name).len());
    assert_eq!((told.iter().sum::<usize>(), told[0]), (2, 1), "{:#?}", run.lines());
    assert_eq!(number(&status(&mut run.uno), "dust"), 8);
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
