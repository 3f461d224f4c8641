//! What commands change, read back from the machine: noise on the line may turn a value into another valid one.
//!
//! # How it works
//!
//! The session believes settings that the machine has shown twice in a row. Behind a `set` it asks for that setting, before
//! it types the next command. If the value is another one, it types `set` again. The answer counts after that.
//!
//! # Limits
//!
//! The machine obeys another command that noise has made of a valid one, as `forget 1` of `forget 12`. Examples are read
//! once: their answer is so long that a noisy line seldom gives the same twice, and a session that waits for it cannot hold.

use super::{EVENTS, EXAMPLES, Happening, SETTINGS, SURE_TRIES, Session};
use crate::settings::{Setting, name, shown};
use control::say::command::{Action, Command};

/// The refusal of a `set` that came through with another value each time.
const CHANGED: &str = "error: noise on the line has changed this: see to its cable, and type it again";

/// A `set` that the machine has accepted, and whose value is read back.
pub(super) struct Accepted {
    pub(super) number: u64,
    pub(super) line: String,
    set: (Setting, u16),
    /// How often it was typed again.
    again: usize,
    /// Whether it has to be typed again.
    is_wrong: bool,
}

impl Accepted {
    /// What to type next: the question for the value, or the command again.
    pub(super) fn to_type(&self) -> String {
        if self.is_wrong { self.line.clone() } else { format!("{SETTINGS} {}", name(self.set.0)) }
    }
}

/// The setting that a line sets, and its value.
pub(super) fn set_by(line: &str) -> Option<(Setting, u16)> {
    match crate::command(line) {
        Ok(Command { action: Action::Set, setting, number, .. }) => Some((setting, number)),
        _ => None,
    }
}

impl Session {
    /// Takes a `set` that the machine has accepted.
    pub(super) fn accept(&mut self, number: u64, line: String, set: (Setting, u16)) {
        self.accepted = Some(Accepted { number, line, set, again: 0, is_wrong: false });
    }

    /// Takes the answer to what an accepted `set` has had typed.
    pub(super) fn confirm(&mut self, mut accepted: Accepted, answer: &[String]) {
        let is_set = answer.iter().any(|line| shown(line) == Some(accepted.set));
        if accepted.is_wrong || !is_set && accepted.again < SURE_TRIES {
            accepted.again += usize::from(!accepted.is_wrong);
            accepted.is_wrong ^= true;
            self.accepted = Some(accepted);
            return;
        }
        self.own.insert(SETTINGS.to_owned());
        let said = if is_set { "ok" } else { CHANGED };
        self.turn.happened.push(Happening::Answer(said.to_owned()));
        let (Accepted { number, line: command, .. }, refusal) = (accepted, (!is_set).then(|| said.to_owned()));
        self.turn.happened.push(Happening::Answered { number, command, refusal });
    }

    /// Whether this answer to `get` differs from the one before it.
    pub(super) fn is_doubtful(&mut self, answer: &[String]) -> bool {
        let is_new = self.doubted.as_deref() != Some(answer);
        self.doubted = is_new.then(|| answer.to_vec());
        is_new
    }

    /// What to ask again after this command was answered by `ok`; `None` if it changes nothing that the session needs.
    pub(super) fn changed_by(&self, command: &str) -> Option<&'static str> {
        match crate::command(command).ok()?.action {
            Action::Save | Action::Revert | Action::Defaults | Action::Calibrate => Some(SETTINGS),
            Action::LabelPlant
            | Action::LabelWeed
            | Action::TeachPlant
            | Action::TeachWeed
            | Action::Forget
            | Action::ForgetAll => Some(EXAMPLES),
            Action::EventsOff => self.keeps_events.then_some(EVENTS),
            _ => None,
        }
    }
}
