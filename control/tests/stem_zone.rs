//! Stem zones: of a single plant seen whole, the middle is kept, and of any other detection the full width.

mod common;
#[path = "common/rolling.rs"]
mod rolling;

use common::{ByWidth, LEAST_HOLD_MM};
use control::settings::Setting;
use proptest::prelude::*;
use rig::Rig;
use rolling::{BEAM_TO_TOOL_MM, Rolling, SECOND_BEAM_MM};

const ZONE_MM: f64 = 96.0;
const MARGIN_MM: f64 = 10.0;

/// Most that is cut off either side.
const MOST_MM: f64 = ZONE_MM * 11.0 / 64.0;

/// Tolerance: two ticks at either end, a turn's distance, and the command of the next turn.
const TOLERANCE_MM: f64 = 2.5;

/// A tool without swing time, so that it shows where the ground is closed.
const SETTINGS: [(Setting, u16); 4] = [
    (Setting::MarginMm, MARGIN_MM as u16),
    (Setting::LeadOutMs, 0),
    (Setting::LeadInMs, 0),
    (Setting::StemZoneMm, ZONE_MM as u16),
];

fn along(seen_mm: Vec<(f64, f64)>) -> Rolling {
    Rolling::along(seen_mm, Vec::new(), &SETTINGS)
}

fn with_beams(first_mm: Vec<(f64, f64)>, second_mm: Vec<(f64, f64)>) -> Rolling {
    let second = [(Setting::SecondBeamMm, SECOND_BEAM_MM as u16)];
    Rolling::along(first_mm, second_mm, &[&SETTINGS[..], &second].concat())
}

impl Rolling {
    /// The ground kept around a place, without the margins.
    fn kept_mm(&self, place_mm: f64) -> (f64, f64) {
        let before = self.weeded_mm.iter().copied().filter(|&mm| mm < place_mm).fold(f64::MIN, f64::max);
        let behind = self.weeded_mm.iter().copied().filter(|&mm| mm > place_mm).fold(f64::MAX, f64::min);
        (before + MARGIN_MM, behind - MARGIN_MM)
    }

    #[track_caller]
    fn assert_kept(&self, from_mm: f64, to_mm: f64) {
        let (from, to) = self.kept_mm((from_mm + to_mm) / 2.0);
        let is_right = (from - from_mm).abs() < TOLERANCE_MM && (to - to_mm).abs() < TOLERANCE_MM;
        assert!(is_right, "{from:.1} to {to:.1} instead of {from_mm:.1} to {to_mm:.1}");
    }
}

#[test]
fn the_tool_works_under_leaves_by_at_most_a_part_of_the_zone() {
    for width_mm in [62.0, 70.0, 96.0, 110.0, 132.0, 150.0, 190.0, 300.0] {
        let mut rolling = along(vec![(600.0 - width_mm / 2.0, 600.0 + width_mm / 2.0)]);
        rolling.roll_to(1400.0, 300.0);
        let half_mm = (ZONE_MM / 2.0).max(width_mm / 2.0 - MOST_MM);
        rolling.assert_kept(600.0 - half_mm, 600.0 + half_mm);
    }
}

#[test]
fn without_a_zone_the_canopy_is_kept_from_end_to_end() {
    let mut rolling = Rolling::along(vec![(500.0, 650.0)], Vec::new(), &SETTINGS[..3]);
    rolling.roll_to(1400.0, 300.0);
    rolling.assert_kept(500.0, 650.0);
}

#[test]
fn narrow_gaps_belong_to_a_plant_and_wide_gaps_keep_the_full_width() {
    for (gap_mm, is_one) in [(2.0, true), (9.0, true), (12.0, false), (18.0, false)] {
        let mut rolling = along(vec![(520.0, 590.0), (590.0 + gap_mm, 680.0)]);
        rolling.roll_to(1400.0, 300.0);
        let trimmed_mm = if is_one { MOST_MM } else { 0.0 };
        rolling.assert_kept(520.0 + trimmed_mm, 680.0 - trimmed_mm);
    }
}

#[test]
fn a_cut_detection_has_half_of_the_zone_behind_its_end() {
    // A plant that the start has cut, and a stalk that begins within the merging gap behind the start.
    for (from_mm, to_mm) in [(-50.0, 100.0), (10.0, 14.0)] {
        let mut rolling = along(vec![(from_mm, to_mm)]);
        rolling.roll_to(1400.0, 300.0);
        let kept_to_mm = rolling.kept_mm(0.0).1;
        assert!((kept_to_mm - to_mm - ZONE_MM / 2.0).abs() < TOLERANCE_MM, "{from_mm}: {kept_to_mm}");
    }
}

#[test]
fn a_detection_unclassified_before_the_next_is_kept_from_end_to_end() {
    let plants = vec![(500.0, 650.0), (680.0, 830.0)];
    let machine = Rig::new(ByWidth::new(LEAST_HOLD_MM, 1250));
    let mut rolling = Rolling::with(machine, plants, Vec::new(), &SETTINGS);
    rolling.roll_to(1600.0, 300.0);
    rolling.assert_kept(500.0, 650.0);
    rolling.assert_kept(680.0 + MOST_MM, 830.0 - MOST_MM);
}

#[test]
fn each_end_of_a_plant_is_where_either_beam_saw_it() {
    for off_mm in [-8.0, 8.0_f64] {
        let plant = (500.0, 650.0);
        let mut rolling = with_beams(vec![plant], vec![(plant.0 + off_mm, plant.1 + off_mm)]);
        rolling.roll_to(1400.0, 300.0);
        rolling.assert_kept(500.0 + off_mm.min(0.0) + MOST_MM, 650.0 + off_mm.max(0.0) - MOST_MM);
    }
}

