//! A link at ports that answer by a script: valid, silent and noisy ones.

use super::*;
use crate::examples::ExamplesError;
use control::ground::class::label;
use control::ground::examples::EXAMPLES;
use control::ground::features::Features;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use rig::{Rig, ScriptedPort};
use std::cell::RefCell;

/// A port that sends `greeting` before the first line, and answers each line by `answer`.
fn script(greeting: &str, mut answer: impl FnMut(&str) -> Vec<u8>) -> impl Port {
    let mut greeting = greeting.as_bytes().to_vec();
    ScriptedPort::new(move |line: Option<&str>| Some(line.map_or_else(|| std::mem::take(&mut greeting), &mut answer)))
}

/// A link to a firmware that answers `version` correctly, and everything else by `answer`.
fn link(answer: impl Fn(&str) -> Vec<u8> + 'static) -> Link {
    let answer = move |line: &str| match line {
        "" => Vec::new(),
        "version" => b"weeder 0.2.0\r\nok\r\n".to_vec(),
        line => answer(line),
    };
    Link::over(Wire::over(script("", answer), false)).expect("the firmware answers")
}

#[test]
fn the_greeting_after_a_reset_is_waited_for_and_the_version_asked() {
    let answer = |line: &str| if line.is_empty() { Vec::new() } else { b"weeder 0.2.0\r\nok\r\n".to_vec() };
    let greeting = "\0\x1Bgarbage\r\nweeder 0.2.0, reset by power, state hold, tool out; help lists the commands\r\n";
    let link = Link::over(Wire::over(script(greeting, answer), true)).unwrap();
    assert_eq!(link.version(), "0.2.0");
}

#[test]
fn an_uno_that_starts_while_it_is_asked_is_asked_again() {
    let (mut machine, mut lines) = (machine(), 0);
    let answer = move |line: &str| {
        lines += 1;
        let greeting = b"weeder 0.2.0, reset by button, state hold\r\n".to_vec();
        if lines <= 2 { greeting } else { (machine(line).join("\r\n") + "\r\n").into_bytes() }
    };
    let link = Link::over(Wire::over(script("", answer), false)).unwrap();
    assert!(link.version().starts_with(env!("CARGO_PKG_VERSION")), "{}", link.version());
}

#[test]
fn an_answer_that_comes_late_and_slowly_belongs_to_its_own_question() {
    const SILENT_READS_BETWEEN_LINES: usize = 15;
    let mut machine = machine();
    // The Uno starts after the first questions are typed, and then answers them.
    let mut lines = VecDeque::from(["weeder 0.2.0, reset by external, state hold".to_owned()]);
    let mut reads = 0;
    let port = ScriptedPort::new(move |line: Option<&str>| {
        match line {
            Some("") => {}
            Some(line) => lines.extend(machine(line)),
            None => reads += 1,
        }
        let is_due = line.is_none() && reads % SILENT_READS_BETWEEN_LINES == 0;
        let due = if is_due { lines.pop_front() } else { None };
        Some(due.map_or_else(Vec::new, |line| format!("{line}\r\n").into_bytes()))
    });
    let mut link = Link::over(Wire::over(port, false)).expect("the firmware answers");
    assert_eq!(settings::read(&mut link).expect("all are shown"), settings::Settings::new());
}

#[test]
fn a_line_that_is_cut_before_an_answer_is_no_other_firmware() {
    for cut in ["state=wo", "weeder 0.2.0, re", "plant pos=12 vot", "ok", "error: no su", "\0\u{1B}"] {
        let mut machine = machine();
        let mut asked = 0;
        let answer = move |line: &str| {
            asked += usize::from(line == "version");
            let cut = if asked == 1 && line == "version" { cut } else { "" };
            (cut.to_owned() + &machine(line).join("\r\n") + "\r\n").into_bytes()
        };
        let link = Link::over(Wire::over(script("", answer), false));
        assert!(link.is_ok(), "{cut}: {:?}", link.err());
    }
}

#[test]
fn events_before_an_answer_are_kept_and_do_not_belong_to_it() {
    let mut link = link(|_| b"swing tool=out pos=7\r\nstate=hold tool=out\r\nlost=0\r\nok\r\n".to_vec());
    assert_eq!(link.ask("status").unwrap(), ["state=hold tool=out", "lost=0"]);
    assert_eq!(link.next_line().unwrap().as_deref(), Some("swing tool=out pos=7"));
    assert_eq!(link.next_line().unwrap(), None);
}

