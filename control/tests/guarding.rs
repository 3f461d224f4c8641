//! Missed plants in a crop at even distances: the ground of an expected plant is kept as if the beam had seen it.

mod common;
#[path = "common/rolling.rs"]
mod rolling;

use control::{alarm::Alarm, operate::event::Event, operate::state::State, settings::Setting};
use proptest::prelude::*;
use rolling::{BEAM_TO_TOOL_MM, MARGIN_MM, Rolling, TICKS_A_MM};

const SPACING_MM: f64 = 500.0;
const CANOPY_MM: f64 = 150.0;

/// Tolerance of a position: two ticks, a turn, and variation of a lead.
const TOLERANCE_MM: f64 = 8.0;

/// A machine at work along canopies, from and to, with this spacing and scatter.
fn guarding(seen_mm: Vec<(f64, f64)>, settings: &[(Setting, u16)]) -> Rolling {
    let guard = [(Setting::GuardSpacingMm, SPACING_MM as u16), (Setting::GuardScatterMm, 30), (Setting::LeadInMs, 0)];
    Rolling::along(seen_mm, Vec::new(), &[&guard, settings].concat())
}

/// Plants at their positions, in the middle; `seen` tells which of them the beam sees.
fn with_plants(seen: &[bool]) -> Rolling {
    let places = (1..).map(|place| f64::from(place) * SPACING_MM);
    let seen_mm = places.zip(seen).filter(|(_, seen)| **seen).map(|(place, _)| canopy(place)).collect();
    guarding(seen_mm, &[])
}

impl Rolling {
    /// Positions of the `guarded` events.
    fn guarded_mm(&self) -> Vec<f64> {
        self.events_of(|event| match event {
            Event::Guarded(place) => Some(f64::from(place.count()) / TICKS_A_MM),
            _ => None,
        })
    }

    /// Whether the tool was in the row between two positions.
    fn has_weeded(&self, from_mm: f64, to_mm: f64) -> bool {
        self.weeded_mm.iter().any(|place| (from_mm..to_mm).contains(place))
    }

    /// Whether all ground kept for a plant with this middle stayed clear.
    fn has_kept(&self, middle_mm: f64) -> bool {
        let half_mm = 30.0 + MARGIN_MM - TOLERANCE_MM;
        !self.has_weeded(middle_mm - half_mm, middle_mm + half_mm)
    }

    #[track_caller]
    fn assert_guarded(&self, middles_mm: &[f64]) {
        let is_near = |(one, other): (&f64, &f64)| (one - other).abs() < 4.0;
        let guarded_mm = self.guarded_mm();
        let are_same = guarded_mm.len() == middles_mm.len();
        assert!(are_same && guarded_mm.iter().zip(middles_mm).all(is_near), "{guarded_mm:?}");
    }
}

fn canopy(middle_mm: f64) -> (f64, f64) {
    (middle_mm - CANOPY_MM / 2.0, middle_mm + CANOPY_MM / 2.0)
}

#[test]
fn a_missed_plant_is_kept_with_its_own_swing() {
    let mut rolling = with_plants(&[true, true, false, true, false, false, true]);
    rolling.roll_to(3600.0, 400.0);
    rolling.assert_guarded(&[1500.0, 2500.0, 3000.0]);
    rolling.roll_to(3950.0, 400.0);
    assert!([1500.0, 2500.0, 3000.0].iter().all(|&middle_mm| rolling.has_kept(middle_mm)));
    assert!((1..7).all(|gap| rolling.has_weeded(f64::from(gap) * 500.0 + 200.0, f64::from(gap) * 500.0 + 300.0)));
    let out = rolling.events_of(|event| matches!(event, Event::Swing { out: true, .. }).then_some(()));
    assert_eq!(out.len(), 7);
}

#[test]
fn a_missed_plant_keeps_its_stem_zone_and_the_scatter() {
    for zone_mm in [0.0, 100.0] {
        let seen_mm = [500.0, 1000.0, 2000.0].map(canopy).to_vec();
        let mut rolling = guarding(seen_mm, &[(Setting::TopSpeedMmS, 1000), (Setting::StemZoneMm, zone_mm as u16)]);
        rolling.roll_to(2400.0, 400.0);
        rolling.assert_guarded(&[1500.0]);
        let half_mm = 30.0 + zone_mm / 2.0 + MARGIN_MM;
        assert!(!rolling.has_weeded(1500.0 - half_mm + TOLERANCE_MM, 1500.0 + half_mm - TOLERANCE_MM));
        assert!(rolling.has_weeded(1500.0 + half_mm - 1.0, 1500.0 + half_mm + TOLERANCE_MM), "{zone_mm}");
    }
}

#[test]
fn after_three_missed_plants_the_row_has_ended_until_a_plant_is_seen() {
    let mut seen = vec![true, true];
    seen.extend([false; 8]);
    seen.extend([true, false, true]);
    let mut rolling = with_plants(&seen);
    rolling.roll_to(8500.0, 500.0);
    rolling.assert_guarded(&[1500.0, 2000.0, 2500.0, 6000.0, 7000.0, 7500.0, 8000.0]);
    assert!(rolling.has_weeded(3000.0, 3001.0) && rolling.has_weeded(5000.0, 5001.0));
}

