//! A tool that was driven directly must not count as stuck when the machine moves it back: its time limit restarts.

use crate::common::{ask, run_for_ms, started, status, throw_switch, value};
use field::wiring;
use uno::Uno;

/// The tool follows a command by this.
const FOLLOWS_MS: u64 = 120;

/// Types a line that moves the tool, and waits until it has moved.
fn moved(uno: &mut Uno, line: &str, out: bool) {
    ask(uno, line);
    run_for_ms(uno, FOLLOWS_MS);
    uno.set(wiring::END_SWITCH, !out);
    run_for_ms(uno, 600);
}

#[test]
fn a_tool_that_follows_every_move_by_hand_is_not_stuck() {
    for back in ["servo out", "hold", "start", "the switch"] {
        let mut uno = started();
        uno.set(wiring::END_SWITCH, false);
        run_for_ms(&mut uno, 100);
        ask(&mut uno, "set end_switch on");
        moved(&mut uno, "servo in", false);
        if back == "the switch" {
            throw_switch(&mut uno, true);
            run_for_ms(&mut uno, FOLLOWS_MS - 50);
            uno.set(wiring::END_SWITCH, false);
            run_for_ms(&mut uno, 600);
        } else {
            moved(&mut uno, back, true);
        }
        let said = status(&mut uno);
        assert!(["hold", "work"].contains(&value(&said, "state")), "{back}: {said}");
    }
}
