//! Types lines into the machine, checks that each is answered once, and stores its effect for the checks.
//!
//! The content of an answer is not checked here, only its end.

use super::{Drive, is_alarm, scale};
use crate::machine::{Attended, Checked, Machine};
use control::{operate::state::State, say::command::LineBuffer, settings::Setting};
use proptest::prelude::*;

/// Turns in which every line must be answered, also during a write to the EEPROM.
const PATIENCE: u32 = 20_000;

/// A short line is executed and answered within this time.
const ANSWERED_S: f64 = 0.05;

impl<M: Machine> Drive<M> {
    /// Types one or several lines, and waits until each has been answered once.
    pub(super) fn say(&mut self, text: &str) -> Checked {
        if !M::IS_OPEN && text.contains("start now") {
            // The reported unseen ground, which the operator vouches for.
            self.say("status")?;
        }
        let lines = self.type_in(text);
        let mut ends = 0;
        for _ in 0..PATIENCE {
            if self.machine.is_done() {
                prop_assert_eq!(ends, lines.len(), "ends of answers to {:?}", lines);
                return Ok(());
            }
            self.turn()?;
            ends += self.written.iter().filter(|line| is_end(line)).count();
        }
        prop_assert!(false, "{text:?} is not answered");
        Ok(())
    }

    /// Types one or several lines. Returns those that must be answered.
    pub(super) fn type_in(&mut self, text: &str) -> Vec<String> {
        self.disturb();
        let lines = text.split(['\r', '\n']).map(|line| line.trim_matches([' ', '\t']));
        let lines: Vec<String> = lines.filter(|line| is_answered(line)).map(str::to_owned).collect();
        self.machine.put(text, &lines);
        lines
    }

    /// The console's part of a turn.
    pub(super) fn attend_to_the_console(&mut self) -> Checked {
        let (before, unseen_mm) = (self.machine.state(), self.machine.unseen_mm());
        let Attended { begun, written } = self.machine.attend()?;
        if let Some(line) = begun {
            self.begin(&line, before);
            if M::IS_OPEN {
                self.check_begun(&line, before)?;
                if self.machine.state() == State::Work {
                    self.trust(&line, unseen_mm);
                }
            }
            self.current = line;
        }
        if self.scale != scale(self.machine.settings()) {
            self.scale = scale(self.machine.settings());
            self.model.see_again(self.here());
        }
        for end in written.iter().filter(|line| is_end(line)) {
            self.end(end, unseen_mm);
        }
        written.iter().try_for_each(|line| self.hear(line))?;
        self.written = written;
        Ok(())
    }

    /// A line is executed, now or soon.
    fn begin(&mut self, line: &str, before: State) {
        let words = words(line);
        self.is_tried |= matches!(words[0], "servo" | "calibrate" | "test");
        if M::IS_OPEN {
            self.is_tried &= self.machine.state() == State::Hold && !matches!(words[..], ["hold"] | ["servo", "out"]);
        }
        self.saving = (words == ["save"]).then(|| self.machine.settings().clone());
        if self.saving.is_some() {
            self.leads_in_doubt = self.machine.settings_are_in_doubt();
        }
        if self.machine.state() != before {
            self.disturb();
        }
    }

    fn check_begun(&self, line: &str, before: State) -> Checked {
        let (words, after) = (words(line), self.machine.state());
        prop_assert!(after == before || after != State::Work || words[0] == "start", "{line:?} started work");
        prop_assert!(after == before || !is_alarm(before) || words == ["clear"], "{line:?} cleared an alarm");
        Ok(())
    }

    /// The line that was begun has been answered.
    fn end(&mut self, end: &str, unseen_mm: i16) {
        let (line, is_ok) = (std::mem::take(&mut self.current), end == "ok");
        if let Some(saving) = self.saving.take()
            && is_ok
        {
            self.saved = Some(saving);
        }
        let words = words(&line);
        if matches!(words.first(), Some(&("label" | "teach" | "forget"))) {
            self.taught = self.machine.examples();
        }
        if !M::IS_OPEN && is_ok {
            self.is_tried &= !matches!(words[..], ["hold"] | ["servo", "out"] | ["start", ..]);
            self.trust(&line, unseen_mm);
        }
    }

    /// Opens the ground that the machine has not seen, if the line is the operator's `start now`.
    fn trust(&mut self, line: &str, unseen_mm: i16) {
        if words(line) == ["start", "now"] && unseen_mm > 0 {
            let (tool, margin) = (self.here() - self.ticks(Setting::BeamToToolMm), self.ticks(Setting::MarginMm));
            let unseen = f64::from(unseen_mm + 1) * f64::from(self.machine.settings().wheel().ticks(1000).0) / 1000.0;
            // The distance rolled since the line was executed.
            let late = if M::IS_OPEN { 0 } else { (self.speed.abs() * ANSWERED_S) as i64 };
            // That distance includes the margin ahead of the ground.
            self.model.trust(tool - 2 * margin - late, tool + unseen as i64 - margin);
        }
    }

    /// Asks the machine for the facts that are not visible from outside.
    pub(super) fn look(&mut self) -> Checked {
        if M::IS_OPEN {
            return Ok(());
        }
        if self.machine.settings_are_in_doubt() {
            self.say("get")?;
        }
        self.say("status")?;
        let state = self.machine.state();
        // Tests on the bench run only in HOLD.
        self.is_tried &= state == State::Hold;
        self.check_tool_stuck(state)
    }
}

fn words(line: &str) -> Vec<&str> {
    line.split([' ', '\t']).filter(|word| !word.is_empty()).collect()
}

/// Whether the machine answers a line: backspaces may have emptied it.
fn is_answered(line: &str) -> bool {
    let mut buffer = LineBuffer::new();
    line.bytes().chain(*b"\n").any(|byte| buffer.take(byte).is_some())
}

/// Whether a line is the last one of an answer.
pub fn is_end(line: &str) -> bool {
    line == "ok" || line.starts_with("error: ")
}
