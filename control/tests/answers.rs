//! The console's answers, word for word; each line fits the serial buffer.

mod common;

use common::{ByWidth, LEAST_HOLD_MM, machine};
use control::{
    alarm::{Alarm, Warning},
    ground::{
        class::{Class, Vote},
        keep_out::Plan,
    },
    measure::{readings::Readings, reset::Cause},
    memory::Volatile,
    operate::{
        calibration::{Outcome, SwingTimes},
        event::Event,
        plot::Plot,
        saved::SavedSettings,
        state::State,
    },
    say::{
        self, Console, LINE,
        command::{LineBuffer, Word},
        line::Line,
    },
    settings::{Setting, Settings},
    units::{Instant, Position, Ticks},
};
use rig::{Beams, Rig};

/// A line's text; checks its length.
fn said(line: Line) -> String {
    let said: String = line.map(char::from).collect();
    assert!(said.len() <= LINE, "{} characters: {said}", said.len());
    said
}

fn settings() -> impl Iterator<Item = Setting> {
    (0..).map_while(Setting::from_index)
}

#[test]
fn every_answer_ends_in_exactly_one_ok_or_error() {
    let mut lines = rig::every_command();
    lines.extend(["nonsense", "set k 99"].map(str::to_owned));
    for setting in settings() {
        let name = String::from_utf8(setting.text().bytes().collect()).unwrap();
        lines.extend([
            format!("help {name}"),
            format!("get {name}"),
            format!("set {name} 60000"),
            format!("set {name} x"),
        ]);
    }
    for line in lines {
        let answer = machine().ask(&line);
        let ends = answer.iter().filter(|line| *line == "ok" || line.starts_with("error: ")).count();
        assert_eq!(ends, 1, "{line}: {answer:?}");
        assert!(answer.last().is_some_and(|line| line == "ok" || line.starts_with("error: ")), "{line}: {answer:?}");
    }
}

#[test]
fn help_lists_every_command() {
    let help = machine().ask("help");
    for word in (0..).map_while(Word::from_index) {
        let word = String::from_utf8(word.text().bytes().collect()).unwrap();
        assert!(help.iter().any(|line| line.starts_with(&word)), "{word}");
    }
}

#[test]
fn a_setting_takes_every_value_of_its_range_and_no_other() {
    for setting in settings() {
        let name = String::from_utf8(setting.text().bytes().collect()).unwrap();
        let mut machine = machine();
        // These values contradict no value of another setting.
        for line in ["set lead_out_ms 0", "set margin_mm 0", "set beam_to_tool_mm 1000", "set wheel_mm 200"] {
            assert_eq!(machine.ask(line), ["ok"]);
        }
        for value in [setting.least(), setting.greatest()] {
            assert_eq!(machine.ask(&format!("set {name} {value}")), ["ok"]);
            assert_eq!(machine.settings().get(setting), value);
            if !setting.is_switched() {
                assert!(machine.ask(&format!("get {name}"))[0].starts_with(&format!("{name}={value} ")));
            }
        }
        if setting.is_switched() {
            let refusal = [format!("error: {name} takes on or off")];
            assert_eq!(machine.ask(&format!("set {name} 2")), refusal);
            assert_eq!(machine.ask(&format!("get {name}"))[0], format!("{name}=on on or off, default off, not saved"));
            continue;
        }
        let outside = [setting.least().checked_sub(1), setting.greatest().checked_add(1)];
        for value in outside.into_iter().flatten() {
            let range = format!("from {} to {}", setting.least(), setting.greatest());
            let expected = format!("error: {name} takes a whole number {range}");
            assert_eq!(machine.ask(&format!("set {name} {value}")), [expected]);
            assert_eq!(machine.settings().get(setting), setting.greatest(), "the old value stays");
        }
    }
}

#[test]
fn settings_that_move_the_tool_are_refused_at_work() {
    let mut machine = machine();
    assert_eq!(machine.ask("start"), ["ok"]);
    let refusal = "error: wheel_mm changes where the tool is, hold first";
    assert_eq!(machine.ask("set wheel_mm 500"), [refusal]);
    assert!(machine.ask("set servo_out_us 1500")[0].starts_with("error: servo_out_us changes"));
    assert_eq!(machine.ask("set lead_out_ms 150"), ["ok"]);
    assert_eq!(machine.ask("hold"), ["ok"]);
    assert_eq!(machine.ask("set wheel_mm 500"), ["ok"]);
}

