//! Sessions with a firmware that may be silent, say something by itself, or be unplugged.

mod lossy;
mod slow;

use super::*;
use crate::connection::Connection;
use crate::{Link, Wire};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rig::ScriptedBoard;
use std::assert_matches;
use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::Write;
use std::rc::Rc;

/// The answer to `status` in HOLD.
const IS_IN_HOLD: &str = "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=400\r\nok\r\n";

/// The greeting after a brown-out.
const RESTARTS: &[u8] = b"weeder 0.2.0, reset by brown_out, state hold, tool out; help lists the commands\r\n";

/// A connection to a board, at a time.
struct Talk {
    connection: Connection,
    board: ScriptedBoard,
    /// How often the port was opened.
    opened: Rc<Cell<usize>>,
    now: Moment,
}

impl Talk {
    fn waiting(board: ScriptedBoard) -> Self {
        let (port, opened) = (board.clone(), Rc::new(Cell::new(0)));
        let count = Rc::clone(&opened);
        let open = move || {
            count.set(count.get() + 1);
            Ok(Wire::over(port.open().ok_or(LinkError::Absent("it".to_owned()))?, false))
        };
        Self { connection: Connection::waiting_for(open), board, opened, now: Moment::default() }
    }

    /// A connection that has reported its machine.
    fn connected() -> Self {
        let mut talk = Self::waiting(ScriptedBoard::plugged_in());
        talk.second();
        assert!(talk.session().is_connected());
        talk
    }

    fn session(&mut self) -> &mut Session {
        &mut self.connection.session
    }

    /// Types a command with a deadline far ahead.
    fn command(&mut self, command: &str) -> bool {
        let deadline = self.now.after(Duration::from_secs(60));
        self.session().command(command, deadline).is_some()
    }

    /// The next turn's events, without the ends of answers.
    fn turn(&mut self) -> Vec<Happening> {
        let mut happened = self.connection.turn(|| self.now);
        happened.retain(|happening| !matches!(happening, Happening::Answered { .. }));
        happened
    }

    /// The events of the next second, without statuses.
    fn second(&mut self) -> Vec<Happening> {
        let mut happened = Vec::new();
        for _ in 0..50 {
            happened.extend(self.turn());
            self.now = self.now.after(Duration::from_millis(20));
        }
        happened.retain(|happening| !matches!(happening, Happening::Status(..)));
        happened
    }
}

fn typed(line: &str) -> Happening {
    Happening::Command(line.to_owned())
}

fn answered(line: &str) -> Happening {
    Happening::Answer(line.to_owned())
}

#[test]
fn commands_are_answered_one_after_the_other_beside_the_status() {
    let mut talk = Talk::waiting(ScriptedBoard::plugged_in());
    assert_matches!(talk.second().as_slice(), [Happening::Connected { .. }]);
    assert!(talk.command("hold") && talk.command("hepl") && !talk.session().is_idle());
    let unknown = answered("error: no such command, help lists them all");
    assert_eq!(talk.second(), [typed("hold"), answered("ok"), typed("hepl"), unknown]);
    assert!(talk.session().is_idle());
    assert!(!talk.command("two\nlines"));
}

#[test]
fn events_are_reported_during_every_answer() {
    let mut talk = Talk::connected();
    talk.board.say(b"swing tool=out pos=9\r\n\xFF\xFE junk\r\n");
    let event = Happening::Event(EventLine::Swing { out: true, position: 9 }, "swing tool=out pos=9".to_owned());
    assert_eq!(talk.second(), [event]);
}

#[test]
fn settings_are_asked_for_again_after_every_change() {
    let mut talk = Talk::connected();
    for (command, wheel_mm) in [("set wheel_mm 405", 405), ("save", 405), ("defaults", 400), ("revert", 405)] {
        assert!(talk.command(command));
        let happened = talk.second();
        let Some(Happening::Settings(settings, shown)) = happened.last() else { panic!("{command}: {happened:?}") };
        assert_eq!(settings.get(crate::settings::Setting::WheelMm), wheel_mm, "{command}");
        let line = format!("wheel_mm={wheel_mm} mm ");
        assert!(shown.iter().any(|shown| shown.starts_with(&line)), "{shown:?}");
    }
    talk.board.say(b"calibrated lead_out_ms=150 lead_in_ms=40 set=yes\r\n");
    assert_matches!(talk.second().as_slice(), [Happening::Event(..), Happening::Settings(..)]);
    assert!(talk.command("set wheel_mm 9"));
    assert_matches!(talk.second().as_slice(), [Happening::Command(_), Happening::Answer(_)]);
}

