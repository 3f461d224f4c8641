//! Snapshots of the screen after events of a machine.

use super::*;
use crate::monitor::model::RowModel;
use control::alarm::Warning;
use link::ConsoleLine;
use link::rows::{Heard, Hold, What};
use link::session::Happening;
use link::settings::{Setting, Settings};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;
use std::time::{Duration, Instant};

fn screen(model: &Model) -> String {
    screen_of(model, 90, 22)
}

fn screen_of(model: &Model, columns: u16, lines: u16) -> String {
    let mut terminal = Terminal::new(TestBackend::new(columns, lines)).unwrap();
    terminal.draw(|frame| draw(model, frame)).unwrap();
    terminal.backend().to_string()
}

/// A machine after these lines since its connection.
fn machine(lines: &[&str]) -> Model {
    let mut model = Model::new(vec!["Uno".to_owned()]);
    tell(&mut model, 0, lines);
    model
}

/// A machine that has rolled along [`ROW`], after these lines.
fn machine_in_row(lines: &[&str]) -> Model {
    machine(&[&ROW[..], lines].concat())
}

fn lose(model: &mut Model, row: usize) {
    model.update(row, Happening::Lost("the port is gone: plug the Uno in again".to_owned()));
}

/// Connects a row and sends these lines.
fn tell(model: &mut Model, row: usize, lines: &[&str]) {
    let (version, settings, shown, examples) = ("0.2.0".to_owned(), Settings::new(), Vec::new(), Vec::new());
    model.update(row, Happening::Connected { version, settings, shown, examples });
    for &line in lines {
        let happening = match ConsoleLine::parse(line) {
            ConsoleLine::Status(status) => Happening::Status(status, line.to_owned()),
            ConsoleLine::Event(event) => Happening::Event(event, line.to_owned()),
            _ => Happening::Answer(line.to_owned()),
        };
        model.update(row, happening);
    }
}

/// The console's lines that begin so.
fn said<'a>(model: &'a Model, begin: &str) -> Vec<&'a String> {
    model.lines.iter().filter(|line| line.starts_with(begin)).collect()
}

/// A plant 150 mm wide that began 250 mm ahead of the tool, a weed, and the plant before them.
const ROW: [&str; 5] = [
    "state is=work",
    "plant pos=1000 votes=3 spacing=955 delay=668 hold=477 actuation=1145",
    "swing tool=in pos=1400",
    "weed pos=1600 votes=2 spacing=600 delay=668 hold=220 actuation=888",
    "plant pos=1910 votes=3 spacing=910 delay=668 hold=477 actuation=1145",
];

#[test]
fn zones_move_toward_the_tool() {
    insta::assert_snapshot!(screen(&machine_in_row(&[AT_WORK])));
    let later = "state=work tool=out for=plant pos=2560 speed_mm_s=556 windows=1 unseen_mm=0";
    insta::assert_snapshot!(screen(&machine_in_row(&[AT_WORK, later])));
}

#[test]
fn the_next_measurement_is_named_once_calibration_has_begun() {
    let timed = "calibrated lead_out_ms=158 lead_in_ms=52 set=yes";
    let mut model = machine(&["state is=hold"]);
    assert_eq!(said(&model, "-- next, "), [""; 0]);
    tell(&mut model, 0, &[timed, timed]);
    assert_eq!(
        said(&model, "-- next, "),
        [
            "-- next, time the servo: `calibrate servo` (1 of 2 done)",
            "-- next, measure 10 m: `calibrate start`, roll, `calibrate 10000` (0 of 3 done)",
        ]
    );
}

#[test]
fn a_margin_that_nothing_was_measured_for_is_warned_of_once() {
    let mut model = machine(&["state is=hold"]);
    model.update(0, Happening::Command("set margin_mm 13".to_owned()));
    let mut settings = Settings::new();
    settings.set(Setting::MarginMm, 13).expect("it is in its range");
    model.update(0, Happening::Settings(settings.clone(), Vec::new()));
    model.update(0, Happening::Settings(settings, Vec::new()));
    assert_eq!(
        said(&model, "-- warning: "),
        ["-- warning: margin_mm 13 is not measured: time the servo and measure the wheel first; 50 is safe"]
    );
}

#[test]
fn an_alarm_is_shown_with_advice_until_it_is_cleared() {
    let mut lines = vec![
        "alarm code=1-1 name=beam_blocked pos=2700",
        "state is=alarm",
        "state=alarm code=1-1 name=beam_blocked tool=out pos=2700 speed_mm_s=0 windows=0 unseen_mm=400",
    ];
    insta::assert_snapshot!(screen(&machine_in_row(&lines)));
    lines.push("state=hold tool=out pos=2700 speed_mm_s=0 windows=0 unseen_mm=400");
    assert_eq!(machine_in_row(&lines).rows[0].advice(), None);
}

