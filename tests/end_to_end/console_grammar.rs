//! The console's grammar over the serial line.

use crate::common::{exchange, refusal, run_for_ms, started, status, value};
use control::say::command::Word;
use control::settings::Setting;
use field::wiring;
use uno::Uno;

/// The number of lines that end an answer.
fn ends(lines: &[String]) -> usize {
    lines.iter().filter(|line| *line == "ok" || line.starts_with("error: ")).count()
}

/// Asserts that the answer is this number of lines and `ok`, and nothing else.
#[track_caller]
fn assert_answer(uno: &mut Uno, command: &str, lines: u8) {
    let answer = exchange(uno, format!("{command}\n").as_bytes());
    assert_eq!(answer.last().map(String::as_str), Some("ok"), "{command}: {answer:#?}");
    assert_eq!((answer.len(), ends(&answer)), (usize::from(lines) + 1, 1), "{command}: {answer:#?}");
}

#[test]
fn every_command_is_answered_by_one_ok_or_error() {
    let mut uno = started();
    // That one restarts the machine (`power_and_memory_faults`).
    for command in rig::every_command().into_iter().filter(|command| command != "test watchdog") {
        // A dry run would let the next commands wait for its end.
        exchange(&mut uno, b"hold\n");
        uno.send(format!("{command}\n").as_bytes());
        let (mut answer, mut lines) = (String::new(), Vec::new());
        for _ in 0..10 {
            run_for_ms(&mut uno, 100);
            answer += &uno.received();
            lines = answer.lines().map(str::to_owned).collect();
            if ends(&lines) > 0 {
                break;
            }
        }
        assert_eq!(ends(&lines), 1, "{command}: {lines:#?}");
    }
}

#[test]
fn a_command_is_answered_by_all_its_lines_and_ok() {
    let mut uno = started();
    for (command, lines) in [
        ("help", Word::COUNT),
        ("help wheel_mm", 2),
        ("version", 1),
        ("status", 2),
        ("get", Setting::COUNT),
        ("get wheel_mm", 1),
        ("set wheel_mm 405", 0),
        ("start", 0),
        ("hold", 0),
        ("start now", 0),
        ("hold", 0),
        ("save", 0),
        ("clear", 0),
        ("events on", 0),
        ("events off", 0),
        ("  set \t wheel_mm   400  ", 0),
    ] {
        assert_answer(&mut uno, command, lines);
    }
}

#[test]
fn the_firmware_sends_its_name_and_state_at_start() {
    let mut uno = Uno::boot(&crate::common::elf()).expect("the firmware can be run").wired(&wiring::WIRES);
    run_for_ms(&mut uno, 300);
    let greeting = uno.received();
    assert!(
        greeting.starts_with("weeder ")
            && greeting.contains("power_on")
            && greeting.contains("settings_lost")
            && greeting.contains("help"),
        "{greeting:?}"
    );
    assert_eq!(greeting.lines().count(), 1, "{greeting:?}");
    let version = exchange(&mut uno, b"version\n");
    assert_eq!(version[0].split(" (").next(), Some(concat!("weeder ", env!("CARGO_PKG_VERSION"))));
}

#[test]
fn the_status_has_every_figure() {
    let mut uno = started();
    let status = &status(&mut uno);
    for (key, expected) in [
        ("state", "hold"),
        ("tool", "out"),
        ("pos", "0"),
        ("speed_mm_s", "0"),
        ("windows", "0"),
        ("lost", "0"),
        ("unseen_mm", "450"),
        ("jumps", "0"),
        ("late", "0"),
        ("missed", "0"),
        ("mistakes", "0"),
        ("reset", "power_on"),
    ] {
        assert_eq!(value(status, key), expected, "{status}");
    }
}

#[test]
fn help_names_every_command_and_explains_every_setting() {
    let mut uno = started();
    let help = exchange(&mut uno, b"help\n");
    for word in (0..).map_while(Word::from_index) {
        let name = String::from_utf8(word.text().bytes().collect()).expect("ASCII");
        assert!(help.iter().any(|line| line.split_whitespace().next() == Some(&name)), "{name}: {help:#?}");
    }
    for setting in (0..).map_while(Setting::from_index) {
        let name = String::from_utf8(setting.text().bytes().collect()).expect("ASCII");
        let answer = exchange(&mut uno, format!("help {name}\n").as_bytes());
        assert!(answer.len() == 3 && answer[0].starts_with(&name) && answer[2] == "ok", "{answer:#?}");
        assert!(answer[0].len() > name.len() + 10, "{answer:#?}");
        assert!(answer[1].starts_with(&format!("{name}=")), "{answer:#?}");
    }
}

