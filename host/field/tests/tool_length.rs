//! A tool with a length along the row is a rectangle: closed forms of where it meets a zone, a weed and the row's line.

use field::baselines::ideal;
use field::conditions::Mechanism;
use field::driving::Steering;
use field::machine::Machine;
use field::motion::{Motion, mm_s};
use field::optimum::undamaged_share;
use field::pass::{Pass, Weeded};
use field::row::{Canopy, Row, Stem};
use field::servo::Servo;
use field::stand::{Stand, Weed};
use field::tool_path::{Effect, effect};
use field::verdict::{Verdict, ZoneSettings, judge};
use uno::{CYCLES_PER_SECOND, Pulse};

/// A stem at 1000 mm, so far from the row's line, with a zone of this radius.
fn stem(across_mm: f64, protected_mm: f64) -> Stem {
    Stem { along_mm: 1000.0, across_mm, protected_mm, is_seen: true }
}

fn stand(stem: Stem, weeds_mm: &[f64]) -> Stand {
    Stand {
        row: Row::new(vec![Canopy::plant(1000.0, 150.0)]).expect("it is a row"),
        stems: vec![stem],
        neighbours: Vec::new(),
        weeds: weeds_mm.iter().map(|&along_mm| Weed { along_mm, across_mm: 0.0 }).collect(),
        counted_mm: 0.0..2000.0,
        span_mm: 0.0..2000.0,
    }
}

/// A tool of this length on a servo that needs no time.
fn machine(tool_length_mm: f64) -> Machine {
    Machine {
        tool_length_mm,
        servo: Servo { dead_time_ms: 0.0, travel_ms: 0.01, ..Servo::default() },
        ..Machine::default()
    }
}

/// Slow, so that the time of a pulse is a fifth of a millimetre.
fn motion() -> Motion {
    Motion::steady(-500.0, 1e6, 100.0, 3000.0)
}

/// Pulses that swing the tool out, and back in, when its middle is at these places.
fn pulses(machine: &Machine, motion: &Motion, out_mm: f64, in_mm: f64) -> [Pulse; 3] {
    let pulse = |tool_mm: f64, width_us: u64| {
        let passing = motion.passings(tool_mm + machine.beam_to_tool_mm).next().expect("it is passed");
        let rise = (passing.time_s * CYCLES_PER_SECOND as f64) as u64;
        Pulse { rise, fall: rise + width_us * 16 }
    };
    [Pulse { rise: 0, fall: 1500 * 16 }, pulse(out_mm, 2000), pulse(in_mm, 1500)]
}

fn effect_of(machine: &Machine, stand: &Stand, out_mm: f64, in_mm: f64) -> Effect {
    let (motion, steering) = (motion(), Steering::default());
    let pulses = pulses(machine, &motion, out_mm, in_mm);
    // Without sweeps.
    let mechanism = Mechanism { sweeps_a_side: 0, ..Mechanism::default() };
    effect(stand, machine, &mechanism, (&motion, &steering), &pulses, 0)
}

#[test]
fn a_rectangle_meets_a_circle_with_edges_and_corners() {
    for length_mm in [0.0, 20.0, 45.0, 90.0] {
        let machine = machine(length_mm);
        // On the row's line an edge meets the zone. At 60 mm on the other side than the tool swings, the corner does, at
        // 32.5 mm from the stem across the row. At 73 mm it passes.
        for (across_mm, reach_mm) in [(0.0, 45.0), (-60.0, 31.125), (-73.0, f64::NEG_INFINITY)] {
            let stand = stand(stem(across_mm, 45.0), &[]);
            let damaged = |out_mm: f64, in_mm: f64| effect_of(&machine, &stand, out_mm, in_mm).damaged;
            if reach_mm < 0.0 {
                assert_eq!(damaged(1500.0, 1900.0), 0, "{length_mm} mm beside the zone");
                continue;
            }
            let from_stem_mm = reach_mm + length_mm / 2.0;
            for (more_mm, is_damaged) in [(1.0, 0), (-1.0, 1)] {
                let clear_mm = from_stem_mm + more_mm;
                let what = format!("{length_mm} mm, {clear_mm} mm from a stem at {across_mm} mm");
                assert_eq!(damaged(1000.0 - clear_mm, 1500.0), is_damaged, "front edge, {what}");
                assert_eq!(damaged(500.0, 1000.0 + clear_mm), is_damaged, "rear edge, {what}");
            }
        }
    }
}