#[test]
fn nothing_is_guarded_before_a_plant_is_seen_or_without_a_spacing() {
    let mut rolling = with_plants(&[]);
    rolling.roll_to(6000.0, 500.0);
    rolling.assert_guarded(&[]);
    let plants = || [1.0, 3.0, 4.0].map(|place| canopy(place * SPACING_MM)).to_vec();
    let mut off = guarding(plants(), &[(Setting::GuardSpacingMm, 0)]);
    off.roll_to(4000.0, 500.0);
    off.assert_guarded(&[]);
    assert!(off.has_weeded(1000.0, 1001.0));
}

#[test]
fn a_plant_within_the_scatter_sets_the_next_expected_position() {
    for off_mm in [-90.0, -30.0, 30.0, 90.0] {
        let middles_mm = [500.0, 1000.0, 1500.0 + off_mm];
        let mut rolling = guarding(middles_mm.map(canopy).to_vec(), &[]);
        rolling.roll_to(2200.0, 400.0);
        rolling.assert_guarded(&[2000.0 + off_mm]);
    }
}

#[test]
fn a_double_or_a_weed_does_not_move_the_expected_plants() {
    let between_mm = [(620.0, 700.0), (1700.0, 1790.0)];
    let mut seen_mm = [500.0, 1000.0, 1500.0].map(canopy).to_vec();
    seen_mm.extend(between_mm);
    let mut rolling = guarding(seen_mm, &[]);
    rolling.roll_to(2300.0, 400.0);
    rolling.assert_guarded(&[2000.0]);
}

#[test]
fn a_weed_at_an_expected_plant_does_not_replace_it() {
    let mut seen_mm = [500.0, 1000.0].map(canopy).to_vec();
    seen_mm.push((1495.0, 1510.0));
    let mut rolling = guarding(seen_mm, &[]);
    rolling.roll_to(1950.0, 400.0);
    rolling.assert_guarded(&[1500.0]);
    assert!(rolling.has_kept(1500.0));
}

#[test]
fn guarded_ground_is_reported_once_and_kept_when_rolled_over_again() {
    let mut rolling = with_plants(&[true, false, true]);
    for (there_mm, back_mm) in [(1040.0, 900.0), (1100.0, 600.0), (2000.0, 400.0), (1990.0, 1000.0)] {
        rolling.roll_to(there_mm, 300.0);
        rolling.roll_to(back_mm, 300.0);
    }
    rolling.roll_to(1990.0, 300.0);
    rolling.assert_guarded(&[1000.0]);
    assert!(rolling.has_kept(1000.0));
}

#[test]
fn after_an_alarm_no_plant_is_expected_until_one_is_seen() {
    let mut rolling = with_plants(&[true, true, false, false, true, false]);
    rolling.roll_to(1200.0, 400.0);
    rolling.lose_edges();
    assert_eq!(rolling.machine.state(), State::Alarm(Alarm::BeamEdgesLost));
    rolling.machine.clear();
    rolling.machine.start(false).unwrap();
    rolling.roll_to(3300.0, 400.0);
    rolling.assert_guarded(&[3000.0]);
}

#[test]
fn an_expected_plant_keeps_the_tool_out_until_its_ground_is_seen() {
    // The tool is so near that it reaches the ground before the beam has seen all of it.
    let settings = [
        (Setting::TopSpeedMmS, 100),
        (Setting::LeadOutMs, 100),
        (Setting::BeamToToolMm, 100),
        (Setting::GuardScatterMm, 60),
    ];
    let mut rolling = guarding(vec![canopy(500.0)], &settings);
    rolling.roll_to(1200.0, 80.0);
    let weeded = |place_mm: f64| rolling.has_weeded(place_mm - 1.0, place_mm + 1.0);
    assert!(!weeded(950.0) && !weeded(1000.0) && !weeded(1050.0) && weeded(800.0));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 100, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_missed_plant_of_an_even_stand_is_kept_at_every_speed(
        seen in prop::collection::vec(prop::bool::weighted(0.7), 4..12),
        off_mm in prop::collection::vec(-14.0..14.0, 12),
        speed_mm_s in 100.0..900.0,
        back_mm in 0.0..900.0,
    ) {
        let middles: Vec<(f64, bool)> = (1..).zip(&off_mm).zip(&seen).map(|((place, off_mm), &seen)| {
            (f64::from(place) * SPACING_MM + off_mm, seen || place == 1)
        }).collect();
        let seen_mm = middles.iter().filter(|(_, seen)| *seen).map(|&(middle_mm, _)| canopy(middle_mm)).collect();
        let mut rolling = guarding(seen_mm, &[]);
        let end_mm = (middles.len() as f64 + 0.8) * SPACING_MM;
        rolling.roll_to(0.6 * end_mm, speed_mm_s);
        rolling.roll_to(0.6 * end_mm - back_mm, speed_mm_s);
        rolling.roll_to(end_mm + BEAM_TO_TOOL_MM, speed_mm_s);
        let mut unseen = 0;
        for (middle_mm, seen) in middles {
            unseen = if seen { 0 } else { unseen + 1 };
            let half_mm = MARGIN_MM - TOLERANCE_MM - speed_mm_s / 100.0;
            let is_weeded = rolling.has_weeded(middle_mm - half_mm, middle_mm + half_mm);
            prop_assert!(!is_weeded || unseen > 3, "the plant at {middle_mm}, {:?}", rolling.guarded_mm());
        }
    }
}