#[test]
fn a_refusal_is_an_error_with_the_firmware_s_words() {
    let mut link = link(|_| b"error: no such command, help lists them all\r\n".to_vec());
    let error = link.ask("hepl").unwrap_err().to_string();
    assert_eq!(error, "the firmware answers `hepl` with `error: no such command, help lists them all`");
}

#[test]
fn a_port_at_which_nothing_answers_is_given_up() {
    let error = Link::over(Wire::over(script("", |_: &str| Vec::new()), true)).err().unwrap();
    assert!(error.to_string().contains("`weeder flash`"), "{error}");
}

#[test]
fn noise_without_an_end_is_given_up_as_noise() {
    let noise: Vec<u8> = (0..=255).filter(|&byte| byte != b'\n' && byte != b'\r').cycle().take(60_000).collect();
    let error = Link::over(Wire::over(script("", move |_: &str| noise.clone()), false)).err().unwrap();
    assert!(matches!(error, LinkError::Noise), "{error}");
}

#[test]
fn text_without_an_end_is_given_up_and_only_its_end_is_shown() {
    let mut link = link(|_| b"all work and no play\r\n".repeat(5000));
    let error = link.ask("status").unwrap_err().to_string();
    assert!(error.contains("the answer to `status` has no end") && error.len() < 600, "{error}");
}

#[test]
fn another_firmware_is_recognised() {
    let error = Link::over(Wire::over(script("", |_: &str| b"Grbl 1.1h\r\nok\r\n".to_vec()), false)).err().unwrap();
    assert!(error.to_string().contains("not the weeder's firmware that answers, but \"Grbl 1.1h\""), "{error}");
}

#[test]
fn a_reset_while_it_is_asked_is_an_error() {
    let mut link = link(|_| b"weeder 0.2.0, reset by brown_out, state hold\r\nok\r\n".to_vec());
    assert!(matches!(link.ask("save"), Err(LinkError::Restarted(command)) if command == "save"));
}

#[test]
fn a_command_that_would_be_two_lines_or_no_text_is_not_typed() {
    let mut link = link(|line| panic!("`{line}` was typed"));
    for command in ["hold\nstart now", "h\u{00E4}lt", &"x".repeat(COMMAND_LENGTH + 1)] {
        assert!(matches!(link.send(command), Err(LinkError::NoCommand(_))), "{command:?}");
    }
}

#[test]
fn a_port_that_goes_away_says_so() {
    let error = Link::over(Wire::over(ScriptedPort::new(|_: Option<&str>| None), false)).err().unwrap();
    assert_eq!(error.to_string(), "the port is gone: plug the Uno in again");
}

/// The firmware's decisions in HOLD, with its built-in examples, which answer a line.
fn machine() -> impl FnMut(&str) -> Vec<String> {
    let mut rig = Rig::new(Nearest::new(&EXAMPLES[..], Volatile::new()));
    move |line| rig.ask(line)
}

/// A link to the machine, after these typed lines.
fn link_to_machine(typed: &[&str]) -> Link {
    let machine = RefCell::new(machine());
    let answer = move |line: &str| (machine.borrow_mut()(line).join("\r\n") + "\r\n").into_bytes();
    typed.iter().for_each(|line| drop(answer(line)));
    link(answer)
}

#[test]
fn examples_are_taught_after_features_of_an_earlier_command() {
    let wanted = [examples::example_of(&Features::describe(278, 250, 20), label::PLANT)];
    for left in 0..=6 {
        let mut link = link_to_machine(&vec!["teach 7"; left]);
        let pushed = examples::push(&mut link, &wanted, false).expect("it is taught");
        assert_eq!((pushed.taught, pushed.forgotten), (1, 0), "{left}");
        assert_eq!(examples::read(&mut link).expect("it lists them"), [(0, wanted[0])], "{left}");
    }
}

#[test]
fn a_machine_at_work_is_not_taught_and_forgets_nothing() {
    let [one, other] = [20, 24].map(|width| examples::example_of(&Features::describe(278, 250, width), label::PLANT));
    let mut link = link_to_machine(&[]);
    examples::push(&mut link, &[one], false).expect("it is in HOLD");
    link.ask("start").expect("it goes to work");
    let refused = examples::push(&mut link, &[other], true);
    assert!(matches!(refused, Err(ExamplesError::AtWork)), "{refused:?}");
    assert_eq!(examples::read(&mut link).expect("it lists them"), [(0, one)]);
}
