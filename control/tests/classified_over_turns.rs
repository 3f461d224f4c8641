//! Classification over several turns: until the class is known, the ground is closed from the detection's beginning on.
//!
//! A machine that classifies at once and one that takes several turns go the same way. The second is never in the row while the
//! first is out. It reports the same detections, and knows the same plants in the end.

mod common;
#[path = "common/rolling.rs"]
mod rolling;

use common::{ByWidth, LEAST_HOLD_MM};
use control::{
    alarm::Alarm,
    ground::class::{Class, Vote},
    operate::{event::Event, state::State},
    settings::Setting,
    units::{Position, Ticks},
};
use proptest::prelude::*;
use rig::Rig;
use rolling::{BEAM_TO_TOOL_MM, MARGIN_MM, Rolling, SECOND_BEAM_MM};

/// Wider detections are plants.
const LEAST_PLANT_MM: f64 = 65.0;

/// The command to come back leads by this time. The fastest machine here rolls 30 mm in it, of a margin of 50.
const LEAD_IN_MS: u16 = 20;

/// An event's detection, without the plan, which depends on the slip known at that moment.
fn detection(event: Event) -> Option<(Vote, Position, Ticks)> {
    if let Event::Detection { vote, leading, spacing, .. } = event { Some((vote, leading, spacing)) } else { None }
}

/// A machine that classifies this many turns late, with or without a second beam.
fn rolling(turns: u16, seen_mm: &[(f64, f64)], unseen: usize, settings: &[(Setting, u16)]) -> Rolling {
    // The first beam misses one of them.
    let first_mm = seen_mm.iter().enumerate().filter(|&(number, _)| number != unseen).map(|(_, &thing)| thing);
    let (first_mm, second_mm) = (first_mm.collect(), seen_mm.to_vec());
    match turns {
        0 => Rolling::along(first_mm, second_mm, settings),
        _ => Rolling::with(Rig::new(ByWidth::new(LEAST_HOLD_MM, turns)), first_mm, second_mm, settings),
    }
}

#[test]
fn a_weed_keeps_the_tool_out_until_it_is_classified() {
    let weed_mm = (600.0, 620.0);
    let mut late = rolling(2000, &[weed_mm], usize::MAX, &[]);
    // So near that the servo needs its command.
    late.roll_to(weed_mm.0 + BEAM_TO_TOOL_MM - MARGIN_MM, 500.0);
    assert!(late.machine.tool_out(), "it is not yet classified as a weed");
    assert_eq!((late.events_of(detection).len(), late.machine.zones()), (0, 1));
    late.roll_to(weed_mm.0 + BEAM_TO_TOOL_MM, 100.0);
    assert!(!late.machine.tool_out());
    assert_eq!((late.events_of(detection).len(), late.machine.zones()), (1, 0));
}

#[test]
fn a_detection_forgotten_during_classification_is_reported_and_not_kept() {
    let mut late = rolling(20, &[(600.0, 700.0)], usize::MAX, &[]);
    late.roll_to(725.0, 500.0);
    assert_eq!((late.events_of(detection).len(), late.machine.zones()), (0, 1));
    late.lose_edges();
    assert_eq!(late.machine.zones(), 0);
    late.roll_to(800.0, 500.0);
    assert_eq!(late.events_of(detection).len(), 1);
    assert_eq!((late.machine.zones(), late.machine.state()), (0, State::Alarm(Alarm::BeamEdgesLost)));
}

#[test]
fn a_detection_still_unclassified_when_the_next_comes_is_kept() {
    let mut late = rolling(u16::MAX, &[(600.0, 620.0), (660.0, 680.0)], usize::MAX, &[]);
    late.roll_to(690.0, 1000.0);
    assert_eq!((late.events_of(detection).len(), late.machine.zones()), (0, 2));
    late.roll_to(710.0, 1000.0);
    assert_eq!(late.events_of(detection).iter().map(|&(vote, ..)| vote).collect::<Vec<_>>(), [Vote::UNKNOWN]);
    assert_eq!(late.machine.zones(), 2);
}

