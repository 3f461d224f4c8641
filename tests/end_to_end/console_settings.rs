//! Every setting over the console: its range, values out of range, and changes while the machine works.

use crate::common::{ask, refusal, run_for_ms, started};
use control::settings::Setting;
use uno::Uno;

/// Every setting with its name.
fn settings() -> impl Iterator<Item = (Setting, String)> {
    Setting::all().map(|setting| {
        let name = setting.text().bytes().map(char::from).collect();
        (setting, name)
    })
}

/// A value as the console writes it.
fn written(setting: Setting, value: u16) -> String {
    match (setting.is_switched(), value) {
        (true, 0) => "off".to_owned(),
        (true, 1) => "on".to_owned(),
        _ => value.to_string(),
    }
}

/// The firmware's value.
#[track_caller]
fn get(uno: &mut Uno, name: &str) -> String {
    let lines = ask(uno, &format!("get {name}"));
    assert_eq!(lines.len(), 1, "{lines:?}");
    let (said, rest) = lines[0].split_once('=').expect("name=value");
    assert_eq!(said, name);
    rest.split_whitespace().next().expect("a value").to_owned()
}

/// An Uno with settings that no value of another setting contradicts.
fn easily_set() -> Uno {
    let mut uno = started();
    for line in ["set lead_out_ms 0", "set margin_mm 0", "set beam_to_tool_mm 1000", "set wheel_mm 200"] {
        ask(&mut uno, line);
    }
    uno
}

#[test]
fn get_lists_every_setting_with_value_unit_range_and_default() {
    let listed = ask(&mut started(), "get");
    let expected: Vec<String> = settings()
        .map(|(setting, name)| {
            let (least, greatest, default) = (setting.least(), setting.greatest(), setting.default());
            let default = written(setting, default);
            let range =
                if setting.is_switched() { "on or off".to_owned() } else { format!("from {least} to {greatest}") };
            let unit = String::from_utf8(setting.unit().bytes().collect()).expect("ASCII");
            format!("{name}={default}{unit} {range}, default {default}, not saved")
        })
        .collect();
    assert_eq!(listed, expected);
}

#[test]
fn every_setting_takes_the_ends_of_its_range() {
    let mut uno = easily_set();
    for (setting, name) in settings() {
        let (least, greatest) = (setting.least(), setting.greatest());
        let before = get(&mut uno, &name);
        for value in [written(setting, least), written(setting, greatest), before] {
            assert_eq!(ask(&mut uno, &format!("set {name} {value}")), [""; 0]);
            assert_eq!(get(&mut uno, &name), value);
        }
    }
}

#[test]
fn every_setting_refuses_values_beyond_its_range_and_keeps_its_value() {
    let mut uno = started();
    for (setting, name) in settings() {
        let (least, greatest, default) = (setting.least(), setting.greatest(), setting.default());
        let below = i32::from(least) - 1;
        let above = i32::from(greatest) + 1;
        let right = match setting.is_switched() {
            true => format!("error: {name} takes on or off"),
            false => format!("error: {name} takes a whole number from {least} to {greatest}"),
        };
        for value in
            [below.to_string(), above.to_string(), "65536".into(), "4294967296".into(), "1.5".into(), "much".into()]
        {
            let answer = refusal(&mut uno, &format!("set {name} {value}"));
            assert_eq!(answer, right, "set {name} {value}");
        }
        assert_eq!(get(&mut uno, &name), written(setting, default));
    }
}

#[test]
fn settings_that_contradict_each_other_are_refused() {
    let mut uno = started();
    let answer = refusal(&mut uno, "set beam_to_tool_mm 300");
    assert!(answer.contains("beam_to_tool_mm 389 or more"), "{answer}");
    let answer = refusal(&mut uno, "set servo_out_us 1500");
    assert!(answer.contains("equal"), "{answer}");
    assert_eq!((get(&mut uno, "beam_to_tool_mm"), get(&mut uno, "servo_out_us")), ("400".into(), "2000".into()));
}

#[test]
fn settings_that_move_the_tool_are_refused_at_work() {
    let mut uno = easily_set();
    ask(&mut uno, "start");
    let mut refused = Vec::new();
    for (setting, name) in settings() {
        let least = written(setting, setting.least());
        if setting.is_hold_only() {
            let before = get(&mut uno, &name);
            let answer = refusal(&mut uno, &format!("set {name} {least}"));
            assert!(answer.contains(&name) && answer.contains("hold first"), "{answer}");
            assert_eq!(get(&mut uno, &name), before);
            refused.push(name);
        } else {
            ask(&mut uno, &format!("set {name} {least}"));
            assert_eq!(get(&mut uno, &name), least);
        }
    }
    let names = [
        "ticks_per_rev",
        "wheel_mm",
        "ticks_per_m",
        "beam_to_tool_mm",
        "second_beam_mm",
        "margin_mm",
        "stem_zone_mm",
        "servo_in_us",
        "servo_out_us",
        "beam_response_ms",
    ];
    assert_eq!(refused, names);

    ask(&mut uno, "hold");
    for name in refused {
        let (setting, _) = settings().find(|(_, other)| *other == name).expect("a setting");
        // One above the least: the two servo pulses must differ.
        let value = setting.least() + u16::from(name == "servo_out_us");
        ask(&mut uno, &format!("set {name} {value}"));
    }
}

#[test]
fn the_distance_from_beam_to_tool_shows_in_the_status_at_once() {
    let mut uno = easily_set();
    for beam_to_tool_mm in [100, 750, 2000] {
        ask(&mut uno, &format!("set beam_to_tool_mm {beam_to_tool_mm}"));
        run_for_ms(&mut uno, 5);
        let status = crate::common::status(&mut uno);
        let unseen_mm = crate::common::number(&status, "unseen_mm");
        assert!((beam_to_tool_mm..=beam_to_tool_mm + 1).contains(&unseen_mm), "{status}");
    }
}
