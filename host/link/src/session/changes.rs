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
//! once: their answer is so long that a noisy line seldom gives the same twice. A `hold` that is typed meanwhile is answered
//! before the `set`.

use super::{EVENTS, EXAMPLES, Happening, PATIENCE, SETTINGS, SURE_TRIES, Session};
use crate::moment::Moment;
use crate::settings::{Setting, name, shown};
use control::say::command::{Action, Command};

/// The refusal of a `set` that came through with another value each time.
const CHANGED: &str = "error: noise on the line has changed this: see to its cable, and type it again";

/// A `set` that the machine has accepted, and whose value is read back.
pub(super) struct Accepted {
    pub(super) number: u64,
    pub(super) line: String,
    set: (Setting, u16),
    /// Until when it may be typed again: later, others may have set another value.
    until: Moment,
    /// How often it was typed again.
    again: usize,
    /// Whether it has to be typed again.
    is_wrong: bool,
    /// The last refusal of it.
    refusal: Option<String>,
}

impl Accepted {
    /// What to type next: the question for the value, or the command again.
    pub(super) fn to_type(&self) -> String {
        if self.is_wrong { self.line.clone() } else { format!("{SETTINGS} {}", name(self.set.0)) }
    }

    /// A late one is not typed again.
    pub(super) fn expire(&mut self, now: Moment) {
        if now.is_after(self.until) {
            (self.is_wrong, self.again) = (false, SURE_TRIES);
        }
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
        let until = self.turned.unwrap_or_default().after(PATIENCE);
        self.accepted = Some(Accepted { number, line, set, until, again: 0, is_wrong: false, refusal: None });
    }

    /// Takes the answer to what an accepted `set` has had typed.
    pub(super) fn confirm(&mut self, mut accepted: Accepted, answer: &[String], refusal: Option<String>) {
        let is_set = answer.iter().any(|line| shown(line) == Some(accepted.set));
        if accepted.is_wrong {
            (accepted.is_wrong, accepted.refusal) = (false, refusal);
            self.accepted = Some(accepted);
        } else if !is_set && accepted.again < SURE_TRIES {
            (accepted.is_wrong, accepted.again) = (true, accepted.again + 1);
            self.accepted = Some(accepted);
        } else {
            self.own.insert(SETTINGS.to_owned());
            let Accepted { number, line: command, refusal, .. } = accepted;
            let refusal = (!is_set).then(|| refusal.unwrap_or_else(|| CHANGED.to_owned()));
            self.turn.happened.push(Happening::Answer(refusal.clone().unwrap_or_else(|| "ok".to_owned())));
            self.turn.happened.push(Happening::Answered { number, command, refusal });
        }
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
