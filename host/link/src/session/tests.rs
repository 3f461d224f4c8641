//! Sessions with a firmware that may be silent, say something by itself, or be unplugged.

use super::*;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::{Rig, ScriptedPort};
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// The machine's unrequested output, sent before its next answer.
type Says = Rc<RefCell<Vec<u8>>>;

/// A link to a new machine in HOLD. The test can unplug it, and set its unrequested output. It does not answer
/// `silence`, and accepts every change of its examples.
fn open(plugged_in: &Rc<Cell<bool>>, says: &Says) -> Result<Link, LinkError> {
    if !plugged_in.get() {
        return Err(LinkError::Absent("it".to_owned()));
    }
    let (plugged_in, says) = (Rc::clone(plugged_in), Rc::clone(says));
    let mut rig = Rig::new(Nearest::new(&[][..], Volatile::new()));
    let mut answer = move |line: &str| match line.split(' ').next() {
        Some("" | "silence") => Vec::new(),
        Some("label" | "teach" | "forget") => b"ok\n".to_vec(),
        _ => {
            // The save before it is complete.
            while !rig.carry_on() {}
            (rig.ask(line).join("\n") + "\n").into_bytes()
        }
    };
    let script = move |line: Option<&str>| {
        plugged_in.get().then(|| line.map_or_else(|| std::mem::take(&mut *says.borrow_mut()), &mut answer))
    };
    Link::over(ScriptedPort::new(script), false)
}

/// A session, the plug, and the machine's mouth.
fn session() -> (Session, Rc<Cell<bool>>, Says) {
    let (plugged_in, says) = (Rc::new(Cell::new(true)), Says::default());
    let (plug, mouth) = (Rc::clone(&plugged_in), Rc::clone(&says));
    (Session::open(move || open(&plug, &mouth)).unwrap(), plugged_in, says)
}

/// The events of one second, without statuses.
fn second(session: &mut Session, from: Instant) -> Vec<Happening> {
    let turns = (0..50).map(|turn| from + Duration::from_millis(20 * turn));
    let happened = turns.flat_map(|now| session.turn(now)).collect::<Vec<_>>();
    happened.into_iter().filter(|happening| !matches!(happening, Happening::Status(..))).collect()
}

#[test]
fn commands_are_answered_one_after_the_other_beside_the_status() {
    let (mut session, _, _) = session();
    let now = Instant::now();
    assert!(matches!(session.turn(now).as_slice(), [Happening::Connected { .. }, Happening::Status(..)]));
    assert!(session.command("hold") && session.command("hepl") && !session.is_idle());
    let expected = [
        Happening::Command("hold".to_owned()),
        Happening::Answer("ok".to_owned()),
        Happening::Command("hepl".to_owned()),
        Happening::Answer("error: no such command, help lists them all".to_owned()),
    ];
    assert_eq!(second(&mut session, now), expected);
    assert!(session.is_idle());
    assert!(!session.command("two\nlines"));
}

#[test]
fn events_are_reported_during_every_answer() {
    let (mut session, _, says) = session();
    let now = Instant::now();
    second(&mut session, now);
    says.borrow_mut().extend(b"swing tool=out pos=9\r\n\xFF\xFE junk\r\n");
    let event = Happening::Event(EventLine::Swing { out: true, position: 9 }, "swing tool=out pos=9".to_owned());
    assert_eq!(second(&mut session, now + Duration::from_secs(1)), [event]);
}

#[test]
fn settings_are_asked_for_again_after_every_change() {
    let (mut session, _, says) = session();
    let mut now = Instant::now();
    second(&mut session, now);
    for (command, wheel_mm) in [("set wheel_mm 405", 405), ("save", 405), ("defaults", 400), ("revert", 405)] {
        now += Duration::from_secs(1);
        assert!(session.command(command));
        let happened = second(&mut session, now);
        let Some(Happening::Settings(settings, shown)) = happened.last() else { panic!("{command}: {happened:?}") };
        assert_eq!(settings.get(settings::Setting::WheelMm), wheel_mm, "{command}");
        let line = format!("wheel_mm={wheel_mm} mm ");
        assert!(shown.iter().any(|shown| shown.starts_with(&line)), "{shown:?}");
    }
    says.borrow_mut().extend(b"calibrated lead_out_ms=150 lead_in_ms=40 set=yes\r\n");
    let happened = second(&mut session, now + Duration::from_secs(1));
    assert!(matches!(happened.as_slice(), [Happening::Event(..), Happening::Settings(..)]), "{happened:?}");
    assert!(session.command("set wheel_mm 9"));
    let happened = second(&mut session, now + Duration::from_secs(2));
    assert!(matches!(happened.as_slice(), [Happening::Command(_), Happening::Answer(_)]), "{happened:?}");
}

#[test]
fn examples_are_asked_for_again_behind_a_command_that_changes_them() {
    let (mut session, _, _) = session();
    let mut now = Instant::now();
    second(&mut session, now);
    for command in ["label plant", "label weed force", "teach plant", "forget 3", "forget all"] {
        now += Duration::from_secs(1);
        assert!(session.command(command));
        let happened = second(&mut session, now);
        assert!(matches!(happened.last(), Some(Happening::Examples(_))), "{command}");
    }
}

