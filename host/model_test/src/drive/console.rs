//! Types lines into the machine, checks that each is answered once, and stores its effect for the checks.
//!
//! The content of an answer is not checked here, only its end.

use super::{Drive, is_alarm};
use crate::machine::{Attended, Checked, Machine};
use control::{
    operate::state::State,
    say::command::LineBuffer,
    settings::{Setting, Settings},
    units::LengthScale,
};
use proptest::prelude::*;

/// Turns in which every line must be answered, also during a write to the EEPROM.
const PATIENCE: u32 = 20_000;

/// A short line is executed and answered within this time.
const ANSWERED_S: f64 = 0.05;

/// The lines sent and received.
#[derive(Debug, Default)]
pub(super) struct Console {
    /// The line that the machine is answering.
    current: String,
    /// The number of answers that have ended.
    answers: usize,
    /// The alarms, warnings and greetings that the machine wrote, until the caller takes them.
    pub(super) events: Vec<String>,
}

impl<M: Machine> Drive<M> {
    /// Types one or several lines, and waits until each has been answered once.
    pub(super) fn say(&mut self, text: &str) -> Checked {
        if !M::IS_OPEN && text.contains("start now") {
            // The reported unseen ground, which the operator vouches for.
            self.say("status")?;
        }
        let (lines, before) = (self.type_in(text), self.console.answers);
        for _ in 0..PATIENCE {
            if self.machine.is_done() {
                prop_assert_eq!(self.console.answers - before, lines.len(), "ends of answers to {:?}", lines);
                return Ok(());
            }
            self.turn()?;
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
        let scale_before = scale(self.machine.settings());
        let Attended { begun, written } = self.machine.attend()?;
        if let Some(line) = begun {
            self.begin(&line, before);
            if M::IS_OPEN {
                self.check_begun(&line, before)?;
                self.follow_start(&line, self.machine.state() == State::Work, unseen_mm);
            }
            self.console.current = line;
        }
        if scale(self.machine.settings()) != scale_before {
            self.expectations.model.see_again(self.here());
        }
        for end in written.iter().filter(|line| is_end(line)) {
            self.end(end, unseen_mm);
        }
        written.iter().try_for_each(|line| self.hear(line))?;
        if self.machine.state() != before {
            self.expectations.follow_work(self.machine.state() == State::Work, false, self.here());
        }
        Ok(())
    }

    /// A line is executed, now or soon.
    fn begin(&mut self, line: &str, before: State) {
        let (words, state) = (words(line), self.machine.state());
        let (is_tried, saves) = (&mut self.expectations.is_tried, &mut self.expectations.saves);
        *is_tried |= matches!(words[0], "servo" | "calibrate" | "test");
        if M::IS_OPEN {
            *is_tried &= state == State::Hold && !matches!(words[..], ["hold"] | ["servo", "out"]);
        }
        saves.saving = (words == ["save"]).then(|| self.machine.settings().clone());
        if saves.saving.is_some() {
            saves.leads_in_doubt = self.machine.settings_are_in_doubt();
        }
        if state != before {
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
        self.console.answers += 1;
        let (line, is_ok) = (std::mem::take(&mut self.console.current), end == "ok");
        let (is_tried, saves) = (&mut self.expectations.is_tried, &mut self.expectations.saves);
        if let Some(saving) = saves.saving.take()
            && is_ok
        {
            saves.saved = Some(saving);
        }
        let words = words(&line);
        if matches!(words.first(), Some(&("label" | "teach" | "forget"))) {
            saves.taught = self.machine.examples();
        }
        if !M::IS_OPEN && is_ok {
            *is_tried &= !matches!(words[..], ["hold"] | ["servo", "out"] | ["start", ..]);
            match words[..] {
                ["start", ..] => self.follow_start(&line, true, unseen_mm),
                ["hold" | "clear"] => self.expectations.works = false,
                _ => {}
            }
        }
    }

    /// The machine works or not after a line. `start now` keeps the ground, and opens what the machine has not seen, but not after
    /// it has rolled back.
    fn follow_start(&mut self, line: &str, works: bool, unseen_mm: i16) {
        let (machine, here) = (&self.machine, self.here());
        let margin = machine.ticks(Setting::MarginMm);
        // The distance rolled since the line was executed.
        let late = if M::IS_OPEN { 0 } else { (self.physics.speed.abs() * ANSWERED_S) as i64 };
        let (expectations, is_now) = (&mut self.expectations, words(line) == ["start", "now"]);
        let beyond = expectations.model.rolled_back(here) - margin;
        let keeps = is_now && beyond <= 0;
        expectations.follow_work(works, keeps, here);
        let may_keep = is_now && expectations.model.doubt(beyond, late + expectations.blur());
        if works && (keeps || may_keep) && unseen_mm > 0 {
            let tool = here - machine.ticks(Setting::BeamToToolMm);
            let unseen = f64::from(unseen_mm + 1) * f64::from(machine.settings().wheel().ticks(1000).0) / 1000.0;
            // That distance includes half of the stem zone and the margin, which lie ahead of the ground that was forgotten.
            let ahead = machine.ticks(Setting::StemZoneMm) / 2 + margin;
            expectations.model.trust(tool - 2 * margin - late, tool + unseen as i64 - ahead);
        }
    }

    /// Takes a line that the machine wrote, if it is an event or a greeting.
    fn hear(&mut self, line: &str) -> Checked {
        if line.starts_with("guarded ") {
            return self.expectations.check_guarded(self.reported(line));
        }
        if line.starts_with("weed ") {
            let width = value(line, "hold").map(i64::from).unwrap_or(0) - 2 * self.machine.ticks(Setting::MarginMm);
            let behind = self.reported(line) - self.here();
            if let Some(stand) = &mut self.expectations.stand {
                stand.mistake(self.physics.ground as i64 + behind, width, behind);
            }
        }
        if ["alarm ", "warning ", "weeder "].iter().any(|event| line.starts_with(event)) {
            self.console.events.push(line.to_owned());
        }
        Ok(())
    }

    /// The position that an event reports.
    fn reported(&self, line: &str) -> i64 {
        let here = self.here();
        let position = value(line, "pos").unwrap_or_default();
        here + i64::from(position.wrapping_sub(self.machine.own_count(here)))
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
        self.expectations.is_tried &= state == State::Hold;
        self.physics.check_tool_stuck(state)
    }
}

/// The unit of the machine's positions on the ground. A change of the unit makes the machine forget the ground.
fn scale(settings: &Settings) -> LengthScale {
    LengthScale::of(settings.wheel().ticks(1000))
}

fn words(line: &str) -> Vec<&str> {
    line.split([' ', '\t']).filter(|word| !word.is_empty()).collect()
}

/// The number of a key in an event.
fn value(line: &str, key: &str) -> Option<i32> {
    let value = line.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='))?;
    value.parse().ok()
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
