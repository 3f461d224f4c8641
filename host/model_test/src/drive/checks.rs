//! Checks of the tool and of the events against the model.
//!
//! For some turns after a change the machine may still use the earlier state. In these turns nothing is checked.

use super::{Drive, Place};
use crate::machine::{Checked, Machine};
use control::{operate::tool::Reason, settings::Setting};
use proptest::prelude::*;

/// At a steady speed, the measured one is right after this time, if it is no slower than this.
const STEADY_US: u64 = 1_200_000;
const STEADY_SPEED: f64 = 60.0;

/// What the machine rolls in two turns of its loop, in ticks, at the speeds at which the ground is judged by its plants.
const TURN: i64 = 4;

impl<M: Machine> Drive<M> {
    /// The tool is in the row, and may be. One that goes over a canopy may be on its way out; and where it does not go, what was known
    /// of the ground may have changed at that moment.
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

    /// Checks that the tool is not in a plant, for every slip of the wheel, and for either beam that has seen it.
    fn check_plants(&self, plants: &[(i64, i64)], tool: i64) -> Checked {
        let in_row = tool.rem_euclid(self.row[0].len() as i64);
        let is_in = |&&(from, to): &&(i64, i64)| (from + TURN..to - TURN).contains(&in_row);
        // One that stands where the run began or where the row was cut off was not seen, or in part.
        let begin = tool - in_row;
        let hit = plants.iter().find(is_in).filter(|(from, to)| begin + from > 0 && begin + to <= self.bare_from);
        prop_assert!(
            hit.is_none(),
            "the tool is in the row at {tool} ticks of ground, at {in_row} of the row, in a plant from and to {hit:?}"
        );
        Ok(())
    }

    /// The tool may be in the row.
    fn check_place(&self, Place { tool, ground, slowest, fastest }: Place) -> Checked {
        if let Some(plants) = &self.plants {
            return self.check_plants(plants, ground);
        }
        let settings = self.machine.settings();
        // The machine adds a millisecond to each lead, for the command's way to the pin.
        let lead = |milliseconds: u16| f64::from(milliseconds + u16::from(milliseconds > 0)) / 1000.0;
        let lead_out = lead(settings.get(Setting::LeadOutMs));
        let lead_in = (1.25 * lead(settings.get(Setting::LeadInMs))).min(lead_out);
        let ticks = |speed: f64, seconds: f64| (speed * seconds) as i64;
        // Coming back is led, in the direction of rolling; so is leaving, by as much as the slowest speed makes it.
        let near = tool + ticks(fastest.max(0.0), lead_in) + 1;
        let far = tool + ticks(slowest.min(0.0), lead_in) - 1;
        let margin = self.ticks(Setting::MarginMm);
        let (from, to) = if slowest > 0.0 {
            prop_assert!(!self.model.is_unseen(near), "the tool is in the row at {tool}, where nothing has been seen");
            (near, tool + ticks(slowest, lead_out))
        } else if fastest < 0.0 {
            (tool + ticks(fastest, lead_out), far)
        } else {
            (near, far)
        };
        let canopy = if from <= to {
            self.model.canopy_between(from, to, margin)
        } else {
            // At speeds as different as these, or rolling forward and back in the same second, it may be either way: what is
            // closed all over is closed.
            self.model.canopies_all_over(to, from, margin)
        };
        prop_assert!(
            canopy.is_none(),
            "the tool is in the row at {tool}, rolling {slowest:.0} to {fastest:.0} ticks/s, margin {margin}, leads \
             {lead_out} s and {lead_in} s: {canopy:?}"
        );
        Ok(())
    }

    /// The tool has left the row: at a steady speed, not for the canopy for which it left before.
    pub(super) fn check_swing(&mut self, tool: i64) -> Checked {
        let is_calm = self.speed == self.target
            && self.speed.abs() > STEADY_SPEED
            && self.calm_since_us + STEADY_US < self.world.time_us
            && self.machine.reason().is_none_or(|reason| reason == Reason::Plant)
            && !self.model.is_unseen(tool)
            // What is guarded may not have been told.
            && self.guard_spacings.is_empty()
            && !self.had_second_beam
            // Nor is it told what a canopy is taken for.
            && !self.model.keeps_stems()
            && !self.model.is_in_doubt();
        if !is_calm {
            self.left_for = None;
            return Ok(());
        }
        // A window is left, and over, by the lead before its end, the less as the measured speed wavers.
        let settings = self.machine.settings();
        let lead_in_ms = settings.get(Setting::LeadInMs).min(settings.get(Setting::LeadOutMs));
        let ahead = tool + (0.8 * self.speed * f64::from(lead_in_ms) / 1000.0) as i64;
        let window = self.model.next_window(ahead, self.speed > 0.0, self.ticks(Setting::MarginMm));
        let again =
            window.is_some() && window.map(|stretch| stretch.leading) == self.left_for.map(|stretch| stretch.leading);
        prop_assert!(!again, "at {tool} the tool leaves again for {window:?}, at {:.0} ticks/s", self.speed);
        self.left_for = window;
        self.steady_swings += 1;
        Ok(())
    }

    /// What the machine has just taken for a weed was one, as the model saw it.
    pub(super) fn check_weed(&mut self) -> Checked {
        let Some(width_mm) = self.machine.take_weed() else { return Ok(()) };
        let wheel = self.machine.settings().wheel();
        // A millimetre, and what lies between it and the next.
        let millimetre = i64::from(wheel.ticks(1).0) + 1;
        let told = self.model.weed(self.here(), wheel.ticks(width_mm as u16).0.into(), millimetre);
        // One that only the second beam has seen opens nothing.
        let is_right = told.is_ok() || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{}", told.unwrap_err());
        Ok(())
    }

    /// What the machine says that it guards is where a plant was due.
    pub(super) fn check_guarded(&mut self, line: &str) -> Checked {
        let Some(told) = line.strip_prefix("guarded pos=").and_then(|place| place.parse::<i32>().ok()) else {
            return Ok(());
        };
        let here = self.here();
        let due = here + i64::from(told.wrapping_sub(self.machine.own_count(here)));
        // It was decided a moment ago, and the settings may have changed since.
        let guarded: Vec<_> =
            self.guard_spacings.iter().map(|&spacing| self.model.guard(due, spacing, self.guard_scatter)).collect();
        let is_right = guarded.iter().any(Result::is_ok) || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{guarded:?}");
        Ok(())
    }
}