#[test]
fn an_alarm_prevents_a_start_until_it_is_cleared() {
    let mut machine = machine();
    machine.ask("start");
    machine.lose_edges(Beams::default());
    machine.turn_after(1000);
    assert!(machine.ask("status")[0].starts_with("state=alarm code=1-3 name=beam_edges_lost tool=out "));
    assert_eq!(machine.ask("start"), ["error: an alarm is latched, see status, then clear it"]);
    machine.ask("hold");
    assert!(matches!(machine.state(), State::Alarm(_)), "hold does not clear an alarm");
    assert_eq!(machine.ask("clear"), ["ok"]);
    assert_eq!(machine.ask("start"), ["ok"]);
}

#[test]
fn status_shows_the_distance_to_seen_ground() {
    let mut machine = machine();
    assert_eq!(
        machine.ask("status"),
        [
            "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=450",
            "lost=0 jumps=0 late=0 missed=0 mistakes=0 dust=0 stack_free=65535 reset=power_on",
            "ok"
        ]
    );
    assert_eq!(machine.ask("start"), ["ok"]);
    machine.turn_after(1000);
    assert!(machine.ask("status")[0].starts_with("state=work tool=out for=unseen_ground "));
    assert_eq!(machine.ask("start now"), ["ok"]);
    assert!(machine.ask("status")[0].ends_with("unseen_mm=0"));
}

/// The greeting of a machine with saved settings after a reset at work, and the machine.
fn after_a_reset_at_work(cause: Cause) -> (String, Rig<ByWidth>) {
    let mut saved = SavedSettings::new(Volatile::new());
    saved.save();
    while !saved.carry_on(&Settings::new()) {}
    let readings = Readings::new(Instant::ZERO, Position::new(0));
    let classifier = ByWidth::new(LEAST_HOLD_MM, 0);
    let mut machine = Rig::wake_from(classifier, saved.into_memory(), readings, Beams::default(), cause, true);
    let mut console = Console::new();
    console.carry_on(&mut machine);
    (std::iter::from_fn(|| console.next_byte()).map(char::from).collect(), machine)
}

#[test]
fn a_reset_at_work_is_reported_until_a_start_or_hold() {
    for cause in [Cause::ResetPin, Cause::BrownOut, Cause::LoopStalled, Cause::Unknown] {
        for line in ["start", "hold"] {
            let (greeting, mut machine) = after_a_reset_at_work(cause);
            assert!(greeting.contains(&format!(", reset by {}, was work, state hold", cause.text())), "{greeting}");
            let reset = format!(" reset={}", cause.text());
            assert!(machine.ask("status")[1].ends_with(&format!("{reset} was=work")));
            assert!(machine.works_or_did(), "another reset does not hide it");
            assert_eq!(machine.ask(line), ["ok"]);
            assert!(machine.ask("status")[1].ends_with(&reset), "{line}");
            assert_eq!(machine.works_or_did(), line == "start");
        }
    }
    let (_, mut machine) = after_a_reset_at_work(Cause::BrownOut);
    machine.lose_edges(Beams::default());
    assert!(machine.ask("status")[1].contains(" was=work") && machine.works_or_did(), "an alarm does not hide it");
    assert_eq!(machine.ask("clear"), ["ok"]);
    assert!(!machine.ask("status")[1].contains(" was=work"));
    let (greeting, mut machine) = after_a_reset_at_work(Cause::PowerOn);
    assert!(greeting.contains(", reset by power_on, state hold"), "SRAM is random then: {greeting}");
    assert!(machine.ask("status")[1].ends_with(" reset=power_on"));
}

#[test]
fn the_longest_numbers_fit_on_the_status_line() {
    let mut machine = machine();
    machine.ask("start");
    machine.lose_edges(Beams::default());
    (machine.readings.lost, machine.readings.jumps) = (u16::MAX, u16::MAX);
    machine.at(i32::MIN).turn_after(1000);
    machine.ask("status");
}

