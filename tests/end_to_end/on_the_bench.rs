//! What is tried on the bench, on the real ELF: the servo by hand and timed, the wheel calibrated, a row without sensors.

use crate::common::{ask, exchange, refusal, run_for_ms, status, value, woken_up};
use field::machine::Machine;
use field::motion::{Motion, mm_s};
use field::servo::Servo;
use field::wiring;
use uno::Uno;

/// The last servo pulse's width.
fn pulse_us(uno: &Uno) -> f64 {
    uno.pulses(wiring::SERVO).last().expect("the servo has pulses").width_us().round()
}

#[test]
fn the_servo_moves_by_hand_in_hold_only() {
    let mut uno = woken_up();
    for (command, width_us) in [("servo in", 1500.0), ("servo 1720", 1720.0), ("servo out", 2000.0)] {
        ask(&mut uno, command);
        run_for_ms(&mut uno, 50);
        assert_eq!(pulse_us(&uno), width_us, "{command}");
    }
    assert!(refusal(&mut uno, "servo 400").contains("from 500 to 2500"));
    ask(&mut uno, "servo in");
    ask(&mut uno, "start");
    run_for_ms(&mut uno, 50);
    assert_eq!(pulse_us(&uno), 2000.0, "the ground is not known");
    assert!(refusal(&mut uno, "servo in").contains("hold first"));
}

#[test]
fn a_measured_distance_sets_the_wheel() {
    let mut uno = woken_up();
    ask(&mut uno, "calibrate start");
    // The tyre is worn: the machine takes its wheel for larger than it is.
    let machine = Machine { wheel_mm: 384.0, ..Machine::default() };
    let motion = Motion::steady(0.0, 3000.0, mm_s(2.5), 2000.0).change_speed(0.0, 3000.0);
    let (rolled_mm, start) = (motion.end_mm().round() as u32, uno.cycle());
    uno.drive(machine.pin_changes(&crate::common::bare_ground(), &motion, start));
    run_for_ms(&mut uno, (motion.duration_s() * 1000.0) as u64 + 50);
    assert!(refusal(&mut uno, &format!("calibrate {}", rolled_mm / 2)).contains("add force"));
    let answer = ask(&mut uno, &format!("calibrate {rolled_mm}")).remove(0);
    // 2400 counts in pi * 0.384 m.
    let ticks_per_m: f64 = value(&answer, "ticks_per_m").parse().expect("a number");
    assert!((ticks_per_m - 1989.4).abs() < 3.0, "{answer}");
}

/// Has the end switch follow the servo's commands, as a tool does that takes `out_ms` and begins to leave after `in_ms`.
fn swing(uno: &mut Uno, duration_ms: u64, out_ms: u64, in_ms: u64) {
    let (mut told_out, mut told_at) = (true, 0);
    for now in 0..duration_ms {
        let out = pulse_us(uno) > 1750.0;
        if out != told_out {
            (told_out, told_at) = (out, now);
        }
        if now - told_at == if told_out { out_ms } else { in_ms } {
            uno.set(wiring::END_SWITCH, !told_out);
        }
        run_for_ms(uno, 1);
    }
}

#[test]
fn the_end_switch_times_the_servo() {
    let mut uno = woken_up();
    uno.set(wiring::END_SWITCH, false);
    run_for_ms(&mut uno, 50);
    ask(&mut uno, "set end_switch on");
    ask(&mut uno, "calibrate servo");
    swing(&mut uno, 10_000, 150, 60);
    let told = uno.received();
    let line = told.lines().find(|line| line.starts_with("calibrated ")).expect("how it ended");
    let number = |key| value(line, key).parse::<f64>().expect("a number");
    // A pulse has to end before it can be seen, and the firmware adds 11 ms to the way out.
    assert!((159.0..=168.0).contains(&number("lead_out_ms")), "{line}");
    assert!((58.0..=66.0).contains(&number("lead_in_ms")), "{line}");
    assert_eq!(value(line, "set"), "yes");
    assert_eq!(value(&ask(&mut uno, "get lead_out_ms")[0], "lead_out_ms"), value(line, "lead_out_ms"));
}

#[test]
fn a_row_without_sensors_swings_the_servo_for_each_plant() {
    let mut uno = woken_up();
    ask(&mut uno, "events on");
    let before = uno.pulses(wiring::SERVO).len();
    ask(&mut uno, "test row 400");
    run_for_ms(&mut uno, 12_000);
    let told = uno.received();
    // The beginning of the first line may have come with the answer.
    assert!(told.lines().skip(1).all(|line| line.starts_with("swing ")), "{told}");
    assert_eq!(told.lines().count(), 14, "{told}");
    let commands = Servo::default().commands(&uno.pulses(wiring::SERVO)[before..]);
    // Into the row, and out and in for each plant; out for good at the end.
    assert_eq!(commands.len(), 1 + 2 * 6 + 1, "{commands:?}");
    let said = status(&mut uno);
    assert_eq!((value(&said, "state"), value(&said, "pos")), ("hold", "0"), "{said}");
    assert!(refusal(&mut uno, "test row 2000").contains("from 100 to 1400"));
}

#[test]
fn curves_come_twenty_times_a_second_and_nothing_else_carries_a_colon() {
    let mut uno = woken_up();
    ask(&mut uno, "events on");
    ask(&mut uno, "plot on");
    uno.received();
    ask(&mut uno, "start");
    run_for_ms(&mut uno, 1000);
    let text = uno.received();
    let (points, others): (Vec<&str>, Vec<&str>) = text.lines().partition(|line| line.starts_with("speed_mm_s:"));
    assert!((19..=22).contains(&points.len()), "{points:?}");
    let complete = &points[1..points.len() - 1];
    assert!(complete.iter().all(|line| *line == "speed_mm_s:0,tool_deg:45,beam_broken:0,windows:0"), "{points:?}");
    assert!(others.iter().all(|line| !line.contains(':')), "{others:?}");
    ask(&mut uno, "plot teleplot");
    run_for_ms(&mut uno, 200);
    assert!(uno.received().contains(">tool_deg:45\r\n"));
    ask(&mut uno, "plot off");
    assert_eq!(exchange(&mut uno, b"\n"), [""; 0]);
}

#[test]
fn settings_are_taken_back_from_the_memory_or_the_table() {
    let mut uno = woken_up();
    assert!(refusal(&mut uno, "revert").contains("save"));
    for line in ["set k 5", "save", "set k 9"] {
        ask(&mut uno, line);
    }
    assert_eq!(ask(&mut uno, "get k"), ["k=9 from 1 to 15, default 3, saved 5"]);
    ask(&mut uno, "revert");
    assert_eq!(ask(&mut uno, "get k"), ["k=5 from 1 to 15, default 3"]);
    ask(&mut uno, "defaults");
    assert_eq!(ask(&mut uno, "get k"), ["k=3 from 1 to 15, default 3, saved 5"]);
}
