//! Faults in the wires and in the weeder: the check finds each, and names it.

use crate::common::{boards, boards_with};
use check_board::alarms::SCENES;
use check_board::pair::Wiring;
use check_board::rates::Turning;
use check_board::resets::{Kept, ResetBy};
use check_board::{row, servo};
use control::alarm::Alarm;
use field::wiring as pins;
use object::{File, Object, ObjectSection};
use std::cell::{Cell, RefCell};
use std::fs;
use std::io::Write;
use std::path::Path;
use std::rc::Rc;
use tempfile::NamedTempFile;
use tester_core::pins::Line;
use uno::{Pin, PinChange};
use uno_run::firmware;

/// Leads two lines to each other's pins.
fn swap(wires: &mut Wiring, one: Pin, other: Pin) {
    for (_, pin, _) in &mut wires.inputs {
        *pin = match *pin {
            pin if pin == one => other,
            pin if pin == other => one,
            pin => pin,
        };
    }
}

fn open(wires: &mut Wiring, pin: Pin) {
    wires.inputs.retain(|wire| wire.1 != pin);
    wires.outputs.retain(|output| *output != pin);
}

/// A fault, and the words of one sentence about it: none if the wires are right.
type Fault = (fn(&mut Wiring), &'static [&'static str]);

#[test]
fn a_wrong_wire_is_named_and_right_wires_are_not() {
    let faults: [Fault; 11] = [
        (|wires| swap(wires, pins::ENCODER_A, pins::ENCODER_B), &["encoder", "swapped"]),
        (|wires| open(wires, pins::ENCODER_B), &["encoder B", "D3"]),
        // A floating channel follows the other one.
        (
            |wires| {
                open(wires, pins::ENCODER_B);
                wires.inputs.push((Line::EncoderA, pins::ENCODER_B, false));
            },
            &["encoder", "D3"],
        ),
        (
            |wires| wires.inputs.iter_mut().filter(|wire| wire.1 == pins::BEAM).for_each(|wire| wire.2 = true),
            &["beam", "at rest", "inverted"],
        ),
        (|wires| swap(wires, pins::BEAM, pins::SECOND_BEAM), &["second beam", "the beam (D8)", "swapped"]),
        (|wires| swap(wires, pins::WORK_SWITCH, pins::END_SWITCH), &["work switch", "end switch (D5)", "swapped"]),
        (|wires| open(wires, pins::SECOND_BEAM), &["second beam", "D10"]),
        (|wires| wires.has_reset = false, &["reset", "D7"]),
        (|wires| open(wires, pins::SERVO), &["servo", "D9"]),
        (|wires| open(wires, pins::LED), &["LED", "D13"]),
        (|_| (), &[]),
    ];
    for (change, words) in faults {
        let mut wires = Wiring::right();
        change(&mut wires);
        let said = boards(wires).wire_errors().expect("both boards answer");
        assert_eq!(said.is_empty(), words.is_empty(), "{said:?}");
        let is_named = said.iter().any(|sentence| words.iter().all(|word| sentence.contains(word)));
        assert!(is_named || words.is_empty(), "{words:?} are not in {said:?}");
    }
}

/// The pulses in hold. `change` changes the edges from the boards.weeder.
fn steady(change: impl FnMut(PinChange) -> Option<PinChange> + 'static, clock_ppm: i64) -> servo::Steady {
    let wires = Wiring { from_weeder: Box::new(change), clock_ppm, ..Wiring::right() };
    let mut boards = boards(wires);
    boards.weeder.to_hold().expect("it holds");
    // The first pulses are from before the weeder's reset.
    boards.tester.record_for_ms(100).expect("it records");
    let records = boards.tester.record_for_ms(400).expect("it records");
    servo::steady(&servo::pulses(&records, 0)).expect("there are pulses")
}

/// A line's edge on the tester's side of the servo's wire.
fn is_servo(change: &PinChange) -> bool {
    change.pin == Pin::D8
}

#[test]
fn a_clock_that_is_slow_by_two_percent_is_measured() {
    let ratio = steady(Some, -20_000).clock_ratio;
    assert!((ratio - 0.98).abs() < 1e-4, "{ratio}");
}

