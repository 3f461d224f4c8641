//! The longest turn of the main loop, for all commands and all output.
//!
//! The loop reads the ground once a turn, so its decisions are late by up to a turn. A turn may therefore take a
//! millisecond. In that time a machine at 5 km/h rolls 1.4 mm. Longer work is divided over several turns. The time is
//! counted in cycles from one reset of the watchdog to the next, interrupts included. Sleep is not counted: an interrupt ends it.

use crate::common::{Run, encoder_steps, pass, run_for_ms, started, steady};
use control::ground::field_examples;
use control::say::command::{LINE_LENGTH, Word};
use control::settings::Setting;
use field::planting::Planting;
use link::settings::name;
use uno::CYCLES_PER_SECOND;
use uno::Uno;

/// A turn's cycles at most: 1 ms.
const TURN: u64 = CYCLES_PER_SECOND / 1000;

/// Every valid line of the grammar, and some lines for each kind of error.
fn lines() -> Vec<String> {
    let mut lines: Vec<String> = [
        "help",
        "status",
        "get",
        "save",
        "revert",
        "defaults",
        "calibrate start",
        "calibrate 999",
        "calibrate 1000",
        "calibrate 60000",
        "calibrate 10000 force",
        "calibrate servo",
        "servo in",
        "servo out",
        "servo 1750",
        "servo 499",
        "servo 9999",
        "test row",
        "test row 99",
        "test row 700",
        "test row 1300",
        "start",
        "hold",
        "start now",
        "hold",
        "clear",
        "events off",
        "events on",
        "plot teleplot",
        "plot on",
        "label plant",
        "label weed",
        "label plant force",
        "label weed force",
        "teach weed",
        "teach 12",
        "teach 34",
        "teach 56",
        "teach 78",
        "teach 90",
        "teach weed",
        "examples",
        "forget 0",
        "forget 31",
        "forget all",
        "dump",
        "version",
        "hepl",
        "HELP",
        "h",
        "versions",
        "calibrat",
        "set",
        "set k",
        "set k 3 4",
        "set nothing 3",
        "set top_speed_mm_ 3",
        "get nothing",
        "help nothing",
        "calibrate",
        "calibrate 10000 faster",
        "calibrate 70000",
        "calibrate start now",
        "servo",
        "servo up",
        "servo 70000",
        "test",
        "test row fast",
        "test teleplot teleplot",
        "start later",
        "events teleplot",
        "plot",
        "plot weed",
        "label",
        "label tree",
        "teach 256",
        "label weed weed",
        "label weed force force",
        "forget",
        "forget 256",
        "forget teleplot",
        "\u{7}hold",
        "h\u{f6}ld",
    ]
    .map(str::to_owned)
    .to_vec();
    lines.extend((0..).map_while(Word::from_index).map(|word| {
        let word = String::from_utf8(word.text().bytes().collect()).expect("ASCII");
        format!("{word} end_switch end_switch end_switch")
    }));
    for setting in Setting::all() {
        let name = name(setting);
        lines.extend([
            format!("help {name}"),
            format!("get {name}"),
            format!("set {name} x"),
            format!("set {name} 65535"),
        ]);
        lines.extend(
            [setting.least(), setting.greatest(), setting.default()].map(|value| format!("set {name} {value}")),
        );
    }
    lines.push("defaults".to_owned());
    // Lines of every length, and one that is too long.
    lines.extend((1..=LINE_LENGTH + 1).step_by(8).map(|length| "s".repeat(length)));
    lines.extend((4..=LINE_LENGTH + 1).step_by(8).map(|length| format!("{:length$}", "get")));
    lines
}

/// A machine that rolls along a row at 5 km/h, with all events on.
fn under_way() -> Run {
    under_way_after(&["plot on"], 60)
}

/// The same, along this number of plants and after these commands.
fn under_way_after(commands: &[&str], plants: usize) -> Run {
    let planting = Planting { plants, weeds: plants / 2, spacing_mm: 300.0, ragged: true, ..Planting::default() };
    let row = planting.grow(1).expect("everything has room");
    let end_mm = row.span_mm().end;
    Run::begin(pass(row, steady(1000.0, end_mm)), commands)
}