#[test]
fn hold_drops_nothing_that_the_session_asks_for_itself() {
    let (mut session, _, _) = session();
    let now = Instant::now();
    second(&mut session, now);
    assert!(session.command("set wheel_mm 405"));
    session.turn_events_on();
    assert_eq!(session.turn(now + Duration::from_secs(1)), [Happening::Command("set wheel_mm 405".to_owned())]);
    session.hold();
    let happened = second(&mut session, now + Duration::from_secs(2));
    let ok = Happening::Answer("ok".to_owned());
    let held = [ok.clone(), Happening::Command("hold".to_owned()), ok];
    assert!(
        matches!(happened.split_last(), Some((Happening::Settings(..), before)) if *before == held),
        "{happened:?}"
    );
}

#[test]
fn noise_between_the_lines_does_not_end_a_session() {
    let (mut session, _, says) = session();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    let mut now = Instant::now();
    second(&mut session, now);
    for _ in 0..10 {
        let mut noise = vec![0; 10_000];
        random.fill_bytes(&mut noise);
        says.borrow_mut().extend(noise);
        says.borrow_mut().extend(b"\r\nplant pos=99999999999 votes=-1\r\nstate=hold\r\nswing\r\n=\r\n:\r\n");
        assert!(session.command("hold"));
        for _ in 0..3 {
            now += Duration::from_secs(1);
            let happened = second(&mut session, now);
            assert!(!happened.iter().any(|happening| matches!(happening, Happening::Lost(_))), "{happened:?}");
        }
        assert!(session.is_idle() && session.is_connected());
    }
}

#[test]
fn an_uno_that_is_unplugged_is_lost_and_found_again() {
    let (mut session, plugged_in, _) = session();
    let now = Instant::now();
    second(&mut session, now);
    plugged_in.set(false);
    let lost = second(&mut session, now + Duration::from_secs(1));
    assert!(matches!(lost.as_slice(), [Happening::Lost(why)] if why.contains("plug the Uno in again")), "{lost:?}");
    assert!(!session.is_connected());
    assert_eq!(second(&mut session, now + Duration::from_secs(5)), []);
    plugged_in.set(true);
    let found = second(&mut session, now + Duration::from_secs(10));
    assert!(matches!(found.as_slice(), [Happening::Connected { .. }]), "{found:?}");
}

#[test]
fn an_uno_that_is_reset_is_asked_for_everything_again() {
    let (mut session, _, says) = session();
    let now = Instant::now();
    second(&mut session, now);
    says.borrow_mut().extend(b"weeder 0.2.0, reset by brown_out, state hold, tool out; help lists the commands\r\n");
    let happened = second(&mut session, now + Duration::from_secs(1));
    assert!(matches!(happened.as_slice(), [Happening::Lost(_), Happening::Connected { .. }]), "{happened:?}");
}

#[test]
fn an_answer_that_does_not_come_is_given_up() {
    let (mut session, _, _) = session();
    let now = Instant::now();
    second(&mut session, now);
    assert!(session.command("silence"));
    let mut happened = Vec::new();
    for seconds in 1..5 {
        happened.extend(second(&mut session, now + Duration::from_secs(seconds)));
    }
    assert!(happened.iter().any(|happening| matches!(happening, Happening::Lost(_))), "{happened:?}");
    assert!(session.is_idle());
}

#[test]
fn hold_is_typed_at_once_and_waiting_commands_are_dropped() {
    let (mut session, _, says) = session();
    let now = Instant::now();
    second(&mut session, now);
    // One command that is being answered, and two that wait.
    assert!(session.command("silence"));
    session.turn(now + Duration::from_secs(1));
    assert!(session.command("start") && session.command("start now"));
    assert_eq!(session.hold(), 2);
    assert!(!session.is_idle());
    let now = now + Duration::from_secs(1);
    assert_eq!(session.turn(now), [Happening::Command("hold".to_owned())]);
    // The first answer belongs to the first hold. A second hold is not typed.
    let ok = Happening::Answer("ok".to_owned());
    assert_eq!(session.hold(), 0);
    assert_eq!(session.turn(now), std::slice::from_ref(&ok));
    says.borrow_mut().extend(b"ok\r\n");
    assert_eq!(second(&mut session, now), [ok]);
    assert!(session.is_idle());
}

#[test]
fn commands_typed_before_a_reset_are_not_executed_after_it() {
    let (mut session, _, says) = session();
    let now = Instant::now();
    second(&mut session, now);
    assert!(session.command("silence"));
    session.turn(now + Duration::from_secs(1));
    assert!(session.command("start"));
    session.hold();
    assert!(session.command("start"));
    says.borrow_mut().extend(b"weeder 0.2.0, reset by brown_out, state hold, tool out; help lists the commands\r\n");
    let happened = second(&mut session, now + Duration::from_secs(1));
    assert!(matches!(happened.as_slice(), [Happening::Lost(_), Happening::Connected { .. }]), "{happened:?}");
    assert!(session.is_idle());
}

#[test]
fn a_session_without_an_uno_says_why_once_and_finds_it_later() {
    let plugged_in = Rc::new(Cell::new(false));
    let plug = Rc::clone(&plugged_in);
    let mut session = Session::waiting_for(move || open(&plug, &Says::default()));
    let now = Instant::now();
    let lost = second(&mut session, now);
    assert!(matches!(lost.as_slice(), [Happening::Lost(why)] if why.starts_with("there is no port it")), "{lost:?}");
    assert_eq!(second(&mut session, now + Duration::from_secs(5)), []);
    plugged_in.set(true);
    let found = second(&mut session, now + Duration::from_secs(10));
    assert!(matches!(found.as_slice(), [Happening::Connected { .. }]), "{found:?}");
}
