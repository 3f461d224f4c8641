//! A machine on an endless row, compared with the model after every turn.
//!
//! The ground is counted in ticks of the encoder. The trait [`Machine`] hides whether the machine is the decisions
//! alone or the firmware in an Uno. Facts that are visible only in the decisions are checked only there. This file
//! executes steps and rolls the machine. `checks` compares the tool with the model, and `console` types lines and
//! follows their effects.

mod checks;
mod console;

pub use console::is_end;

use crate::{
    machine::{Checked, Machine, World},
    model::{Model, Stretch},
    run::{Beginning, Run, Step, TEST_WATCHDOG, TICKS_A_MM},
    speeds::Speeds,
};
use control::{
    alarm::Alarm,
    ground::class::Listed,
    measure::reset::Cause,
    operate::state::State,
    settings::{Setting, Settings},
    units::LengthScale,
};
use field::wheel::Wheel;
use proptest::prelude::*;

/// The grain of the measured speed: that of a tick in 10 ms, twice.
const GRAIN_OF_SPEED: f64 = 200.0;

/// The end switch follows the tool by this.
const SWITCH_DELAY_US: u64 = 60_000;

/// So many ticks behind the row, no monitor counts what stood there.
const BEHIND_THE_ROW: i64 = 500;

/// As a machine that is not open is asked for its state on the way back to work.
const ASKED_EVERY_US: u64 = 300_000;

/// Edges of dust that are more than the machine can take at once.
const TOO_MANY: u32 = 40;

/// Where the tool is while the machine rolls between two speeds, in ticks a second.
#[derive(Clone, Copy, Debug)]
struct Place {
    tool: i64,
    /// The same on the ground, independent of the wheel's slip.
    ground: i64,
    slowest: f64,
    fastest: f64,
}

/// The machine on its way, see the module's words.
#[derive(Debug)]
pub struct Drive<M> {
    machine: M,
    /// The line that it is answering.
    current: String,
    /// The last lines that it wrote.
    written: Vec<String>,
    /// What is kept for sure, and what is being written.
    saved: Option<Settings>,
    saving: Option<Settings>,
    /// Whether the leads in it may be others, which the machine has measured meanwhile.
    leads_in_doubt: bool,
    taught: Vec<Listed>,
    model: Model,
    beginning: Beginning,
    /// What each beam sees of the row, and the plants in it, if the ground is judged by these.
    row: [Vec<bool>; 2],
    plants: Option<Vec<(i64, i64)>>,
    /// From which tick of it on it is bare; the farthest that the beam has come to.
    bare_from: i64,
    farthest: i64,
    /// What the sensors show.
    world: World,
    /// Where the machine really is, in ticks, and its wheel.
    ground: f64,
    wheel: Wheel,
    /// In ticks a second: what it is, and what it is becoming.
    speed: f64,
    target: f64,
    /// The speeds of the encoder's count.
    speeds: Speeds,
    /// Since when the machine has rolled steadily, and nothing has come in between.
    calm_since_us: u64,
    /// The canopy for which the tool last left the row in that time.
    left_for: Option<Stretch>,
    was_out: bool,
    /// Where the tool was first seen in the row over a canopy, and when: it may be on its way out.
    suspect: Option<(u64, Place)>,
    /// Whether something is tried on the bench, so that the tool may be in the row.
    is_tried: bool,
    /// In what steps the machine remembers the ground.
    scale: LengthScale,
    encoder_is_silent: bool,
    edges_get_lost: bool,
    tool_is_stuck: bool,
    /// Whether it was stuck since the machine woke up.
    tool_was_stuck: bool,
    out_since_us: Option<u64>,
    turns: u64,
    steady_swings: u32,
    /// The least that a plant was said to stand off its place, and every distance of plants that was set: the machine may guard by
    /// what was set a moment ago.
    guard_scatter: i64,
    guard_spacings: Vec<i64>,
    /// Whether there has been a second beam. What it widens, and what it alone has seen, is no part of the model: that is closed besides.
    had_second_beam: bool,
}

impl<M: Machine> Drive<M> {
    /// A new board, told that its settings are right.
    ///
    /// # Errors
    /// What does not hold.
    pub fn new(run: &Run) -> Result<Self, TestCaseError> {
        let (beginning, row) = (run.beginning.clone(), run.levels());
        let plants = (!run.sights.is_empty()).then(|| run.plants());
        let world = World {
            time_us: 0,
            count: beginning.count.into(),
            jumps: 0,
            broken: row[0][0],
            second_broken: false,
            switch_on: false,
            end_switch_on: false,
            stack_is_low: false,
        };
        let machine = M::new(&beginning, &world)?;
        let mut drive = Self {
            scale: scale(machine.settings()),
            machine,
            current: String::new(),
            written: Vec::new(),
            saved: None,
            saving: None,
            leads_in_doubt: false,
            taught: Vec::new(),
            model: Model::new(world.count, world.broken),
            beginning,
            row,
            plants,
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
            encoder_is_silent: false,
            edges_get_lost: false,
            tool_is_stuck: false,
            tool_was_stuck: false,
            out_since_us: Some(0),
            turns: 0,
            steady_swings: 0,
            guard_scatter: i64::MAX,
            guard_spacings: Vec::new(),
            had_second_beam: false,
        };
        drive.say("clear")?;
        Ok(drive)
    }

