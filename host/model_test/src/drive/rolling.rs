//! Rolls the machine over the row: speed, wheel and encoder, and the beams' edges at plants and weeds.

use super::Drive;
use crate::{
    machine::{Checked, Machine},
    run::{Encoder, TICKS_A_MM},
};
use control::settings::Setting;

/// The end switch reports the tool's arrival after this time.
pub(super) const SWITCH_DELAY_US: u64 = 60_000;

impl<M: Machine> Drive<M> {
    pub(super) fn roll(&mut self, ticks: f64, speed: f64) -> Checked {
        let (from, begun_us) = (self.ground, self.world.time_us);
        // The time of a turn in the other direction.
        let most_us = ((ticks / speed).abs() * 1e6) as u64 + 5_000_000;
        if self.target != speed {
            self.disturb();
        }
        self.target = speed;
        while (self.ground - from) * ticks.signum() < ticks.abs() && self.world.time_us < begun_us + most_us {
            self.turn()?;
        }
        Ok(())
    }

    pub(super) fn stop(&mut self) {
        (self.speed, self.target) = (0.0, 0.0);
        self.disturb();
    }

    pub(super) fn turns(&mut self, turns: u32) -> Checked {
        self.disturb();
        let passed = (0..turns).try_for_each(|_| self.turn());
        self.disturb();
        passed
    }

    /// A turn of the machine's loop.
    pub(super) fn turn(&mut self) -> Checked {
        self.turns += 1;
        let before = self.world;
        // A detection below the minimum width is dust, and causes no event.
        let narrow_mm = M::NARROW_MM.max(self.machine.settings().get(Setting::MinWidthMm));
        self.model.follow(self.here(), self.machine.settings(), narrow_mm);
        self.response_ms = self.response_ms.max(self.machine.settings().get(Setting::BeamResponseMs));
        let leads_ms = [Setting::LeadOutMs, Setting::LeadInMs].map(|lead| self.machine.settings().get(lead));
        self.leads_turns = if leads_ms == self.leads_ms { self.leads_turns.saturating_add(1) } else { 0 };
        self.leads_ms = leads_ms;
        self.guard_scatter = self.guard_scatter.min(self.ticks(Setting::GuardScatterMm));
        self.had_second_beam |= self.ticks(Setting::SecondBeamMm) > 0;
        let spacing = self.ticks(Setting::GuardSpacingMm);
        if spacing > 0 && !self.guard_spacings.contains(&spacing) {
            self.guard_spacings.push(spacing);
        }

        self.world.time_us += self.beginning.turn_us;
        let seconds = self.beginning.turn_us as f64 / 1e6;
        let most = f64::from(self.beginning.mm_s2) * TICKS_A_MM * seconds;
        self.speed += (self.target - self.speed).clamp(-most, most);
        let turned = if self.encoder == Encoder::Works { self.speed * self.wheel.turns_a_tick } else { 0.0 };
        self.speeds.take(self.world.time_us, turned);
        self.roll_by(self.speed * seconds)?;
        let rolled = (self.speed * seconds).abs();
        self.rolled += rolled;
        self.weeded += if self.machine.tool_out() { 0.0 } else { rolled };
        let tool_is_out = self.out_since_us.is_some_and(|since_us| since_us + SWITCH_DELAY_US <= self.world.time_us);
        self.world.end_switch_on = tool_is_out && !self.tool_is_stuck;
        self.step(&before)?;
        self.attend_to_the_console()
    }

    /// Rolls by this many ticks, past the plants and weeds there.
    pub(super) fn roll_by(&mut self, ticks: f64) -> Checked {
        let from = self.ground.floor() as i64;
        self.ground += ticks;
        let to = self.ground.floor() as i64;
        let (moves, direction) = ((to - from).abs(), (to - from).signum());
        for place in 1..=moves {
            let turned = self.wheel.roll(from + (place - 1) * direction, direction > 0);
            let counted = match self.encoder {
                Encoder::Works => turned,
                Encoder::Silent => 0,
                Encoder::OneChannel => turned.abs() * (1 - 2 * (self.wheel.ticks() & 1)),
            };
            for _ in 0..counted.abs() {
                self.world.count += counted.signum();
                self.machine.count(counted > 0);
            }
            if let Some(stand) = &mut self.stand {
                stand.lose_ticks(turned - counted);
            }
            self.beam_at(from + place * direction)?;
        }
        self.beam_at(to)
    }

    fn beam_at(&mut self, ground: i64) -> Checked {
        self.farthest = self.farthest.max(ground);
        let stands_at =
            |row: &[bool], place: i64| place <= self.bare_from && row[place.rem_euclid(row.len() as i64) as usize];
        let apart = self.geometry.map_or_else(|| self.ticks(Setting::SecondBeamMm), |real| real.second_beam);
        let [first, second] = &self.row;
        let (broken, second_broken) = (stands_at(first, ground), apart > 0 && stands_at(second, ground - apart));
        if second_broken != self.world.second_broken {
            self.second_edge(second_broken);
        }
        if broken == self.world.broken { Ok(()) } else { self.edge(broken) }
    }

    /// The first beam changes its level.
    pub(super) fn edge(&mut self, broken: bool) -> Checked {
        self.world.broken = broken;
        if !self.edges_get_lost {
            self.machine.beam_edge(&self.world);
            self.check_weed()?;
        }
        self.model.edge(self.here(), broken, self.blur());
        Ok(())
    }

    /// The second beam changes its level.
    pub(super) fn second_edge(&mut self, broken: bool) {
        self.world.second_broken = broken;
        if !self.edges_get_lost {
            self.machine.beam_edge(&self.world);
        }
    }

    /// Error of the machine's positions, in ticks, from the sensor response that it expects: this sensor answers at once.
    pub(super) fn blur(&self) -> i64 {
        let (slowest, fastest) = self.speeds.extremes();
        (fastest.max(-slowest) * f64::from(self.response_ms) / 1000.0) as i64 + 1
    }
}
