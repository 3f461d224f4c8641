//! The tool is never in the row over a plant. Rows and motion are random, with stops, reversals, and speeds from a crawl to 10
//! km/h. Plants stand closer than the beam's distance, and farther.
//!
//! The reference is slow and simple: it knows each plant's position and the real speed.

mod common;
#[path = "common/rolling.rs"]
mod rolling;

use common::machine;
use control::{
    alarm::Alarm,
    operate::{event::Event, servo, state::State},
    settings::Setting,
    units::Ticks,
};
use proptest::prelude::*;
use rig::Beams;
use rolling::{BEAM_TO_TOOL_MM, MARGIN_MM, Rolling, TICKS_A_MM};

/// Ticks a metre of the default wheel.
const TICKS_A_METRE: f64 = 1909.86;

/// A turn of the main loop.
const TURN_US: u32 = 500;
const TURN_S: f64 = TURN_US as f64 / 1e6;

/// Tolerance of the command in ticks, because the measured speed lags.
const TOLERANCE: f64 = 12.0;

#[derive(Clone, Debug)]
struct Leg {
    speed_mm_s: f64,
    length_mm: f64,
}

fn legs() -> impl Strategy<Value = Vec<Leg>> {
    let leg = prop_oneof![
        4 => (200.0..2800.0, 100.0..1500.0),
        1 => (-700.0..-50.0, 10.0..900.0),
        1 => (5.0..50.0, 1.0..20.0),
    ];
    prop::collection::vec(leg.prop_map(|(speed_mm_s, length_mm)| Leg { speed_mm_s, length_mm }), 1..12)
}

/// Gaps before each plant and canopies, in mm.
fn plants() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((60.0..900.0, 65.0..300.0), 1..20)
}

/// The data of a run.
struct Run {
    plants_told: usize,
    plants_seen: usize,
}

/// Rolls past the plants, and checks each order.
fn roll(distance_mm: u16, plants: &[(f64, f64)], legs: &[Leg], paper: bool) -> Result<Run, TestCaseError> {
    let mut place = 700.0 + f64::from(distance_mm);
    let canopies: Vec<(f64, f64)> = plants
        .iter()
        .map(|&(gap_mm, canopy_mm)| {
            let leading = place + gap_mm;
            place = leading + canopy_mm;
            (leading * TICKS_A_METRE / 1000.0, place * TICKS_A_METRE / 1000.0)
        })
        .collect();
    let broken_at = |count: i32| canopies.iter().any(|&(from, to)| (from..to).contains(&f64::from(count)));

    let mut machine = machine();
    let (lead_out_s, lead_in_s) = if paper { (0.0, 0.0) } else { (0.180, 0.040) };
    // The speed that the beam's distance allows.
    let notice_s = lead_out_s * 9.0 / 8.0 + 0.001;
    let top_speed_mm_s = ((f64::from(distance_mm) - 52.0) / notice_s).min(3000.0).floor();
    for (setting, value) in [
        (Setting::TopSpeedMmS, 100),
        (Setting::BeamToToolMm, distance_mm),
        // The beam of this test responds at once.
        (Setting::BeamResponseMs, 0),
        (Setting::MaxWidthMm, 1500),
        (Setting::LeadOutMs, (lead_out_s * 1000.0) as u16),
        (Setting::LeadInMs, (lead_in_s * 1000.0) as u16),
        (Setting::TopSpeedMmS, top_speed_mm_s as u16),
    ] {
        machine.set(setting, value).unwrap();
    }
    machine.enable_events(true);
    machine.start(true).unwrap();
    let distance = f64::from(machine.settings().ticks(Setting::BeamToToolMm).0);
    let margin = f64::from(machine.settings().ticks(Setting::MarginMm).0);
    let tool_in = servo::from_us(machine.settings().get(Setting::ServoInUs));

    let mut run = Run { plants_told: 0, plants_seen: 0 };
    let (mut time_us, mut position, mut count, mut farthest) = (0, 0.0_f64, 0_i32, 0_i32);
    let mut speed = 0.0_f64;
    let mut out_since_us = None;
    for leg in legs {
        // Rolling back too fast is an alarm too.
        let most_mm_s = 0.95 * top_speed_mm_s;
        let target = leg.speed_mm_s.clamp(-most_mm_s, most_mm_s) * TICKS_A_METRE / 1000.0;
        let mut left = leg.length_mm * TICKS_A_METRE / 1000.0;
        while left > 0.0 {
            // A person pushes: 1 m/s2.
            let most = 1000.0 * TICKS_A_METRE / 1000.0 * TURN_S;
            let step = (target - speed).clamp(-most, most);
            speed += step;
            let rolled = speed * TURN_S;
            position += rolled;
            left -= rolled.abs().max(0.01);
            time_us += TURN_US;
            // Each count passed, with the beam's edges at their positions.
            let reached = position.floor() as i32;
            while count != reached {
                count += (reached - count).signum();
                machine.at(count).see(Beams::one(broken_at(count)));
            }
            farthest = farthest.max(count);
            let orders = machine.turn_after(TURN_US);
            let events = machine.events();
            run.plants_told += events.iter().filter(|event| matches!(event, Event::Detection { .. })).count();
            let tool = f64::from(count) - distance;
            if orders.pulse != tool_in {
                // Over a canopy, the servo must have had its lead to swing out.
                let over_a_canopy = canopies.iter().any(|&(from, to)| (from..to).contains(&tool));
                let out_for_s = f64::from(time_us - *out_since_us.get_or_insert(time_us)) / 1e6;
                prop_assert!(
                    !over_a_canopy || out_for_s + TURN_S >= lead_out_s,
                    "the tool was told to leave only {out_for_s} s ago, at {tool}, at {speed} ticks/s"
                );
                continue;
            }
            out_since_us = None;
            for &(leading, trailing) in &canopies {
                let (from, to) = (leading - margin, trailing + margin);
                // The tool stays out for the lead before it moves, so its command may come that much early.
                let early = (speed * lead_in_s).abs() * 1.5 + TOLERANCE;
                let (from, to) = if speed >= 0.0 { (from, to - early) } else { (from + early, to) };
                prop_assert!(
                    !(from + TOLERANCE..=to).contains(&tool),
                    "the tool is in the row at {tool}, within {from} to {to}, at {speed} ticks/s"
                );
            }
        }
    }
    run.plants_seen = canopies.iter().filter(|&&(_, trailing)| trailing + 45.0 < f64::from(farthest)).count();
    Ok(run)
}