#[test]
fn every_event_fits_on_a_line() {
    let far = Position::new(i32::MIN);
    let long = Ticks(i32::MIN / 4);
    let vote = Vote { class: Class::Unknown, votes: u8::MAX };
    let plan = Plan { delay: long, hold: long };
    let mut events = vec![
        Event::Detection { vote, leading: far, spacing: long, plan },
        Event::Guarded(far),
        Event::Swing { out: true, position: far },
        Event::State(State::Hold),
    ];
    events.extend((0..).map_while(Warning::from_index).map(Event::Warning));
    let longest = Outcome::Measured(SwingTimes { out_ms: u16::MAX, in_ms: u16::MAX });
    events.extend([longest, Outcome::Shown, Outcome::Failed].map(|outcome| Event::Calibrated { outcome, fits: false }));
    events.extend((0..).map_while(Alarm::from_index).map(|alarm| Event::Alarm { alarm, position: far }));
    for event in events {
        let mut line = Line::new();
        say::write_event(&event, &mut line);
        let said = said(line);
        assert!(said.ends_with("\r\n") && !said.contains(':'), "{said}");
    }
}

#[test]
fn an_alarm_is_not_cleared_by_the_switch_going_on() {
    let mut machine = machine();
    machine.ask("start");
    machine.lose_edges(Beams::default());
    machine.turn();
    let mut throw = |switch_on: bool| {
        machine.readings.switch_on = switch_on;
        machine.stand(30);
        machine.state()
    };
    assert_eq!(throw(true), State::Alarm(Alarm::BeamEdgesLost));
    assert_eq!(throw(false), State::Hold);
    assert_eq!(throw(true), State::Work);
}

#[test]
fn after_lost_edges_the_present_level_of_the_beam_counts() {
    for broken in [false, true] {
        let mut machine = machine();
        machine.lose_edges(Beams::one(broken));
        machine.turn_after(1000);
        assert_eq!(machine.zones(), u8::from(broken));
    }
}

#[test]
fn contradicting_settings_are_refused_with_the_allowed_value() {
    let mut machine = machine();
    let refusal = "error: margin, leads and top speed would need beam_to_tool_mm 389 or more, change one of them first";
    assert_eq!(machine.ask("set beam_to_tool_mm 388"), [refusal]);
    assert_eq!(machine.ask("set beam_to_tool_mm 389"), ["ok"]);
    for line in ["set margin_mm 51", "set lead_out_ms 240", "set top_speed_mm_s 1310", "set beam_response_ms 3"] {
        assert!(machine.ask(line)[0].starts_with("error: margin, leads and top speed would need"), "{line}");
    }
    assert_eq!(machine.ask("set top_speed_mm_s 1000"), ["ok"]);
    assert_eq!(machine.ask("set margin_mm 60"), ["ok"]);
    let refusal = "error: servo_in_us and servo_out_us would be equal, and the tool would not move";
    assert_eq!(machine.ask("set servo_in_us 2000"), [refusal]);
}

#[test]
fn a_wheel_with_too_few_counts_is_refused_with_the_allowed_value() {
    let mut machine = machine();
    let refusal = "error: a wheel gives 900 ticks a metre or more, take a finer encoder";
    for (too_few, enough) in [
        ("set ticks_per_m 1", "set ticks_per_m 0"),
        ("set ticks_per_m 39", "set ticks_per_m 900"),
        ("set ticks_per_m 899", "set ticks_per_m 1500"),
        ("set ticks_per_rev 1130", "set ticks_per_rev 1132"),
    ] {
        assert_eq!(machine.ask(too_few), [refusal], "{too_few}");
        assert_eq!(machine.ask(enough), ["ok"], "{enough}");
    }
    assert_eq!(machine.ask("set wheel_mm 401"), [refusal]);
    machine.ask("calibrate start");
    machine.at(800).turn_after(1000);
    machine.stand(200);
    assert_eq!(machine.ask("calibrate 1000 force"), [refusal]);
    assert_eq!(machine.settings().get(Setting::TicksPerM), 0);
}

#[test]
fn settings_are_saved_in_hold_only() {
    let mut machine = machine();
    assert_eq!(machine.ask("save"), ["ok"]);
    machine.ask("start");
    assert_eq!(machine.ask("save"), ["error: the machine is at work, hold first"]);
}

