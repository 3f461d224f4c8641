//! A link at ports that answer by a script: valid, silent and noisy ones.

use super::*;
use crate::examples::ExamplesError;
use crate::settings::Settings;
use control::ground::class::label;
use control::ground::examples::EXAMPLES;
use control::ground::features::Features;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use rig::{Rig, ScriptedPort};
use std::assert_matches;
use std::cell::RefCell;
use std::rc::Rc;

const VERSION: &[u8] = b"weeder 0.2.0\r\nok\r\n";

fn over(resets: bool, mut answer: impl FnMut(&str) -> Vec<u8> + 'static) -> Result<Link, LinkError> {
    let script = move |line: Option<&str>| Some(line.map_or_else(Vec::new, &mut answer));
    Link::over(Wire::over(ScriptedPort::new(script), resets))
}

/// A link to a firmware that answers `version` correctly, and everything else by `answer`.
fn link(mut answer: impl FnMut(&str) -> Vec<u8> + 'static) -> Link {
    let answer = move |line: &str| match line {
        "" => Vec::new(),
        "version" => VERSION.to_vec(),
        line => answer(line),
    };
    over(false, answer).expect("the firmware answers")
}

#[test]
fn the_greeting_after_a_reset_is_waited_for_and_the_version_asked() {
    let mut greeting =
        &b"\0\x1Bgarbage\r\nweeder 0.2.0, reset by power, state hold, tool out; help lists the commands\r\n"[..];
    let script = move |line: Option<&str>| match line {
        None => Some(std::mem::take(&mut greeting).to_vec()),
        Some("") => Some(Vec::new()),
        Some(_) => Some(VERSION.to_vec()),
    };
    let link = Link::over(Wire::over(ScriptedPort::new(script), true)).unwrap();
    assert_eq!(link.version(), "0.2.0");
}

#[test]
fn an_uno_that_starts_while_it_is_asked_is_asked_again() {
    let (mut machine, mut lines) = (machine(), 0);
    let answer = move |line: &str| {
        lines += 1;
        let greeting = b"weeder 0.2.0, reset by button, state hold\r\n".to_vec();
        if lines <= 2 { greeting } else { machine(line) }
    };
    let link = over(false, answer).unwrap();
    assert!(link.version().starts_with(env!("CARGO_PKG_VERSION")), "{}", link.version());
}

