//! A save that is answered with `ok` keeps its values, even if the settings change during the write to the EEPROM: the
//! servo's swings end, and set the leads.

use crate::common::{ask, run_for_ms, started};
use field::servo::Servo;
use field::wiring;
use uno::Uno;

/// Delay of the end switch after the servo's commands.
const FOLLOWS_MS: u64 = 90;

/// Runs for a time, with an end switch that follows the servo.
fn follow(uno: &mut Uno, duration_ms: u64) {
    let mut told = Vec::from([true; FOLLOWS_MS as usize]);
    for now in 0..duration_ms {
        let place = (now % FOLLOWS_MS) as usize;
        uno.set(wiring::END_SWITCH, !told[place]);
        let pulses = uno.pulses(wiring::SERVO);
        told[place] = Servo::default().commands(&pulses[pulses.len().saturating_sub(2)..])[0].is_out;
        run_for_ms(uno, 1);
    }
}

#[test]
fn settings_saved_while_swings_are_timed_are_complete() {
    let mut meanwhile = 0;
    for save_at_ms in [19_350, 19_400, 19_450, 19_480, 19_500] {
        let mut uno = started();
        uno.set(wiring::END_SWITCH, false);
        run_for_ms(&mut uno, 50);
        for line in ["set end_switch on", "set k 5", "events on", "calibrate servo"] {
            ask(&mut uno, line);
        }
        follow(&mut uno, save_at_ms);
        uno.received();
        uno.send(b"save\n");
        follow(&mut uno, 400);
        let answer = uno.received();
        assert!(answer.lines().any(|line| line == "ok"), "{answer}");
        meanwhile += u32::from(answer.contains("calibrated "));
        uno.power_cycle();
        let greeting = uno.run_until_serial("commands\r\n", 16_000_000).expect("the firmware wakes up");
        assert!(greeting.contains("state hold"), "{save_at_ms} ms: {greeting}");
        assert_eq!(ask(&mut uno, "get k"), ["k=5 from 1 to 15, default 3"], "{save_at_ms} ms");
    }
    assert!(meanwhile > 1, "the swings ended while it was written");
}
