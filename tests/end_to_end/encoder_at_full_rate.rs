//! The encoder at its full rate, a hundred times walking speed, with the rest of the firmware busy.

use crate::common::{ask, elf, encoder_steps, number, run_for_ms, started, status};
use field::wiring;
use std::path::Path;
use uno::{CYCLES_PER_SECOND, PinChange};
use uno_run::bench::encoder::{self, Direction, JITTER, Load, RateResult, Turning};

/// Counts a second that the firmware follows while its status streams at 115200 baud and the beam flickers. This holds
/// for any timing of the edges: even, and early and late by 30 % of the time between two.
const EVEN_PER_S: f64 = 255_000.0;
const JITTERED_PER_S: f64 = 235_000.0;

/// Turns the encoder forward and backward under full load, with random edges and with edges at the worst moments.
#[track_caller]
fn assert_no_count_is_lost(counts_per_s: f64, jitter: f64) {
    for direction in [Direction::Forward, Direction::Backward] {
        let turning = Turning { load: Load::Telemetry, direction, jitter };
        for (trial, moments) in
            [(encoder::turn as Trial, "moments by chance"), (encoder::turn_at_worst, "worst moments")]
        {
            let counted = trial(&elf(), turning, counts_per_s).expect("the firmware runs");
            let share = counted.line_share * 100.0;
            println!("{direction:?} at {counts_per_s} counts/s, {moments}: {share:.0} % of the serial line");
            assert!(counted.is_passed(), "{direction:?} at {counts_per_s} counts/s, {moments}: {counted:?}");
        }
    }
}

type Trial = fn(&Path, Turning, f64) -> anyhow::Result<RateResult>;

#[test]
fn no_count_is_lost_at_the_full_rate_with_a_flickering_beam() {
    assert_no_count_is_lost(EVEN_PER_S, 0.0);
}

#[test]
fn no_count_is_lost_when_edges_come_early_and_late() {
    assert_no_count_is_lost(JITTERED_PER_S, JITTER);
}

/// Cycles between two counts at 20,000 a second.
const STEP_CYCLES: u64 = CYCLES_PER_SECOND / 20_000;

#[test]
fn no_count_is_lost_when_a_fast_wheel_turns_back() {
    let mut uno = started();
    ask(&mut uno, "events on");
    ask(&mut uno, "start now");
    let begin = uno.cycle() + STEP_CYCLES;
    // Two seconds forward, then half a second back.
    let steps = (0..50_000).map(|number| if number < 40_000 { 1 } else { -1 });
    uno.drive(encoder_steps((0..).map(|number| begin + number * STEP_CYCLES).zip(steps)));
    uno.drive((0..1500).map(|edge| PinChange {
        cycle: begin + edge * (CYCLES_PER_SECOND / 600) + edge % 7 * 111,
        pin: wiring::BEAM,
        high: edge % 2 == 1,
    }));
    let mut answers = 0;
    for _ in 0..26 {
        uno.send(b"help\n");
        run_for_ms(&mut uno, 100);
        answers += uno.received().lines().filter(|line| *line == "ok").count();
    }
    assert!(answers > 20, "the console streamed: {answers}");
    let status = status(&mut uno);
    assert_eq!((number(&status, "pos"), number(&status, "lost")), (30_000, 0), "{status}");
}
