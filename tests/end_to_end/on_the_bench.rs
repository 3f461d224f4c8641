//! Bench commands on the real ELF: the servo driven directly and timed, and a row without sensors.

use crate::common::{Run, ask, assert_all_kept, exchange, pass, refusal, run_for_ms, started, status, value};
use field::machine::Machine;
use field::motion::{Motion, mm_s};
use field::row::{Canopy, Row};
use field::servo::Servo;
use field::wiring;
use uno::{CYCLES_PER_SECOND, Uno};

/// The last servo pulse's width.
fn pulse_us(uno: &Uno) -> f64 {
    uno.pulses(wiring::SERVO).last().expect("the servo has pulses").width_us().round()
}

#[test]
fn the_tool_moves_in_hold_only_while_the_machine_stands() {
    let motion = Motion::steady(0.0, 3000.0, mm_s(2.5), 1000.0).change_speed(0.0, 3000.0);
    let roll = |uno: &mut Uno| {
        let start = uno.cycle();
        uno.drive(Machine::default().pin_changes(&crate::common::bare_ground(), &motion, start));
    };
    let rolls_ms = (motion.duration_s() * 1000.0) as u64;
    // The first swing of `calibrate servo` is out.
    for (command, after_ms, width_us) in [
        ("calibrate servo", 1600, 1500.0),
        ("servo in", 200, 1500.0),
        ("servo 1720", 200, 1720.0),
        ("test row", 200, 1500.0),
    ] {
        let mut uno = started();
        roll(&mut uno);
        run_for_ms(&mut uno, 500);
        assert!(refusal(&mut uno, command).contains("the machine rolls, stop first"), "{command}");
        run_for_ms(&mut uno, rolls_ms);
        assert_eq!(pulse_us(&uno), 2000.0, "{command}");
        ask(&mut uno, command);
        run_for_ms(&mut uno, after_ms);
        assert_eq!(pulse_us(&uno), width_us, "{command}");
        roll(&mut uno);
        run_for_ms(&mut uno, 100);
        assert_eq!(pulse_us(&uno), 2000.0, "{command}");
        run_for_ms(&mut uno, rolls_ms + 500);
        assert_eq!(pulse_us(&uno), 2000.0, "{command}: it does not come back by itself");
    }
}

/// Simulates the end switch of a tool that is out after `out_ms`, and begins to swing in after `in_ms`.
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
    let mut uno = started();
    uno.set(wiring::END_SWITCH, false);
    run_for_ms(&mut uno, 50);
    ask(&mut uno, "set end_switch on");
    // The manual has the tool put into the soil first.
    ask(&mut uno, "servo in");
    swing(&mut uno, 500, 150, 60);
    ask(&mut uno, "calibrate servo");
    swing(&mut uno, 20_500, 150, 60);
    let told = uno.received();
    let line = told.lines().find(|line| line.starts_with("calibrated ")).expect("how it ended");
    let number = |key| value(line, key).parse::<f64>().expect("a number");
    // A pulse is known only at its end, the switch is read a millisecond late at most, and the firmware adds 11 ms to the swing out.
    assert!((159.0..=169.0).contains(&number("lead_out_ms")), "{line}");
    assert!((58.0..=66.0).contains(&number("lead_in_ms")), "{line}");
    assert_eq!(value(line, "set"), "yes");
    assert_eq!(value(&ask(&mut uno, "get lead_out_ms")[0], "lead_out_ms"), value(line, "lead_out_ms"));
}

#[test]
fn a_row_without_sensors_swings_the_servo_for_each_plant() {
    let mut uno = started();
    ask(&mut uno, "events on");
    let before = uno.pulses(wiring::SERVO).len();
    ask(&mut uno, "test row 400");
    run_for_ms(&mut uno, 12_000);
    let told = uno.received();
    // The beginning of the first line may have come with the answer.
    assert!(told.lines().skip(1).all(|line| line.starts_with("swing ")), "{told}");
    assert_eq!(told.lines().count(), 14, "{told}");
    let commands = Servo::default().commands(&uno.pulses(wiring::SERVO)[before..]);
    // One swing in, a swing out and in for each plant, and the final swing out.
    assert_eq!(commands.len(), 1 + 2 * 6 + 1, "{commands:?}");
    let said = status(&mut uno);
    assert_eq!((value(&said, "state"), value(&said, "pos")), ("hold", "0"), "{said}");
    assert!(refusal(&mut uno, "test row 2000").contains("from 100 to 1300"));
}

#[test]
fn a_command_as_a_dry_run_ends_costs_no_real_plant() {
    // The row ends after 3.5 m, with half a turn of tolerance.
    let ends_us = 3_500_000_000 / 1300;
    for (command, off_us) in
        [("servo in", -600), ("servo in", -200), ("servo in", 0), ("servo in", 300), ("calibrate servo", 0)]
    {
        let mut uno = started();
        ask(&mut uno, "hold");
        let typed = "test row 1300\n";
        uno.send(typed.as_bytes());
        // A byte takes ten bits. The row begins with the last byte of its command, and the other line also ends with
        // its last byte.
        let bytes_us = |text: &str| text.len() as i64 * 1_000_000 * 10 / 115_200;
        let wait_us = bytes_us(typed) + ends_us + off_us - bytes_us(command) - bytes_us("\n");
        let cycle = uno.cycle() + wait_us as u64 * (CYCLES_PER_SECOND / 1_000_000);
        uno.run_until(cycle).expect("the firmware runs");
        uno.send(format!("{command}\n").as_bytes());
        run_for_ms(&mut uno, 100);
        ask(&mut uno, "hold");
        let row = Row::new((0..4).map(|plant| Canopy::plant(700.0 + 600.0 * f64::from(plant), 150.0)).collect());
        let motion = Motion::starting_at(0.0).change_speed(mm_s(2.0), 3000.0).roll_to(3100.0);
        let mut run = Run::set_off(uno, pass(row.expect("the plants stand apart"), motion), &[], |_, changes| changes);
        run.roll_to_the_end();
        let seen = run.events("plant").len() + run.events("unknown").len();
        assert_eq!(seen, 4, "{command}: {:#?}", run.lines());
        assert_all_kept(&run.judgement());
    }
}

#[test]
fn curves_come_twenty_times_a_second_and_nothing_else_carries_a_colon() {
    let mut uno = started();
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
    let mut uno = started();
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
