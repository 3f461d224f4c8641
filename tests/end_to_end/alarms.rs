//! Alarms: a fault puts the tool out. The firmware names it, blinks its code, and latches it until it is cleared.

use crate::common::{
    Run, ask, bare_ground, is_out_at_the_pin, named, number, pass, refusal, run_for_ms, status, steady, throw_switch,
    value,
};
use control::alarm::Alarm;
use field::machine::Machine;
use field::motion::mm_s;
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::wiring;
use std::fs;
use uno::Uno;
use uno::{CYCLES_PER_SECOND, PinChange};

/// A flash and the dark time after it, within a digit.
const FLASH_CYCLES: u64 = CYCLES_PER_SECOND * 524 / 1000;

/// From a digit's last flash to the next digit's first, and to the next code's.
const GAP_CYCLES: u64 = 2 * FLASH_CYCLES;
const PAUSE_CYCLES: u64 = 4 * FLASH_CYCLES;

/// A run in which the beam is broken for 600 mm, more than any plant covers, while the tool is far behind in the row.
fn with_a_blocked_beam(start: Start) -> Run {
    let row = Row::new(vec![Canopy::plant(1300.0, 600.0)]).expect("a plant is a row");
    let machine = Machine { beam_to_tool_mm: 900.0, ..Machine::default() };
    let motion = steady(mm_s(2.0), 1800.0);
    let mut run = Run::begin(Pass { machine, start, ..pass(row, motion) }, &[]);
    // 400 mm after the beginning of the blocked stretch.
    run.roll_to(1390.0);
    assert!(!is_out_at_the_pin(&run.uno));
    run.roll_to(1450.0);
    run
}

/// The alarm is named in event and status, and the tool is out.
#[track_caller]
fn assert_alarm(run: &mut Run, alarm: &str) {
    let events = run.events("alarm");
    assert_eq!(events.len(), 1, "{:#?}", run.lines());
    assert_eq!(named(&events[0]), alarm);
    assert!(is_out_at_the_pin(&run.uno));
    let status = status(&mut run.uno);
    let said = (value(&status, "state"), &*named(&status), value(&status, "tool"));
    assert_eq!(said, ("alarm", alarm, "out"), "{status}");
}

/// The codes that the LED blinks during some seconds, as digits. The first and the last code may be cut, so they are
/// left out.
fn blinked_codes(uno: &mut Uno) -> Vec<Vec<usize>> {
    let begin = uno.cycle();
    run_for_ms(uno, 16_000);
    let flashes: Vec<u64> = uno
        .changes()
        .iter()
        .filter(|change| change.pin == wiring::LED && change.high && change.cycle > begin)
        .map(|change| change.cycle)
        .collect();
    let parted_by = |cycles: u64| move |one: &u64, next: &u64| next - one < cycles - FLASH_CYCLES / 4;
    let codes = flashes.chunk_by(parted_by(PAUSE_CYCLES));
    let mut codes: Vec<Vec<usize>> =
        codes.map(|code| code.chunk_by(parted_by(GAP_CYCLES)).map(<[u64]>::len).collect()).collect();
    codes.pop();
    codes.drain(..1);
    codes
}

#[track_caller]
fn assert_blinks(uno: &mut Uno, code: [usize; 2]) {
    let codes = blinked_codes(uno);
    assert!(!codes.is_empty() && codes.iter().all(|blinked| *blinked == code), "{codes:?}");
}

#[test]
fn a_beam_that_stays_broken_is_an_alarm_that_puts_the_tool_out() {
    let mut run = with_a_blocked_beam(Start::Now);
    assert_alarm(&mut run, "1-1 beam_blocked");
    let command = run.commands().pop().expect("a command");
    let place_mm = run.place_mm(command.rise_cycle);
    assert!(command.is_out && (1395.0..1410.0).contains(&place_mm), "{place_mm} mm");
}

#[test]
fn a_beam_that_stays_broken_at_standstill_is_no_alarm() {
    let row = Row::new(vec![Canopy::plant(300.0, 150.0)]).expect("a plant is a row");
    let mut run = Run::begin(pass(row, steady(mm_s(1.0), 300.0).go_on_for(4.0)), &[]);
    run.roll_to_the_end();
    assert_eq!(run.events("alarm"), [""; 0]);
    assert_eq!(value(&status(&mut run.uno), "state"), "work");
}

#[test]
fn more_plants_than_the_schedule_holds_are_an_alarm() {
    let plants = (0..20).map(|number| Canopy::plant(300.0 + 110.0 * f64::from(number), 90.0));
    let row = Row::new(plants.collect()).expect("the plants stand apart");
    let machine = Machine { beam_to_tool_mm: 2000.0, ..Machine::default() };
    let mut run = Run::begin(Pass { machine, ..pass(row, steady(mm_s(2.5), 2300.0)) }, &["set merge_gap_mm 3"]);
    run.roll_to_the_end();
    assert_alarm(&mut run, "3-3 schedule_full");
    assert_blinks(&mut run.uno, [3, 3]);
}