#[test]
fn a_warning_does_not_hide_the_alarm_of_another_row() {
    let mut model = rows(4);
    model.update(0, Happening::Warning(Some(Warning::NoPlants)));
    let drawn = screen_of(&model, 80, 24);
    assert!(drawn.contains("row 3: alarm 2-2 encoder_channel_dead: "), "{drawn}");
    let advised = |model: &Model| model.rows[0].advice().unwrap_or_default();
    assert!(advised(&model).starts_with("warning no_plants: "));
    model.update(0, Happening::Warning(None));
    assert_eq!(advised(&model), "");
}

#[test]
fn completions_are_offered_below_the_line() {
    let mut model = machine(&[]);
    for character in "set servo".chars() {
        model.line.key(KeyCode::Char(character).into());
    }
    model.line.key(KeyCode::Tab.into());
    insta::assert_snapshot!(screen(&model));
}

#[test]
fn a_lost_machine_is_shown_as_lost() {
    let mut model = machine(&ROW);
    lose(&mut model, 0);
    insta::assert_snapshot!(screen(&model));
}

#[test]
fn a_state_not_understood_for_a_second_is_shown_as_unknown() {
    for (columns, lines) in SIZES {
        let known = |model: &Model| !screen_of(model, columns, lines).contains("state unknown");
        let began = Instant::now();
        let mut model = machine(&[]);
        // A newer firmware's state, and nothing else.
        tell(&mut model, 0, &["state=rest tool=away pos=1 speed_mm_s=2 windows=0 unseen_mm=0"]);
        model.turn(began);
        assert!(!known(&model) && screen_of(&model, columns, lines).contains("? tool"));
        tell(&mut model, 0, &[AT_WORK]);
        model.turn(began);
        model.turn(began + Duration::from_secs(1));
        assert!(known(&model));
        model.turn(began + Duration::from_millis(1001));
        assert!(!known(&model));
    }
    let mut model = rows(3);
    let began = Instant::now();
    model.turn(began);
    model.turn(began + Duration::from_secs(2));
    let drawn = screen_of(&model, 80, 24);
    assert!(drawn.contains("1 LOST 2 ?") && drawn.contains("row 2 ?       ?"), "{drawn}");
}

#[test]
fn a_restart_at_work_is_shown_until_the_machine_works_again() {
    let message = "restarted (brown_out) while at work: not weeded from here";
    let in_hold = "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=400";
    let mut model = machine(&ROW);
    model.take_ring();
    let restart = |while_at_work: Option<&str>| Happening::Started {
        greeting: "weeder 0.2.0, reset by brown_out, state hold".to_owned(),
        while_at_work: while_at_work.map(str::to_owned),
    };
    model.update(0, restart(Some("brown_out")));
    assert!(model.take_ring());
    for _ in 0..10 {
        model.update(0, Happening::Lost("the Uno was reset".to_owned()));
        model.update(0, restart(None));
        tell(&mut model, 0, &[in_hold]);
    }
    tell(&mut model, 0, &[IN_ALARM]);
    for (columns, lines) in [(90, 22), (60, 16)] {
        let drawn = screen_of(&model, columns, lines);
        assert!(drawn.contains(message), "{drawn}");
    }
    tell(&mut model, 0, &["state is=work"]);
    assert_eq!(model.rows[0].restarted, None);
}

#[test]
fn a_lost_machine_shows_no_present_values() {
    let mut model = machine_in_row(&[AT_WORK]);
    assert!(screen(&model).contains("██"));
    for (columns, lines) in SIZES {
        let drawn = screen_of(&model, columns, lines);
        assert!(drawn.contains("2.00 km/h") && drawn.contains("tool in"), "{drawn}");
    }
    lose(&mut model, 0);
    for (columns, lines) in SIZES {
        let drawn = screen_of(&model, columns, lines);
        assert!(drawn.contains("speed unknown") && !drawn.contains("km/h") && !drawn.contains('▲'), "{drawn}");
        assert!(!drawn.contains("██"), "{drawn}");
    }
    tell(&mut model, 0, &[AT_WORK]);
    assert!(screen(&model).contains("2.00 km/h"));
}

#[test]
fn a_list_of_examples_has_a_head() {
    let list = ["built_in 1 plant 12 200 8 90 255", "built_in 2 weed 12 20 8 9 25", "field 1 weed 3 4 5 6 7", "ok"];
    let model = machine(&[&list[..], &list[..]].concat());
    let lines: Vec<&String> = model.lines.iter().skip_while(|line| !line.starts_with("-- source")).collect();
    let heads = lines.iter().filter(|line| line.starts_with("-- source number class")).count();
    assert_eq!((heads, lines.len()), (2, 10), "{lines:?}");
    assert_eq!(lines[1], list[0]);
}

#[test]
fn numbers_that_no_machine_gives_are_drawn_as_far_as_they_go() {
    for number in [i32::MIN, i32::MAX] {
        let plant =
            format!("plant pos={number} votes=255 spacing={number} delay={number} hold={number} actuation={number}");
        let status =
            "state=work tool=in pos=0 speed_mm_s=0 windows=4294967295 unseen_mm=0".replace("=0", &format!("={number}"));
        let lines = [plant.as_str(), &status, &plant, "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=0"];
        let drawn = screen(&machine(&lines));
        assert!(drawn.contains("plant    255"), "{drawn}");
    }
}