#[test]
fn a_leaf_near_the_end_changes_nothing_when_passed_again() {
    let leaves = vec![(500.0, 509.0), (514.0, 520.0), (525.0, 630.0), (634.0, 639.0), (643.0, 650.0)];
    let mut rolling = with_beams(leaves.clone(), leaves);
    rolling.roll_to(880.0, 300.0);
    for _ in 0..4 {
        rolling.roll_to(660.0, 300.0);
        rolling.roll_to(880.0, 300.0);
    }
    rolling.roll_to(1400.0, 300.0);
    rolling.assert_kept(500.0 + MOST_MM, 650.0 - MOST_MM);
}

#[test]
fn a_plant_longer_in_the_second_beam_is_kept_from_end_to_end() {
    let mut rolling = with_beams(vec![(500.0, 650.0)], vec![(500.0, 680.0)]);
    rolling.roll_to(1400.0, 300.0);
    rolling.assert_kept(500.0, 680.0);
}

#[test]
fn a_detection_of_the_second_beam_alone_is_kept_from_end_to_end() {
    let mut rolling = with_beams(vec![(500.0, 650.0)], vec![(500.0, 650.0), (1000.0, 1150.0)]);
    rolling.roll_to(1800.0, 300.0);
    rolling.assert_kept(1000.0, 1150.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Either beam may miss the tip of a leaf at either end. The second beam stands at any distance.
    #[test]
    fn the_stem_zone_never_shrinks_where_a_beam_misses_a_leaf_tip(
        machine_mm in prop::sample::select(vec![(400_u16, 200_u16), (1000, 900), (700, 100)]),
        width_mm in 62.0..200.0_f64,
        missed in prop::array::uniform2(0.0..1.0_f64),
        by_first: bool,
        speed_mm_s in 100.0..300.0_f64,
    ) {
        let (beam_to_tool_mm, second_beam_mm) = machine_mm;
        let tip_mm = f64::from(second_beam_mm) / 16.0;
        let plant = (1000.0 - width_mm / 2.0, 1000.0 + width_mm / 2.0);
        let seen = (plant.0 + missed[0] * tip_mm, plant.1 - missed[1] * tip_mm);
        // Less would be a weed for the first beam.
        prop_assume!(seen.1 > seen.0 + if by_first { 62.0 } else { 10.0 });
        let (first, second) = if by_first { (vec![seen], vec![plant]) } else { (vec![plant], vec![seen]) };
        let machine = [(Setting::BeamToToolMm, beam_to_tool_mm), (Setting::SecondBeamMm, second_beam_mm)];
        let mut rolling = Rolling::along(first, second, &[&SETTINGS[..], &machine].concat());
        rolling.roll_to(1500.0 + f64::from(beam_to_tool_mm), speed_mm_s);
        let (from, to) = rolling.kept_mm(1000.0);
        let half_mm = ZONE_MM / 2.0 - TOLERANCE_MM;
        prop_assert!(from < 1000.0 - half_mm && to > 1000.0 + half_mm, "{from:.1} to {to:.1}");
    }

    /// Narrow plants, plants that have grown together, ragged plants, and weeds that touch. The tool keeps off the zone of a plant that
    /// stands alone. It never comes nearer to a stem than a single plant's trim allows, at each position of the stem in its canopy.
    #[test]
    fn no_stem_is_nearer_to_the_tool_than_a_single_plants_trim_allows(
        plants in prop::collection::vec((62.0..200.0_f64, prop::option::of((20.0..120.0_f64, 62.0..200.0_f64)), 150.0..400.0_f64), 1..8),
        speed_mm_s in 100.0..900.0_f64,
    ) {
        let (mut place_mm, mut seen_mm, mut stems_mm) = (400.0, Vec::new(), Vec::new());
        for (width_mm, double, gap_mm) in plants {
            let mut grown = vec![(place_mm + 100.0, width_mm)];
            grown.extend(double.map(|(apart_mm, width_mm)| (place_mm + 100.0 + apart_mm, width_mm)));
            let spans = grown.iter().map(|&(middle_mm, width_mm)| (middle_mm - width_mm / 2.0, middle_mm + width_mm / 2.0));
            let (from_mm, to_mm) = spans.fold((f64::MAX, f64::MIN), |(from, to), span| (from.min(span.0), to.max(span.1)));
            seen_mm.push((from_mm, to_mm));
            let alone_mm = if grown.len() == 1 { ZONE_MM / 2.0 } else { 0.0 };
            stems_mm.extend(grown.into_iter().map(|(stem_mm, width_mm)| (stem_mm, alone_mm.max(width_mm / 2.0 - MOST_MM))));
            place_mm = to_mm + gap_mm;
        }
        let mut rolling = along(seen_mm);
        rolling.roll_to(place_mm + 2.0 * BEAM_TO_TOOL_MM, speed_mm_s);
        for (stem_mm, kept_mm) in stems_mm {
            let (from, to) = rolling.kept_mm(stem_mm);
            let beside_mm = kept_mm - TOLERANCE_MM - 0.002 * speed_mm_s;
            prop_assert!(stem_mm - from > beside_mm && to - stem_mm > beside_mm, "{from:.1} to {to:.1} round {stem_mm:.1}");
        }
    }
}
