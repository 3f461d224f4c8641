//! The facts that must hold by the model, and the checks of the tool and of the events against them.
//!
//! For some turns after a change the machine may still use the earlier state. In these turns nothing is checked.

use super::{Drive, Physics, Saves, is_alarm};
use crate::{
    machine::{Checked, Machine, World},
    model::{Model, Stretch},
    run::{Encoder, Run},
    speeds::Speeds,
    stand::Stand,
};
use control::{
    operate::{state::State, tool::Reason},
    settings::Setting,
};
use proptest::prelude::*;

/// Resolution of the measured speed, in ticks a second: twice a tick in 10 ms.
const SPEED_RESOLUTION: f64 = 200.0;

/// At a steady speed of at least [`STEADY_SPEED`] ticks a second, the measured speed is right after this time.
const STEADY_US: u64 = 1_200_000;
const STEADY_SPEED: f64 = 60.0;

/// Turns after which new leads have an effect.
const RECALCULATION_TURNS: u32 = 3;

/// The tool's position, while the machine rolls between two speeds in ticks a second.
#[derive(Clone, Copy, Debug)]
struct Place {
    tool: i64,
    slowest: f64,
    fastest: f64,
}

/// The facts that must hold, and those in doubt.
#[derive(Debug, Default)]
pub(super) struct Expectations {
    /// The ground as the beam saw it, and the real plants, if they are checked.
    pub(super) model: Model,
    pub(super) stand: Option<Stand>,
    pub(super) saves: Saves,
    /// The speeds of the encoder's count.
    pub(super) speeds: Speeds,
    /// The time since which the machine has rolled steadily and undisturbed.
    calm_since_us: u64,
    /// The canopy for which the tool last left the row in that time.
    left_for: Option<Stretch>,
    /// Whether the tool was in the row in the last turn.
    was_in_row: bool,
    /// The time and position at which the tool was first seen in the row over a canopy: it may be on its way out.
    suspect: Option<(u64, Place)>,
    /// Whether the machine works, as far as is known.
    pub(super) works: bool,
    /// Whether a test on the bench is running, so that the tool may be in the row.
    pub(super) is_tried: bool,
    /// Turns in which the tool was out for a plant that the model does not know.
    unexplained_turns: u32,
    /// Swings out at a steady speed, each for another keep-out zone.
    pub(super) steady_swings: u32,
    /// The longest response that was set: the machine may expect that of a moment ago.
    response_ms: u16,
    /// The leads out and in, ms, and the turns since they were set.
    leads_ms: [u16; 2],
    leads_turns: u32,
    /// The least scatter and every spacing that were set: the machine may guard by values of a moment ago.
    guard_scatter: i64,
    guard_spacings: Vec<i64>,
    /// Whether there was a second beam since the machine started. It can only close more ground, which the model does
    /// not follow.
    had_second_beam: bool,
}

impl Expectations {
    pub(super) fn new(run: &Run, world: &World) -> Self {
        let stand = (!run.sights.is_empty()).then(|| Stand::new(run, 0));
        Self { model: Model::new(world.count, world.broken), stand, guard_scatter: i64::MAX, ..Self::default() }
    }

    /// The machine was reset, and has forgotten the ground.
    pub(super) fn restart(&mut self, machine: &impl Machine, physics: &Physics) {
        let world = &physics.world;
        self.model = Model::new(machine.place(world.count), world.broken);
        if let Some(stand) = &mut self.stand {
            stand.forget(world.time_us, &physics.geometry(machine));
        }
        // The measured speed is 0 until the first measurement.
        self.speeds = Speeds::default();
        self.speeds.take(world.time_us, 0.0);
        (self.suspect, self.works, self.is_tried, self.had_second_beam) = (None, false, false, false);
        self.disturb(world.time_us);
    }

    /// The machine works or not, with the beam at a position. Work begins on ground that the beam has yet to see, except after
    /// `start now`.
    pub(super) fn follow_work(&mut self, works: bool, keeps_ground: bool, here: i64) {
        if works && !self.works && !keeps_ground {
            self.model.see_again(here);
        }
        self.works = works;
    }

    /// Ends a steady stretch.
    pub(super) fn disturb(&mut self, now_us: u64) {
        (self.calm_since_us, self.left_for) = (now_us, None);
    }

