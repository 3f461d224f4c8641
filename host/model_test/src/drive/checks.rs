//! Checks of the tool and of the events against the model.
//!
//! For some turns after a change the machine may still use the earlier state. In these turns nothing is checked.

use super::{Drive, Place, rolling::SWITCH_DELAY_US};
use crate::{
    machine::{Checked, Machine},
    run::Encoder,
};
use control::{
    alarm::Alarm,
    operate::{state::State, tool::Reason},
    settings::Setting,
};
use proptest::prelude::*;

/// At a steady speed of at least [`STEADY_SPEED`] ticks a second, the measured speed is right after this time.
const STEADY_US: u64 = 1_200_000;
const STEADY_SPEED: f64 = 60.0;

/// Turns after which new leads have an effect.
const RECALCULATION_TURNS: u32 = 3;

impl<M: Machine> Drive<M> {
    /// Checks that the tool may be in the row. A tool over a canopy may be on its way out. If it is not, the ground at
    /// the first such position counts, because later the machine may have forgotten it.
    pub(super) fn check(&mut self, place: Place) -> Checked {
        let held = self.check_place(place);
        match self.suspect {
            Some((since_us, first)) if since_us + M::LATENESS_US <= self.world.time_us => {
                self.suspect = None;
                self.check_place(first)
            }
            None if held.is_err() && M::LATENESS_US > 0 => {
                self.suspect = Some((self.world.time_us, place));
                Ok(())
            }
            None => held,
            Some(_) => Ok(()),
        }
    }

    /// Checks the swinging tool against the real plants, in every state.
    pub(super) fn check_stand(&mut self, Place { tool, .. }: Place, ground: i64, out: bool) -> Checked {
        let geometry = self.geometry();
        let Some(stand) = &mut self.stand else { return Ok(()) };
        let now_us = self.world.time_us;
        if self.encoder != Encoder::Works {
            stand.mistrust_speed(now_us, &geometry);
        }
        let clear = stand.is_clear(out, now_us, M::LATENESS_US, &geometry);
        let is_unseen = out && self.model.is_unseen(tool, 0);
        stand.judge(clear, ground, now_us, &geometry, is_unseen).map_err(TestCaseError::fail)
    }

    /// Checks a position of the tool in the row.
    fn check_place(&mut self, Place { tool, slowest, fastest }: Place) -> Checked {
        // With two beams the machine corrects slip, which the model of the ground does not know.
        if self.stand.is_some() && self.had_second_beam || self.leads_turns <= RECALCULATION_TURNS {
            return Ok(());
        }
        // The machine adds a millisecond to each lead, for the command's way to the pin.
        let lead = |milliseconds: u16| f64::from(milliseconds + u16::from(milliseconds > 0)) / 1000.0;
        let [lead_out, lead_in] = self.leads_ms.map(lead);
        let lead_in = (1.25 * lead_in).min(lead_out);
        let ticks = |speed: f64, seconds: f64| (speed * seconds) as i64;
        // The order to come back leads in the direction of rolling. So does the order to leave, at least by the slowest speed.
        let near = tool + ticks(fastest.max(0.0), lead_in) + 1;
        let far = tool + ticks(slowest.min(0.0), lead_in) - 1;
        let margin = self.ticks(Setting::MarginMm);
        let (from, to) = if slowest > 0.0 {
            prop_assert!(!self.model.is_unseen(near, margin), "the tool is in the row at {tool}, over unseen ground");
            (near, tool + ticks(slowest, lead_out))
        } else if fastest < 0.0 {
            (tool + ticks(fastest, lead_out), far)
        } else {
            (near, far)
        };
        let canopy = if from <= to {
            self.model.canopy_between(from, to, margin)
        } else {
            // The speed changed much in the last second, or its direction did. Only ground that is closed for every
            // measured speed is closed.
            self.model.canopies_all_over(to, from, margin)
        };
        prop_assert!(
            canopy.is_none(),
            "the tool is in the row at {tool}, rolling {slowest:.0} to {fastest:.0} ticks/s, margin {margin}, leads \
             {lead_out} s and {lead_in} s: {canopy:?}"
        );
        Ok(())
    }

    /// Checks that a tool stays out for a plant only if the beam has seen one near it.
    pub(super) fn check_reason(&mut self, Place { tool, slowest, fastest, .. }: Place) -> Checked {
        // The machine expects at most 2.3 times its speed, and comes in only if the row is open for twice the lead.
        let lead_s = f64::from(self.machine.settings().get(Setting::LeadOutMs) + 1) / 1000.0;
        let reach = (4.6 * fastest.max(-slowest) * lead_s) as i64 + self.ticks(Setting::MarginMm);
        let is_explained = self.machine.reason() != Some(Reason::Plant)
            || self.model.has_canopy_near(tool, reach)
            // The machine may guard ground that it has not reported yet, and a second beam closes more.
            || !self.guard_spacings.is_empty()
            || self.had_second_beam
            || self.model.is_in_doubt();
        self.unexplained_turns = if is_explained { 0 } else { self.unexplained_turns + 1 };
        prop_assert!(
            self.unexplained_turns <= RECALCULATION_TURNS,
            "the tool at {tool} stays out for a plant, but none is within {reach} ticks"
        );
        Ok(())
    }