#[test]
fn a_pulse_that_is_too_long_by_40_us_is_measured() {
    let longer = |change: PinChange| {
        let late = if is_servo(&change) && !change.high { 640 } else { 0 };
        Some(PinChange { cycle: change.cycle + late, ..change })
    };
    let width_us = steady(longer, 3000).width_us;
    assert!((width_us - 2040.0).abs() < 1.0, "{width_us}");
}

#[test]
fn a_pulse_that_trembles_by_10_us_is_measured() {
    let mut number = 0;
    let tremble = move |change: PinChange| {
        number += 1;
        let late = if is_servo(&change) && !change.high && number % 4 == 0 { 160 } else { 0 };
        Some(PinChange { cycle: change.cycle + late, ..change })
    };
    let spread_us = steady(tremble, 3000).width_spread_us;
    assert!((spread_us - 10.0).abs() < 1.0, "{spread_us}");
}

#[test]
fn counts_that_are_lost_above_150_000_a_second_are_counted() {
    let mut last = 0;
    let slow = move |change: PinChange| {
        let is_encoder = change.pin == Pin::A0 || change.pin == Pin::A1;
        let is_too_fast = is_encoder && change.cycle - last < 16_000_000 / 150_000 - 6;
        last = if is_encoder { change.cycle } else { last };
        (!is_too_fast).then_some(change)
    };
    let wires = Wiring { to_weeder: Box::new(slow), ..Wiring::right() };
    let mut boards = boards(wires);
    let mut lost = |cycles| {
        let turning = Turning { cycles, forward: true, jittered: false, busy: true };
        boards.lost_counts(turning).expect("both answer").expect("it does not start afresh")
    };
    assert_eq!(lost(106), 0);
    assert!(lost(55) > 10_000);
    assert_eq!(boards.highest_rate(true, true).expect("both answer"), None);
}

#[test]
fn a_channel_that_hides_the_end_of_a_glitch_is_counted() {
    // Edges within 5 us of another are lost, as behind a filter of 1 k and 4.7 nF on one channel only.
    let mut last = 0;
    let filter = move |change: PinChange| {
        let is_short = change.pin == Pin::A0 && change.cycle - last < 80;
        last = change.cycle;
        (!is_short).then_some(change)
    };
    let wires = Wiring { to_weeder: Box::new(filter), ..Wiring::right() };
    let mut boards = boards(wires);
    let mut left = |channel| boards.left_by_glitches(channel).expect("both answer");
    assert!(left(Line::EncoderA) > 0.0);
    assert!(left(Line::EncoderB) < 0.5);
}

#[test]
fn a_code_of_the_led_that_is_off_by_one_is_read_as_it_is_flashed() {
    // The first flash after each pause is lost.
    let (mut fell, mut hides) = (0, false);
    let swallow = move |change: PinChange| {
        if is_servo(&change) {
            return Some(change);
        }
        if change.high {
            hides = change.cycle - fell > 16_000_000;
        } else {
            fell = change.cycle;
        }
        (!hides).then_some(change)
    };
    let wires = Wiring { from_weeder: Box::new(swallow), ..Wiring::right() };
    let mut boards = boards(wires);
    let dead_channel = SCENES.iter().find(|scene| scene.alarm == Alarm::EncoderChannelDead).expect("it is a scene");
    let raised = boards.play_scene(dead_channel).expect("both answer");
    assert!(raised.is_expected && raised.code != 22.0, "{raised:?}");
}

#[test]
fn a_swing_that_is_late_by_10_ms_is_measured() {
    let swings = |late_cycles: u64| {
        let late = move |change: PinChange| {
            let late = if is_servo(&change) { late_cycles } else { 0 };
            Some(PinChange { cycle: change.cycle + late, ..change })
        };
        let wires = Wiring { from_weeder: Box::new(late), ..Wiring::right() };
        let mut boards = boards(wires);
        let pass = row::pass(3, 1, 2.5).expect("it grows");
        let outcome = boards.weed(&pass).expect("both answer");
        outcome.judgement.swing_errors_ticks()
    };
    let (right, wrong) = (swings(0), swings(160_000));
    // 10 ms at 2.5 km/h are 13.3 counts. One swing may come a servo's frame earlier or later from run to run, by 26
    // counts.
    let later = right.iter().zip(&wrong).map(|(right, wrong)| wrong - right).sum::<f64>() / right.len() as f64;
    assert!(right.len() == wrong.len() && (later - 13.3).abs() < 8.0, "{right:?} {wrong:?}");
}