#[test]
fn examples_are_asked_for_again_behind_a_command_that_changes_them() {
    let mut talk = Talk::connected();
    for command in ["label plant", "label weed force", "teach plant", "forget 3", "forget all"] {
        assert!(talk.command(command));
        assert_matches!(talk.second().last(), Some(Happening::Examples(_)), "{command}");
    }
}

#[test]
fn hold_drops_nothing_that_the_session_asks_for_itself() {
    let mut talk = Talk::connected();
    assert!(talk.command("set wheel_mm 405"));
    assert_eq!(talk.turn().last(), Some(&typed("set wheel_mm 405")));
    talk.session().hold();
    // A set whose value was not read back is no success.
    let unread = answered("error: hold came before this was read back: `get` shows the value");
    let held = [unread, typed("hold"), answered("ok")];
    assert_matches!(talk.second().split_last(), Some((Happening::Settings(..), before)) if *before == held);
}

#[test]
fn a_session_that_needs_the_events_turns_them_on_again() {
    for keeps_events in [false, true] {
        let mut talk = Talk::connected();
        talk.session().keeps_events = keeps_events;
        assert!(talk.command("events off"));
        assert_eq!(talk.second(), [typed("events off"), answered("ok")]);
        let again: &[&str] = if keeps_events { &["events on"] } else { &[] };
        assert_eq!(talk.board.typed(), [&["events on", "events off"], again].concat());
    }
}

#[test]
fn noise_between_the_lines_does_not_end_a_session() {
    let mut talk = Talk::connected();
    let mut random = ChaCha8Rng::seed_from_u64(1);
    for _ in 0..10 {
        let mut noise = vec![0; 10_000];
        random.fill_bytes(&mut noise);
        talk.board.say(&noise);
        talk.board.say(b"\r\nplant pos=99999999999 votes=-1\r\nstate=hold\r\nswing\r\n=\r\n:\r\n");
        assert!(talk.command("hold"));
        for _ in 0..3 {
            let happened = talk.second();
            assert!(!happened.iter().any(|happening| matches!(happening, Happening::Lost(_))), "{happened:?}");
        }
        assert!(talk.session().is_idle() && talk.session().is_connected());
    }
}

#[test]
fn an_absent_uno_is_reported_lost_once_and_found_later() {
    let unplugged = Talk::connected();
    unplugged.board.plug(false);
    let absent = Talk::waiting(ScriptedBoard::default());
    for (mut talk, problem) in [(unplugged, "plug the Uno in again"), (absent, "there is no port it")] {
        assert_matches!(talk.second().as_slice(), [Happening::Lost(why)] if why.contains(problem));
        assert!(!talk.session().is_connected());
        assert_eq!(talk.second(), []);
        talk.board.plug(true);
        let found = [talk.second(), talk.second()].concat();
        assert_matches!(found.as_slice(), [Happening::Connected { .. }]);
    }
}

#[test]
fn an_answer_that_does_not_come_is_given_up_and_the_port_stays_open() {
    let mut talk = Talk::connected();
    assert!(talk.command("silence"));
    let happened: Vec<_> = (0..6).flat_map(|_| talk.second()).collect();
    let lost = happened.iter().position(|happening| matches!(happening, Happening::Lost(_)));
    let found = happened.iter().position(|happening| matches!(happening, Happening::Connected { .. }));
    assert!(lost.is_some() && lost < found, "{happened:?}");
    // Opening a real port resets its Uno, which may be at work.
    assert_eq!((talk.opened.get(), talk.session().is_idle()), (1, true));
}

#[test]
fn a_hold_that_waits_for_a_board_is_not_ended_at_each_try() {
    let mut talk = Talk::connected();
    talk.session().keeps_hold = true;
    talk.session().hold();
    talk.board.plug(false);
    let happened: Vec<_> = (0..5).flat_map(|_| talk.second()).collect();
    let ends = happened.iter().filter(|happening| matches!(happening, Happening::Unanswered { .. })).count();
    assert_eq!(ends, 1, "{happened:?}");
    talk.board.plug(true);
    let happened = [talk.second(), talk.second()].concat();
    assert!(happened.contains(&typed("hold")), "{happened:?}");
}