    /// Goes a run, and back to work; how many turns were checked.
    ///
    /// # Errors
    /// What does not hold.
    pub fn go(run: &Run) -> Result<u64, TestCaseError> {
        let mut drive = Self::new(run)?;
        run.steps.iter().try_for_each(|step| drive.happen(step))?;
        // Where the ground is judged by its plants, the row goes on.
        if drive.plants.is_none() {
            drive.come_back_to_work()?;
        }
        Ok(drive.turns)
    }

    /// Has it happen.
    ///
    /// # Errors
    /// What does not hold.
    pub fn happen(&mut self, step: &Step) -> Checked {
        self.have(step)?;
        self.look()
    }

    fn have(&mut self, step: &Step) -> Checked {
        match *step {
            // The Uno would be reset while it answers, so that only the decisions are asked here.
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
            Step::Dust { times } => (0..2 * times).try_for_each(|_| self.edge(!self.world.broken)),
            Step::LoseEdges { turns } if M::IS_OPEN => {
                self.edges_get_lost = true;
                self.turns(turns)?;
                self.find_edges_lost()
            }
            Step::LoseEdges { turns } => {
                (0..TOO_MANY).try_for_each(|_| self.edge(!self.world.broken))?;
                self.turns(turns)
            }
            Step::Silence { ms } => {
                (self.encoder_is_silent, self.model.is_shifted) = (true, true);
                self.turns((u64::from(ms) * 1000 / self.beginning.turn_us) as u32)?;
                self.encoder_is_silent = false;
                Ok(())
            }
            Step::Spike { ticks, times } => (0..times).try_for_each(|_| {
                self.model.is_shifted = true;
                let off = self.machine.spike(&mut self.world, ticks);
                self.model.loosen(off);
                // A spike looks like a speed of its own, because the speed is measured over 10 ms.
                self.speeds.take(self.world.time_us, self.speed + f64::from(ticks) / 0.01);
                self.turn()
            }),
            Step::Reset(cause) => self.init(cause, None),
            Step::CutPower { line, turns, byte } => {
                self.type_in(line);
                self.turns(turns)?;
                self.init(Cause::PowerOn, Some(byte))
            }
            Step::LowerStack { turns } => {
                self.world.stack_is_low = true;
                self.turns(turns)?;
                self.world.stack_is_low = false;
                // What the firmware has once seen used stays used.
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

    /// Has the machine tell what cannot be seen of it.
    fn look(&mut self) -> Checked {
        if M::IS_OPEN {
            return Ok(());
        }
        if self.machine.settings_are_in_doubt() {
            self.say("get")?;
        }
        self.say("status")?;
        let state = self.machine.state();
        // Only in HOLD is anything tried.
        self.is_tried &= state == State::Hold;
        let is_false = state == State::Alarm(Alarm::ToolStuck) && !self.tool_was_stuck;
        prop_assert!(!is_false, "an end switch that follows the tool within {SWITCH_DELAY_US} us is an alarm");
        Ok(())
    }

    /// Every fault is mended, and the row is at its end; the operator clears the alarm, starts, and drives on until the tool is
    /// in. On the way back through the row there may be more alarms.
    ///
    /// # Errors
    /// What does not hold.
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
        // Over what was seen, and forgotten, and on until ground that is known comes to the tool.
        let end = self.farthest.max(self.ground as i64)
            + self.unseen_row()
            + 2 * self.ticks(Setting::BeamToToolMm)
            + self.ticks(Setting::MarginMm)
            + metre as i64;
        self.target = 0.5 * self.ticks(Setting::TopSpeedMmS) as f64;
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
            // What the last turn has rolled past is still counted.
            let is_bare = there > self.bare_from + BEHIND_THE_ROW + self.unseen_row();
            prop_assert!(!is_bare || !is_alarm(self.machine.state()), "{:?} on bare ground", self.machine.state());
            let (state, reason) = (self.machine.state(), self.machine.reason());
            prop_assert!(there < end, "the tool does not come back to work: {state:?}, {reason:?}");
        }
        Ok(())
    }

    /// So far behind the row the machine may guard plants that it has not seen.
    fn unseen_row(&self) -> i64 {
        match self.ticks(Setting::GuardSpacingMm) {
            0 => 0,
            spacing => 4 * (spacing + self.ticks(Setting::GuardScatterMm) + self.ticks(Setting::MarginMm)),
        }
    }

    /// The machine's state.
    pub fn state(&self) -> State {
        self.machine.state()
    }

    /// Whether the tool is out of the row.
    pub fn tool_out(&self) -> bool {
        self.machine.tool_out()
    }

    /// Swings out at a steady speed, each for a window of its own.
    pub fn steady_swings(&self) -> u32 {
        self.steady_swings
    }

    fn ticks(&self, setting: Setting) -> i64 {
        self.machine.settings().ticks(setting).0.into()
    }

    /// Something came in between.
    fn disturb(&mut self) {
        (self.calm_since_us, self.left_for) = (self.world.time_us, None);
    }

    fn roll(&mut self, ticks: f64, speed: f64) -> Checked {
        let (from, begun_us) = (self.ground, self.world.time_us);
        // What it may take to turn round is not rolled.
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

    fn stop(&mut self) {
        (self.speed, self.target) = (0.0, 0.0);
        self.disturb();
    }

    fn turns(&mut self, turns: u32) -> Checked {
        self.disturb();
        let passed = (0..turns).try_for_each(|_| self.turn());
        self.disturb();
        passed
    }

    /// A turn of the machine's loop.
    fn turn(&mut self) -> Checked {
        self.turns += 1;
        let before = self.world;
        let wheel = self.machine.settings().wheel();
        let merge_gap = self.machine.settings().ticks(Setting::MergeGapMm).0.into();
        self.model.follow(self.here(), merge_gap, wheel.ticks(1000).0.into());
        self.model.keep_stems(self.ticks(Setting::StemZoneMm), self.ticks(Setting::SecondBeamMm));
        // A detection below the minimum width is dust, and causes no event.
        let narrow_mm = M::NARROW_MM.max(self.machine.settings().get(Setting::MinWidthMm));
        self.guard_scatter = self.guard_scatter.min(self.ticks(Setting::GuardScatterMm));
        self.had_second_beam |= self.ticks(Setting::SecondBeamMm) > 0;
        let spacing = self.ticks(Setting::GuardSpacingMm);
        if spacing > 0 && !self.guard_spacings.contains(&spacing) {
            self.guard_spacings.push(spacing);
        }
        self.model.leave_narrow(wheel.ticks(narrow_mm).0.into());

        self.world.time_us += self.beginning.turn_us;
        let seconds = self.beginning.turn_us as f64 / 1e6;
        let most = f64::from(self.beginning.mm_s2) * TICKS_A_MM * seconds;
        self.speed += (self.target - self.speed).clamp(-most, most);
        let turned = if self.encoder_is_silent { 0.0 } else { self.speed * self.wheel.turns_a_tick };
        self.speeds.take(self.world.time_us, turned);
        self.roll_by(self.speed * seconds)?;
        let tool_is_out = self.out_since_us.is_some_and(|since_us| since_us + SWITCH_DELAY_US <= self.world.time_us);
        self.world.end_switch_on = tool_is_out && !self.tool_is_stuck;
        self.step(&before)?;
        self.attend_to_the_console()
    }

    /// Rolls by so many ticks, past what stands there.
    fn roll_by(&mut self, ticks: f64) -> Checked {
        let from = self.ground.floor() as i64;
        self.ground += ticks;
        let to = self.ground.floor() as i64;
        let (moves, direction) = ((to - from).abs(), (to - from).signum());
        for place in 1..=moves {
            let turned = self.wheel.roll(from + (place - 1) * direction, direction > 0);
            let turned = if self.encoder_is_silent { 0 } else { turned };
            for _ in 0..turned.abs() {
                self.world.count += turned.signum();
                self.machine.count(turned > 0);
            }
            self.beam_at(from + place * direction)?;
        }
        self.beam_at(to)
    }

    fn beam_at(&mut self, ground: i64) -> Checked {
        self.farthest = self.farthest.max(ground);
        let stands_at =
            |row: &[bool], place: i64| place <= self.bare_from && row[place.rem_euclid(row.len() as i64) as usize];
        let apart = self.ticks(Setting::SecondBeamMm);
        let [first, second] = &self.row;
        let (broken, second_broken) = (stands_at(first, ground), apart > 0 && stands_at(second, ground - apart));
        if second_broken != self.world.second_broken {
            self.world.second_broken = second_broken;
            if !self.edges_get_lost {
                self.machine.beam_edge(&self.world);
            }
        }
        if broken == self.world.broken { Ok(()) } else { self.edge(broken) }
    }

    /// The beam changes its level.
    fn edge(&mut self, broken: bool) -> Checked {
        self.world.broken = broken;
        if !self.edges_get_lost {
            self.machine.beam_edge(&self.world);
            self.check_weed()?;
        }
        self.model.edge(self.here(), broken, self.blur());
        Ok(())
    }

    /// The machine finds that edges were lost.
    fn find_edges_lost(&mut self) -> Checked {
        self.edges_get_lost = false;
        self.machine.lose_edges(&self.world)?;
        prop_assert!(is_alarm(self.machine.state()) || self.is_tried, "lost edges are no alarm");
        Ok(())
    }

    /// How far off the machine may have a place for its sensor's sake: the sensor of this machine answers at once.
    fn blur(&self) -> i64 {
        let (slowest, fastest) = self.speeds.extremes();
        let response_ms = self.machine.settings().get(Setting::BeamResponseMs);
        (fastest.max(-slowest) * f64::from(response_ms) / 1000.0) as i64 + 1
    }

    /// The place that the machine takes itself to be at.
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
        }
        if M::IS_OPEN && state != state_before {
            prop_assert!(state != State::Work || self.world.switch_on, "the machine went to work by itself");
            prop_assert!(!is_alarm(state_before) || !self.world.switch_on, "{state_before:?} went away by itself");
            let is_false = state == State::Alarm(Alarm::ToolStuck) && !self.tool_was_stuck;
            prop_assert!(!is_false, "an end switch that follows the tool within {SWITCH_DELAY_US} us is an alarm");
        }
        prop_assert!(!M::IS_OPEN || !self.world.stack_is_low || is_alarm(state), "a low stack is no alarm");
        let works = if M::IS_OPEN { state == State::Work } else { !self.is_tried };
        let (slowest, fastest) = self.speeds.extremes();
        let (slowest, fastest) = (slowest - GRAIN_OF_SPEED, fastest + GRAIN_OF_SPEED);
        let beam_to_tool = self.ticks(Setting::BeamToToolMm);
        let ground = self.ground.floor() as i64 - beam_to_tool;
        let place = Place { tool: place - beam_to_tool, ground, slowest, fastest };
        if out || !works || self.machine.settings_are_in_doubt() {
            self.suspect = None;
        } else {
            self.check(place)?;
        }
        if works && out && !self.was_out {
            self.check_swing(place.tool)?;
        }
        self.was_out = out;
        Ok(())
    }