#[test]
fn a_crop_of_unknown_stalks_is_an_alarm_before_the_sixth() {
    let widths_mm = [20.0, 15.0, 25.0, 18.0, 22.0, 16.0, 24.0];
    for (spacing_mm, before_mm, speed_km_h) in
        [(500.0, 300.0, 1.0), (600.0, 900.0, 2.0), (250.0, 500.0, 2.5), (550.0, 1400.0, 1.5)]
    {
        let stalk = |(width_mm, number)| Canopy::plant(before_mm + spacing_mm * f64::from(number), width_mm);
        let row = Row::new(widths_mm.into_iter().zip(0..).map(stalk).collect()).expect("the stalks stand apart");
        let mut run = Run::begin(pass(row, steady(mm_s(speed_km_h), before_mm + 5.5 * spacing_mm)), &[]);
        run.roll_to_the_end();
        assert_alarm(&mut run, "3-4 crop_unknown");
    }
}

#[test]
fn stalks_are_no_alarm_where_it_is_off() {
    let stalks = (0..9).map(|number| Canopy::plant(300.0 + 250.0 * f64::from(number), 20.0));
    let row = Row::new(stalks.collect()).expect("the stalks stand apart");
    let mut run = Run::begin(pass(row, steady(mm_s(2.0), 2700.0)), &["set misfit_after 0"]);
    run.roll_to_the_end();
    assert_eq!(run.events("alarm"), [""; 0]);
    assert_eq!(run.events("weed").len() + run.events("unknown").len(), 9, "{:#?}", run.lines());
}

#[test]
fn a_beam_that_flickers_faster_than_it_can_be_followed_is_an_alarm() {
    let mut run = Run::begin(pass(bare_ground(), steady(mm_s(2.0), 900.0)), &[]);
    run.roll_to(600.0);
    assert!(!is_out_at_the_pin(&run.uno));
    let begin = run.uno.cycle();
    run.uno.drive((0..400).map(|edge| PinChange { cycle: begin + edge * 160, pin: wiring::BEAM, high: edge % 2 == 1 }));
    run.roll_to_the_end();
    assert_alarm(&mut run, "1-3 beam_edges_lost");
    assert_blinks(&mut run.uno, [1, 3]);
}

#[test]
fn an_alarm_refuses_to_start_and_blinks_its_code_until_it_is_cleared() {
    let mut run = with_a_blocked_beam(Start::Now);
    run.roll_to_the_end();
    for command in ["start", "start now"] {
        let answer = refusal(&mut run.uno, command);
        assert!(answer.contains("alarm") && answer.contains("clear"), "{answer}");
    }
    ask(&mut run.uno, "hold");
    assert_eq!(value(&status(&mut run.uno), "state"), "alarm");
    assert_blinks(&mut run.uno, [1, 1]);
    assert!(is_out_at_the_pin(&run.uno));

    ask(&mut run.uno, "clear");
    let cleared = status(&mut run.uno);
    assert_eq!((value(&cleared, "state"), value(&cleared, "tool")), ("hold", "out"), "{cleared}");
    ask(&mut run.uno, "start now");
    run_for_ms(&mut run.uno, 30);
    assert_eq!(value(&status(&mut run.uno), "state"), "work");
    assert!(!is_out_at_the_pin(&run.uno));
}

#[test]
fn the_switch_clears_an_alarm_by_going_off_and_on() {
    let mut run = with_a_blocked_beam(Start::Switch);
    run.roll_to_the_end();
    throw_switch(&mut run.uno, false);
    assert_eq!(value(&status(&mut run.uno), "state"), "hold");
    throw_switch(&mut run.uno, true);
    let after = status(&mut run.uno);
    assert_eq!(value(&after, "state"), "work");
    // The ground behind the beam is unknown after a fault: the tool waits for ground that the beam sees from there on.
    assert!(number(&after, "unseen_mm") > 400, "{after}");
    assert!(is_out_at_the_pin(&run.uno));
}

/// By its code and name, as tests expect it of the console.
#[test]
fn every_alarm_is_named_in_a_test_of_the_elf() {
    let tests = fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/end_to_end")).expect("the tests are there");
    let tests: String = tests.filter_map(|test| fs::read_to_string(test.expect("a file").path()).ok()).collect();
    let names = (0..).map_while(Alarm::from_index).map(|alarm| {
        let (first, second) = alarm.code();
        let (code, name) = (format!("{first}-{second}"), alarm.text());
        [format!("{code} {name}"), format!("\"{code}\", \"{name}\"")]
    });
    let untested: Vec<_> = names.filter(|forms| !forms.iter().any(|form| tests.contains(form))).collect();
    assert!(untested.is_empty(), "{untested:?}");
}