#[test]
fn a_machine_without_saved_settings_starts_only_after_clear() {
    let mut machine = Rig::wake(ByWidth::new(LEAST_HOLD_MM, 0), Volatile::new(), Cause::BrownOut);
    assert_eq!(machine.state(), State::Alarm(Alarm::SettingsLost));
    assert_eq!(machine.ask("start"), ["error: an alarm is latched, see status, then clear it"]);
    assert_eq!(machine.ask("clear"), ["ok"]);
    assert_eq!(machine.ask("start"), ["ok"]);
}

#[test]
fn lines_with_an_error_are_counted() {
    let mut machine = machine();
    for line in ["nonsense", "set", "\u{7}"] {
        machine.ask(line);
    }
    assert!(machine.ask("status")[1].contains(" mistakes=3 "));
}

#[test]
fn the_table_of_faults_names_every_alarm_warning_and_cause() {
    let table = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/faults.md")).unwrap();
    let name = |text: control::say::Text| String::from_utf8(text.bytes().collect()).unwrap();
    for alarm in (0..).map_while(Alarm::from_index) {
        let row = format!("| `{}-{} {}` |", alarm.code().0, alarm.code().1, name(alarm.text()));
        assert!(table.lines().any(|line| line.starts_with(&row)), "{row}");
    }
    for warning in (0..).map_while(Warning::from_index) {
        assert!(table.contains(&format!("`{}` (warning)", name(warning.text()))), "{warning:?}");
    }
    for cause in (0..).map_while(Cause::from_index) {
        assert!(table.contains(&format!("`{}`", name(cause.text()))), "{cause:?}");
    }
}

#[test]
fn get_and_help_show_the_unit_as_a_separate_word() {
    for command in ["get", "help"] {
        let tells = |setting: &str, shown: &str| {
            let answer = machine().ask(&format!("{command} {setting}"));
            assert!(answer[answer.len() - 2].starts_with(shown), "{answer:?}");
        };
        tells("top_speed_mm_s", "top_speed_mm_s=1300 mm/s from 100 to 3000, default 1300");
        tells("merge_gap_mm", "merge_gap_mm=21 mm from 0 to 1000, default 21");
        tells("ticks_per_rev", "ticks_per_rev=2400 from 600 to 10000, default 2400");
        tells("end_switch", "end_switch=off on or off, default off");
    }
}

#[test]
fn get_shows_the_saved_value_if_it_differs() {
    let mut machine = machine();
    assert_eq!(machine.ask("get k")[0], "k=3 from 1 to 15, default 3, not saved");
    assert_eq!(machine.ask("save"), ["ok"]);
    while !machine.carry_on() {}
    assert_eq!(machine.ask("get k")[0], "k=3 from 1 to 15, default 3");
    machine.ask("set k 5");
    assert_eq!(machine.ask("get k")[0], "k=5 from 1 to 15, default 3, saved 3");
    assert_eq!(machine.ask("revert"), ["ok"]);
    assert_eq!(machine.ask("get k")[0], "k=3 from 1 to 15, default 3");
}

#[test]
fn a_calibration_answers_its_result_or_the_allowed_values() {
    let mut machine = machine();
    assert_eq!(machine.ask("calibrate 10000"), ["error: calibrate start first, then roll"]);
    assert_eq!(machine.ask("calibrate start"), ["ok"]);
    machine.at(18_900).turn_after(1000);
    assert_eq!(machine.ask("calibrate 10000"), ["error: the machine rolls, stop first"]);
    machine.stand(200);
    assert_eq!(machine.ask("calibrate 500"), ["error: roll 1000 mm at least, 10000 are better"]);
    let refusal = "error: that would be ticks_per_m 3780, the wheel has 1910, look again, or add force";
    assert_eq!(machine.ask("calibrate 5000"), [refusal]);
    let answer = [
        "that is 11 permille off the diameter of the wheel",
        "ticks_per_m=1890 from 0 to 20000, default 0, not saved",
        "ok",
    ];
    assert_eq!(machine.ask("calibrate 10000"), answer);
    assert_eq!(machine.ask("calibrate 5000 force")[1], "ticks_per_m=3780 from 0 to 20000, default 0, not saved");
    // The same wheel keeps its calibration, and another one does not.
    for (line, ticks_per_m) in [("set wheel_mm 400", 3780), ("set ticks_per_rev 2400", 3780), ("set wheel_mm 401", 0)] {
        machine.ask(line);
        assert_eq!(machine.settings().get(Setting::TicksPerM), ticks_per_m, "{line}");
    }
}

