//! Rolls a machine along a row, executes the steps of a run, and checks the machine after every turn of its loop.
//!
//! The ground is counted in ticks of the encoder. The trait [`Machine`] hides whether the machine is the decisions
//! alone or the firmware in an Uno. Facts that are visible only in the decisions are checked only there. This file
//! executes steps. `physics` has the real machine, and rolls it. `console` types lines and follows their effects.
//! `expectations` compares the tool with the model, and `restart` resets the machine.
//!
//! [`Drive::go`] executes a run on a new machine. A soak keeps one drive for hours: it draws its steps one by one
//! ([`Drive::execute`]), and takes the machine from row to row ([`Drive::enter_row`]).

mod console;
mod expectations;
mod physics;
mod restart;

pub use console::is_end;

use crate::{
    machine::{Checked, Machine, World},
    run::{Beginning, Encoder, Run, Step, TEST_WATCHDOG, TICKS_A_MM},
    stand::{Geometry, Score},
};
use console::Console;
use control::{measure::reset::Cause, operate::state::State, settings::Setting};
use expectations::Expectations;
use physics::Physics;
use proptest::prelude::*;
use restart::Saves;

/// Ticks behind the row after which the firmware's monitors no longer count its plants.
const BEHIND_THE_ROW: i64 = 500;

/// Interval of `status` on the way back to work, for a machine that is not open.
const ASKED_EVERY_US: u64 = 300_000;

/// Edges of dust in one turn that overflow the machine's queue.
const TOO_MANY: u32 = 40;

/// A machine on a row, see the module's documentation. Its methods fail if a check fails.
#[derive(Debug)]
pub struct Drive<M> {
    machine: M,
    physics: Physics,
    console: Console,
    expectations: Expectations,
}

impl<M: Machine> Drive<M> {
    /// Starts a new machine with `boot`. The operator clears the alarm about its settings.
    ///
    /// # Errors
    /// If it does not start, or a check fails.
    pub fn new(
        run: &Run,
        boot: impl FnOnce(&Beginning, &World) -> Result<M, TestCaseError>,
    ) -> Result<Self, TestCaseError> {
        let physics = Physics::new(run);
        let machine = boot(&run.beginning, &physics.world)?;
        let expectations = Expectations::new(run, &physics.world);
        let mut drive = Self { machine, physics, console: Console::default(), expectations };
        drive.say("clear")?;
        Ok(drive)
    }

    /// Executes a run, and brings the machine back to work. Returns the number of checked turns.
    pub fn go(
        run: &Run,
        boot: impl FnOnce(&Beginning, &World) -> Result<M, TestCaseError>,
    ) -> Result<u64, TestCaseError> {
        let mut drive = Self::new(run, boot)?;
        run.steps.iter().try_for_each(|step| drive.execute(step))?;
        // Where the real plants are checked, the row goes on.
        if drive.expectations.stand.is_none() {
            drive.come_back_to_work()?;
        }
        Ok(drive.physics.world.time_us / drive.physics.turn_us)
    }

    /// Carries the machine to the headland of another row, and resets it there.
    pub fn enter_row(&mut self, run: &Run, geometry: Geometry, stem_zone: i64) -> Checked {
        self.stop();
        self.physics.enter_row(run, geometry);
        self.expectations.stand.get_or_insert_default().replace(run, stem_zone);
        self.init(Cause::ResetPin, None)
    }

    /// Executes a step, and checks the machine.
    pub fn execute(&mut self, step: &Step) -> Checked {
        self.start_step(step)?;
        self.look()
    }

    fn start_step(&mut self, step: &Step) -> Checked {
        match *step {
            // The Uno would be reset while it answers, so only the decisions get this line.
            Step::Type(ref line) if line == TEST_WATCHDOG => {
                if M::IS_OPEN {
                    self.say(line)?;
                }
                if self.machine.has_heartbeat() { Ok(()) } else { self.init(Cause::LoopStalled, None) }
            }
            Step::Type(ref line) => self.say(line),
            Step::Roll { mm, mm_s } => self.roll(f64::from(mm) * TICKS_A_MM, f64::from(mm_s) * TICKS_A_MM),
            Step::Stand { ms } => {
                self.physics.target = 0.0;
                self.turns_for(ms)
            }
            Step::Tremble { times } => {
                self.stop();
                (0..times).try_for_each(|time| {
                    self.roll_by(f64::from(time % 2 * 2) - 1.0)?;
                    self.turn()
                })
            }
            Step::Switch { on } => {
                self.physics.world.switch_on = on;
                self.turn()
            }
            Step::Dust { times, on_second: false } => {
                (0..2 * times).try_for_each(|_| self.edge(!self.physics.world.broken))
            }
            Step::Dust { times, on_second: true } => {
                (0..2 * times).for_each(|_| self.second_edge(!self.physics.world.second_broken));
                Ok(())
            }
            Step::LoseEdges { turns } if M::IS_OPEN => {
                self.physics.edges_get_lost = true;
                self.turns(turns)?;
                self.physics.edges_get_lost = false;
                self.machine.lose_edges(&self.physics.world)?;
                self.expectations.model.lose_edges();
                prop_assert!(is_alarm(self.machine.state()) || self.expectations.is_tried, "lost edges are no alarm");
                Ok(())
            }
            Step::LoseEdges { turns } => {
                (0..TOO_MANY).try_for_each(|_| self.edge(!self.physics.world.broken))?;
                self.turns(turns)
            }
            Step::Silence { ms, encoder } => {
                (self.physics.encoder, self.expectations.model.is_shifted) = (encoder, true);
                self.turns_for(ms)?;
                self.physics.encoder = Encoder::Works;
                Ok(())
            }
            Step::Spike { ticks, times } => (0..times).try_for_each(|_| {
                let Self { machine, physics, expectations, .. } = self;
                let ticks = if physics.speed < 0.0 { -ticks } else { ticks };
                expectations.model.loosen(machine.spike(&mut physics.world, ticks));
                // The speed is measured over 10 ms, so a spike looks like a speed of its own.
                expectations.speeds.take(physics.world.time_us, physics.speed + f64::from(ticks) / 0.01);
                self.turn()
            }),
            Step::Reset(cause) => self.init(cause, None),
            Step::Spoil { address, byte } => {
                self.machine.spoil(address, byte)?;
                self.expectations.saves.is_spoiled = true;
                self.init(Cause::PowerOn, None)
            }
            Step::CutPower { line, turns, byte } => {
                self.type_in(line);
                self.turns(turns)?;
                self.init(Cause::PowerOn, Some(byte))
            }
            Step::LowerStack { turns } => {
                self.physics.world.stack_is_low = true;
                self.turns(turns)?;
                self.physics.world.stack_is_low = false;
                // The firmware remembers the deepest stack until a reset.
                if M::IS_OPEN { Ok(()) } else { self.init(Cause::ResetPin, None) }
            }
            Step::Slip { permille } => {
                self.physics.wheel.turns_a_tick = 1.0 + f64::from(permille) / 1000.0;
                Ok(())
            }
            Step::StickTool { stuck } => {
                self.physics.tool_is_stuck = stuck;
                self.physics.tool_was_stuck |= stuck;
                self.turn()
            }
        }
    }

