//! Rolls a machine along a row, executes the steps of a run, and checks the machine after every turn of its loop.
//!
//! The ground is counted in ticks of the encoder. The trait [`Machine`] hides whether the machine is the decisions
//! alone or the firmware in an Uno. Facts that are visible only in the decisions are checked only there. This file
//! executes steps, `rolling` rolls the machine, and `restart` resets it. `checks` compares the tool with the model, and
//! `console` types lines and follows their effects.
//!
//! [`Drive::go`] executes a run on a new machine. A soak keeps one drive for hours: it draws its steps one by one
//! ([`Drive::execute`]), and takes the machine from row to row ([`Drive::enter_row`]).

mod checks;
mod console;
mod restart;
mod rolling;

pub use console::is_end;

use crate::{
    machine::{Checked, Machine, World},
    model::{Model, Stretch},
    run::{Beginning, Encoder, Run, Step, TEST_WATCHDOG, TICKS_A_MM},
    speeds::Speeds,
    stand::{Geometry, Score, Stand},
};
use control::{
    ground::class::Listed,
    measure::reset::Cause,
    operate::state::State,
    settings::{Setting, Settings},
    units::LengthScale,
};
use field::wheel::Wheel;
use proptest::prelude::*;

/// Resolution of the measured speed, in ticks a second: twice a tick in 10 ms.
const SPEED_RESOLUTION: f64 = 200.0;

/// Ticks behind the row after which the firmware's monitors no longer count its plants.
const BEHIND_THE_ROW: i64 = 500;

/// Interval of `status` on the way back to work, for a machine that is not open.
const ASKED_EVERY_US: u64 = 300_000;

/// Edges of dust in one turn that overflow the machine's queue.
const TOO_MANY: u32 = 40;

/// The tool's position, while the machine rolls between two speeds in ticks a second.
#[derive(Clone, Copy, Debug)]
struct Place {
    tool: i64,
    slowest: f64,
    fastest: f64,
}