    /// Checks, after the tool left the row at a steady speed, that it did not leave before for the same canopy.
    pub(super) fn check_swing(&mut self, tool: i64) -> Checked {
        let is_calm = self.speed == self.target
            && self.speed.abs() > STEADY_SPEED
            && self.calm_since_us + STEADY_US < self.world.time_us
            && self.machine.reason().is_none_or(|reason| reason == Reason::Plant)
            && !self.model.is_unseen(tool, self.ticks(Setting::MarginMm))
            // The machine may not have reported yet where it guards.
            && self.guard_spacings.is_empty()
            && !self.had_second_beam
            // The machine does not report whether it keeps a canopy or a stem.
            && !self.model.keeps_stems()
            && !self.model.is_in_doubt();
        if !is_calm {
            self.left_for = None;
            return Ok(());
        }
        // The tool comes back by the lead before the zone's end, less the error of the measured speed.
        let settings = self.machine.settings();
        let lead_in_ms = settings.get(Setting::LeadInMs).min(settings.get(Setting::LeadOutMs));
        let ahead = tool + (0.8 * self.speed * f64::from(lead_in_ms) / 1000.0) as i64;
        let zone = self.model.next_canopy(ahead, self.speed > 0.0, self.ticks(Setting::MarginMm));
        // The machine may have dropped a narrow one as dust, and leave for the next.
        let left_for = self.left_for.map(|stretch| stretch.leading);
        let again = zone.is_some_and(|zone| left_for == Some(zone.leading) && self.model.is_wide(&zone));
        prop_assert!(!again, "at {tool} the tool leaves again for {zone:?}, at {:.0} ticks/s", self.speed);
        self.left_for = zone;
        self.steady_swings += 1;
        Ok(())
    }

    /// Checks that the detection just classified as a weed is one of the model's, seen whole.
    pub(super) fn check_weed(&mut self) -> Checked {
        let Some(width_mm) = self.machine.take_weed() else { return Ok(()) };
        let wheel = self.machine.settings().wheel();
        // A millimetre, rounded up.
        let millimetre = i64::from(wheel.ticks(1).0) + 1;
        let weed = self.model.weed(self.here(), wheel.ticks(width_mm as u16).0.into(), millimetre);
        // A weed that only the second beam saw opens no ground.
        let is_right = weed.is_ok() || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{}", weed.unwrap_err());
        Ok(())
    }

    /// Takes a line that the machine wrote, if it is an event or a greeting.
    pub(super) fn hear(&mut self, line: &str) -> Checked {
        if line.starts_with("guarded ") {
            return self.check_guarded(line);
        }
        if line.starts_with("weed ") {
            let width = value(line, "hold").map(i64::from).unwrap_or(0) - 2 * self.ticks(Setting::MarginMm);
            let behind = self.reported(line) - self.here();
            if let Some(stand) = &mut self.stand {
                stand.mistake(self.ground as i64 + behind, width, behind);
            }
        }
        if ["alarm ", "warning ", "weeder "].iter().any(|event| line.starts_with(event)) {
            self.events.push(line.to_owned());
        }
        Ok(())
    }

    /// The position that an event reports.
    fn reported(&self, line: &str) -> i64 {
        let here = self.here();
        let position = value(line, "pos").unwrap_or_default();
        here + i64::from(position.wrapping_sub(self.machine.own_count(here)))
    }

    /// Checks that a plant was due where the machine reports that it guards one.
    fn check_guarded(&mut self, line: &str) -> Checked {
        let due = self.reported(line);
        // The machine decided a moment ago, and its settings may have changed since.
        let guarded: Vec<_> =
            self.guard_spacings.iter().map(|&spacing| self.model.guard(due, spacing, self.guard_scatter)).collect();
        let is_right = guarded.iter().any(Result::is_ok) || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{guarded:?}");
        Ok(())
    }

    pub(super) fn check_tool_stuck(&self, state: State) -> Checked {
        let is_false = state == State::Alarm(Alarm::ToolStuck) && !self.tool_was_stuck;
        prop_assert!(!is_false, "an end switch that follows the tool within {SWITCH_DELAY_US} us is an alarm");
        Ok(())
    }
}

/// The number of a key in an event.
fn value(line: &str, key: &str) -> Option<i32> {
    let value = line.split(' ').find_map(|word| word.strip_prefix(key)?.strip_prefix('='))?;
    value.parse().ok()
}