#[test]
fn no_turn_takes_more_than_a_millisecond_for_all_commands_and_output() {
    let mut uno = started();
    let mut worst = (0, String::new());
    for line in lines() {
        let cycles = typed_takes(&mut uno, &line);
        assert!(cycles <= TURN, "a turn took {cycles} cycles: {line}");
        worst = worst.max((cycles, line));
    }
    println!("{} of {TURN} cycles: {}", worst.0, worst.1);
}

#[test]
fn no_turn_takes_more_than_a_millisecond_while_a_row_rolls_by() {
    let mut run = under_way();
    let mut end = run.cycles().end;
    let mut worst = (0, String::new());
    for line in lines() {
        if run.uno.cycle() + CYCLES_PER_SECOND >= end {
            run = under_way();
            end = run.cycles().end;
        }
        // An alarm would end the decisions, so it is cleared.
        for typed in [line.as_str(), "clear", "start"] {
            worst = worst.max((typed_takes(&mut run.uno, typed), typed.to_owned()));
        }
    }
    println!("{} of {TURN} cycles: {}", worst.0, worst.1);
    assert!(worst.0 <= TURN, "a turn took {} cycles: {}", worst.0, worst.1);
}

#[test]
fn no_turn_takes_over_a_millisecond_with_all_examples_taught() {
    // Among the built-in examples, so that they become nearest neighbours.
    let teach = |number| {
        let features = [128, 100 + number, 128, 90 + 2 * number, 128].map(|feature| format!("teach {feature}"));
        features.into_iter().chain([format!("teach {}", if number % 2 == 0 { "plant" } else { "weed" })])
    };
    for taught in [0, field_examples::CAPACITY] {
        let mut commands: Vec<String> = (0..taught).flat_map(teach).collect();
        commands.extend(["set k 15", "plot on"].map(str::to_owned));
        let mut run = under_way_after(&commands.iter().map(String::as_str).collect::<Vec<_>>(), 24);
        run.uno.measure_turns();
        run.roll_to_the_end();
        let longest = run.uno.turns().expect("they are measured").most;
        println!("{longest} of {TURN} cycles with {taught} from the field");
        assert!(longest <= TURN, "a turn took {longest} cycles with {taught} from the field");
    }
}

/// Encoder counts a second, with more time between two than a turn takes.
const COUNTS_PER_S: u64 = 2000;

#[test]
fn each_interrupt_starts_a_turn_and_the_loop_sleeps_between() {
    let mut uno = started();
    // Without counts only the clock's overflows start turns.
    for counts in [0, COUNTS_PER_S] {
        let begin = uno.cycle();
        let cycles = (1..=counts).map(|number| begin + number * CYCLES_PER_SECOND / COUNTS_PER_S);
        uno.drive(encoder_steps(cycles.map(|cycle| (cycle, 1))));
        uno.measure_turns();
        run_for_ms(&mut uno, 1000);
        let turns = uno.turns().expect("they are measured");
        let awake = turns.total as f64 / CYCLES_PER_SECOND as f64;
        println!("{counts} counts: {} turns, {:.0} % of the time awake", turns.count, awake * 100.0);
        let overflows = CYCLES_PER_SECOND / (64 * 256);
        // No sleep is between a long calculation, such as that of new leads, and the next turn.
        let calculations = 100;
        assert!((counts.max(overflows)..=counts + overflows + calculations).contains(&turns.count), "{turns:?}");
        assert!(awake < 0.6, "{turns:?}");
    }
}

/// Types a line and waits for its verdict; returns the cycles of the longest turn until then.
fn typed_takes(uno: &mut Uno, line: &str) -> u64 {
    uno.received();
    uno.measure_turns();
    uno.send(format!("{line}\n").as_bytes());
    let mut answer = String::new();
    for _ in 0..2000 {
        run_for_ms(uno, 2);
        answer += &uno.received();
        let verdicts = answer.lines().filter(|line| *line == "ok" || line.starts_with("error: ")).count();
        assert!(verdicts <= 1, "{line}: {answer}");
        if verdicts == 1 && answer.ends_with('\n') {
            return uno.turns().expect("they are measured").most;
        }
    }
    panic!("{line:?} is not answered: {answer}");
}