/// A machine on a row, see the module's documentation. Its methods fail if a check fails.
#[derive(Debug)]
pub struct Drive<M> {
    machine: M,
    /// The line that the machine is answering.
    current: String,
    /// The lines that it wrote in the last turn.
    written: Vec<String>,
    /// The alarms, warnings and greetings that the machine wrote, until the caller takes them.
    pub events: Vec<String>,
    /// The settings of the last acknowledged save, and those of a save in progress.
    saved: Option<Settings>,
    saving: Option<Settings>,
    /// Whether the machine may have measured other leads before it saved.
    leads_in_doubt: bool,
    /// Whether a byte of the EEPROM was changed, so that the next start may find anything.
    is_spoiled: bool,
    taught: Vec<Listed>,
    model: Model,
    beginning: Beginning,
    /// The level of each beam at each tick of the row, and the real plants, if they are checked.
    row: [Vec<bool>; 2],
    stand: Option<Stand>,
    /// The real machine, where its settings may be wrong.
    geometry: Option<Geometry>,
    /// The tick from which on the row is bare, and the farthest tick that the beam has reached.
    bare_from: i64,
    farthest: i64,
    /// The sensors' levels.
    world: World,
    /// The real position in ticks, and the wheel.
    ground: f64,
    wheel: Wheel,
    /// The present and the intended speed, in ticks a second.
    speed: f64,
    target: f64,
    /// The speeds of the encoder's count.
    speeds: Speeds,
    /// The time since which the machine has rolled steadily and undisturbed.
    calm_since_us: u64,
    /// The canopy for which the tool last left the row in that time.
    left_for: Option<Stretch>,
    was_out: bool,
    /// The time and position at which the tool was first seen in the row over a canopy: it may be on its way out.
    suspect: Option<(u64, Place)>,
    /// Whether a test on the bench is running, so that the tool may be in the row.
    is_tried: bool,
    /// The resolution at which the machine remembers the ground.
    scale: LengthScale,
    encoder: Encoder,
    edges_get_lost: bool,
    tool_is_stuck: bool,
    /// Whether the tool was stuck since the machine started.
    tool_was_stuck: bool,
    out_since_us: Option<u64>,
    /// Turns in which the tool was out for a plant that the model does not know.
    unexplained_turns: u32,
    turns: u64,
    /// Swings out at a steady speed, each for another keep-out zone.
    pub steady_swings: u32,
    /// Ticks rolled in this row, and with the tool in the row.
    rolled: f64,
    weeded: f64,
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

impl<M: Machine> Drive<M> {
    /// Starts a new machine with `boot`. The operator clears the alarm about its settings.
    ///
    /// # Errors
    /// If it does not start, or a check fails.
    pub fn new(
        run: &Run,
        boot: impl FnOnce(&Beginning, &World) -> Result<M, TestCaseError>,
    ) -> Result<Self, TestCaseError> {
        let (beginning, row) = (run.beginning.clone(), run.levels());
        let world = World { count: beginning.count.into(), broken: row[0][0], ..World::default() };
        let machine = boot(&beginning, &world)?;
        let mut drive = Self {
            scale: scale(machine.settings()),
            machine,
            current: String::new(),
            written: Vec::new(),
            events: Vec::new(),
            saved: None,
            saving: None,
            leads_in_doubt: false,
            is_spoiled: false,
            taught: Vec::new(),
            model: Model::new(world.count, world.broken),
            beginning,
            row,
            stand: (!run.sights.is_empty()).then(|| Stand::new(run, 0)),
            geometry: None,
            bare_from: i64::MAX,
            farthest: 0,
            world,
            ground: 0.0,
            wheel: Wheel::default(),
            speed: 0.0,
            target: 0.0,
            speeds: Speeds::default(),
            calm_since_us: 0,
            left_for: None,
            was_out: true,
            suspect: None,
            is_tried: false,
            encoder: Encoder::Works,
            edges_get_lost: false,
            tool_is_stuck: false,
            tool_was_stuck: false,
            out_since_us: Some(0),
            unexplained_turns: 0,
            turns: 0,
            steady_swings: 0,
            rolled: 0.0,
            weeded: 0.0,
            guard_scatter: i64::MAX,
            guard_spacings: Vec::new(),
            had_second_beam: false,
            response_ms: 0,
            leads_ms: [0; 2],
            leads_turns: 0,
        };
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
        if drive.stand.is_none() {
            drive.come_back_to_work()?;
        }
        Ok(drive.turns)
    }

