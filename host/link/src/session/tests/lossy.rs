//! A session with the firmware's decisions over a line that loses a byte.

use super::*;
use crate::SURE_TRIES;
use crate::settings::Setting;
use control::ground::examples::EXAMPLES;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use control::operate::state::State as Operating;
use rig::{ByExamples, Rig};

/// Time between two turns.
const TURN: Duration = Duration::from_millis(20);

/// Turns until the session is connected.
const CONNECTED: usize = 50;

/// A machine at work and a session with it, after some turns. The session does something behind its connection, and the
/// line loses this byte of what follows. Returns what has happened since.
fn talk(
    turns: usize,
    lost: usize,
    of_answers: bool,
    mut act: impl FnMut(&mut Session, usize, &Rig<ByExamples>),
) -> (Rig<ByExamples>, Vec<Happening>) {
    let mut rig = Rig::new(Nearest::new(&EXAMPLES[..], Volatile::new()));
    assert_eq!(rig.ask("start now"), ["ok"]);
    let (mut session, mut now, mut received) = (Session::default(), Moment::default(), Vec::new());
    let (mut passed, mut happened) = (0, Vec::new());
    session.open(false);
    for turn in 0..CONNECTED + turns {
        let is_behind = turn >= CONNECTED;
        if is_behind {
            assert!(turn > CONNECTED || session.is_connected());
            act(&mut session, turn - CONNECTED, &rig);
        }
        now = now.after(TURN);
        let mut turn = session.turn(now, &received);
        let mut lose = |bytes: &mut Vec<u8>| {
            let at = lost.wrapping_sub(passed);
            if is_behind {
                passed += bytes.len();
                (at < bytes.len()).then(|| bytes.remove(at));
            }
        };
        if !of_answers {
            lose(&mut turn.to_send);
        }
        received = rig.type_in(turn.to_send).iter().flat_map(|line| format!("{line}\r\n").into_bytes()).collect();
        if of_answers {
            lose(&mut received);
        }
        happened.extend(turn.happened.into_iter().filter(|_| is_behind));
    }
    (rig, happened)
}

/// The ends of commands that begin so.
fn ends<'a>(happened: &'a [Happening], begins: &str) -> Vec<&'a Happening> {
    let is_end = |one: &&Happening| match one {
        Happening::Answered { command, .. } | Happening::Unanswered { command, .. } => command.starts_with(begins),
        _ => false,
    };
    happened.iter().filter(is_end).collect()
}

/// The first bytes after a moment, typed or answered.
fn bytes() -> impl Iterator<Item = (usize, bool)> {
    (0..200).flat_map(|lost| [(lost, false), (lost, true)])
}

#[test]
fn a_hold_comes_through_whichever_byte_is_lost() {
    for (lost, of_answers) in bytes() {
        let (_, happened) = talk(50, lost, of_answers, |session, turn, rig| match turn {
            0 => assert!(session.command("start now", Moment::NEVER).is_some()),
            1 => drop(session.hold()),
            26 => assert_eq!(rig.state(), Operating::Hold, "{lost} {of_answers}"),
            _ => {}
        });
        let ends = ends(&happened, HOLD);
        assert!(matches!(ends[..], [Happening::Answered { refusal: None, .. }]), "{lost} {of_answers}: {ends:?}");
    }
}

#[test]
fn a_set_that_is_answered_ok_has_set_this_whichever_byte_is_lost() {
    let mut is_ok = 0;
    // The settings that are read behind it are longer.
    for (lost, of_answers) in bytes().chain((200..3000).step_by(13).map(|lost| (lost, true))) {
        let (rig, happened) = talk(250, lost, of_answers, |session, turn, _| {
            if turn == 1 {
                session.command("set k 15", Moment::NEVER).unwrap();
            }
        });
        let k = rig.settings().get(Setting::K);
        // The last settings that the session tells are the machine's.
        let told = happened.iter().rev().find_map(|one| match one {
            Happening::Settings(settings, _) | Happening::Connected { settings, .. } => Some(settings.get(Setting::K)),
            _ => None,
        });
        match ends(&happened, "set")[..] {
            [Happening::Answered { refusal: None, .. }] => {
                assert_eq!((k, told), (15, Some(15)), "{lost} {of_answers}");
                is_ok += 1;
            }
            // A refused one has changed nothing.
            [Happening::Answered { .. }] => assert_eq!((k, told), (3, None), "{lost} {of_answers}"),
            [Happening::Unanswered { .. }] => assert_eq!(told, Some(k), "{lost} {of_answers}"),
            ref ends => panic!("{lost} {of_answers}: {ends:?}"),
        }
    }
    assert!(is_ok > 350, "{is_ok}");
}

/// A session over a line that makes `wrong` of `line`, the first times that it is typed. Returns what is typed behind the
/// connection, with a `hold` in the turn of this number, and what has happened.
fn changed(line: &str, wrong: &str, times: usize, hold: Option<usize>) -> (String, Vec<Happening>) {
    let mut rig = Rig::new(Nearest::new(&EXAMPLES[..], Volatile::new()));
    let (mut session, mut now, mut received) = (Session::default(), Moment::default(), String::new());
    let (mut typed, mut happened) = (String::new(), Vec::new());
    session.open(false);
    for turn in 0..200 {
        if turn == CONNECTED {
            session.command(line, Moment::NEVER).unwrap();
            typed.clear();
        }
        if Some(turn) == hold.map(|after| CONNECTED + after) {
            session.hold();
        }
        now = now.after(TURN);
        let turn = session.turn(now, received.as_bytes());
        happened.extend(turn.happened);
        let sent = String::from_utf8(turn.to_send).unwrap();
        typed += &sent;
        let damaged = if typed.matches(line).count() <= times { sent.replace(line, wrong) } else { sent };
        received = rig.type_in(damaged.into_bytes()).join("\r\n") + "\r\n";
    }
    (typed, happened)
}

/// The lines of the answers to commands.
fn answers(happened: &[Happening]) -> Vec<&str> {
    happened
        .iter()
        .filter_map(|one| if let Happening::Answer(line) = one { Some(line.as_str()) } else { None })
        .collect()
}

#[test]
fn a_set_that_noise_changes_each_time_is_refused() {
    let (typed, happened) = changed("set k 15", "set k 1", usize::MAX, None);
    assert!(matches!(ends(&happened, "set")[..], [Happening::Answered { refusal: Some(_), .. }]), "{happened:?}");
    assert!(matches!(answers(&happened)[..], [said] if said.starts_with("error: noise")), "{happened:?}");
    assert_eq!(typed.matches("set k 15").count(), 1 + SURE_TRIES);
    // The machine's own reason is told, if it has one.
    let (_, happened) = changed("set beam_to_tool_mm 100", "set beam_to_tool_mm 1000", 1, None);
    assert!(matches!(answers(&happened)[..], [said] if said.contains("beam_to_tool_mm")), "{happened:?}");
}

#[test]
fn nothing_is_set_behind_a_hold() {
    for after in 0..20 {
        let (typed, happened) = changed("set k 15", "set k 1", usize::MAX, Some(after));
        let (_, behind) = typed.split_once("hold\n").unwrap();
        assert!(!behind.contains("set"), "{after}: {typed}");
        let [set, hold] = [ends(&happened, "set"), ends(&happened, HOLD)];
        let is_answered = matches!(hold[..], [Happening::Answered { refusal: None, .. }]);
        assert!(is_answered && set.len() == 1, "{after}: {happened:?}");
        // The answers come in the order of the commands. A log pairs them by that order.
        assert!(answers(&happened).last() == Some(&"ok"), "{after}: {happened:?}");
    }
}