#[test]
fn a_busy_computer_reads_everything_before_it_times_out() {
    let mut talk = Talk::connected();
    talk.board.say(&b"swing tool=out pos=9\r\n".repeat(256));
    assert!(talk.command("hold"));
    talk.turn();
    talk.now = talk.now.after(2 * PATIENCE);
    let happened: Vec<_> = (0..50).flat_map(|_| talk.turn()).collect();
    assert!(happened.contains(&answered("ok")), "{happened:?}");
    assert!(talk.session().is_connected());
}

#[test]
fn hold_is_typed_at_once_and_waiting_commands_are_dropped() {
    let mut talk = Talk::connected();
    // One command that is being answered, and two that wait.
    assert!(talk.command("silence"));
    talk.turn();
    assert!(talk.command("start") && talk.command("start now"));
    let number = talk.session().hold();
    assert!(!talk.session().is_idle());
    let dropped =
        |number, command: &str| Happening::Unanswered { number, command: command.to_owned(), why: Unanswered::Held };
    assert_eq!(talk.turn(), [dropped(2, "start"), dropped(3, "start now"), typed("hold")]);
    // The first answer belongs to the first hold. A second hold is not typed.
    assert_eq!(talk.session().hold(), number);
    assert_eq!(talk.turn(), [answered("ok")]);
    talk.board.say(b"ok\r\n");
    assert_eq!(talk.second(), [answered("ok")]);
    assert!(talk.session().is_idle());
}

#[test]
fn commands_from_before_a_reset_are_not_executed() {
    let mut talk = Talk::connected();
    assert!(talk.command("silence"));
    talk.turn();
    assert!(talk.command("start"));
    talk.session().hold();
    assert!(talk.command("start"));
    talk.board.say(RESTARTS);
    let mut happened = talk.second();
    let ends: Vec<(u64, Unanswered)> = happened
        .extract_if(.., |happening| matches!(happening, Happening::Unanswered { .. }))
        .filter_map(|end| if let Happening::Unanswered { number, why, .. } = end { Some((number, why)) } else { None })
        .collect();
    assert_matches!(&happened[..], [Happening::Started { .. }, Happening::Lost(_), Happening::Connected { .. }]);
    let why = "the Uno was reset (brown_out)".to_owned();
    let [unknown, not_typed] = [Unanswered::Unknown(why.clone()), Unanswered::NotTyped(why)];
    assert_eq!(ends, [(2, Unanswered::Held), (1, unknown), (4, not_typed.clone()), (3, not_typed)]);
    assert!(talk.session().is_idle());
}

/// Whether a restart at work was reported, by its cause.
fn restart_at_work(happened: &[Happening]) -> Option<&str> {
    happened.iter().find_map(|happening| match happening {
        Happening::Started { while_at_work, .. } => while_at_work.as_deref(),
        _ => None,
    })
}

#[test]
fn a_restart_at_work_is_reported_with_its_cause_and_one_in_hold_is_not() {
    let mut talk = Talk::connected();
    talk.board.say(RESTARTS);
    assert_eq!(restart_at_work(&talk.second()), None);
    for at_work in [&b"state is=work\r\n"[..], b"state is=hold\r\nstate is=work\r\n"] {
        // The line before it may be cut.
        talk.board.say(&[at_work, b"state=wo", RESTARTS].concat());
        let happened = talk.second();
        assert_eq!(restart_at_work(&happened), Some("brown_out"), "{happened:?}");
        assert_eq!(restart_at_work(&talk.second()), None);
    }
    // What happened before the session, only the machine knows.
    talk.board.say(b"weeder 0.2.0, reset by reset_pin, was work, state hold, tool out; help lists the commands\r\n");
    assert_eq!(restart_at_work(&talk.second()), Some("reset_pin"));
    talk.board.say(&[b"state is=work\r\nalarm code=3-1 name=too_fast pos=1\r\n", RESTARTS].concat());
    assert_eq!(restart_at_work(&talk.second()), None);
}

#[test]
fn an_answer_to_an_earlier_question_counts_for_no_other() {
    for count in 0..4 {
        let mut talk = Talk::connected();
        talk.board.say(&[RESTARTS, IS_IN_HOLD.repeat(count).as_bytes()].concat());
        let happened = [talk.second(), talk.second()].concat();
        let connected = happened.iter().filter(|happening| matches!(happening, Happening::Connected { .. })).count();
        assert!(connected == 1 && talk.session().is_connected(), "{count}: {happened:?}");
    }
}

