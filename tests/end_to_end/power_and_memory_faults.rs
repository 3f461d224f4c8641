//! Resets, stalls, damaged memory and overflowing counters: the machine starts in HOLD with the tool out, reports the
//! cause, and uses no damaged data.

use crate::common::{
    Run, ask, assert_a_swing_each, assert_all_kept, assert_commands_in_place, bare_ground, elf, is_out_at_the_pin,
    number, pass, refusal, run_for_ms, started, status, steady, value,
};
use control::memory::{SIZE, Volatile};
use control::operate::saved::{COPY, SavedSettings};
use control::settings::{Setting, Settings};
use field::motion::mm_s;
use field::pass::{Pass, Start};
use field::row::{Canopy, Row};
use field::wiring;
use uno::CYCLES_PER_SECOND;
use uno::Uno;
use uno_run::power_up;

/// Longest time from a reset to the greeting.
const GREETING_CYCLES: u64 = CYCLES_PER_SECOND / 2;

/// Servo pulse for the tool out of the row, by default.
const OUT_US: f64 = 2000.0;

/// The greeting after a reset. Asserts that no pulse since `cycle` has the tool in the row.
#[track_caller]
fn greeting_with_the_tool_out_since(uno: &mut Uno, cycle: u64) -> String {
    let greeting = uno.run_until_serial("commands\r\n", GREETING_CYCLES).expect("the firmware wakes up");
    run_for_ms(uno, 30);
    let pulses = uno.pulses(wiring::SERVO);
    let since: Vec<f64> = pulses.iter().filter(|pulse| pulse.rise > cycle).map(|pulse| pulse.width_us()).collect();
    assert!(!since.is_empty() && since.iter().all(|width| (width - OUT_US).abs() < 1.0), "{since:?}");
    greeting
}

/// A machine at work, with the tool in the row and the settings saved.
fn at_work() -> Run {
    let row = Row::new(vec![Canopy::plant(1500.0, 150.0)]).expect("a plant is a row");
    let motion = steady(mm_s(2.0), 3000.0);
    let mut run = Run::begin(Pass { start: Start::Now, ..pass(row, motion) }, &["save"]);
    run.roll_to(1000.0);
    assert!(!is_out_at_the_pin(&run.uno));
    run
}

#[test]
fn a_reset_at_any_moment_ends_in_hold_with_the_tool_out() {
    for (restart, cause) in [
        (Uno::power_cycle as fn(&mut Uno), "power_on"),
        (Uno::reset, "reset_pin"),
        (Uno::brown_out, "brown_out"),
        (|uno| uno.power_cycle_to_noise(7), "power_on"),
    ] {
        let mut run = at_work();
        // Times that are independent of the loop's turns: in the row, over the plant, behind it.
        for wait_us in [0, 1_237, 250_011, 433_333, 700_003, 311] {
            let cycle = run.uno.cycle() + wait_us * (CYCLES_PER_SECOND / 1_000_000);
            run.uno.run_until(cycle).expect("the firmware runs");
            restart(&mut run.uno);
            let greeting = greeting_with_the_tool_out_since(&mut run.uno, cycle);
            assert!(
                greeting.contains(&format!(
                    "reset by {cause}{}, state hold,",
                    if cause == "power_on" { "" } else { ", was work" }
                )),
                "{greeting:?}"
            );
            let said = status(&mut run.uno);
            let expected = ["hold", "out", cause];
            assert_eq!(["state", "tool", "reset"].map(|key| value(&said, key)), expected, "{said}");
            // 30 ms of rolling are known, and no ground before them.
            assert!(number(&said, "unseen_mm") > 350, "{said}");
            ask(&mut run.uno, "start now");
        }
    }
}