/// Canopies closer than the merging gap would be one detection; these are at least 60 mm apart.
fn check(distance_mm: u16, plants: &[(f64, f64)], legs: &[Leg], paper: bool) -> Result<(), TestCaseError> {
    let run = roll(distance_mm, plants, legs, paper)?;
    prop_assert!(
        (run.plants_seen..=run.plants_seen + 1).contains(&run.plants_told),
        "{} of {} plants were reported",
        run.plants_told,
        run.plants_seen
    );
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_tool_is_never_in_the_row_over_a_plant(
        distance_mm in 150_u16..=2000,
        plants in plants(),
        legs in legs(),
    ) {
        check(distance_mm, &plants, &legs, false)?;
    }

    #[test]
    fn the_same_without_leads_as_in_the_paper(distance_mm in 150_u16..=2000, plants in plants(), legs in legs()) {
        check(distance_mm, &plants, &legs, true)?;
    }

    #[test]
    fn a_sudden_start_does_not_bring_the_tool_back_too_early(
        stands_at in -45_f64..190.0,
        mm_s in 100_f64..800.0,
        mm_s2 in prop_oneof![300_f64..3000.0, Just(1e9)],
    ) {
        let (begin_mm, end_mm) = (600.0, 750.0);
        let mut rolling = Rolling::along(vec![(begin_mm, end_mm)], Vec::new(), &[]);
        let mut speed: f64 = 300.0;
        // The machine brakes over 45 mm and stands. Then it starts, or a dead encoder works again.
        rolling.roll_to(begin_mm + BEAM_TO_TOOL_MM + stands_at - 45.0, speed);
        while speed > 0.0 {
            speed -= 1000.0 * TURN_S;
            rolling.turn(speed.max(0.0) * TURN_S);
        }
        (0..1200).for_each(|_| rolling.turn(0.0));
        prop_assert!(rolling.machine.tool_out() && rolling.machine.unseen_mm() == 0);
        while rolling.machine.tool_out() {
            speed = mm_s.min(speed + mm_s2 * TURN_S);
            rolling.turn(speed * TURN_S);
        }
        let (tool_mm, lead_in_s) = (rolling.place_mm - BEAM_TO_TOOL_MM, 0.041);
        let least_mm = end_mm + MARGIN_MM - speed * lead_in_s - 2.0 / TICKS_A_MM;
        prop_assert!(tool_mm >= least_mm, "{tool_mm} mm at {speed} mm/s, {least_mm} mm is safe");
    }
}

