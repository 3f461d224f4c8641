//! A second beam: it measures the wheel's slip plant by plant. A torn wire of either beam is reported before it costs a
//! plant.

use crate::common::{Run, is_out_at_the_pin, named, number, pass, started, status, steady, value};
use field::machine::{Machine, cycle_at};
use field::motion::mm_s;
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::verdict::{Judgement, Verdict};
use field::wiring;
use uno::{Pin, PinChange};

const SECOND_BEAM_MM: f64 = 200.0;

const PLANTS: usize = 7;

/// Plants every 500 mm, the first at 600 mm.
fn plants(count: usize) -> Row {
    Row::new((0..count).map(|plant| Canopy::plant(600.0 + 500.0 * plant as f64, 150.0)).collect())
        .expect("the plants stand apart")
}

/// A machine with two beams, along seven plants. `slip` returns the wheel's slip in each leg.
fn slipping(speed_km_h: f64, second_beam_mm: f64, slip: impl FnMut() -> f64) -> Pass {
    let pass = pass(plants(PLANTS), steady(mm_s(speed_km_h), 4300.0).with_slip(slip));
    Pass { machine: Machine { second_beam_mm, ..Machine::default() }, start: Start::Now, ..pass }
}

fn count(judgement: &Judgement, verdict: Verdict) -> usize {
    // The first two plants measure the slip.
    judgement.plants[2..].iter().filter(|plant| plant.verdict == verdict).count()
}

#[test]
fn with_slip_every_plant_after_the_second_is_kept() {
    for (speed_km_h, slip) in [(1.0, 0.1), (2.5, 0.1), (2.5, -0.1)] {
        let outcome = |second_beam_mm| {
            let mut run = Run::begin(slipping(speed_km_h, second_beam_mm, || slip), &[]);
            run.roll_to_the_end();
            assert_eq!(run.events("alarm"), [""; 0]);
            (count(&run.judgement(), Verdict::Kept), run.events("slip"))
        };
        let (kept, told) = outcome(SECOND_BEAM_MM);
        assert_eq!(kept, PLANTS - 2, "{speed_km_h} km/h, slip {slip}");
        let measured = number(told.last().expect("plants have told it"), "permille") as f64;
        assert!((measured - 1000.0 * slip).abs() < 8.0, "{told:?}");
        let (kept, told) = outcome(0.0);
        assert!(kept < PLANTS - 2 && told.is_empty(), "without it, margins are cut: {kept}, {told:?}");
    }
}

#[test]
fn the_slip_is_reported_plant_by_plant_and_dropped_by_an_alarm() {
    let mut run = Run::begin(slipping(1.0, SECOND_BEAM_MM, || 0.1), &[]);
    run.roll_to(600.0);
    assert_eq!(value(&status(&mut run.uno), "slip_permille"), "none");
    run.roll_to(2350.0);
    assert_eq!(run.events("slip").len(), 2, "of three plants that have passed, by the second on: {:#?}", run.lines());
    let begin = run.uno.cycle() + 1600;
    // The first beam chatters, too fast to be handled.
    run.uno.drive((0..400).map(|edge| PinChange { cycle: begin + edge * 160, pin: wiring::BEAM, high: edge % 2 == 1 }));
    run.roll_to(2450.0);
    let told = status(&mut run.uno);
    assert_eq!((value(&told, "state"), value(&told, "slip_permille")), ("alarm", "none"), "{told}");
}

/// Seven plants at 2 km/h. The wire of a beam tears at a position of the machine: its pin stays on the pull-up.
fn with_torn_wire(pin: Pin, torn_mm: f64) -> Run {
    let pass = slipping(2.0, SECOND_BEAM_MM, || 0.0);
    let torn_s = pass.motion.passings(torn_mm).next().expect("the machine comes there").time_s;
    Run::begin_altered(pass, &[], |start_cycle, mut changes| {
        let torn = cycle_at(start_cycle, torn_s);
        changes.retain(|change| change.pin != pin || change.cycle < torn);
        changes
    })
}

#[test]
fn a_torn_wire_of_either_beam_is_an_alarm_and_costs_no_plant() {
    for (pin, alarm) in [(wiring::BEAM, "1-4 beam_blind"), (wiring::SECOND_BEAM, "1-5 second_beam_blind")] {
        // Between the fourth plant and the fifth, for both of the beams.
        let mut run = with_torn_wire(pin, 2400.0);
        run.roll_to(3525.0 + 3.0 * 75.0);
        assert_eq!(run.events("alarm"), [""; 0], "two plants may be chance");
        // The third is at 3600 mm, and has passed the second beam. A fourth has not reached the first beam.
        run.roll_to(4020.0);
        let told = run.events("alarm");
        assert_eq!(told.len(), 1, "{:#?}", run.lines());
        assert_eq!(named(&told[0]), alarm);
        run.roll_to_the_end();
        assert!(is_out_at_the_pin(&run.uno));
        assert_eq!(run.judgement().count(Verdict::Damaged), 0, "{:#?}", run.judgement().plants);
    }
}

#[test]
fn without_a_second_beam_its_pin_may_do_what_it_likes() {
    let mut uno = started();
    let begin = uno.cycle();
    uno.drive((0..5000).map(|edge| PinChange {
        cycle: begin + edge * 320,
        pin: wiring::SECOND_BEAM,
        high: edge % 2 == 1,
    }));
    crate::common::run_for_ms(&mut uno, 150);
    let told = status(&mut uno);
    assert_eq!(value(&told, "state"), "hold", "{told}");
    assert!(!told.contains("slip"), "{told}");
}