#[test]
fn a_stalled_loop_puts_the_tool_out_and_resets_the_machine() {
    for wait_us in [0, 777, 100_013] {
        let mut run = at_work();
        run.uno.run_until(run.uno.cycle() + wait_us * (CYCLES_PER_SECOND / 1_000_000)).expect("the firmware runs");
        let stalled = run.uno.cycle();
        run.uno.stall().expect("the firmware runs");
        let greeting = run.uno.run_until_serial("commands\r\n", CYCLES_PER_SECOND).expect("the watchdog resets it");
        assert!(greeting.contains("reset by loop_stalled, was work, state hold,"), "{greeting:?}");
        // The timer's interrupt puts it out 200 ms after the last turn, well before the watchdog's reset.
        let reset = run.uno.resets()[0].cycle;
        let ms_after = |cycle: u64| (cycle - stalled) as f64 / (CYCLES_PER_SECOND as f64 / 1000.0);
        assert!((240.0..300.0).contains(&ms_after(reset)), "{} ms", ms_after(reset));
        let command = run.first_command_after(stalled);
        assert!(command.is_out && command.rise_cycle < reset, "{command:?}");
        assert!((195.0..225.0).contains(&ms_after(command.rise_cycle)), "{} ms", ms_after(command.rise_cycle));
        run_for_ms(&mut run.uno, 100);
        assert!(is_out_at_the_pin(&run.uno));
        // The cause does not carry over to the next reset.
        run.uno.reset();
        let greeting = greeting_with_the_tool_out_since(&mut run.uno, reset);
        assert!(greeting.contains("reset by reset_pin"), "{greeting:?}");
    }
}

#[test]
fn the_operator_has_the_watchdog_restart_a_machine_that_stands_in_hold() {
    let mut run = at_work();
    let works = refusal(&mut run.uno, "test watchdog");
    assert!(works.contains("hold first"), "{works}");
    ask(&mut run.uno, "hold");
    run.roll_to_the_end();
    run_for_ms(&mut run.uno, 1000);
    ask(&mut run.uno, "servo in");
    run_for_ms(&mut run.uno, 100);
    let typed = run.uno.cycle();
    ask(&mut run.uno, "test watchdog");
    // At most two frames later the servo has the pulse for out, and keeps it.
    let greeting = greeting_with_the_tool_out_since(&mut run.uno, typed + CYCLES_PER_SECOND / 25);
    assert!(greeting.contains("reset by loop_stalled, state hold,"), "{greeting:?}");
    assert_eq!(run.uno.resets().len(), 1);
}

#[test]
fn a_stack_that_nearly_reaches_the_variables_is_an_alarm() {
    let mut run = at_work();
    let free = number(&status(&mut run.uno), "stack_free");
    assert!((200..1000).contains(&free), "{free}");
    let corrupted = run.uno.first_stack_address() + 40;
    run.uno.write_sram(corrupted, &[0]).expect("an address in SRAM");
    run.roll_to_the_end();
    let said = status(&mut run.uno);
    assert_eq!(
        ["state", "code", "name", "tool"].map(|key| value(&said, key)),
        ["alarm", "6-1", "stack_low", "out"],
        "{said}"
    );
    assert_eq!(number(&said, "stack_free"), 40);
    assert!(is_out_at_the_pin(&run.uno));
}

/// An EEPROM with these settings, valid or not, saved one after the other.
fn eeprom_with(saves: &[Settings]) -> Vec<u8> {
    let mut saved = SavedSettings::new(Volatile::new());
    for settings in saves {
        saved.save();
        while !saved.carry_on(settings) {}
    }
    saved.into_memory().bytes.to_vec()
}

fn with(values: &[(Setting, u16)]) -> Settings {
    let mut settings = Settings::new();
    for &(setting, value) in values {
        settings.set(setting, value).expect("within its range");
    }
    settings
}

/// Starts with this EEPROM. Returns the greeting and the Uno.
fn started_with(eeprom: &[u8]) -> (String, Uno) {
    let mut uno = Uno::boot_with_eeprom(&elf(), eeprom).expect("the firmware wakes up").wired(&wiring::WIRES);
    let greeting = uno.run_until_serial("commands\r\n", GREETING_CYCLES).expect("the firmware greets");
    (greeting, uno)
}

fn k(uno: &mut Uno) -> String {
    ask(uno, "get k").into_iter().find(|line| line.starts_with("k=")).expect("an answer")
}

#[test]
fn a_work_switch_whose_line_charges_slowly_clears_no_alarm() {
    let mut uno = Uno::boot_with_eeprom(&elf(), &[]).expect("the firmware wakes up").wired(&wiring::WIRES);
    // It is open, and its cable and a capacitor are low for 5 ms.
    uno.set(wiring::WORK_SWITCH, false);
    uno.run_for_ms(5).expect("the firmware runs");
    uno.set(wiring::WORK_SWITCH, true);
    uno.run_for_ms(200).expect("the firmware runs");
    let said = status(&mut uno);
    assert_eq!(["state", "name"].map(|key| value(&said, key)), ["alarm", "settings_lost"], "{said}");
}