    /// Carries the machine to the headland of another row, and resets it there.
    pub fn enter_row(&mut self, run: &Run, geometry: Geometry, stem_zone: i64) -> Checked {
        self.stop();
        self.row = run.levels();
        (self.ground, self.farthest, self.wheel) = (0.0, 0, Wheel::default());
        (self.world.broken, self.world.second_broken) = (self.row[0][0], false);
        self.geometry = Some(geometry);
        (self.rolled, self.weeded) = (0.0, 0.0);
        self.stand.get_or_insert_default().replace(run, stem_zone);
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
                self.target = 0.0;
                self.turns((u64::from(ms) * 1000 / self.beginning.turn_us) as u32)
            }
            Step::Tremble { times } => {
                self.stop();
                (0..times).try_for_each(|time| {
                    self.roll_by(f64::from(time % 2 * 2) - 1.0)?;
                    self.turn()
                })
            }
            Step::Switch { on } => {
                self.world.switch_on = on;
                self.turn()
            }
            Step::Dust { times, on_second: false } => (0..2 * times).try_for_each(|_| self.edge(!self.world.broken)),
            Step::Dust { times, on_second: true } => {
                (0..2 * times).for_each(|_| self.second_edge(!self.world.second_broken));
                Ok(())
            }
            Step::LoseEdges { turns } if M::IS_OPEN => {
                self.edges_get_lost = true;
                self.turns(turns)?;
                self.edges_get_lost = false;
                self.machine.lose_edges(&self.world)?;
                self.model.lose_edges();
                prop_assert!(is_alarm(self.machine.state()) || self.is_tried, "lost edges are no alarm");
                Ok(())
            }
            Step::LoseEdges { turns } => {
                (0..TOO_MANY).try_for_each(|_| self.edge(!self.world.broken))?;
                self.turns(turns)
            }
            Step::Silence { ms, encoder } => {
                (self.encoder, self.model.is_shifted) = (encoder, true);
                self.turns((u64::from(ms) * 1000 / self.beginning.turn_us) as u32)?;
                self.encoder = Encoder::Works;
                Ok(())
            }
            Step::Spike { ticks, times } => (0..times).try_for_each(|_| {
                self.model.is_shifted = true;
                let ticks = if self.speed < 0.0 { -ticks } else { ticks };
                let off = self.machine.spike(&mut self.world, ticks);
                self.model.loosen(off);
                // The speed is measured over 10 ms, so a spike looks like a speed of its own.
                self.speeds.take(self.world.time_us, self.speed + f64::from(ticks) / 0.01);
                self.turn()
            }),
            Step::Reset(cause) => self.init(cause, None),
            Step::Spoil { address, byte } => {
                self.machine.spoil(address, byte)?;
                self.is_spoiled = true;
                self.init(Cause::PowerOn, None)
            }
            Step::CutPower { line, turns, byte } => {
                self.type_in(line);
                self.turns(turns)?;
                self.init(Cause::PowerOn, Some(byte))
            }
            Step::LowerStack { turns } => {
                self.world.stack_is_low = true;
                self.turns(turns)?;
                self.world.stack_is_low = false;
                // The firmware remembers the deepest stack until a reset.
                if M::IS_OPEN { Ok(()) } else { self.init(Cause::ResetPin, None) }
            }
            Step::Slip { permille } => {
                self.wheel.turns_a_tick = 1.0 + f64::from(permille) / 1000.0;
                Ok(())
            }
            Step::StickTool { stuck } => {
                self.tool_is_stuck = stuck;
                self.tool_was_stuck |= stuck;
                self.turn()
            }
        }
    }

    /// Repairs every fault and ends the row. The operator clears the alarm, starts, and drives on until the tool is in. On the
    /// way back through the row there may be more alarms.
    pub fn come_back_to_work(&mut self) -> Checked {
        (self.tool_is_stuck, self.world.switch_on, self.bare_from) = (false, false, self.farthest);
        self.stop();
        self.turns((1_500_000 / self.beginning.turn_us) as u32)?;
        if self.ticks(Setting::BeamToToolMm) > 4000 {
            self.say("clear")?;
            self.say("defaults")?;
        }
        self.look()?;
        let metre = f64::from(self.machine.settings().wheel().ticks(1000).0);
        // The machine rolls over seen and forgotten ground, and on until known ground reaches the tool.
        let end = self.farthest.max(self.ground as i64)
            + self.unseen_row()
            + 2 * self.ticks(Setting::BeamToToolMm)
            + self.ticks(Setting::MarginMm)
            + metre as i64;
        // Slower if a plant that only the second beam sees would reach the tool.
        let lead_s = f64::from(self.machine.settings().get(Setting::LeadOutMs) + 1) / 1000.0;
        let from_beam = (self.ticks(Setting::BeamToToolMm) - self.ticks(Setting::SecondBeamMm)) as f64;
        self.target = 0.5 * (self.ticks(Setting::TopSpeedMmS) as f64).min(from_beam / lead_s);
        let mut asked_us = self.world.time_us;
        while self.machine.tool_out() || self.is_tried {
            if !M::IS_OPEN && self.world.time_us > asked_us + ASKED_EVERY_US {
                self.look()?;
                asked_us = self.world.time_us;
            }
            if self.machine.state() != State::Work {
                self.say("clear")?;
                self.say("start")?;
                self.look()?;
            }
            self.turn()?;
            let there = self.ground as i64;
            // The plants of the last turn are still counted.
            let is_bare = there > self.bare_from + BEHIND_THE_ROW + self.unseen_row();
            prop_assert!(!is_bare || !is_alarm(self.machine.state()), "{:?} on bare ground", self.machine.state());
            let (state, reason) = (self.machine.state(), self.machine.reason());
            prop_assert!(there < end, "the tool does not come back to work: {state:?}, {reason:?}");
        }
        Ok(())
    }

    /// Ticks behind the row over which the machine may guard missed plants.
    fn unseen_row(&self) -> i64 {
        match self.ticks(Setting::GuardSpacingMm) {
            0 => 0,
            spacing => 4 * (spacing + self.ticks(Setting::GuardScatterMm) + self.ticks(Setting::MarginMm)),
        }
    }

    /// The machine.
    pub fn machine(&self) -> &M {
        &self.machine
    }

    /// The real position in ticks: 0 in the headland of the row.
    pub fn position(&self) -> i64 {
        self.ground as i64
    }

    /// Seconds since the run began.
    pub fn time_s(&self) -> f64 {
        self.world.time_us as f64 / 1e6
    }

    /// The result of the present row.
    pub fn score(&self) -> Score {
        let [metres, weeded_metres] = [self.rolled, self.weeded].map(|ticks| ticks / TICKS_A_MM / 1000.0);
        let mut score = Score { metres, weeded_metres, ..Score::default() };
        self.stand.iter().for_each(|stand| stand.add_to(&mut score));
        score
    }

    fn ticks(&self, setting: Setting) -> i64 {
        self.machine.settings().ticks(setting).0.into()
    }

    /// Ends a steady stretch.
    fn disturb(&mut self) {
        (self.calm_since_us, self.left_for) = (self.world.time_us, None);
    }

    /// The position by the machine's count.
    fn here(&self) -> i64 {
        self.machine.place(self.world.count)
    }

    fn step(&mut self, before: &World) -> Checked {
        let state_before = self.machine.state();
        let place = self.machine.turn(before, &self.world)?;
        self.model.roll_to(place, self.blur());
        let (state, out) = (self.machine.state(), self.machine.tool_out());
        self.check_weed()?;
        self.is_tried &= !M::IS_OPEN || state == state_before;
        if !self.machine.settings_are_in_doubt() {
            self.machine.check_pulse(self.is_tried)?;
        }
        self.out_since_us = self.machine.is_sent_out().then(|| self.out_since_us.unwrap_or(self.world.time_us));
        if state != state_before {
            self.disturb();
            let geometry = self.geometry();
            if let Some(stand) = self.stand.as_mut().filter(|_| is_alarm(state)) {
                stand.forget(self.world.time_us, &geometry);
            }
        }
        if M::IS_OPEN && state != state_before {
            prop_assert!(state != State::Work || self.world.switch_on, "the machine started work by itself");
            prop_assert!(!is_alarm(state_before) || !self.world.switch_on, "{state_before:?} was cleared by itself");
            self.check_tool_stuck(state)?;
        }
        prop_assert!(!M::IS_OPEN || !self.world.stack_is_low || is_alarm(state), "a low stack is no alarm");
        let works = if M::IS_OPEN { state == State::Work } else { !self.is_tried };
        let (slowest, fastest) = self.speeds.extremes();
        let (slowest, fastest) = (slowest - SPEED_RESOLUTION, fastest + SPEED_RESOLUTION);
        let ground = self.ground.floor() as i64 - self.geometry().beam_to_tool;
        let place = Place { tool: place - self.ticks(Setting::BeamToToolMm), slowest, fastest };
        self.check_stand(place, ground, out || self.is_tried)?;
        if out || !works || self.machine.settings_are_in_doubt() {
            self.suspect = None;
        } else {
            self.check(place)?;
        }
        if M::IS_OPEN && works && out {
            self.check_reason(place)?;
        }
        if works && out && !self.was_out {
            self.check_swing(place.tool)?;
        }
        self.was_out = out;
        Ok(())
    }

    /// The real machine. By default its settings are right.
    fn geometry(&self) -> Geometry {
        self.geometry.unwrap_or_else(|| {
            let us = |setting| u64::from(self.machine.settings().get(setting)) * 1000;
            Geometry {
                beam_to_tool: self.ticks(Setting::BeamToToolMm),
                second_beam: self.ticks(Setting::SecondBeamMm),
                dead_us: us(Setting::LeadInMs),
                swing_us: us(Setting::LeadOutMs),
            }
        })
    }
}

/// The unit of the machine's positions on the ground. A change of the unit makes the machine forget the ground.
fn scale(settings: &Settings) -> LengthScale {
    LengthScale::of(settings.wheel().ticks(1000))
}

fn is_alarm(state: State) -> bool {
    matches!(state, State::Alarm(_))
}
