//! `hold`, which must come through a line that loses and damages bytes.
//!
//! # How it works
//!
//! The firmware obeys every `hold`, so a refusal shows that noise has damaged it: it is typed again at once. Without an answer
//! it is typed again after a short time. Backspaces before it delete an earlier `hold` that has lost its line end.
//!
//! # Limits
//!
//! Each time may have its own answer. The next question is then the status: an answer without one is such a late answer.
//!
//! Behind a command that is never answered, `hold` is not typed again before that command is given up.

use super::introduction::ERASE;
use super::{HOLD, STATUS, Session, Unanswered};
use std::time::Duration;

/// Time after which a `hold` without an answer is typed again. An answer takes some hundredths of a second.
pub(super) const PATIENCE: Duration = Duration::from_millis(300);

/// A typed `hold`.
#[derive(Clone, Copy, Default)]
pub(super) struct Typed {
    /// When it was typed last.
    pub(super) at: Duration,
    /// How often it was typed again: most answers that may come beside its own.
    pub(super) again: usize,
}

impl Session {
    /// Types `hold` in the next turn and drops all waiting commands. Returns its number. Answers in progress still come,
    /// before that of `hold`. A `hold` that is already typed and is the last line counts for this one too: the chip's
    /// receive queue is short.
    pub fn hold(&mut self) -> u64 {
        for waiting in std::mem::take(&mut self.waiting) {
            self.end(waiting.number, waiting.line, Unanswered::Held);
        }
        self.leave_unread();
        let pending = self.asked.back().filter(|asked| asked.line == HOLD).and_then(|asked| asked.number);
        let number = pending.or(self.to_hold).unwrap_or_else(|| self.next_number());
        self.to_hold = pending.is_none().then_some(number);
        number
    }

    /// Whether the next answer is that of a `hold`.
    pub(super) fn waits_for_hold(&self) -> bool {
        self.asked.front().is_some_and(|asked| asked.line == HOLD)
    }

    /// Types an unanswered `hold` again. A status is the first question behind it.
    pub(super) fn hold_again(&mut self) {
        self.turn.to_send.extend([ERASE; HOLD.len()]);
        self.turn.to_send.extend(format!("{HOLD}\n").bytes());
        self.held = Typed { at: self.waited, again: self.held.again + 1 };
        (self.poll_at, self.is_polled) = (Duration::ZERO, false);
    }

    /// Whether this end of an answer leaves the present question open: the refusal of a `hold`, which is typed again, or the
    /// late answer to one.
    pub(super) fn is_of_a_hold(&mut self, is_refused: bool) -> bool {
        let Some(asked) = self.asked.front() else { return false };
        if asked.line == HOLD && is_refused && self.waited.saturating_sub(asked.since) < super::PATIENCE {
            self.hold_again();
            return true;
        }
        let is_late = self.held.again > 0 && asked.number.is_none() && asked.line == STATUS && asked.answer.is_empty();
        if is_late {
            self.held.again -= 1;
        } else if asked.line == STATUS {
            self.held.again = 0;
        }
        is_late
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::moment::Moment;
    use crate::session::{Happening, VERSION};

    /// What a session with a machine has typed and said in 2 s. `hold` is typed after 1 s, and `start now` waits behind it. The
    /// machine's answers to `hold` are these, then "ok". An empty one is lost.
    fn held(answers: &[&str]) -> (Vec<String>, Vec<Happening>) {
        let (mut session, mut now, mut received) = (Session::default(), Moment::default(), String::new());
        let (mut answers, mut typed, mut happened) = (answers.iter(), Vec::new(), Vec::new());
        session.open(false);
        for turn in 0..100 {
            if turn == 50 {
                assert!(session.is_connected());
                session.hold();
            }
            if turn == 52 {
                assert!(session.command("start now", Moment::NEVER).is_some());
            }
            now = now.after(Duration::from_millis(20));
            let turn = session.turn(now, received.as_bytes());
            happened.extend(turn.happened);
            received.clear();
            for line in std::str::from_utf8(&turn.to_send).unwrap().split('\n') {
                let line = line.trim_start_matches('\u{8}');
                received += match line {
                    HOLD => answers.next().copied().unwrap_or("ok\r\n"),
                    VERSION => "weeder 0.2.0\r\nok\r\n",
                    "get" => "k=3 from 1 to 15, default 3\r\nok\r\n",
                    STATUS => {
                        "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=400\r\nlost=0 jumps=0\r\nok\r\n"
                    }
                    "examples" | "events on" | "start now" => "ok\r\n",
                    _ => "",
                };
                typed.push(line.to_owned());
            }
        }
        (typed, happened)
    }

    #[test]
    fn a_hold_that_noise_damages_or_swallows_is_typed_again() {
        let refused = "error: no such command, help lists them all\r\n";
        for (answers, times) in [
            (&[][..], 1),
            (&[refused], 2),
            (&[refused, refused, ""], 4),
            (&[""], 2),
            (&["", "", refused], 4),
            // Both answers of a `hold` that only seemed to be lost.
            (&["", "ok\r\nok\r\n"], 2),
        ] {
            let (typed, happened) = held(answers);
            assert_eq!(typed.iter().filter(|line| *line == HOLD).count(), times, "{answers:?}");
            let ends: Vec<_> = happened.iter().filter(|one| matches!(one, Happening::Answered { .. })).collect();
            assert!(matches!(ends[..], [Happening::Answered { refusal: None, .. }, _]), "{answers:?}: {ends:?}");
            let at = |line: &str| typed.iter().rposition(|typed| typed == line).unwrap();
            let is_asked = typed[at(HOLD)..at("start now")].iter().any(|line| line == STATUS);
            assert!(is_asked || times == 1, "{answers:?}: {typed:?}");
            assert!(
                !happened.iter().any(|one| matches!(one, Happening::Lost(_) | Happening::Unanswered { .. })),
                "{answers:?}"
            );
            // No answer is taken for that of another question.
            let statuses = happened.iter().rev().take(20).filter(|one| matches!(one, Happening::Status(..))).count();
            assert!(statuses > 5, "{answers:?}: {statuses}");
        }
    }
}