    /// Repairs every fault and ends the row. The operator clears the alarm, starts, and drives on until the tool is in. On the
    /// way back through the row there may be more alarms.
    pub fn come_back_to_work(&mut self) -> Checked {
        let physics = &mut self.physics;
        (physics.tool_is_stuck, physics.world.switch_on, physics.bare_from) = (false, false, physics.farthest);
        self.stop();
        self.turns_for(1500)?;
        if self.machine.ticks(Setting::BeamToToolMm) > 4000 {
            self.say("clear")?;
            self.say("defaults")?;
        }
        self.look()?;
        let beam_to_tool = self.machine.ticks(Setting::BeamToToolMm);
        let metre = f64::from(self.machine.settings().wheel().ticks(1000).0);
        // The machine rolls over seen and forgotten ground, and on until known ground reaches the tool.
        let farthest = self.physics.farthest.max(self.position());
        let end =
            farthest + self.unseen_row() + 2 * beam_to_tool + self.machine.ticks(Setting::MarginMm) + metre as i64;
        // Slower if a plant that only the second beam sees would reach the tool.
        let lead_s = f64::from(self.machine.settings().get(Setting::LeadOutMs) + 1) / 1000.0;
        let from_beam = (beam_to_tool - self.machine.ticks(Setting::SecondBeamMm)) as f64;
        self.physics.target = 0.5 * (self.machine.ticks(Setting::TopSpeedMmS) as f64).min(from_beam / lead_s);
        let mut asked_us = self.physics.world.time_us;
        while self.machine.tool_out() || self.expectations.is_tried {
            if !M::IS_OPEN && self.physics.world.time_us > asked_us + ASKED_EVERY_US {
                self.look()?;
                asked_us = self.physics.world.time_us;
            }
            if self.machine.state() != State::Work {
                self.say("clear")?;
                self.say("start")?;
                self.look()?;
            }
            self.turn()?;
            let there = self.position();
            // The plants of the last turn are still counted.
            let is_bare = there > self.physics.bare_from + BEHIND_THE_ROW + self.unseen_row();
            prop_assert!(!is_bare || !is_alarm(self.machine.state()), "{:?} on bare ground", self.machine.state());
            let (state, reason) = (self.machine.state(), self.machine.reason());
            prop_assert!(there < end, "the tool does not come back to work: {state:?}, {reason:?}");
        }
        Ok(())
    }

    /// Ticks behind the row over which the machine may guard missed plants.
    fn unseen_row(&self) -> i64 {
        let settings = [Setting::GuardSpacingMm, Setting::GuardScatterMm, Setting::MarginMm];
        let [spacing, scatter, margin] = settings.map(|setting| self.machine.ticks(setting));
        if spacing == 0 { 0 } else { 4 * (spacing + scatter + margin) }
    }

    /// The machine.
    pub fn machine(&self) -> &M {
        &self.machine
    }

    /// The real position in ticks: 0 in the headland of the row.
    pub fn position(&self) -> i64 {
        self.physics.ground as i64
    }

    /// Seconds since the run began.
    pub fn time_s(&self) -> f64 {
        self.physics.world.time_us as f64 / 1e6
    }

    /// The result of the present row.
    pub fn score(&self) -> Score {
        let [metres, weeded_metres] = self.physics.rolled.map(|ticks| ticks / TICKS_A_MM / 1000.0);
        let mut score = Score { metres, weeded_metres, ..Score::default() };
        self.expectations.stand.iter().for_each(|stand| stand.add_to(&mut score));
        score
    }

    /// Takes the alarms, warnings and greetings that the machine wrote.
    pub fn take_events(&mut self) -> Vec<String> {
        std::mem::take(&mut self.console.events)
    }

    /// Swings out at a steady speed, each for another keep-out zone.
    pub fn steady_swings(&self) -> u32 {
        self.expectations.steady_swings
    }

    /// Ends a steady stretch.
    fn disturb(&mut self) {
        self.expectations.disturb(self.physics.world.time_us);
    }

    /// The position by the machine's count.
    fn here(&self) -> i64 {
        self.machine.place(self.physics.world.count)
    }
}

fn is_alarm(state: State) -> bool {
    matches!(state, State::Alarm(_))
}