#[test]
fn dust_does_not_end_a_classification() {
    let settings = [(Setting::MinWidthMm, 5)];
    let mut late = rolling(100, &[(600.0, 620.0), (660.0, 663.0)], usize::MAX, &settings);
    late.roll_to(800.0, 1000.0);
    assert_eq!(late.machine.dust(), 1);
    assert_eq!(late.events_of(detection).iter().map(|(vote, ..)| vote.class).collect::<Vec<_>>(), [Class::Weed]);
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_late_classifier_is_as_safe_and_gives_the_same_classes(
        turns in 1_u16..8,
        things in prop::collection::vec((3.0..400.0, prop_oneof![5.0..40.0, 70.0..200.0]), 1..12),
        legs in prop::collection::vec((50.0..1500.0, prop_oneof![4 => 20.0..900.0, 1 => -200.0..-10.0]), 1..12),
        second in any::<bool>(),
        unseen in 0_usize..20,
        guard_mm in prop_oneof![Just(0_u16), 200_u16..400],
        merge_gap_mm in 0_u16..30,
    ) {
        let mut end_mm = BEAM_TO_TOOL_MM;
        let things: Vec<(f64, f64)> = things
            .into_iter()
            .map(|(gap_mm, width_mm)| {
                let begin_mm = end_mm + gap_mm;
                end_mm = begin_mm + width_mm;
                (begin_mm, end_mm)
            })
            .collect();
        let settings = [
            // An alarm for unknown crop comes with the last weed's class.
            (Setting::MisfitAfter, 0),
            // The second beam gives the slip, and an expected plant's position depends on the slip at the last plant's
            // classification.
            (Setting::GuardSpacingMm, if second { 0 } else { guard_mm }),
            (Setting::MergeGapMm, merge_gap_mm),
            (Setting::LeadInMs, LEAD_IN_MS),
            (Setting::SecondBeamMm, if second { SECOND_BEAM_MM as u16 } else { 0 }),
        ];
        let unseen = if second { unseen } else { usize::MAX };
        let [mut quick, mut late] = [0, turns].map(|turns| rolling(turns, &things, unseen, &settings));
        for (speed_mm_s, rolled_mm) in legs {
            let to_mm = quick.place_mm + rolled_mm;
            // Turn by turn.
            let step_mm = f64::signum(rolled_mm) * speed_mm_s / 1000.0;
            while (to_mm - quick.place_mm) * step_mm > 0.0 {
                let next_mm = quick.place_mm + step_mm;
                quick.roll_to(next_mm, speed_mm_s);
                late.roll_to(next_mm, speed_mm_s);
                // The beams may report two detections in the same turn. The quick machine then keeps the one that it has no time
                // for, and the late machine the other.
                let keeps_unknown = second && quick.events_of(detection).iter().any(|&(vote, ..)| vote == Vote::UNKNOWN);
                prop_assert!(
                    keeps_unknown || late.machine.tool_out() || !quick.machine.tool_out(),
                    "in the row at {next_mm} mm, but the other is out"
                );
            }
        }
        for machine in [&quick, &late] {
            for &(from_mm, to_mm) in things.iter().filter(|(from_mm, to_mm)| to_mm - from_mm > LEAST_PLANT_MM) {
                let over_it_mm = machine.weeded_mm.iter().find(|place_mm| (from_mm..to_mm).contains(place_mm));
                prop_assert_eq!(over_it_mm, None, "in the row over the plant from {} to {} mm", from_mm, to_mm);
            }
        }
        // Both stop, and get all the time that they need. A detection that has just ended begins in the next turn.
        for _ in 0..=turns {
            quick.turn(0.0);
            late.turn(0.0);
        }
        // The second beam may report a detection while another is being classified.
        if !second {
            prop_assert_eq!(quick.events_of(detection), late.events_of(detection));
            prop_assert_eq!(quick.machine.zones(), late.machine.zones());
        }
        prop_assert_eq!(quick.machine.state(), late.machine.state());
    }
}
