//! Both leads at 0: the firmware schedules as the paper does. It damages plants as the paper reports, more at higher
//! speed.

use crate::common::outcome;
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::{Judgement, Verdict, ZoneSettings};

fn judgement(timing: ZoneSettings, speed_km_h: f64) -> Judgement {
    let planting = Planting { plants: 6, spacing_mm: 600.0, ..Planting::default() };
    let row = planting.grow(1).expect("the plants have room");
    outcome(&Pass::at_speed(row, Machine::default(), timing, mm_s(speed_km_h))).judgement
}

/// The tool's mean depth in the canopies; negative if it stays outside.
fn mean_depth_mm(judgement: &Judgement) -> f64 {
    let depths: Vec<f64> =
        judgement.plants.iter().map(|plant| -plant.clearance_before_mm.expect("a swing out")).collect();
    depths.iter().sum::<f64>() / depths.len() as f64
}

#[test]
fn without_leads_a_faster_machine_reaches_deeper_into_canopies() {
    let depths_mm =
        [1.0, 1.5, 2.0, 2.5].map(|speed_km_h| mean_depth_mm(&judgement(ZoneSettings::as_in_the_paper(), speed_km_h)));
    println!("depth into the canopy at 1, 1.5, 2 and 2.5 km/h: {depths_mm:.1?} mm");
    assert!(depths_mm.is_sorted_by(|slower, faster| slower + 10.0 < *faster), "{depths_mm:?}");
}

#[test]
fn without_leads_zones_are_reached_at_speed_and_with_them_none_is() {
    let paper = judgement(ZoneSettings::as_in_the_paper(), 2.5);
    assert_eq!(paper.count(Verdict::Reached), paper.plants.len());
    let led = judgement(ZoneSettings::default(), 2.5);
    assert_eq!(led.count(Verdict::Kept), led.plants.len());
}