    /// Applies the machine's present settings, at a position by its count.
    pub(super) fn follow<M: Machine>(&mut self, machine: &M, here: i64) {
        let get = |setting| machine.settings().get(setting);
        // A detection below the minimum width is dust, and causes no event.
        self.model.follow(here, machine.settings(), M::NARROW_MM.max(get(Setting::MinWidthMm)));
        self.response_ms = self.response_ms.max(get(Setting::BeamResponseMs));
        let leads_ms = [Setting::LeadOutMs, Setting::LeadInMs].map(get);
        self.leads_turns = if leads_ms == self.leads_ms { self.leads_turns.saturating_add(1) } else { 0 };
        self.leads_ms = leads_ms;
        self.guard_scatter = self.guard_scatter.min(machine.ticks(Setting::GuardScatterMm));
        self.had_second_beam |= machine.ticks(Setting::SecondBeamMm) > 0;
        let spacing = machine.ticks(Setting::GuardSpacingMm);
        if spacing > 0 && !self.guard_spacings.contains(&spacing) {
            self.guard_spacings.push(spacing);
        }
    }

    /// Error of the machine's positions, in ticks, from its expected sensor response. This sensor answers at once.
    pub(super) fn blur(&self) -> i64 {
        let (slowest, fastest) = self.speeds.extremes();
        (fastest.max(-slowest) * f64::from(self.response_ms) / 1000.0) as i64 + 1
    }

    /// Checks that the tool may be in the row. A tool over a canopy may be on its way out. If it is not, the ground at
    /// the first such position counts, because later the machine may have forgotten it.
    fn check<M: Machine>(&mut self, place: Place, machine: &M, now_us: u64) -> Checked {
        let margin = machine.ticks(Setting::MarginMm);
        let held = self.check_place(place, margin);
        match self.suspect {
            Some((since_us, first)) if since_us + M::LATENESS_US <= now_us => {
                self.suspect = None;
                self.check_place(first, margin)
            }
            None if held.is_err() && M::LATENESS_US > 0 => {
                self.suspect = Some((now_us, place));
                Ok(())
            }
            None => held,
            Some(_) => Ok(()),
        }
    }

    /// Checks the swinging tool against the real plants, in every state.
    fn check_stand<M: Machine>(&mut self, tool: i64, out: bool, machine: &M, physics: &Physics) -> Checked {
        let Some(stand) = &mut self.stand else { return Ok(()) };
        let (geometry, now_us) = (physics.geometry(machine), physics.world.time_us);
        if physics.encoder != Encoder::Works {
            stand.mistrust_speed(now_us, &geometry);
        }
        let clear = stand.follow(out, now_us, M::LATENESS_US, &geometry);
        let is_unseen = out && self.model.is_unseen(tool, 0);
        let ground = physics.ground.floor() as i64 - geometry.beam_to_tool;
        stand.judge(clear, ground, now_us, &geometry, is_unseen).map_err(TestCaseError::fail)
    }

