//! Plants that the beam does not see, in a crop at even distances: with a set spacing, the ground of expected plants is
//! kept.

use crate::common::{Run, is_out_at_the_pin, number, pass, steady};
use field::motion::mm_s;
use field::row::{Canopy, Row};

/// From beam to tool.
const X_MM: f64 = 400.0;

/// A run past plants half a metre apart. The beam does not see the third plant. The row ends behind the fourth.
fn past_an_unseen_plant(commands: &[&str]) -> Run {
    let seen = [600.0, 1100.0, 2100.0].map(|place_mm| Canopy::plant(place_mm, 150.0));
    let row = Row::new(seen.to_vec()).expect("the plants stand apart");
    Run::begin(pass(row, steady(mm_s(2.0), 4900.0)), commands)
}

/// Whether the tool is out of the row when it reaches a position.
fn is_out_at(run: &mut Run, place_mm: f64) -> bool {
    run.roll_to(place_mm + X_MM);
    is_out_at_the_pin(&run.uno)
}

#[test]
fn a_missed_plant_is_kept_and_after_three_the_row_ends() {
    let mut run = past_an_unseen_plant(&["set guard_spacing_mm 500"]);
    let out_mm = [1100.0, 1530.0, 1600.0, 1650.0, 2100.0, 2600.0, 3100.0, 3600.0];
    let in_mm = [1330.0, 1760.0, 2330.0, 2830.0, 4100.0, 4400.0];
    let mut places_mm: Vec<f64> = out_mm.iter().chain(&in_mm).copied().collect();
    places_mm.sort_by(f64::total_cmp);
    let is_out = |place_mm: &f64| is_out_at(&mut run, *place_mm);
    let found: Vec<f64> = places_mm.into_iter().filter(is_out).collect();
    assert_eq!(found, out_mm, "{:#?}", run.lines());
    let guarded: Vec<f64> = run.events("guarded").iter().map(|line| number(line, "pos") as f64 / 1.90986).collect();
    let due_mm = [1600.0, 2600.0, 3100.0, 3600.0];
    let is_near = |(told, due): (&f64, &f64)| (told - due).abs() < 4.0;
    assert!(guarded.len() == 4 && guarded.iter().zip(&due_mm).all(is_near), "{guarded:?}");
}

#[test]
fn a_plant_that_is_not_seen_is_weeded_where_no_spacing_is_set() {
    let mut run = past_an_unseen_plant(&[]);
    assert!(!is_out_at(&mut run, 1600.0));
    assert_eq!(run.events("guarded"), [""; 0]);
}

#[test]
fn a_stalk_close_behind_unseen_ground_has_its_stem_zone_behind_it() {
    // The ground before the start is unseen. The gap behind it is narrower than the merging gap, so the stalk may be the end of a plant.
    let row = Row::new([(74.0, 4.0), (1000.0, 150.0)].map(|(place, width)| Canopy::plant(place, width)).to_vec());
    let commands = ["set top_speed_mm_s 700", "set merge_gap_mm 82", "set stem_zone_mm 110"];
    let mut run = Run::begin(pass(row.expect("they stand apart"), steady(mm_s(1.0), 1500.0)), &commands);
    // Half of the zone ends 131 mm from the start, and the margin 50 mm behind it.
    let found = [155.0, 200.0].map(|place_mm| is_out_at(&mut run, place_mm));
    assert_eq!(found, [true, false], "{:#?}", run.lines());
}
