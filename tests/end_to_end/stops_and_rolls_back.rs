//! Unsteady motions: the tool's position follows from the machine's position and speed, so plants are equally safe.

use crate::common::{Run, ask, number, pass, status};
use field::machine::cycle_at;
use field::motion::{Motion, mm_s};
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::verdict::{Judgement, Verdict};
use field::wiring;

/// Positions of the three plants, far enough apart for a swing each.
const PLACES_MM: [f64; 3] = [800.0, 1500.0, 2200.0];

/// Rolls past the plants.
fn roll(motion: Motion) -> Run {
    let row =
        Row::new(PLACES_MM.map(|place_mm| Canopy::plant(place_mm, 150.0)).to_vec()).expect("the plants stand apart");
    let mut run = Run::begin(pass(row, motion), &[]);
    run.roll_to_the_end();
    run.uno.send(b"status\n");
    run.uno.run_for_ms(50).expect("the firmware runs");
    run
}

/// Asserts that each plant was counted once and none damaged, and that the tool was in the row between them.
#[track_caller]
fn assert_unharmed_and_counted_once(run: &mut Run) -> Judgement {
    let judgement = run.judgement();
    for plant in &judgement.plants {
        assert_ne!(plant.verdict, Verdict::Damaged, "{plant:?}");
    }
    assert!(judgement.weeded_share > 0.1, "the tool was in the row at all");
    let counted = run.events("plant").len() + run.events("unknown").len();
    assert_eq!(counted, PLACES_MM.len(), "{:#?}", run.lines());
    let lines = run.lines();
    let status = lines.iter().rev().find(|line| line.starts_with("lost=")).expect("a status");
    assert_eq!((number(status, "lost"), number(status, "missed")), (0, 0), "{status}");
    judgement
}

#[test]
fn slow_at_the_beam_and_fast_at_the_tool_harms_no_plant() {
    // Beyond 950 mm the beam has passed the first plant, and the tool has not reached it.
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(1.0), 1000.0)
        .roll_to(950.0)
        .change_speed(mm_s(2.5), 3000.0)
        .roll_to(2900.0);
    assert_unharmed_and_counted_once(&mut roll(motion));
}

#[test]
fn slow_at_the_beam_and_fast_at_the_tool_for_each_plant_harms_none() {
    let mut motion = Motion::starting_at(0.0).change_speed(mm_s(1.0), 1000.0);
    for place_mm in PLACES_MM {
        // Slow while the beam passes the canopy, fast before the tool reaches it.
        motion = motion
            .roll_to(place_mm + 90.0)
            .change_speed(mm_s(2.5), 3000.0)
            .roll_to(place_mm + 500.0)
            .change_speed(mm_s(1.0), 3000.0);
    }
    assert_unharmed_and_counted_once(&mut roll(motion.roll_to(2900.0)));
}

#[test]
fn a_stop_over_a_plant_keeps_the_tool_out_of_it() {
    // The tool stops over the middle plant.
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(1900.0, 1000.0)
        .go_on_for(2.0)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2900.0);
    let judgement = assert_unharmed_and_counted_once(&mut roll(motion));
    assert_eq!(judgement.plants[1].swings, 1);
}

#[test]
fn a_stop_with_the_beam_in_a_plant_makes_one_plant_of_it() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(1500.0, 1000.0)
        .go_on_for(1.5)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2900.0);
    assert_unharmed_and_counted_once(&mut roll(motion));
}

#[test]
fn rolling_back_over_a_plant_harms_none_and_counts_none_twice() {
    // The tool goes back over the middle plant, the beam over the last one.
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(2320.0, 1000.0)
        .change_speed(-mm_s(1.0), 1000.0)
        .stop_at(1650.0, 1000.0)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2900.0);
    assert_unharmed_and_counted_once(&mut roll(motion));
}