#[test]
fn a_command_is_typed_before_its_deadline_or_not_at_all() {
    let mut talk = Talk::connected();
    assert!(talk.command("silence"));
    talk.turn();
    let deadline = talk.now.after(Duration::from_secs(1));
    let start = talk.session().command("start", deadline).unwrap();
    assert!(talk.session().command("clear", Moment::NEVER).is_some());
    assert_eq!(talk.second(), []);
    talk.now = talk.now.after(Duration::from_millis(20));
    talk.board.say(b"ok\r\n");
    let happened = talk.second();
    let late = Happening::Unanswered { number: start, command: "start".to_owned(), why: Unanswered::Late };
    assert_eq!(happened, [answered("ok"), late, typed("clear"), answered("ok")]);
    assert!(!talk.board.typed().contains(&"start".to_owned()));
}

#[test]
fn half_a_line_that_was_typed_before_is_deleted_and_not_ended() {
    let board = ScriptedBoard::plugged_in();
    let mut port = board.open().unwrap();
    // The port stalled in the middle of a command.
    port.write_all(b"start").unwrap();
    let mut link = Link::over(Wire::over(port, false)).unwrap();
    assert_eq!(board.typed(), [""; 0]);
    assert!(link.ask("status").unwrap()[0].starts_with("state=hold "));
}

/// A session without a port, 20 ms later each time; and what it sends.
fn sends(session: &mut Session, now: &mut Moment, received: &str) -> String {
    *now = now.after(Duration::from_millis(20));
    String::from_utf8(session.turn(*now, received.as_bytes()).to_send).unwrap()
}

#[test]
fn hold_does_not_wait_for_the_first_answers() {
    let (mut session, mut now) = (Session::default(), Moment::default());
    session.open(false);
    for _ in 0..3 {
        sends(&mut session, &mut now, "");
    }
    let number = session.hold();
    assert_eq!(sends(&mut session, &mut now, ""), "hold\n");
    assert_eq!(sends(&mut session, &mut now, "weeder 0.2.0\r\nok\r\n"), "");
    let turn = session.turn(now, b"ok\r\n");
    let answered = Happening::Answered { number, command: HOLD.to_owned(), refusal: None };
    assert!(turn.happened.contains(&answered), "{turn:?}");
    assert_eq!(turn.to_send, b"get\n");
}

#[test]
fn a_hold_is_sent_again_after_the_first_certain_answer() {
    let (mut session, mut now) = (Session::default(), Moment::default());
    session.open(false);
    let mut sent = String::new();
    // The first question stays unanswered, so its answer may still come.
    while !sent.ends_with(&format!("version\n{}\n", "\u{8}".repeat(crate::COMMAND_LENGTH))) {
        sent += &sends(&mut session, &mut now, "");
        assert!(now.ticking < Duration::from_secs(9));
    }
    let number = session.hold();
    assert_eq!(sends(&mut session, &mut now, ""), "hold\n");
    let answers = [("", "version\n"), ("ok\r\n", ""), ("weeder 0.2.0\r\nok\r\n", "status\n"), (IS_IN_HOLD, "hold\n")];
    for (received, sent) in answers {
        assert_eq!(sends(&mut session, &mut now, received), sent, "behind {received:?}");
    }
    let answered = Happening::Answered { number, command: HOLD.to_owned(), refusal: None };
    assert!(session.turn(now, b"ok\r\n").happened.contains(&answered));
}

#[test]
fn a_device_that_never_ends_its_answer_is_given_up_in_time() {
    let (mut session, mut now) = (Session::default(), Moment::default());
    session.open(false);
    let mut asked = Vec::new();
    while session.is_open() {
        if sends(&mut session, &mut now, "x").contains(VERSION) {
            asked.push(now.ticking);
        }
        assert!(now.ticking < Duration::from_secs(60), "{asked:?}");
    }
    let try_time = LONGEST_SETTLING + ANSWER_TIME + Duration::from_millis(100);
    assert_eq!(asked.len(), 3);
    assert!(asked.iter().chain([&now.ticking]).is_sorted_by(|one, next| **next - **one <= try_time), "{asked:?}");
    assert_matches!(session.take_failure(), Some(LinkError::NotTheWeeder(_)));
}

/// What a caller knows of a command.
#[derive(Clone, Debug, Default)]
struct Known {
    line: String,
    is_typed: bool,
    ends: usize,
}

