//! Snapshots of the screen, from what happened to a machine.

use super::*;
use link::session::Happening;
use link::settings::Settings;
use link::{EventLine, Status};
use ratatui::Terminal;
use ratatui::backend::TestBackend;
use ratatui::crossterm::event::KeyCode;

/// The screen after all of this.
fn screen(model: &Model) -> String {
    let mut terminal = Terminal::new(TestBackend::new(90, 22)).unwrap();
    terminal.draw(|frame| draw(model, frame)).unwrap();
    terminal.backend().to_string()
}

/// A machine that told these lines since it was connected.
fn machine(lines: &[&str]) -> Model {
    let mut model = Model::new();
    let version = "0.1.0".to_owned();
    model.update(Happening::Connected { version, settings: Settings::new(), examples: Vec::new() });
    for line in lines {
        let line = (*line).to_owned();
        model.update(match (Status::parse(&line), EventLine::parse(&line)) {
            (Some(status), _) => Happening::Status(status, line),
            (None, Some(event)) => Happening::Event(event, line),
            (None, None) => Happening::Answer(line),
        });
    }
    model
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
fn windows_move_toward_the_tool() {
    let mut lines = ROW.to_vec();
    lines.push("state=work tool=in pos=2196 speed_mm_s=556 windows=1 unseen_mm=0");
    insta::assert_snapshot!(screen(&machine(&lines)));
    lines.push("state=work tool=out for=plant pos=2560 speed_mm_s=556 windows=1 unseen_mm=0");
    insta::assert_snapshot!(screen(&machine(&lines)));
}

#[test]
fn an_alarm_is_shown_with_what_to_do_until_it_is_cleared() {
    let mut lines = ROW.to_vec();
    lines.push("alarm name=beam_blocked code=11 pos=2700");
    lines.push("state is=alarm");
    lines.push("state=alarm alarm=beam_blocked tool=out pos=2700 speed_mm_s=0 windows=0 unseen_mm=400");
    insta::assert_snapshot!(screen(&machine(&lines)));
    lines.push("state=hold tool=out pos=2700 speed_mm_s=0 windows=0 unseen_mm=400");
    assert_eq!(machine(&lines).advice, None);
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
fn a_machine_that_is_gone_is_said_to_be() {
    let mut model = machine(&ROW);
    model.update(Happening::Lost("the port is gone: plug the Uno in again".to_owned()));
    insta::assert_snapshot!(screen(&model));
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
    for (width, height) in [(1, 1), (3, 40), (80, 2), (10, 10)] {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(&model, frame)).unwrap();
    }
}

#[test]
fn what_is_drawn_follows_the_machine_s_settings() {
    let mut lines = ROW.to_vec();
    lines.push("state=work tool=in pos=2196 speed_mm_s=556 windows=1 unseen_mm=0");
    let mut model = machine(&lines);
    let mut settings = Settings::new();
    settings.set(Setting::BeamToToolMm, 800).unwrap();
    let before = screen(&model);
    model.update(Happening::Settings(settings));
    assert_ne!(screen(&model), before);
    model.update(Happening::Settings(Settings::new()));
    assert_eq!(screen(&model), before);
}
