//! The encoder at 20,000 counts a second, fifteen times walking speed, with the rest of the firmware busy.

use crate::common::{ask, encoder_steps, number, run_for_ms, status, woken_up};
use field::signal::{CYCLES_PER_SECOND, Pin, PinChange};

/// Cycles between two counts.
const STEP_CYCLES: u64 = CYCLES_PER_SECOND / 20_000;

#[test]
fn no_count_is_lost_while_the_console_streams_and_the_beam_flickers() {
    let mut uno = woken_up();
    ask(&mut uno, "events on");
    ask(&mut uno, "start now");
    let begin = uno.cycle() + STEP_CYCLES;
    // Two seconds forward, then half a second back.
    let steps = (0..50_000).map(|number| if number < 40_000 { 1 } else { -1 });
    uno.drive(encoder_steps((0..).map(|number| begin + number * STEP_CYCLES).zip(steps)));
    uno.drive((0..1500).map(|edge| PinChange {
        cycle: begin + edge * (CYCLES_PER_SECOND / 600) + edge % 7 * 111,
        pin: Pin::Beam,
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