#[test]
fn a_wrong_line_is_answered_by_one_error_with_what_would_be_right() {
    let mut uno = started();
    for (line, remedy) in [
        (&b"hepl"[..], "help"),
        (b"help me", "get"),
        (b"help me now", "help [name]"),
        (b"status please", "the command is status"),
        (b"get wheel", "get"),
        (b"get wheel_mm k", "get [name]"),
        (b"set", "set name value"),
        (b"set wheel_mm", "set name value"),
        (b"set wheel_mm 400 mm", "set name value"),
        (b"set wheel 400", "get"),
        (b"set wheel_mm 4oo", "from 200 to 800"),
        (b"start later", "start [now]"),
        (b"start now now", "start [now]"),
        (b"hold it", "the command is hold"),
        (b"clear all", "the command is clear"),
        (b"events", "events on|off"),
        (b"events maybe", "events on|off"),
        (b"version 2", "the command is version"),
        (b"hold\x1B[A", "letters, digits and blanks"),
        (b"h\xC3\xB6ld", "letters, digits and blanks"),
        (b"hold\0", "letters, digits and blanks"),
    ] {
        let answer = exchange(&mut uno, &[line, b"\n"].concat());
        assert_eq!((answer.len(), ends(&answer)), (1, 1), "{}: {answer:#?}", line.escape_ascii());
        assert!(answer[0].starts_with("error: ") && answer[0].contains(remedy), "{}: {answer:?}", line.escape_ascii());
    }
}

#[test]
fn an_empty_line_is_not_answered() {
    let mut uno = started();
    assert_eq!(exchange(&mut uno, b"\n\r\n\r \t \n"), [""; 0]);
}

#[test]
fn eighty_characters_are_a_line_and_eighty_one_are_too_long() {
    let mut uno = started();
    let line = format!("{:80}\n", "hold");
    assert_eq!(exchange(&mut uno, line.as_bytes()), ["ok"]);
    let line = format!("{:81}\n", "hold");
    let answer = exchange(&mut uno, line.as_bytes());
    assert_eq!(answer.len(), 1, "{answer:#?}");
    assert!(answer[0].starts_with("error: ") && answer[0].contains("80"), "{answer:#?}");
    assert_eq!(exchange(&mut uno, b"hold\n"), ["ok"], "the next line is read");
}

#[test]
fn a_line_may_take_its_time() {
    let mut uno = started();
    assert_eq!(exchange(&mut uno, b"ho"), [""; 0]);
    run_for_ms(&mut uno, 2000);
    assert_eq!(exchange(&mut uno, b"ld\n"), ["ok"]);
}

#[test]
fn commands_that_come_while_one_is_being_answered_wait_for_their_turn() {
    let mut uno = started();
    let answer = exchange(&mut uno, b"help\nversion\nhepl\nhold\n");
    assert_eq!(answer.len(), usize::from(Word::COUNT) + 5, "{answer:#?}");
    let end: Vec<&str> = answer[usize::from(Word::COUNT)..].iter().map(|line| &line[..2]).collect();
    assert_eq!(end, ["ok", "we", "ok", "er", "ok"]);
}

#[test]
fn every_line_ends_with_carriage_return_and_line_feed_and_is_plain_text() {
    let mut uno = started();
    uno.send(b"help\nget\nstatus\nhepl\n");
    run_for_ms(&mut uno, 400);
    let text = uno.received();
    let lines: Vec<&str> = text.split_terminator("\r\n").collect();
    assert_eq!(lines.len(), usize::from(Word::COUNT + Setting::COUNT) + 6);
    for line in lines {
        assert!(!line.is_empty() && line.bytes().all(|byte| matches!(byte, b' '..=b'~')), "{line:?}");
    }
}

#[test]
fn start_is_refused_by_nothing_but_an_alarm() {
    let mut uno = started();
    assert_eq!(exchange(&mut uno, b"start\nstart\nstart now\nhold\nhold\nclear\n"), ["ok"; 6]);
    assert!(refusal(&mut uno, "begin").contains("help"));
}