#[test]
fn manual_tests_are_refused_at_work_with_advice() {
    let mut machine = machine();
    let speed = "error: test row takes a speed in mm/s from 100 to 1300";
    assert_eq!(machine.ask("test row 1401"), [speed]);
    assert_eq!(machine.ask("servo 499"), ["error: servo takes a whole number from 500 to 2500"]);
    assert_eq!(machine.ask("revert"), ["error: no settings are saved, save does it"]);
    machine.ask("start");
    for line in [
        "servo in",
        "servo out",
        "calibrate start",
        "calibrate servo",
        "test row",
        "test watchdog",
        "defaults",
        "revert",
        "save",
        "forget 1",
        "forget all",
    ] {
        assert_eq!(machine.ask(line), ["error: the machine is at work, hold first"], "{line}");
    }
}

#[test]
fn plot_lines_contain_only_labels_and_values() {
    let machine = machine();
    for (plot, expected) in [
        (Plot::Arduino, "speed_mm_s:0,tool_deg:45,beam_broken:0,windows:0\r\n"),
        (Plot::Teleplot, ">speed_mm_s:0\r\n>tool_deg:45\r\n>beam_broken:0\r\n>windows:0\r\n"),
    ] {
        let mut line = Line::new();
        say::write_plot(&machine, plot, &mut line);
        assert_eq!(said(line), expected);
    }
}

#[test]
fn curves_show_speed_and_beam_and_status_shows_the_speed() {
    let mut machine = machine();
    for (direction, broken) in [(1, true), (-1, false)] {
        machine.see(Beams::one(broken));
        for _ in 1..1000 {
            let count = machine.readings.position.count() + i32::from(direction);
            machine.at(count).turn_after(1000);
        }
        let speed = machine.speed_mm_s();
        assert!((speed * direction - 523).abs() <= 1, "1000 ticks a second of the default wheel: {speed}");
        assert!(machine.ask("status")[0].contains(&format!(" speed_mm_s={speed} ")));
        let mut line = Line::new();
        say::write_plot(&machine, Plot::Arduino, &mut line);
        let curves = said(line);
        let expected = format!("speed_mm_s:{speed},tool_deg:45,beam_broken:{},", u8::from(broken));
        assert!(curves.starts_with(&expected), "{curves}");
    }
}

#[test]
fn status_counts_dropped_events() {
    let mut machine = machine();
    machine.enable_events(true);
    for _ in 0..5 {
        machine.start(false).expect("no alarm is latched");
        machine.hold();
    }
    assert!(machine.ask("status")[1].contains(" missed=4 "), "six of ten wait");
    assert_eq!(machine.events().len(), 6);
}

#[test]
fn events_and_curves_wait_until_an_answer_is_complete() {
    let mut machine = machine();
    machine.enable_events(true);
    machine.set_plot(Plot::Arduino);
    let (mut console, mut typed) = (Console::new(), LineBuffer::new());
    let mut to_type = b"help\nnonsense\nget\nversion\n".iter();
    let mut said = String::new();
    for turn in 0..20_000_u32 {
        machine.turn_after(300);
        match turn % 200 {
            0 => machine.start(false).expect("no alarm is latched"),
            100 => machine.hold(),
            _ => {}
        }
        if let Some(byte) = console.next_byte() {
            said.push(char::from(byte));
        } else if console.listens()
            && let Some(&byte) = to_type.next()
        {
            if typed.collect(byte) {
                console.take(&mut typed, &mut machine);
            }
        } else {
            console.carry_on(&mut machine);
        }
    }
    for line in ["help", "nonsense", "get", "version"] {
        let answer = machine.ask(line).join("\r\n") + "\r\n";
        assert_eq!(said.matches(&answer).count(), 1, "{line} is answered once and in one piece: {said}");
    }
    assert_eq!(said.lines().filter(|line| *line == "ok" || line.starts_with("error: ")).count(), 4);
    assert!(said.starts_with("weeder "), "it greets: {said}");
    assert!(said.contains("\r\nstate is=work\r\n") && said.contains("\r\nspeed_mm_s:0,"), "{said}");
}
