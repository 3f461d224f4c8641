//! What commands change, read back from the machine: noise on the line may turn a value into another valid one.
//!
//! # How it works
//!
//! The session believes settings that the machine has shown twice in a row. After a `set` it asks for that setting, before
//! it types the next command. If the value is another one, it types `set` again. The answer counts after that. A `hold`
//! ends this: nothing is set after it.
//!
//! # Limits
//!
//! The machine obeys another command that noise has made of a valid one, as `forget 1` of `forget 12`. Examples are read
//! once: their answer is so long that a noisy line seldom gives the same twice. A setting of the wheel that noise has changed
//! may have cleared the calibration before it was set again.

use super::{EVENTS, EXAMPLES, HOLD, Happening, PATIENCE, SETTINGS, Session};
use crate::SURE_TRIES;
use crate::moment::Moment;
use crate::settings::{Setting, Shown, name, shown};
use control::say::command::{Action, Command};
use std::time::Duration;

/// The refusal of a `set` that came through with another value each time.
const CHANGED: &str = "error: noise on the line has changed this: see to the cable, and type it again";

/// The refusal of a `set` whose value is not known, because a `hold` came first.
const UNREAD: &str = "error: hold came before this was read back: `get` shows the value";

/// Time between two answers to `get` that differ, and the next question. Each answer takes a tenth of a second, in which
/// the firmware obeys no `hold`.
const PAUSE: Duration = Duration::from_secs(1);

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
        if self.to_hold.is_some() || self.asked.iter().any(|asked| asked.line == HOLD) {
            self.leave_unread();
        }
    }

    /// Ends an accepted `set` before its value is known.
    pub(super) fn leave_unread(&mut self) {
        if let Some(accepted) = self.accepted.take() {
            self.finish(accepted, Some(UNREAD.to_owned()));
        }
    }

    /// Takes the answer to a question of the session's own.
    pub(super) fn take_own_answer(&mut self, question: String, answer: Vec<String>, refusal: Option<String>) {
        if let Some(accepted) = self.accepted.take_if(|accepted| accepted.to_type() == question) {
            return self.confirm(accepted, &answer, refusal);
        }
        match question.as_str() {
            // Noise may have damaged a line: ask again.
            SETTINGS if refusal.is_some() || self.is_doubtful(&answer) => drop(self.own.insert(question)),
            EXAMPLES | EVENTS if refusal.is_some() => drop(self.own.insert(question)),
            SETTINGS => self.turn.happened.push(Happening::Settings(Shown::by(&answer).settings, answer)),
            EXAMPLES => self.turn.happened.push(Happening::Examples(answer)),
            _ => {}
        }
    }

    /// Takes the answer to what an accepted `set` has had typed.
    fn confirm(&mut self, mut accepted: Accepted, answer: &[String], refusal: Option<String>) {
        let is_set = answer.iter().any(|line| shown(line) == Some(accepted.set));
        if accepted.is_wrong {
            (accepted.is_wrong, accepted.refusal) = (false, refusal);
            self.accepted = Some(accepted);
        } else if !is_set && accepted.again < SURE_TRIES {
            (accepted.is_wrong, accepted.again) = (true, accepted.again + 1);
            self.accepted = Some(accepted);
        } else {
            let refusal = accepted.refusal.take().unwrap_or_else(|| CHANGED.to_owned());
            self.finish(accepted, (!is_set).then_some(refusal));
        }
    }

    fn finish(&mut self, Accepted { number, line, .. }: Accepted, refusal: Option<String>) {
        self.own.insert(SETTINGS.to_owned());
        self.turn.happened.push(Happening::Answer(refusal.clone().unwrap_or_else(|| "ok".to_owned())));
        self.turn.happened.push(Happening::Answered { number, command: line, refusal });
    }

    /// Whether this answer to `get` differs from the one before it.
    pub(super) fn is_doubtful(&mut self, answer: &[String]) -> bool {
        let is_new = self.doubted.as_deref() != Some(answer);
        if is_new && self.doubted.is_some() {
            self.own_at = self.waited + PAUSE;
        }
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