#[test]
fn a_screen_too_small_for_all_of_it_is_drawn_as_far_as_it_goes() {
    let model = machine(&ROW);
    for (columns, lines) in [(1, 1), (3, 40), (80, 2), (10, 10)] {
        screen_of(&model, columns, lines);
    }
}

#[test]
fn the_drawing_follows_the_machine_s_settings() {
    let mut model = machine_in_row(&[AT_WORK]);
    let mut settings = Settings::new();
    settings.set(Setting::BeamToToolMm, 800).unwrap();
    let before = screen(&model);
    model.update(0, Happening::Settings(settings, Vec::new()));
    assert_ne!(screen(&model), before);
    model.update(0, Happening::Settings(Settings::new(), Vec::new()));
    assert_eq!(screen(&model), before);
}

/// A screen that shows all of a row, and a small one.
const SIZES: [(u16, u16); 2] = [(90, 22), (40, 10)];

/// A status of a row at work with keep-out zones, and one of a row in alarm.
const AT_WORK: &str = "state=work tool=in pos=2196 speed_mm_s=556 windows=1 unseen_mm=0";
const IN_ALARM: &str =
    "state=alarm code=2-2 name=encoder_channel_dead tool=out pos=2700 speed_mm_s=0 windows=0 unseen_mm=400";

/// A machine with this number of rows. The third row is in alarm, and the last one is lost.
fn rows(count: usize) -> Model {
    let mut model = Model::new((1..=count).map(|number| format!("row {number}")).collect());
    for row in 0..count {
        tell(&mut model, row, &[&ROW[..], &[if row == 2 { IN_ALARM } else { AT_WORK }]].concat());
    }
    if count > 1 {
        lose(&mut model, count - 1);
    }
    model
}

/// A HOLD to all. Every row has obeyed except the last, which is lost.
fn held(model: &mut Model) {
    let since = Instant::now();
    let count = model.rows.len();
    model.held(Hold::new(since, model.rows.iter().map(RowModel::is_there)));
    for row in 0..count - 1 {
        let what = What::Happened(Happening::Answered { number: 1, command: "hold".to_owned(), refusal: None });
        model.take(Heard { row, at: since + Duration::from_millis(20 + row as u64), what });
    }
}

#[test]
fn six_and_twelve_rows_are_seen_at_a_glance_on_screens_of_both_sizes() {
    for count in [6, 12] {
        for (columns, lines) in [(40, 10), (80, 24)] {
            let mut model = rows(count);
            insta::assert_snapshot!(format!("{count}_rows_{columns}x{lines}"), screen_of(&model, columns, lines));
            held(&mut model);
            insta::assert_snapshot!(format!("{count}_rows_held_{columns}x{lines}"), screen_of(&model, columns, lines));
        }
    }
}

#[test]
fn one_row_in_a_small_terminal_shows_state_alarm_and_hold_key() {
    let mut model = machine_in_row(&[AT_WORK]);
    insta::assert_snapshot!(screen_of(&model, 40, 10));
    insta::assert_snapshot!(screen_of(&model, 80, 24));
    model = machine_in_row(&[AT_WORK, IN_ALARM]);
    insta::assert_snapshot!(screen_of(&model, 40, 10));
    lose(&mut model, 0);
    insta::assert_snapshot!(screen_of(&model, 40, 10));
}

#[test]
fn every_screen_shows_the_hold_key_and_alarmed_or_lost_rows() {
    for count in 1..=24 {
        for (columns, lines) in [(40, 10), (40, 30), (57, 11), (80, 15), (80, 16), (80, 24), (200, 10), (120, 50)] {
            let mut model = rows(count);
            for _ in 0..=count {
                let drawn = screen_of(&model, columns, lines);
                assert!(drawn.contains("Esc HOLD"), "{count}: {drawn}");
                if count > 3 {
                    assert!(
                        drawn.contains("row 3") && drawn.contains("ALARM") && drawn.contains("2-2 encoder_chan"),
                        "{drawn}"
                    );
                    assert!(drawn.contains(&format!("row {count}")) && drawn.contains("LOST"), "{drawn}");
                }
                model.choose(true);
            }
        }
    }
}

#[test]
fn the_row_that_commands_go_to_is_chosen_and_its_answer_is_marked() {
    let mut model = rows(3);
    assert_eq!(model.target, None);
    model.choose(true);
    model.choose(true);
    assert_eq!(model.target, Some(1));
    model.sent(model.target, "start");
    assert!(screen_of(&model, 80, 24).contains("row 2 work  ? in"), "{}", screen_of(&model, 80, 24));
    let refusal = Some("error: alarm latched".to_owned());
    model.update(1, Happening::Answered { number: 1, command: "start".to_owned(), refusal });
    let drawn = screen_of(&model, 80, 24);
    for part in ["row 2 work  ! in", "row 2> ", "> row 2: start"] {
        assert!(drawn.contains(part), "{drawn}");
    }
    model.choose(false);
    model.choose(false);
    assert_eq!(model.target, None);
    model.choose(false);
    assert_eq!(model.target, Some(2));
}