#[test]
fn an_answer_that_comes_late_and_slowly_belongs_to_its_own_question() {
    const SILENT_READS_BETWEEN_LINES: usize = 15;
    let mut machine = machine();
    // The Uno starts after the first questions are typed, and then answers them.
    let mut to_send = b"weeder 0.2.0, reset by external, state hold\r\n".to_vec();
    let mut reads = 0;
    let port = ScriptedPort::new(move |line: Option<&str>| {
        match line {
            Some("") => {}
            Some(line) => to_send.extend(machine(line)),
            None => reads += 1,
        }
        let is_due = line.is_none() && reads % SILENT_READS_BETWEEN_LINES == 0;
        let end = to_send.iter().position(|&byte| byte == b'\n').filter(|_| is_due);
        Some(to_send.drain(..end.map_or(0, |end| end + 1)).collect())
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
            [cut.as_bytes(), &machine(line)].concat()
        };
        let link = over(false, answer);
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
fn silence_noise_and_another_firmware_are_given_up() {
    let noise: Vec<u8> = (0..=255).filter(|&byte| byte != b'\n' && byte != b'\r').cycle().take(60_000).collect();
    for (resets, answer, problem) in [
        (true, Vec::new(), "nothing answers at this port"),
        (false, noise, "this port sends no text"),
        (true, b"$GPGGA,123519,4807.038,N\r\n".to_vec(), "not the weeder's firmware that answers, but \"$GPGGA,"),
        (false, b"Grbl 1.1h\r\nok\r\n".to_vec(), "not the weeder's firmware that answers, but \"Grbl 1.1h\""),
    ] {
        let error = over(resets, move |_| answer.clone()).err().unwrap().to_string();
        assert!(error.contains(problem), "{error}");
    }
}

#[test]
fn text_without_an_end_is_given_up_and_only_its_end_is_shown() {
    let mut link = link(|_| b"all work and no play\r\n".repeat(5000));
    let error = link.ask("status").unwrap_err().to_string();
    assert!(error.contains("the answer to `status` has no end") && error.len() < 600, "{error}");
}

#[test]
fn a_reset_while_it_is_asked_is_an_error() {
    let mut link = link(|_| b"weeder 0.2.0, reset by brown_out, state hold\r\nok\r\n".to_vec());
    assert_matches!(link.ask("save"), Err(LinkError::Restarted(command)) if command == "save");
}

#[test]
fn a_command_that_would_be_two_lines_or_no_text_is_not_typed() {
    let mut link = link(|line| panic!("`{line}` was typed"));
    for command in ["hold\nstart now", "h\u{00E4}lt", &"x".repeat(COMMAND_LENGTH + 1)] {
        assert_matches!(link.send(command), Err(LinkError::NoCommand(_)));
    }
}

#[test]
fn a_port_that_goes_away_says_so() {
    let error = Link::over(Wire::over(ScriptedPort::new(|_: Option<&str>| None), false)).err().unwrap();
    assert_eq!(error.to_string(), "the port is gone: plug the Uno in again");
}

/// The firmware's decisions in HOLD, with its built-in examples, which answer a line.
fn machine() -> impl FnMut(&str) -> Vec<u8> {
    let mut rig = Rig::new(Nearest::new(&EXAMPLES[..], Volatile::new()));
    move |line| (rig.ask(line).join("\r\n") + "\r\n").into_bytes()
}

fn link_to_machine(typed: &[&str]) -> Link {
    let mut machine = machine();
    typed.iter().for_each(|line| drop(machine(line)));
    over(false, machine).expect("the firmware answers")
}

#[test]
fn examples_are_taught_after_features_of_an_earlier_command() {
    let wanted = [examples::example_of(&Features::describe(278, 250, 20), label::PLANT)];
    for left in 0..=6 {
        let mut link = link_to_machine(&vec!["teach 7"; left]);
        let pushed = examples::push(&mut link, &wanted, false).expect("it is taught");
        assert_eq!((pushed.taught, pushed.forgotten), (1, 0), "{left}");
        assert_eq!(examples::read(&mut link).expect("it lists them").taught, [(0, wanted[0])], "{left}");
    }
}

#[test]
fn a_machine_at_work_is_not_taught_and_forgets_nothing() {
    let [one, other] = [20, 24].map(|width| examples::example_of(&Features::describe(278, 250, width), label::PLANT));
    let mut link = link_to_machine(&[]);
    examples::push(&mut link, &[one], false).expect("it is in HOLD");
    link.ask("start").expect("it goes to work");
    assert_matches!(examples::push(&mut link, &[other], true), Err(ExamplesError::AtWork));
    assert_eq!(examples::read(&mut link).expect("it lists them").taught, [(0, one)]);
}

#[test]
fn each_of_equal_examples_is_taught_and_forgotten() {
    let one = examples::example_of(&Features::describe(278, 250, 20), label::PLANT);
    let mut link = link_to_machine(&[]);
    for (wanted, taught, forgotten) in [(1, 1, 0), (3, 2, 0), (2, 0, 1)] {
        let pushed = examples::push(&mut link, &vec![one; wanted], true).expect("it is in HOLD");
        assert_eq!((pushed.taught, pushed.forgotten), (taught, forgotten), "{wanted}");
        assert_eq!(examples::read(&mut link).expect("it lists them").taught.len(), wanted);
    }
}

#[test]
fn invalid_examples_are_counted() {
    for (answer, spoiled) in [("spoiled=0", 0), ("spoiled=3", 3)] {
        let mut machine = machine();
        let mut link = link(move |line| {
            String::from_utf8(machine(line)).expect("it is text").replace("spoiled=0", answer).into_bytes()
        });
        assert_eq!(examples::read(&mut link).expect("it lists them").spoiled, spoiled);
    }
}

#[test]
fn a_machine_that_has_more_examples_than_this_program_allows_has_no_room() {
    let [known, wanted] =
        [24, 20].map(|width| examples::example_of(&Features::describe(278, 250, width), label::PLANT));
    let known = format!("field 0 plant {}\r\n", known.features.map(|feature| feature.to_string()).join(" "));
    let mut machine = machine();
    let mut link = link(move |line| {
        let more = if line == "examples" { known.repeat(40) } else { String::new() };
        [more.as_bytes(), &machine(line)].concat()
    });
    assert_matches!(examples::push(&mut link, &[wanted], false), Err(ExamplesError::NoRoom { new: 1, free: 0 }));
}

#[test]
fn a_merge_gap_in_ticks_is_pushed_to_old_and_new_machines() {
    let file = tempfile::NamedTempFile::new().unwrap();
    for (is_old, ticks, changed) in
        [(true, 40, None), (true, 41, Some("merge_gap_ticks")), (false, 40, None), (false, 60, Some("merge_gap_mm"))]
    {
        std::fs::write(file.path(), format!("merge_gap_ticks = {ticks}\n")).unwrap();
        let named = settings_file::read(file.path()).unwrap();
        let mut machine = machine();
        let mut link = link(move |line| {
            let own =
                if is_old { line.replace("set merge_gap_ticks 41", "set merge_gap_mm 22") } else { line.to_owned() };
            let answer = String::from_utf8(machine(&own)).unwrap();
            let lines = answer.lines().map(|line| match line.strip_prefix("merge_gap_mm=") {
                Some(rest) if is_old => {
                    let ticks = if rest.starts_with("22") { 41 } else { 40 };
                    format!("merge_gap_ticks={ticks} ticks from 0 to 2000, default 40\r\n")
                }
                _ => format!("{line}\r\n"),
            });
            lines.collect::<String>().into_bytes()
        });
        let pushed = settings::push(&mut link, &named.settings, &named.foreign, false).unwrap();
        assert_eq!(pushed, changed.into_iter().collect::<Vec<_>>(), "{is_old} {ticks}");
    }
}

/// A line to a machine that once loses the byte of this number, of those that it types or of its answers.
fn damaged(there: Rc<RefCell<impl FnMut(&str) -> Vec<u8> + 'static>>, lost: usize, of_answers: bool) -> Link {
    let mut passed = 0;
    let mut lose = move |mut bytes: Vec<u8>| {
        let at = lost.wrapping_sub(passed);
        passed += bytes.len();
        if at < bytes.len() {
            bytes.remove(at);
        }
        bytes
    };
    link(move |line| {
        if of_answers {
            return lose(there.borrow_mut()(line));
        }
        let line = String::from_utf8(lose(line.as_bytes().to_vec())).expect("it is text");
        there.borrow_mut()(&line)
    })
}

#[test]
fn no_lost_byte_makes_settings_or_examples_wrong_that_are_said_to_be_right() {
    let example = |width| examples::example_of(&Features::describe(278, 250, width), label::PLANT);
    let (before, wanted) = ([example(20), example(24)], [example(24), example(28)]);
    for (bytes, step, of_answers) in [(160, 1, false), (20_000, 13, true)] {
        for lost in (0..bytes).step_by(step) {
            let machine = Rc::new(RefCell::new(machine()));
            let mut link = damaged(Rc::clone(&machine), lost, of_answers);
            for line in before.iter().flat_map(examples::lines) {
                machine.borrow_mut()(&line);
            }
            if let Ok(settings) = settings::read(&mut link) {
                assert_eq!(settings, Settings::default(), "{lost}");
            }
            if let Ok(read) = examples::read(&mut link) {
                assert_eq!(read.taught, [(0, before[0]), (1, before[1])], "{lost}");
            }
            if examples::push(&mut link, &wanted, true).is_ok() {
                let said = String::from_utf8(machine.borrow_mut()("examples")).expect("it is text");
                let taught = said.lines().filter_map(examples::taught).filter(|(from_field, ..)| *from_field);
                let taught: Vec<_> = taught.map(|(_, _, example)| example).collect();
                assert!(wanted.iter().all(|one| taught.contains(one)) && taught.len() == 2, "{lost}: {taught:?}");
            }
        }
    }
}

#[test]
fn a_value_out_of_range_is_found_before_anything_is_sent() {
    let mut machine = machine();
    let mut link = link(move |line| {
        assert!(!line.starts_with("set "), "`{line}` was typed");
        String::from_utf8(machine(line)).expect("it is text").replace("from 1 to 15", "from 1 to 9").into_bytes()
    });
    let wanted = [(settings::Setting::MarginMm, 20), (settings::Setting::K, 15)];
    let error = settings::push(&mut link, &wanted, &[], false).unwrap_err().to_string();
    assert_eq!(error, "the machine takes k from 1 to 9; nothing was sent");
}

#[test]
fn an_error_between_two_settings_says_that_the_first_may_be_set() {
    let wanted = [(settings::Setting::WheelMm, 500), (settings::Setting::MarginMm, 20)];
    for (wanted, is_by_half) in [(&wanted[..], true), (&wanted[1..], false)] {
        let mut machine = machine();
        let mut link = link(move |line| match line {
            "set margin_mm 20" => b"error: noise\r\n".to_vec(),
            line => machine(line),
        });
        let error = settings::push(&mut link, wanted, &[], true).unwrap_err().to_string();
        assert!(error.starts_with("the firmware answers `set margin_mm 20` with `error: noise`"), "{error}");
        assert_eq!(error.ends_with("not saved: `revert` takes them back"), is_by_half, "{error}");
    }
}
