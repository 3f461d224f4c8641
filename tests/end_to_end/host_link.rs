//! The PC's link with the real firmware: its questions, settings and events.

use crate::common::{elf, number};
use control::settings::{Setting, Settings};
use field::machine::Machine;
use field::motion::Motion;
use field::row::{Canopy, Row};
use field::wiring;
use link::settings::{self, SettingsError};
use link::{EventLine, Link, LinkError, Mode, Status, Wire};
use uno::Uno;
use uno_run::UnoPort;

/// A link to a firmware that has just woken up.
fn link() -> Link {
    let uno = Uno::boot(&elf()).expect("the firmware is an image").wired(&wiring::WIRES);
    Link::over(Wire::over(UnoPort::new(uno), true)).expect("the firmware answers")
}

#[test]
fn a_link_waits_for_the_greeting_and_knows_the_version() {
    assert!(link().version().starts_with(env!("CARGO_PKG_VERSION")));
}

#[test]
fn half_a_line_typed_before_the_link_was_there_harms_nothing() {
    let mut uno = uno_run::boot(&elf(), &[]).expect("the firmware wakes up");
    uno.send(b"set whe");
    let mut link = Link::over(Wire::over(UnoPort::new(uno), false)).expect("the firmware answers");
    let status = link.ask("status").expect("the firmware knows the command").join(" ");
    assert_eq!(number(&status, "mistakes"), 0, "{status}");
}

#[test]
fn all_settings_are_read_and_are_the_table_s_defaults() {
    assert_eq!(settings::read(&mut link()).expect("the firmware tells them"), Settings::new());
}

#[test]
fn settings_are_pushed_even_if_their_ranges_block_each_other() {
    let mut link = link();
    link.ask("clear").expect("the firmware knows the command");
    // The pulses are exchanged, and only the beam's new position makes room for the margin.
    let wanted = [
        (Setting::MarginMm, 200),
        (Setting::LeadOutMs, 400),
        (Setting::BeamToToolMm, 1500),
        (Setting::ServoInUs, 2000),
        (Setting::ServoOutUs, 1500),
    ];
    let changed = settings::push(&mut link, &wanted, &[], true).expect("the firmware takes them");
    assert_eq!(changed.len(), wanted.len());
    let found = settings::read(&mut link).expect("the firmware tells them");
    assert!(wanted.iter().all(|&(setting, value)| found.get(setting) == value), "{found:?}");
    assert_eq!(settings::push(&mut link, &wanted, &[], false).expect("there is nothing to do"), [""; 0]);
}

#[test]
fn another_wheel_is_pushed_with_what_was_measured_of_it_or_with_nothing() {
    let mut link = link();
    link.ask("clear").and_then(|_| link.ask("set ticks_per_m 1950")).expect("the firmware knows the commands");
    let ticks_per_m = |link: &mut _| settings::read(link).expect("the firmware tells them").get(Setting::TicksPerM);
    let changed = settings::push(&mut link, &[(Setting::WheelMm, 410)], &[], false).expect("the firmware takes it");
    assert_eq!((changed, ticks_per_m(&mut link)), (vec!["wheel_mm".to_owned(), "ticks_per_m".to_owned()], 0));
    link.ask("set ticks_per_m 1950").expect("the firmware knows the command");
    // A pulled file in which only the wheel was edited has the calibration of the wheel before. Another file has its own.
    let with = |ticks| [(Setting::WheelMm, 400), (Setting::TicksPerM, ticks)];
    let refused = settings::push(&mut link, &with(1950), &[], true).unwrap_err().to_string();
    assert!(refused.contains("ticks_per_m 1950 was measured with the wheel before"), "{refused}");
    let changed = settings::push(&mut link, &with(1952), &[], true).expect("the firmware takes both");
    assert_eq!((changed, ticks_per_m(&mut link)), (vec!["wheel_mm".to_owned(), "ticks_per_m".to_owned()], 1952));
}

#[test]
fn settings_that_contradict_each_other_are_not_sent() {
    let mut link = link();
    let error =
        settings::push(&mut link, &[(Setting::MarginMm, 20), (Setting::BeamToToolMm, 150)], &[], false).unwrap_err();
    assert!(matches!(error, SettingsError::Contradiction(_)), "{error}");
    assert!(error.to_string().contains("need a beam_to_tool_mm of "), "{error}");
    assert_eq!(settings::read(&mut link).expect("the firmware tells them"), Settings::new());
}

#[test]
fn a_machine_at_work_is_not_given_another_geometry() {
    let mut link = link();
    link.ask("clear").and_then(|_| link.ask("start")).expect("the firmware knows the commands");
    let wanted = [(Setting::K, 5), (Setting::WheelMm, 405)];
    assert!(matches!(settings::push(&mut link, &wanted, &[], false), Err(SettingsError::AtWork)));
    assert_eq!(settings::read(&mut link).expect("the firmware tells them"), Settings::new());
    assert_eq!(settings::push(&mut link, &[(Setting::K, 5)], &[], false).expect("k may change"), ["k"]);
}

#[test]
fn every_line_of_a_row_being_weeded_is_understood() {
    let row = Row::new(vec![Canopy::plant(500.0, 150.0), Canopy::weed(850.0, 15.0), Canopy::plant(1200.0, 150.0)]);
    let row = row.expect("plants and a weed are a row");
    let machine = Machine::default();
    let motion = Motion::steady(0.0, 1000.0, 500.0, 2200.0).change_speed(0.0, 1000.0);
    let mut uno = uno_run::boot(&elf(), &machine.beams_before(&row, &motion)).expect("the firmware wakes up");
    uno.send(b"events on\nstart\n");
    uno.run_for_ms(100).expect("the firmware runs");
    uno.received();
    let changes = machine.pin_changes(&row, &motion, uno.cycle());
    uno.drive(changes);
    let mut link = Link::over(Wire::over(UnoPort::new(uno), false)).expect("the firmware answers");

    let (mut objects, mut swings) = (0, 0);
    for _ in 0..500 {
        match link.next_line().expect("the port stays").as_deref().map(EventLine::parse) {
            None => {}
            Some(Some(EventLine::Detection { .. })) => objects += 1,
            Some(Some(EventLine::Swing { .. })) => swings += 1,
            other => panic!("{other:?}"),
        }
    }
    assert_eq!(objects, 3);
    assert!(swings >= 4, "in, and out and in for each plant: {swings}");
    let status = Status::parse(&link.ask("status").expect("the firmware knows the command")[0]).expect("a status");
    assert_eq!((status.mode, status.speed_mm_s), (Mode::Work, 0));
}

#[test]
fn what_the_firmware_refuses_is_said_in_its_words() {
    let error = link().ask("set wheel_mm 7").unwrap_err();
    assert!(matches!(&error, LinkError::Refused { answer, .. } if answer.contains("200 to 800")), "{error}");
}
