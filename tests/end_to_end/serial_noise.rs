//! Noise on the serial line while the machine weeds: the swings are those of a run without noise, and each bad line
//! gets an error.

use crate::common::{Run, ask, assert_all_kept, exchange, number, run_for_ms, started, status};
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::Pass;
use field::planting::Planting;
use field::verdict::ZoneSettings;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

const SPEED_KM_H: f64 = 2.5;

/// A command waits for a running pulse of 2 ms and a gap of 3 ms at most. The loop's turns take the rest.
const GRAIN_MM: f64 = SPEED_KM_H / 3.6 * 6.0;

fn set_out() -> Run {
    let row = Planting { plants: 4, ..Planting::default() }.grow(1).expect("the plants have room");
    Run::begin(Pass::at_speed(row, Machine::default(), ZoneSettings::default(), mm_s(SPEED_KM_H)), &["events off"])
}

/// The commands at the pin: out or in, and the position.
fn swings(run: &Run) -> Vec<(bool, f64)> {
    run.commands().iter().map(|command| (command.is_out, run.place_mm(command.rise_cycle))).collect()
}

/// A start bit, eight bits and a stop bit at 115200 baud. Every Uno is 2.1 % off, and a receiver takes 4 %.
#[test]
fn the_firmware_sends_at_115200_baud() {
    let mut uno = started();
    uno.received_bytes();
    uno.send(b"help\n");
    run_for_ms(&mut uno, 50);
    let cycles: Vec<u64> = uno.received_bytes().iter().map(|received| received.cycle).collect();
    let mut apart: Vec<u64> = cycles.windows(2).map(|bytes| bytes[1] - bytes[0]).collect();
    apart.sort_unstable();
    // Most bytes follow the one before at once.
    let (usual, nominal) = (apart[apart.len() / 2] as f64, 10.0 * 16e6 / 115_200.0);
    assert!((usual / nominal - 1.0).abs() < 0.025, "{usual} cycles instead of {nominal:.0}");
}

/// Weeds with `noise` on the line every 50 ms and returns the lines that the firmware sent.
#[track_caller]
fn answers_to(mut noise: impl FnMut() -> Vec<u8>) -> Vec<String> {
    let mut quiet = set_out();
    quiet.roll_to_the_end();
    let mut noisy = set_out();
    let end = noisy.cycles().end;
    while noisy.uno.cycle() < end {
        noisy.uno.send(&noise());
        run_for_ms(&mut noisy.uno, 50);
    }
    // Lets the firmware answer its queue: 64 bytes are four times `help` and `get`, 0.9 s of the line.
    run_for_ms(&mut noisy.uno, 1000);
    let lines = noisy.lines();

    assert_all_kept(&noisy.judgement());
    let (swings, expected) = (swings(&noisy), swings(&quiet));
    assert_eq!(swings.len(), expected.len());
    for ((out, place_mm), (expected_out, expected_mm)) in swings.iter().zip(&expected) {
        assert_eq!(out, expected_out);
        assert!((place_mm - expected_mm).abs() <= GRAIN_MM, "{place_mm} mm instead of {expected_mm} mm");
    }
    // First ends a line that the noise may have begun.
    noisy.uno.send(b"\n");
    run_for_ms(&mut noisy.uno, 50);
    let (noisy, quiet) = (status(&mut noisy.uno), status(&mut quiet.uno));
    assert_eq!((number(&noisy, "pos"), number(&noisy, "lost")), (number(&quiet, "pos"), 0));
    lines
}

/// Asserts that each bad line got one error, and that there was no other output.
#[track_caller]
fn assert_an_error_each(lines: &[String], bad_lines: usize) {
    assert!(lines.iter().all(|line| line.starts_with("error: ")), "{lines:#?}");
    assert_eq!(lines.len(), bad_lines);
}

#[test]
fn binary_garbage_changes_no_swing() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut sent = 0;
    let lines = answers_to(|| {
        sent += 1;
        let mut line: Vec<u8> = (0..200).map(|_| rng.random()).filter(|byte| !b"\r\n".contains(byte)).collect();
        line.push(b'\n');
        line
    });
    assert_an_error_each(&lines, sent);
}

#[test]
fn lines_of_300_characters_change_no_swing() {
    let mut sent = 0;
    let lines = answers_to(|| {
        sent += 1;
        let mut line = vec![b'x'; 300];
        line.push(b'\n');
        line
    });
    assert_an_error_each(&lines, sent);
    assert!(lines.iter().all(|line| line.contains("80")), "{lines:#?}");
}

#[test]
fn half_lines_change_no_swing() {
    let mut sent = 0;
    let lines = answers_to(|| {
        sent += 1;
        // A line in two halves, 50 ms apart.
        if sent % 2 == 1 { b"set wheel_mm 4".to_vec() } else { b"oo\r\n".to_vec() }
    });
    assert_an_error_each(&lines, sent / 2);
    assert!(lines.iter().all(|line| line.contains("wheel_mm takes a whole number from 200 to 800")), "{lines:#?}");
}

#[test]
fn a_flood_at_full_line_rate_changes_no_swing() {
    // 50 ms of the line hold 576 bytes. There are more bad lines than answers, and none of them has an effect.
    let lines = answers_to(|| b"hodl\n".repeat(576 / 5));
    assert!(lines.len() > 20, "{lines:#?}");
    assert!(lines.iter().all(|line| line.starts_with("error: ")), "{lines:#?}");
}

#[test]
fn a_flood_of_questions_at_full_line_rate_changes_no_swing() {
    let lines = answers_to(|| b"status\nhelp\nget\n".repeat(576 / 16));
    assert!(lines.iter().filter(|line| *line == "ok").count() > 20, "{lines:#?}");
}

#[test]
fn a_flood_without_a_line_end_changes_no_swing_and_is_one_bad_line() {
    let lines = answers_to(|| vec![b'x'; 576]);
    assert_eq!(lines, [""; 0]);
}

#[test]
fn a_command_after_a_flood_is_carried_out() {
    let mut uno = started();
    uno.send(&b"hodl\n".repeat(1000));
    run_for_ms(&mut uno, 1000);
    // Ends the line that the flood may have left incomplete.
    exchange(&mut uno, b"\n");
    ask(&mut uno, "set margin_mm 60");
    assert!(ask(&mut uno, "get margin_mm")[0].starts_with("margin_mm=60 "));
}