#[test]
fn a_rectangle_takes_weeds_up_to_its_front_and_rear_edge() {
    for length_mm in [0.0, 20.0, 45.0] {
        let half_mm = length_mm / 2.0;
        for (weed_mm, after) in [
            (800.0 + half_mm - 1.0, 0),
            (800.0 + half_mm + 1.0, 1),
            (1200.0 - half_mm - 1.0, 1),
            (1200.0 - half_mm + 1.0, 0),
            (300.0, 0),
        ] {
            let effect = effect_of(&machine(length_mm), &stand(stem(0.0, 45.0), &[weed_mm]), 800.0, 1200.0);
            assert_eq!(effect.in_row.after, after, "{length_mm} mm and a weed at {weed_mm} mm");
        }
    }
}

#[test]
fn clearances_end_at_the_edges_and_the_margin_at_the_middle() {
    let (row, motion) = (stand(stem(0.0, 45.0), &[]).row, motion());
    let timing = ZoneSettings { margin_mm: 50, lead_out_ms: 0, lead_in_ms: 0, ..ZoneSettings::default() };
    // The canopy is from 925 to 1075 mm.
    let of = |length_mm: f64, margin_mm: f64| {
        let machine = machine(length_mm);
        let pulses = pulses(&machine, &motion, 925.0 - margin_mm, 1075.0 + margin_mm);
        let judgement = judge(&row, &machine, &motion, timing, &pulses, 0);
        let weeded_mm: f64 = judgement.weeded_mm.iter().map(|ground| ground.end - ground.start).sum();
        (judgement.plants[0].clone(), weeded_mm)
    };
    let (line, line_mm) = of(0.0, 50.0);
    let (blade, blade_mm) = of(40.0, 50.0);
    for (before, after) in
        [(line.clearance_before_mm, blade.clearance_before_mm), (line.clearance_behind_mm, blade.clearance_behind_mm)]
    {
        let nearer_mm = before.expect("it swings") - after.expect("it swings");
        assert!((nearer_mm - 20.0).abs() < 1e-9, "{nearer_mm} mm");
    }
    // 20 mm more at each of the four ends.
    assert!((blade_mm - line_mm - 80.0).abs() < 1e-6, "{blade_mm} and {line_mm} mm");
    let verdicts = |length_mm: f64| [50.0, 35.0, 15.0].map(|margin_mm| of(length_mm, margin_mm).0.verdict);
    assert_eq!(verdicts(0.0), [Verdict::Kept, Verdict::MarginCut, Verdict::MarginCut]);
    assert_eq!(verdicts(40.0), [Verdict::Kept, Verdict::MarginCut, Verdict::Reached]);
}

#[test]
fn the_bound_of_undamaged_ground_ends_at_the_zones_with_any_length() {
    let (stand, motion) = (stand(stem(0.0, 45.0), &[]), Motion::steady(-500.0, 1e6, 1.0, 3000.0));
    for length_mm in [0.0, 20.0, 45.0] {
        let machine = Machine { tool_length_mm: length_mm, ..Machine::default() };
        let share = undamaged_share(&stand, &machine, &motion, &Steering::default());
        assert!((share - (1.0 - 90.0 / 2000.0)).abs() < 0.002, "{length_mm} mm: {share}");
    }
}

#[test]
fn the_ideal_controller_swings_for_the_tool_s_length() {
    let stand = stand(stem(0.0, 45.0), &[]);
    let of = |length_mm: f64| Machine { tool_length_mm: length_mm, ..Machine::default() };
    for speed_km_h in [0.5, 1.0, 2.5] {
        let pass = |length_mm: f64| {
            Pass::at_speed(stand.row.clone(), of(length_mm), ZoneSettings::default(), mm_s(speed_km_h))
        };
        // With the swings for a tool of one length, and the tool of another.
        let damaged = |known_mm: f64, length_mm: f64| {
            let (known, pass) = (pass(known_mm), pass(length_mm));
            let Weeded { pulses, .. } = ideal(&known, &stand.stems);
            let drive = (&pass.motion, &Steering::default());
            effect(&stand, &pass.machine, &Mechanism::default(), drive, &pulses, 0).damaged
        };
        assert_eq!([damaged(0.0, 0.0), damaged(200.0, 200.0)], [0, 0], "{speed_km_h} km/h");
        assert_eq!(damaged(0.0, 200.0), 1, "{speed_km_h} km/h");
    }
}