    /// What was kept, with the leads that were found, if they are in doubt.
    fn with_leads_of(&self, kept: &Option<Settings>, found: &Option<Settings>) -> Option<Settings> {
        let (Some(kept), Some(found)) = (kept, found) else { return kept.clone() };
        let mut kept = kept.clone();
        for lead in [Setting::LeadOutMs, Setting::LeadInMs] {
            if self.leads_in_doubt {
                // It was within its range.
                let _ = kept.set(lead, found.get(lead));
            }
        }
        Some(kept)
    }

    /// The machine has been reset: in HOLD or with an alarm, the tool out, and with all that it said that it keeps.
    fn init(&mut self, cause: Cause, torn: Option<u8>) -> Checked {
        let is_answered = self.machine.is_done();
        let maybe = self.machine.examples();
        self.machine.reset(cause, torn, &self.world)?;
        let is_lost = self.machine.state() == State::Alarm(Alarm::SettingsLost);
        prop_assert!(is_lost || self.machine.state() == State::Hold, "woken up in {:?}", self.machine.state());
        let found = (!is_lost).then(|| self.machine.settings().clone());
        // What was not acknowledged is there, or is not.
        let expected = [&self.saving, &self.saved].map(|kept| self.with_leads_of(kept, &found));
        if self.saving.is_some() && expected[0] == found {
            self.saved = found;
        } else {
            prop_assert_eq!(&found, &expected[1], "other settings than were saved");
            self.saved = found;
        }
        let examples = self.machine.examples();
        if is_answered {
            prop_assert_eq!(&examples, &self.taught, "other examples than were taught");
        } else {
            let is_known = |example| maybe.contains(example) || self.taught.contains(example);
            prop_assert!(examples.iter().all(is_known) || !M::IS_OPEN, "{examples:?}");
        }
        self.taught = examples;
        self.scale = scale(self.machine.settings());
        self.model = Model::new(self.here(), self.world.broken);
        // It takes itself for standing until it has measured.
        self.speeds = Speeds::default();
        self.speeds.take(self.world.time_us, 0.0);
        (self.saving, self.suspect, self.is_tried) = (None, None, false);
        (self.tool_was_stuck, self.out_since_us) = (self.tool_is_stuck, Some(self.world.time_us));
        self.disturb();
        Ok(())
    }
}

/// The unit of the machine's positions on the ground. Another unit makes it forget the ground.
fn scale(settings: &Settings) -> LengthScale {
    LengthScale::of(settings.wheel().ticks(1000))
}

fn is_alarm(state: State) -> bool {
    matches!(state, State::Alarm(_))
}
