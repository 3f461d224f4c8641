//! What is typed next: a `hold` at once, else one line after the answer to the last one.
//!
//! # How it works
//!
//! A connected session asks for the status ten times a second. What waits comes between two of these questions: first the
//! `set` that is read back, then the caller's commands, then the session's own questions.

use super::introduction::INTRODUCTION;
use super::{Asked, HOLD, Happening, POLL, STATUS, Session, State, Waiting};
use std::mem;
use std::time::Duration;

/// Longest further wait of a poll for commands: between many of them the state must not become unknown.
const BEHIND: Duration = Duration::from_millis(300);

impl Session {
    /// Types the next line, if none waits for its answer. `hold` does not wait.
    pub(super) fn type_next(&mut self) {
        if matches!(self.state, State::Closed | State::Starting { .. }) {
            return;
        }
        if self.introduction.late > 0 {
            if self.to_hold.is_some() && !mem::replace(&mut self.introduction.has_held, true) {
                self.turn.to_send.extend(HOLD.bytes().chain(*b"\n"));
                self.introduction.late += 1;
            }
        } else if matches!(self.state, State::Asking(_) | State::Ready)
            && let Some(number) = self.to_hold.take()
        {
            (self.held.at, self.is_polled) = (self.waited, false);
            return self.send(HOLD.to_owned(), Some(number));
        }
        if !self.asked.is_empty() {
            return;
        }
        match self.state {
            State::Ready if self.is_bare => {}
            State::Closed | State::Starting { .. } | State::Settling { .. } => {}
            State::Asking(question) => {
                self.introduction.bytes = 0;
                self.send(INTRODUCTION[question].to_owned(), None);
            }
            State::Ready => {
                let behind = if self.waiting.is_empty() { Duration::ZERO } else { BEHIND };
                // In long turns a status is always due: another line has every second one.
                let is_due = self.waited >= self.poll_at + behind && !self.is_polled;
                if !is_due && self.send_next() {
                    self.is_polled = false;
                } else if self.waited >= self.poll_at {
                    (self.is_polled, self.poll_at) = (true, self.waited + POLL);
                    self.send(STATUS.to_owned(), None);
                }
            }
        }
    }

    /// Types what waits, beside the status. Returns whether anything does.
    fn send_next(&mut self) -> bool {
        if let Some(set) = &self.accepted {
            self.send(set.to_type(), None);
        } else if let Some(Waiting { number, line, .. }) = self.waiting.pop_front() {
            self.send(line, Some(number));
        } else if self.waited >= self.own_at
            && let Some(own) = self.own.pop_first()
        {
            self.send(own, None);
        } else {
            return false;
        }
        true
    }

    fn send(&mut self, line: String, number: Option<u64>) {
        if number.is_some() {
            self.turn.happened.push(Happening::Command(line.clone()));
        }
        self.turn.to_send.extend(line.bytes().chain(*b"\n"));
        self.asked.push_back(Asked { line, number, since: self.waited, answer: Vec::new() });
    }
}