    /// Checks a position of the tool in the row.
    fn check_place(&self, Place { tool, slowest, fastest }: Place, margin: i64) -> Checked {
        // With two beams the machine corrects slip, which the model of the ground does not know.
        if self.stand.is_some() && self.had_second_beam || self.leads_turns <= RECALCULATION_TURNS {
            return Ok(());
        }
        // The machine adds a millisecond to each lead, for the command's way to the pin.
        let lead = |milliseconds: u16| f64::from(milliseconds + u16::from(milliseconds > 0)) / 1000.0;
        let [lead_out, lead_in] = self.leads_ms.map(lead);
        let lead_in = (1.25 * lead_in).min(lead_out);
        let ticks = |speed: f64, seconds: f64| (speed * seconds) as i64;
        // Both orders lead in the direction of rolling, the order to leave at least by the slowest speed.
        let near = tool + ticks(fastest.max(0.0), lead_in) + 1;
        let far = tool + ticks(slowest.min(0.0), lead_in) - 1;
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
    fn check_reason(&mut self, Place { tool, slowest, fastest }: Place, machine: &impl Machine) -> Checked {
        // The machine expects at most 2.3 times its speed, and comes in only if the row is open for twice the lead.
        let lead_s = f64::from(machine.settings().get(Setting::LeadOutMs) + 1) / 1000.0;
        let reach = (4.6 * fastest.max(-slowest) * lead_s) as i64
            + machine.ticks(Setting::MarginMm)
            + self.model.widest_zone() / 2;
        let is_explained = machine.reason() != Some(Reason::Plant)
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
    fn check_swing(&mut self, tool: i64, machine: &impl Machine, physics: &Physics) -> Checked {
        let (speed, margin) = (physics.speed, machine.ticks(Setting::MarginMm));
        let is_calm = speed == physics.target
            && speed.abs() > STEADY_SPEED
            && self.calm_since_us + STEADY_US < physics.world.time_us
            && machine.reason().is_none_or(|reason| reason == Reason::Plant)
            && !self.model.is_unseen(tool, margin)
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
        let settings = machine.settings();
        let lead_in_ms = settings.get(Setting::LeadInMs).min(settings.get(Setting::LeadOutMs));
        let ahead = tool + (0.8 * speed * f64::from(lead_in_ms) / 1000.0) as i64;
        let zone = self.model.next_canopy(ahead, speed > 0.0, margin);
        // The machine may have dropped a narrow one as dust, and leave for the next.
        let left_for = self.left_for.map(|stretch| stretch.leading);
        let again = zone.is_some_and(|zone| left_for == Some(zone.leading) && self.model.is_wide(&zone));
        prop_assert!(!again, "at {tool} the tool leaves again for {zone:?}, at {speed:.0} ticks/s");
        self.left_for = zone;
        self.steady_swings += 1;
        Ok(())
    }

    /// Checks that the detection just classified as a weed is one of the model's, seen whole.
    pub(super) fn check_weed(&mut self, machine: &mut impl Machine, count: i64) -> Checked {
        let Some(width_mm) = machine.take_weed() else { return Ok(()) };
        let wheel = machine.settings().wheel();
        // A millimetre, rounded up.
        let millimetre = i64::from(wheel.ticks(1).0) + 1;
        let weed = self.model.weed(machine.place(count), wheel.ticks(width_mm as u16).0.into(), millimetre);
        // A weed that only the second beam saw opens no ground.
        let is_right = weed.is_ok() || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{}", weed.unwrap_err());
        Ok(())
    }

    /// Checks that a plant was due where the machine reports that it guards one.
    pub(super) fn check_guarded(&mut self, due: i64) -> Checked {
        // The machine decided a moment ago, and its settings may have changed since.
        let guarded: Vec<_> =
            self.guard_spacings.iter().map(|&spacing| self.model.guard(due, spacing, self.guard_scatter)).collect();
        let is_right = guarded.iter().any(Result::is_ok) || self.model.is_in_doubt() || self.had_second_beam;
        prop_assert!(is_right, "{guarded:?}");
        Ok(())
    }
}

impl<M: Machine> Drive<M> {
    /// Runs a turn of the machine's loop, and checks it.
    pub(super) fn check_turn(&mut self, before: &World) -> Checked {
        let Self { machine, physics, expectations, .. } = self;
        let (state_before, now_us) = (machine.state(), physics.world.time_us);
        let position = machine.turn(before, &physics.world)?;
        expectations.model.roll_to(position, expectations.blur());
        let (state, out) = (machine.state(), machine.tool_out());
        expectations.check_weed(machine, physics.world.count)?;
        expectations.is_tried &= !M::IS_OPEN || state == state_before;
        if !machine.settings_are_in_doubt() {
            machine.check_pulse(expectations.is_tried)?;
        }
        physics.out_since_us = machine.is_sent_out().then(|| physics.out_since_us.unwrap_or(now_us));
        if state != state_before {
            expectations.follow_work(state == State::Work, false, position);
            expectations.disturb(now_us);
            if let Some(stand) = expectations.stand.as_mut().filter(|_| is_alarm(state)) {
                stand.forget(now_us, &physics.geometry(machine));
            }
        }
        if M::IS_OPEN && state != state_before {
            prop_assert!(state != State::Work || physics.world.switch_on, "the machine started work by itself");
            prop_assert!(!is_alarm(state_before) || !physics.world.switch_on, "{state_before:?} was cleared by itself");
            physics.check_tool_stuck(state)?;
        }
        prop_assert!(!M::IS_OPEN || !physics.world.stack_is_low || is_alarm(state), "a low stack is no alarm");
        let works = if M::IS_OPEN { state == State::Work } else { !expectations.is_tried };
        let (slowest, fastest) = expectations.speeds.extremes();
        let (slowest, fastest) = (slowest - SPEED_RESOLUTION, fastest + SPEED_RESOLUTION);
        let tool = position - machine.ticks(Setting::BeamToToolMm);
        let place = Place { tool, slowest, fastest };
        expectations.check_stand(tool, out || expectations.is_tried, machine, physics)?;
        if out || !works || machine.settings_are_in_doubt() {
            expectations.suspect = None;
        } else {
            expectations.check(place, machine, now_us)?;
        }
        if M::IS_OPEN && works && out {
            expectations.check_reason(place, machine)?;
        }
        if works && out && expectations.was_in_row {
            expectations.check_swing(tool, machine, physics)?;
        }
        expectations.was_in_row = !out;
        Ok(())
    }
}