#[test]
fn an_erased_eeprom_gives_the_defaults_and_an_alarm() {
    let mut uno = power_up(&elf(), &[]).expect("it wakes up");
    let said = status(&mut uno);
    assert_eq!(["state", "code", "name"].map(|key| value(&said, key)), ["alarm", "5-1", "settings_lost"], "{said}");
    assert!(refusal(&mut uno, "start").contains("clear"));
    assert!(k(&mut uno).starts_with("k=3 "));
    ask(&mut uno, "clear");
    ask(&mut uno, "save");
    let cycle = uno.cycle();
    uno.power_cycle();
    let greeting = greeting_with_the_tool_out_since(&mut uno, cycle);
    assert!(greeting.contains("state hold,"), "saved once, they are found: {greeting:?}");
}

#[test]
fn settings_are_saved_and_outlive_the_power() {
    let mut uno = started();
    for line in ["set k 5", "set beam_to_tool_mm 620", "set end_switch on", "set end_switch off", "save"] {
        ask(&mut uno, line);
    }
    let cycle = uno.cycle();
    uno.power_cycle();
    greeting_with_the_tool_out_since(&mut uno, cycle);
    assert!(k(&mut uno).starts_with("k=5 "));
    assert!(ask(&mut uno, "get beam_to_tool_mm")[0].starts_with("beam_to_tool_mm=620 "));
    ask(&mut uno, "start");
    assert_eq!(refusal(&mut uno, "save"), "error: the machine is at work, hold first");
}

#[test]
fn any_corrupted_byte_of_a_copy_leaves_the_other_copy() {
    let eeprom = eeprom_with(&[with(&[(Setting::K, 5)]), with(&[(Setting::K, 7)])]);
    for (begin, left) in [(0, "k=7 "), (SIZE / 2, "k=5 ")] {
        for byte in 0..COPY {
            let mut corrupted = eeprom.clone();
            corrupted[begin + byte] ^= 1 << (byte % 8);
            let (greeting, mut uno) = started_with(&corrupted);
            assert!(greeting.contains("state hold,"), "{greeting:?}");
            assert!(k(&mut uno).starts_with(left), "byte {byte} from {begin} on");
            assert_eq!(value(&status(&mut uno), "warning"), "settings_older", "byte {byte} from {begin} on");
        }
    }
}

#[test]
fn two_corrupted_copies_or_another_tables_are_lost_settings() {
    let eeprom = eeprom_with(&[with(&[(Setting::K, 5)]), with(&[(Setting::K, 7)])]);
    // Both copies' values, both copies' table marks, and settings of an older table.
    for places in [[10, SIZE / 2 + 20], [0, SIZE / 2]] {
        let mut corrupted = eeprom.clone();
        places.into_iter().for_each(|place| corrupted[place] ^= 0x20);
        let (greeting, mut uno) = started_with(&corrupted);
        assert!(greeting.contains("state alarm 5-1 settings_lost,"), "{greeting:?}");
        assert!(k(&mut uno).starts_with("k=3 "));
    }
}

#[test]
fn power_lost_at_any_byte_of_a_save_leaves_the_old_settings_or_the_new() {
    let before = eeprom_with(&[with(&[(Setting::K, 5), (Setting::MarginMm, 40)])]);
    let (mut olds, mut news) = (0, 0);
    // A byte takes 3.4 ms.
    for wait_ms in (0..).step_by(3) {
        let (_, mut uno) = started_with(&before);
        for line in ["set k 9", "set margin_mm 45", "set no_plant_m 20"] {
            ask(&mut uno, line);
        }
        uno.send(b"save\n");
        run_for_ms(&mut uno, wait_ms);
        let done = uno.received().contains("ok");
        let cycle = uno.cycle();
        uno.power_cycle();
        let greeting = greeting_with_the_tool_out_since(&mut uno, cycle);
        assert!(greeting.contains("state hold,"), "after {wait_ms} ms: {greeting:?}");
        let said = ["k", "margin_mm"].map(|name| ask(&mut uno, &format!("get {name}")).remove(0));
        let is = |k: &str, margin: &str| said[0].starts_with(k) && said[1].starts_with(margin);
        olds += u32::from(is("k=5 ", "margin_mm=40 "));
        news += u32::from(is("k=9 ", "margin_mm=45 "));
        assert!(is("k=5 ", "margin_mm=40 ") || is("k=9 ", "margin_mm=45 "), "after {wait_ms} ms: {said:?}");
        if done {
            assert!(is("k=9 ", "margin_mm=45 "), "`ok` means that it is there");
            break;
        }
    }
    assert!(olds > 30 && news > 0, "{olds} {news}");
}