#[test]
fn a_channel_that_fails_in_a_row_loses_counts() {
    let position = Rc::new(RefCell::new(0_u32));
    let seen = Rc::clone(&position);
    let drops = move |change: PinChange| {
        let is_a = change.pin == Pin::A0;
        *seen.borrow_mut() += u32::from(is_a);
        // One edge of a thousand, and the next one: two steps in all.
        (!is_a || *seen.borrow() % 1000 > 1).then_some(change)
    };
    let wires = Wiring { to_weeder: Box::new(drops), ..Wiring::right() };
    let mut boards = boards(wires);
    let pass = row::pass(3, 1, 2.5).expect("it grows");
    let outcome = boards.weed(&pass).expect("both answer");
    assert!(outcome.lost_counts > 0, "{}", outcome.lost_counts);
}

/// The firmware without the writes of WDTCSR, so that the watchdog is never on.
fn without_watchdog() -> NamedTempFile {
    /// `sts 0x60, r0`; the register is in the bits that are masked out.
    const STS: (u16, u16) = (0x9200, 0xFE0F);
    let mut bytes = fs::read(firmware::build().expect("the weeder's firmware is built")).expect("it is there");
    let code = {
        let elf = File::parse(&*bytes).expect("it is an ELF");
        let (start, length) = elf.section_by_name(".text").and_then(|text| text.file_range()).expect("it has code");
        start as usize..(start + length) as usize
    };
    let mut words = bytes[code].as_chunks_mut::<2>().0.iter_mut().peekable();
    let mut writes = 0;
    while let Some(word) = words.next() {
        if u16::from_le_bytes(*word) & STS.1 == STS.0
            && let Some(address) = words.next_if(|address| **address == [0x60, 0])
        {
            (*word, *address) = ([0; 2], [0; 2]);
            writes += 1;
        }
    }
    assert!(writes >= 4, "{writes}");
    let mut file = NamedTempFile::new().expect("there is room for a file");
    file.write_all(&bytes).expect("there is room for a file");
    file
}

#[test]
fn a_weeder_without_a_watchdog_is_named() {
    let restart = |elf: &Path| {
        let (_, mut boards) = boards_with(elf, Wiring::right());
        let restart = boards.restart(ResetBy::Watchdog, true).expect("both answer");
        // The check goes on.
        boards.weeder.ask("get").expect("it is reset by its pin, and answers");
        restart
    };
    let right = restart(&firmware::build().expect("the weeder's firmware is built"));
    assert!(right.is_out && right.without_pulse_ms < 100.0, "{right:?}");
    let dead = restart(without_watchdog().path());
    assert!(!dead.is_out && dead.without_pulse_ms.is_infinite(), "{dead:?}");
}

#[test]
fn a_save_that_tears_is_counted() {
    // Each reset corrupts the half of the EEPROM that has the settings.
    let tear = |eeprom: &mut [u8]| eeprom[..512].iter_mut().for_each(|byte| *byte &= 0xF0);
    let wires = Wiring { eeprom_at_reset: Some(Box::new(tear)), ..Wiring::right() };
    let mut boards = boards(wires);
    boards.weeder.to_hold().expect("it holds");
    let saves = boards.reset_while_saving(3).expect("both answer");
    assert_eq!(saves.torn, 3);
}

#[test]
fn settings_that_a_reset_loses_are_counted() {
    let corrupts = Rc::new(Cell::new(false));
    let is_to_corrupt = Rc::clone(&corrupts);
    let lose = move |eeprom: &mut [u8]| {
        if is_to_corrupt.get() {
            eeprom.fill(0xFF);
        }
    };
    let wires = Wiring { eeprom_at_reset: Some(Box::new(lose)), ..Wiring::right() };
    let mut boards = boards(wires);
    boards.weeder.to_hold().expect("it holds");
    boards.weeder.ask("set margin_mm 60").expect("it obeys");
    boards.weeder.ask("save").expect("it saves");
    boards.tester.record_for_ms(1000).expect("the tester answers");
    let saved = Kept::read(&mut boards).expect("both answer");
    corrupts.set(true);
    let after = Kept::read(&mut boards).expect("both answer");
    assert_eq!((saved.lost(&saved), saved.lost(&after)), (0, 1));
}