/// A command's end: its number, and which end it is.
fn end_of(happening: &Happening) -> Option<(u64, usize)> {
    match happening {
        Happening::Answered { number, .. } => Some((*number, 0)),
        Happening::Unanswered { number, why, .. } => match why {
            Unanswered::Late => Some((*number, 1)),
            Unanswered::Held => Some((*number, 2)),
            Unanswered::NotTyped(_) => Some((*number, 3)),
            Unanswered::Unknown(_) => Some((*number, 4)),
        },
        _ => None,
    }
}

#[test]
fn every_command_has_one_end_and_none_is_typed_that_ends_as_not_typed() {
    let seed = std::env::var("WEEDER_SEED").map_or(1, |seed| seed.parse().unwrap());
    println!("WEEDER_SEED={seed}");
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let lines = [
        "ok\r\n",
        "ok",
        "\r\n",
        "weeder 0.2.0\r\nok\r\n",
        "k=3 from 1 to 15, default 3, not saved\r\nok\r\n",
        "spoiled=0\r\nok\r\n",
        IS_IN_HOLD,
        "error: no such command\r\n",
        "swing tool=out pos=9\r\n",
        str::from_utf8(RESTARTS).unwrap(),
        "\u{1}\u{7f}~",
        "",
    ];
    let (mut connections, mut ends) = (0, [0; 5]);
    for _ in 0..200 {
        let (mut session, mut now) = (Session { keeps_hold: random.random(), ..Session::default() }, Moment::default());
        let mut known: BTreeMap<u64, Known> = BTreeMap::new();
        let mut is_heard = true;
        for step in 0..600 {
            match random.random_range(0..40) {
                0 if !session.is_open() => session.open(random.random()),
                1 if step % 7 == 0 => session.lose(LinkError::Noise),
                2..6 => {
                    // Each line occurs once. The machine shows another `k` than every second `set` sets.
                    let [before, behind] = [1 + step % 30, 1 + step / 30].map(|count| " ".repeat(count));
                    let set = format!("set{before}k{behind}{}", 3 + step % 2);
                    let line = if random.random() { set } else { format!("start {step}") };
                    let deadline = now.after(Duration::from_millis(random.random_range(0..500)));
                    let number = session.command(&line, deadline).unwrap();
                    known.insert(number, Known { line, ..Known::default() });
                }
                6 => drop(known.entry(session.hold()).or_insert(Known { line: HOLD.to_owned(), ..Known::default() })),
                _ => {}
            }
            now = now.after(Duration::from_millis(random.random_range(0..60)));
            // Mostly the answer that is due, and sometimes another line.
            let received = match &*session.asked.make_contiguous() {
                [asked, ..] if random.random_ratio(3, 4) => match asked.line.as_str() {
                    VERSION => lines[3],
                    SETTINGS | "get k" => lines[4],
                    EXAMPLES => lines[5],
                    STATUS => lines[6],
                    _ => lines[0],
                },
                _ if random.random_ratio(1, 3) => lines[random.random_range(0..lines.len())],
                _ => "",
            };
            is_heard = !is_heard;
            let turn = session.turn(now, if is_heard { received.as_bytes() } else { b"" });
            let sent = String::from_utf8(turn.to_send).unwrap();
            for happening in turn.happened {
                connections += usize::from(matches!(happening, Happening::Connected { .. }));
                let Some((number, end)) = end_of(&happening) else { continue };
                ends[end] += 1;
                if let Some(known) = known.get_mut(&number) {
                    known.ends += 1;
                    let is_typed = end == 0 || end == 4;
                    // A `hold` may also be typed blindly.
                    assert!(known.is_typed == is_typed || known.line == HOLD, "{known:?} ends by {end}");
                }
            }
            for known in known.values_mut().filter(|known| sent.lines().any(|line| line == known.line)) {
                assert!(known.ends == 0 || known.line == HOLD, "{known:?} is typed behind its end");
                known.is_typed = true;
            }
        }
        session.lose(LinkError::Noise);
        for (number, _) in session.turn(now, b"").happened.iter().filter_map(end_of) {
            if let Some(known) = known.get_mut(&number) {
                known.ends += 1;
            }
        }
        // A `hold` may wait for the next wire.
        known.retain(|number, known| session.to_hold != Some(*number) || known.ends > 0);
        assert!(known.values().all(|known| known.ends == 1), "{known:?}");
    }
    assert!(connections > 100 && ends.iter().all(|&count| count > 100), "{connections} {ends:?}");
}
