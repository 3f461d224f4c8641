//! `hold` and the work switch put the tool out at once, at every position.

use crate::common::{Run, bare_ground, is_out_at_the_pin, pass, run_for_ms, status, steady, value};
use field::motion::mm_s;
use field::pass::{Pass, Start};
use field::wiring;
use uno::CYCLES_PER_SECOND;
use uno::SENT_BYTE_CYCLES;

/// A running pulse, the gap after it, and turns of the loop.
const AT_ONCE_MS: f64 = 6.0;

/// Contacts are believed after 20 ms.
const BOUNCING_MS: f64 = 20.0;

/// The machine weeds bare ground.
fn weeding(start: Start) -> Run {
    let mut run = Run::begin(Pass { start, ..pass(bare_ground(), steady(mm_s(2.5), 2000.0)) }, &[]);
    run.roll_to(900.0);
    assert!(!is_out_at_the_pin(&run.uno));
    run
}

/// Time from a cycle to the next command at the pin, which must be a swing out.
#[track_caller]
fn time_to_swing_out_ms(run: &mut Run, cycle: u64) -> f64 {
    run.roll_to(1500.0);
    let command = run.first_command_after(cycle);
    assert!(command.is_out);
    assert!(is_out_at_the_pin(&run.uno), "it stays out");
    (command.rise_cycle - cycle) as f64 * 1000.0 / CYCLES_PER_SECOND as f64
}

#[test]
fn hold_puts_the_tool_out_at_once() {
    let mut run = weeding(Start::Now);
    let line = b"hold\n";
    run.uno.send(line);
    let line_ends = run.uno.cycle() + line.len() as u64 * SENT_BYTE_CYCLES;
    let time_ms = time_to_swing_out_ms(&mut run, line_ends);
    assert!(time_ms <= AT_ONCE_MS, "{time_ms} ms");
    assert_eq!(value(&status(&mut run.uno), "state"), "hold");
}

#[test]
fn the_switch_puts_the_tool_out_at_once() {
    let mut run = weeding(Start::Switch);
    run.uno.set(wiring::WORK_SWITCH, true);
    let thrown = run.uno.cycle();
    let time_ms = time_to_swing_out_ms(&mut run, thrown);
    assert!((BOUNCING_MS..=BOUNCING_MS + AT_ONCE_MS).contains(&time_ms), "{time_ms} ms");
    assert_eq!(value(&status(&mut run.uno), "state"), "hold");
}

#[test]
fn start_now_uses_the_ground_that_the_beam_saw_in_hold() {
    for (line, is_out) in [(&b"start now\n"[..], false), (b"start\n", true)] {
        let mut run = weeding(Start::Now);
        run.uno.send(b"hold\n");
        run.roll_to(1500.0);
        run.uno.send(line);
        run_for_ms(&mut run.uno, 30);
        assert_eq!(is_out_at_the_pin(&run.uno), is_out);
    }
}