#[test]
fn the_tool_is_in_the_row_if_nothing_keeps_it_out() {
    let mut machine = machine();
    machine.start(false).unwrap();
    let mut orders = machine.turn();
    let out = servo::from_us(machine.settings().get(Setting::ServoOutUs));
    assert_eq!(orders.pulse, out, "the beam has not seen this ground");
    for count in 1..2000 {
        orders = machine.at(count).turn_after(1000);
        // A plant may end where the beam began, so a margin is kept from there.
        let settings = machine.settings();
        let seen = Ticks(count) - settings.ticks(Setting::BeamToToolMm) - settings.ticks(Setting::MarginMm);
        // The lead of 40 ms is 40 ticks at this speed.
        if seen > Ticks(5) {
            assert_ne!(orders.pulse, out, "at {count}");
        }
        if seen < Ticks(-45) {
            assert_eq!(orders.pulse, out, "at {count}");
        }
    }
}

#[test]
fn work_begins_on_ground_that_the_beam_has_yet_to_see() {
    for by in ["start", "switch", "start now"] {
        let mut rolling = Rolling::along(Vec::new(), Vec::new(), &[]);
        rolling.roll_to(2000.0, 500.0);
        assert!(!rolling.machine.tool_out());
        rolling.machine.hold();
        // The machine turns, with reversing. Then another row lies where the beam has been.
        rolling.roll_to(4000.0, 500.0);
        rolling.roll_to(2625.0, 500.0);
        let brakes = (0..).map(|turn| 500.0 - 1000.0 * TURN_S * f64::from(turn)).take_while(|speed| *speed > 0.0);
        brakes.for_each(|speed| rolling.turn(-speed * TURN_S));
        let plant_mm = (2700.0, 2850.0);
        rolling.first_mm = vec![plant_mm];
        rolling.weeded_mm.clear();
        match by {
            "switch" => rolling.machine.readings.switch_on = true,
            _ => rolling.machine.start(by == "start now").unwrap(),
        }
        (0..200).for_each(|_| rolling.turn(0.0));
        assert!(rolling.machine.tool_out(), "{by}");
        rolling.roll_to(4500.0, 500.0);
        // The command to come back leads.
        let zone_mm = plant_mm.0 - MARGIN_MM..plant_mm.1 + MARGIN_MM - 25.0;
        let harm_mm = rolling.weeded_mm.iter().find(|mm| **mm < 2500.0 || zone_mm.contains(mm));
        assert!(harm_mm.is_none() && !rolling.weeded_mm.is_empty(), "{by}: {harm_mm:?}");
    }
}

#[test]
fn start_now_after_rolling_back_too_far_at_work_waits() {
    let mut rolling = Rolling::along(Vec::new(), Vec::new(), &[]);
    rolling.roll_to(9000.0, 500.0);
    rolling.roll_to(980.0, 500.0);
    assert_eq!(rolling.machine.state(), State::Alarm(Alarm::RolledBackTooFar));
    rolling.machine.clear();
    rolling.machine.start(true).unwrap();
    rolling.roll_to(1000.0, 500.0);
    assert!(rolling.machine.tool_out());
}

#[test]
fn start_now_drops_known_ground_after_rolling_back_too_far() {
    // Up to the margin, and beyond; also where the memory ends, and the beam sees the ground again.
    for (back_mm, keeps) in [(0.0, true), (40.0, true), (70.0, false), (3000.0, false), (8010.0, false)] {
        let mut rolling = Rolling::along(Vec::new(), Vec::new(), &[]);
        rolling.roll_to(9000.0, 500.0);
        rolling.machine.hold();
        rolling.roll_to(9000.0 - back_mm, 500.0);
        rolling.machine.start(true).unwrap();
        rolling.roll_to(9010.0 - back_mm, 500.0);
        assert_eq!(rolling.machine.tool_out(), !keeps, "{back_mm} mm");
        // Typed again, it opens nothing that it has forgotten.
        rolling.machine.start(true).unwrap();
        rolling.roll_to(9020.0 - back_mm, 500.0);
        assert_eq!(rolling.machine.tool_out(), !keeps, "{back_mm} mm, again");
    }
}