#[test]
fn saved_settings_that_contradict_each_other_are_an_alarm_and_never_start() {
    let eeprom = eeprom_with(&[with(&[(Setting::BeamToToolMm, 150)])]);
    let (greeting, mut uno) = started_with(&eeprom);
    assert!(greeting.contains("state alarm 5-2 settings_contradict,"), "{greeting:?}");
    ask(&mut uno, "clear");
    for command in ["start", "start now", "save"] {
        let answer = refusal(&mut uno, command);
        assert!(answer.contains("beam_to_tool_mm 389 or more"), "{answer}");
    }
    ask(&mut uno, "set beam_to_tool_mm 400");
    ask(&mut uno, "start");
}

#[test]
fn the_saved_pulse_has_the_tool_out_from_the_first_one_on() {
    // A machine with a mirrored servo.
    let eeprom = eeprom_with(&[with(&[(Setting::ServoOutUs, 1000), (Setting::ServoInUs, 2000)])]);
    let (_, mut uno) = started_with(&eeprom);
    run_for_ms(&mut uno, 50);
    let widths: Vec<f64> = uno.pulses(wiring::SERVO).iter().map(|pulse| pulse.width_us()).collect();
    assert!(!widths.is_empty() && widths.iter().all(|width| (width - 1000.0).abs() < 1.0), "{widths:?}");
}

#[test]
fn nothing_happens_where_position_and_time_wrap() {
    let mut uno = Uno::boot(&elf()).expect("the firmware can be run").wired(&wiring::WIRES);
    uno.run_until_symbol("main", GREETING_CYCLES).expect("the program starts");
    // Both overflow one and a half metres into the row, in the middle of a zone.
    let count = (i32::MAX - 2_500).to_le_bytes();
    uno.write("weeder_firmware::encoder::COUNT_LOW", &count[..2]).expect("the count's lower half");
    uno.write("weeder_firmware::encoder::COUNT_HIGH", &count[2..]).expect("the count's upper half");
    uno.write("weeder_firmware::clock::OVERFLOWS_LOW", &[0]).expect("the clock's lowest byte");
    uno.write("weeder_firmware::clock::OVERFLOWS_HIGH", &[0xEC, 0xFF]).expect("the clock's upper bytes");
    uno.run_until_serial("\n", GREETING_CYCLES).expect("the firmware greets");
    ask(&mut uno, "clear");

    let row = Row::new((0..4).map(|number| Canopy::plant(600.0 + 500.0 * f64::from(number), 150.0)).collect())
        .expect("the plants stand apart");
    let pass = Pass { start: Start::Now, ..pass(row, steady(mm_s(2.0), 2900.0)) };
    let mut run = Run::set_off(uno, pass, &[], |_, changes| changes);
    run.roll_to_the_end();
    let judgement = run.judgement();
    assert_all_kept(&judgement);
    assert_a_swing_each(&judgement, &run.commands());
    assert_commands_in_place(&judgement);
    assert_eq!(run.events("plant").len(), 4);
    let said = status(&mut run.uno);
    assert_eq!(value(&said, "state"), "work");
    assert!(number(&said, "pos") < -2_000_000_000, "the position has wrapped: {said}");
}

#[test]
fn a_work_switch_left_on_over_a_reset_starts_nothing() {
    let mut run = Run::begin(Pass { start: Start::Switch, ..pass(bare_ground(), steady(mm_s(2.0), 900.0)) }, &["save"]);
    run.roll_to(700.0);
    assert!(!is_out_at_the_pin(&run.uno));
    let cycle = run.uno.cycle();
    run.uno.brown_out();
    greeting_with_the_tool_out_since(&mut run.uno, cycle);
    assert_eq!(value(&status(&mut run.uno), "state"), "hold");
    run.uno.set(wiring::WORK_SWITCH, true);
    run_for_ms(&mut run.uno, 100);
    assert_eq!(value(&status(&mut run.uno), "state"), "hold");
}