#[test]
fn rolling_back_fast_over_two_plants_harms_none() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.5), 1000.0)
        .stop_at(2400.0, 1500.0)
        .change_speed(-mm_s(2.5), 1000.0)
        .stop_at(900.0, 1500.0)
        .change_speed(mm_s(2.5), 1000.0)
        .roll_to(2900.0);
    assert_unharmed_and_counted_once(&mut roll(motion));
}

#[test]
fn shunting_with_the_beam_in_a_plant_makes_one_plant_of_it() {
    let mut motion = Motion::starting_at(0.0).change_speed(mm_s(1.5), 1000.0);
    for _ in 0..3 {
        motion = motion.stop_at(1540.0, 1000.0).change_speed(-mm_s(1.0), 1000.0);
        motion = motion.stop_at(1300.0, 1000.0).change_speed(mm_s(1.5), 1000.0);
    }
    assert_unharmed_and_counted_once(&mut roll(motion.roll_to(2900.0)));
}

#[test]
fn after_a_turn_with_reversing_a_plant_of_the_next_row_is_kept() {
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.0), 1000.0)
        .stop_at(1900.0, 1000.0)
        .go_on_for(0.5)
        .change_speed(-mm_s(2.0), 1000.0)
        .stop_at(900.0, 1000.0)
        .go_on_for(1.0)
        .change_speed(mm_s(2.0), 1000.0)
        .roll_to(2600.0);
    let passing = |place_mm, number| motion.passings(place_mm).nth(number).expect("the machine comes there").time_s;
    let (hold_s, turn_s, start_s) = (passing(1000.0, 0), passing(1890.0, 1), passing(905.0, 1) + 0.7);
    for start in [&b"start\n"[..], b"start now\n"] {
        let row = Row::new(vec![Canopy::plant(1300.0, 150.0)]).expect("a plant is a row");
        let pass = Pass { start: Start::Now, ..pass(row, motion.clone()) };
        // Before the turn the beam passes bare ground.
        let mut run = Run::begin_altered(pass, &[], |start, mut changes| {
            changes.retain(|change| change.pin != wiring::BEAM || change.cycle > cycle_at(start, turn_s));
            changes
        });
        for (time_s, line) in [(hold_s, &b"hold\n"[..]), (start_s, start)] {
            run.uno.run_until(cycle_at(run.cycles().start, time_s)).expect("the firmware runs");
            run.uno.send(line);
        }
        run.roll_to_the_end();
        let judgement = run.judgement();
        assert_ne!(judgement.plants[0].verdict, Verdict::Damaged, "{:?}", judgement.plants);
        let start = cycle_at(run.cycles().start, start_s);
        let commands = run.commands();
        assert!(commands.iter().any(|command| command.rise_cycle > start && !command.is_out), "it weeds the next row");
    }
}

#[test]
fn start_now_after_a_hard_stop_damages_no_forgotten_plant() {
    // The second plant stands between beam and tool.
    let motion = Motion::starting_at(0.0)
        .change_speed(mm_s(2.5), 1000.0)
        .stop_at(1800.0, 10_000.0)
        .go_on_for(1.0)
        .change_speed(mm_s(0.3), 500.0)
        .stop_at(1830.0, 500.0)
        .go_on_for(2.0)
        .change_speed(mm_s(2.5), 1000.0)
        .roll_to(2900.0);
    let row = Row::new(PLACES_MM.map(|place_mm| Canopy::plant(place_mm, 150.0)).to_vec()).expect("they stand apart");
    let stopped_s = motion.passings(1829.0).next().expect("the machine comes there").time_s + 1.0;
    let mut run = Run::begin(pass(row, motion), &[]);
    run.uno.run_until(cycle_at(run.cycles().start, stopped_s)).expect("the firmware runs");
    ask(&mut run.uno, "hold");
    let said = status(&mut run.uno);
    assert!(number(&said, "unseen_mm") > 300, "the plants are forgotten: {said}");
    ask(&mut run.uno, "start now");
    run.roll_to_the_end();
    for plant in &run.judgement().plants {
        assert_ne!(plant.verdict, Verdict::Damaged, "{plant:?}");
    }
}
