//! A machine on a row that never ends, with the controller in it and the model beside it; every step is checked.

use crate::model::{Model, Seen};
use control::{
    alarm::Alarm,
    classifier::{Class, Classifier, Full, Listed, Vote},
    controller::{Controller, Readings, Reason, State, WakeUp},
    event::Event,
    features::Features,
    memory::{Memory, Volatile},
    reset::Cause,
    saved::COPY,
    schedule::Plan,
    settings::{Setting, Settings},
    units::{Instant, Interval, Position, Ticks},
};
use proptest::prelude::*;
use std::{cell::RefCell, collections::VecDeque, rc::Rc};

/// What a test asserts is what its caller reports.
pub type Checked = Result<(), TestCaseError>;

/// Objects narrower than this, less one for rounding, are weeds, and wider ones plants.
const PLANT_MM: i16 = 60;

/// The measured speed is that of some moment in this time, give or take the grain of a tick in 10 ms, twice.
const MEMORY_OF_SPEED_US: u64 = 1_000_000;
const GRAIN: f64 = 200.0;

/// The end switch follows the tool by this.
const SWITCH_DELAY_US: u64 = 60_000;

/// Takes for a weed what is narrow.
#[derive(Clone, Debug)]
pub struct ByWidth;

impl Classifier for ByWidth {
    fn wake_up(&mut self) {}

    fn classify(&self, features: &Features, _: u8) -> Vote {
        let narrow = Features::describe(0, 0, PLANT_MM).hold_mm;
        Vote { class: if features.hold_mm < narrow { Class::Weed } else { Class::Plant }, votes: 1 }
    }

    fn teach(&mut self, _: &Features, _: u8) -> Result<(), Full> {
        Err(Full)
    }

    fn forget(&mut self, _: u8) -> bool {
        false
    }

    fn listed(&self, _: u8) -> Option<(Listed, u8)> {
        None
    }

    fn spoiled(&self) -> u8 {
        0
    }

    fn carry_on(&mut self) -> bool {
        true
    }
}

/// A memory that stays when the machine is reset.
#[derive(Clone, Debug, Default)]
struct Shared(Rc<RefCell<Volatile>>);

impl Memory for Shared {
    fn read(&self, address: u16) -> u8 {
        self.0.borrow().read(address)
    }

    fn is_ready(&self) -> bool {
        true
    }

    fn write(&mut self, address: u16, byte: u8) {
        self.0.borrow_mut().write(address, byte);
    }
}

/// Where and when a run begins, and how fast the loop turns.
#[derive(Clone, Debug)]
pub struct Beginning {
    pub count: i32,
    pub steps: u32,
    pub turn_us: u64,
    /// Whether each reading is from before the edges that come with it.
    pub reads_first: bool,
}

/// The machine, see the module's words.
pub struct Drive {
    controller: Controller<ByWidth, Shared>,
    memory: Shared,
    saved: Option<Settings>,
    model: Model,
    beginning: Beginning,
    /// For each tick of ground whether something stands there; the last one is followed by the first.
    row: Vec<bool>,
    time_us: u64,
    /// Where the machine really is, and the encoder's count without wrapping.
    ground: f64,
    count: i64,
    speed: f64,
    /// Speeds of the encoder's count, with their times.
    speeds: VecDeque<(u64, f64)>,
    broken: bool,
    /// What is wrong, or in the operator's hand.
    pub row_is_bare: bool,
    pub encoder_is_silent: bool,
    pub edges_get_lost: bool,
    pub switch_on: bool,
    pub stack_free: u16,
    pub jumps: u16,
    pub tool_is_stuck: bool,
    out_since_us: Option<u64>,
    pub steps: u64,
}

impl Drive {
    pub fn new(beginning: Beginning, row: Vec<bool>) -> Self {
        let memory = Shared::default();
        let readings = Readings::new(Instant::new(beginning.steps), Position::new(beginning.count));
        let wake_up = WakeUp { readings, beam_broken: row[0], cause: Cause::PowerOn };
        let mut drive = Self {
            controller: Controller::new(ByWidth, memory.clone(), wake_up),
            memory,
            saved: None,
            model: Model::new(beginning.count.into(), row[0]),
            count: beginning.count.into(),
            broken: row[0],
            beginning,
            row,
            time_us: 0,
            ground: 0.0,
            speed: 0.0,
            speeds: VecDeque::from([(0, 0.0)]),
            row_is_bare: false,
            encoder_is_silent: false,
            edges_get_lost: false,
            switch_on: false,
            stack_free: u16::MAX,
            jumps: 0,
            tool_is_stuck: false,
            out_since_us: Some(0),
            steps: 0,
        };
        drive.wake_up();
        drive
    }

    /// After a reset: without a contradiction, so that the operator can start it.
    fn wake_up(&mut self) {
        // The beam of these machines answers at once: what the sensor takes is another test's business.
        self.controller.clear();
        self.controller.set(Setting::BeamResponseMs, 0).expect("0 is allowed");
        self.controller.tell_events(true);
    }

    pub fn reset(&mut self, cause: Cause) -> Checked {
        let whole = self.memory.0.borrow().clone().with_power();
        *self.memory.0.borrow_mut() = whole;
        let wake_up = WakeUp { readings: self.readings(), beam_broken: self.broken, cause };
        self.controller = Controller::new(ByWidth, self.memory.clone(), wake_up);
        prop_assert!(self.controller.tool_out());
        let settings_lost = State::Alarm(Alarm::SettingsLost);
        prop_assert_eq!(self.controller.state(), if self.saved.is_some() { State::Hold } else { settings_lost });
        let kept = self.saved.clone().unwrap_or_default();
        prop_assert_eq!(self.controller.settings(), &kept, "other settings than were saved");
        self.model = Model::new(self.count, self.broken);
        self.speeds = VecDeque::from([(self.time_us, 0.0)]);
        self.out_since_us = Some(self.time_us);
        self.wake_up();
        Ok(())
    }

    /// Saves, with power for so many bytes of it; a reset is to follow where that is too little.
    pub fn save(&mut self, bytes: usize) -> Checked {
        let before = self.saved.clone();
        if self.controller.save().is_err() {
            prop_assert_eq!(self.controller.state(), State::Work, "saving was refused");
            return Ok(());
        }
        self.memory.0.borrow_mut().lose_power_after(bytes);
        while !self.controller.carry_on() {}
        let written = Some(self.controller.settings().clone());
        if bytes >= COPY {
            self.saved = written;
            return Ok(());
        }
        // Power went away: either the old settings are there, or the new ones.
        let mut found = control::saved::SavedSettings::new(self.memory.0.borrow().clone().with_power());
        let found = found.load();
        prop_assert!(found == before || found == written, "a save that was cut short left {found:?}");
        self.saved = found;
        self.reset(Cause::BrownOut)
    }

    pub fn set(&mut self, setting: Setting, value: u16) {
        // Refused or not, what is in use is asked for anew each time.
        let _ = self.controller.set(setting, value);
    }

    pub fn state(&self) -> State {
        self.controller.state()
    }

    pub fn tool_out(&self) -> bool {
        self.controller.tool_out()
    }

    pub fn ticks(&self, setting: Setting) -> f64 {
        f64::from(self.controller.settings().ticks(setting).0)
    }

    /// From the beam to the farthest place that it has seen.
    pub fn ticks_to_the_frontier(&self) -> f64 {
        (self.model.frontier() - self.count) as f64
    }

    pub fn start(&mut self, now: bool) -> Checked {
        let allowed = !matches!(self.state(), State::Alarm(_));
        prop_assert_eq!(self.controller.start(now).is_ok(), allowed);
        if allowed && now {
            let (tool, margin) = (self.tool(), self.margin());
            self.model.trust_from(tool - margin);
        }
        Ok(())
    }

    pub fn hold(&mut self) {
        self.controller.hold();
    }

    pub fn clear(&mut self) {
        self.controller.clear();
    }

    /// Rolls for a time, with the speed going to `speed` ticks/s by `acceleration` ticks/s2.
    pub fn roll(&mut self, speed: f64, acceleration: f64, time_us: u64) -> Checked {
        let end_us = self.time_us + time_us;
        while self.time_us < end_us {
            let most = acceleration * self.beginning.turn_us as f64 / 1e6;
            self.speed += (speed - self.speed).clamp(-most, most);
            self.turn(self.speed)?;
        }
        Ok(())
    }

    /// Rolls on as it does.
    pub fn go_on(&mut self, time_ms: u64) -> Checked {
        self.roll(self.speed, 0.0, time_ms * 1000)
    }

    /// A turn of the loop, in which the machine is moved by so many ticks.
    pub fn turn_by(&mut self, ticks: f64) -> Checked {
        self.speed = 0.0;
        self.turn(ticks * 1e6 / self.beginning.turn_us as f64)
    }

    /// A turn of the loop, in which the machine rolls at this speed.
    fn turn(&mut self, speed: f64) -> Checked {
        let before = self.readings();
        self.time_us += self.beginning.turn_us;
        let from = self.ground.floor() as i64;
        self.ground += speed * self.beginning.turn_us as f64 / 1e6;
        let to = self.ground.floor() as i64;
        let (moves, direction) = ((to - from).abs(), (to - from).signum());
        for place in 1..=moves {
            self.count += if self.encoder_is_silent { 0 } else { direction };
            self.beam_at(from + place * direction)?;
        }
        self.beam_at(to)?;
        let counted = if self.encoder_is_silent { 0.0 } else { speed };
        self.speeds.push_back((self.time_us, counted));
        while self.speeds.front().is_some_and(|(time_us, _)| time_us + MEMORY_OF_SPEED_US < self.time_us) {
            self.speeds.pop_front();
        }
        let readings = if self.beginning.reads_first { before } else { self.readings() };
        self.step(readings)
    }

    fn beam_at(&mut self, ground: i64) -> Checked {
        let broken = !self.row_is_bare && self.row[ground.rem_euclid(self.row.len() as i64) as usize];
        if broken == self.broken { Ok(()) } else { self.edge(broken) }
    }

    /// The beam changes its level.
    pub fn edge(&mut self, broken: bool) -> Checked {
        self.broken = broken;
        if self.edges_get_lost {
            return Ok(());
        }
        let (state, frontier) = (self.state(), self.model.frontier());
        let merge_gap = self.merge_gap();
        let seen = self.model.edge(self.count, broken, merge_gap);
        self.controller.beam_edge(Position::new(self.count as i32), broken);
        self.compare(seen, state, frontier)
    }

    /// Dust in the beam: so many short breaks, or clear moments, at one place.
    pub fn flicker(&mut self, times: u32) -> Checked {
        for _ in 0..2 * times {
            self.edge(!self.broken)?;
        }
        Ok(())
    }

    /// The machine finds that edges were lost.
    pub fn find_edges_lost(&mut self) -> Checked {
        self.edges_get_lost = false;
        let (state, frontier) = (self.state(), self.model.frontier());
        self.model.lose_edges(self.broken);
        self.controller.beam_edges_lost(self.broken);
        prop_assert!(matches!(self.state(), State::Alarm(_)), "lost edges are no alarm");
        self.compare(None, state, frontier)
    }

    fn readings(&self) -> Readings {
        let now = Instant::new(self.beginning.steps) + Interval::from_steps((self.time_us / 4) as u32);
        let tool_is_out = self.out_since_us.is_some_and(|since_us| since_us + SWITCH_DELAY_US <= self.time_us);
        Readings {
            switch_on: self.switch_on,
            jumps: self.jumps,
            stack_free: self.stack_free,
            end_switch_on: tool_is_out && !self.tool_is_stuck,
            ..Readings::new(now, Position::new(self.count as i32))
        }
    }

    fn step(&mut self, readings: Readings) -> Checked {
        self.steps += 1;
        let (state, frontier) = (self.state(), self.model.frontier());
        // The reading's count, without its wrapping.
        let count = self.count + i64::from((readings.position - Position::new(self.count as i32)).0);
        let merge_gap = self.merge_gap();
        let seen = self.model.roll_to(count, merge_gap);
        let orders = self.controller.step(readings);
        self.compare(seen, state, frontier)?;
        if self.controller.encoder_is_silent() {
            self.model.lose_place(self.margin());
        }
        let out = self.controller.tool_out();
        self.out_since_us = out.then(|| self.out_since_us.unwrap_or(self.time_us));
        prop_assert_eq!(orders.pulse == orders.pulse_out, out);
        prop_assert!(out || self.state() == State::Work, "the tool is in the row in {:?}", self.state());
        prop_assert!(
            self.state() != State::Work || state == State::Work || self.switch_on,
            "the machine went to work by itself"
        );
        prop_assert!(self.stack_free > 40 || matches!(self.state(), State::Alarm(_)), "a low stack is no alarm");
        if self.state() == State::Work {
            self.check_tool(count - i64::from(self.controller.settings().ticks(Setting::BeamToToolMm).0))?;
        }
        Ok(())
    }

    /// The tool is out wherever it has to be, and in wherever nothing keeps it out.
    fn check_tool(&self, tool: i64) -> Checked {
        let settings = self.controller.settings();
        // The machine adds a millisecond to each lead, for the command's way to the pin.
        let lead = |milliseconds: u16| f64::from(milliseconds + u16::from(milliseconds > 0)) / 1000.0;
        let lead_out = lead(settings.get(Setting::LeadOutMs));
        let lead_in = lead(settings.get(Setting::LeadInMs)).min(lead_out);
        let (slowest, fastest) = self
            .speeds
            .iter()
            .fold((f64::MAX, f64::MIN), |(slowest, fastest), &(_, speed)| (speed.min(slowest), speed.max(fastest)));
        let (slowest, fastest) = (slowest - GRAIN, fastest + GRAIN);
        let ticks = |speed: f64, seconds: f64| (speed * seconds) as i64;
        if !self.controller.tool_out() {
            // Coming back is led, in the direction of rolling; so is leaving, by as much as the slowest speed makes it.
            let near = tool + ticks(fastest.max(0.0), 1.25 * lead_in) + 1;
            let far = tool + ticks(slowest.min(0.0), 1.25 * lead_in) - 1;
            let ahead = tool + ticks(slowest.max(0.0), lead_out);
            let behind = tool + ticks(fastest.min(0.0), lead_out);
            // Rolling forward and back in the same second, either may be the case.
            let stretches = if slowest > 0.0 {
                (near, ahead)
            } else if fastest < 0.0 {
                (behind, far)
            } else {
                (near, far)
            };
            let (from, to) = stretches;
            let closed = if from <= to {
                self.model.is_closed(from, to, self.margin())
            } else {
                // What is closed all over is closed however fast the machine takes itself for, and whichever way.
                (to.min(tool)..=from.max(tool)).all(|place| self.model.is_closed(place, place, self.margin()))
            };
            prop_assert!(
                !closed,
                "the tool is in the row at {tool}, from {from} to {to}, rolling {slowest} to {fastest} ticks/s: {:?}",
                self.model
            );
        } else if let Some(reason @ (Reason::Plant | Reason::UnseenGround)) = self.controller.reason() {
            let reach = ticks(fastest.max(-slowest), 2.0 * lead_out) + 3;
            prop_assert!(
                self.model.may_be_closed(tool - reach, tool + reach, self.margin()),
                "the tool is out at {tool} for {reason:?}, rolling {slowest} to {fastest} ticks/s: {:?}",
                self.model
            );
        }
        Ok(())
    }

    /// Compares what the controller tells with what the model saw in the same call; before it, the controller was in `state`
    /// and the beam had come to `frontier`.
    fn compare(&mut self, seen: Option<Seen>, state: State, frontier: i64) -> Checked {
        let told = std::iter::from_fn(|| self.controller.next_event()).find_map(|event| match event {
            Event::Object { vote, leading, plan, .. } => Some((vote, leading, plan)),
            _ => None,
        });
        // What is told in doubt the machine knows; what the model sees then, it may know.
        let told_as_seen = told.map(|(_, leading, plan)| {
            let leading = self.count + i64::from((leading - Position::new(self.count as i32)).0);
            Seen { leading, trailing: leading + i64::from(plan.hold.0), cut: false }
        });
        let in_doubt = seen.into_iter().chain(told_as_seen);
        if let State::Alarm(_) = self.state() {
            if !matches!(state, State::Alarm(_)) {
                self.model.latch(frontier);
            }
            self.model.alarmed(in_doubt);
            return Ok(());
        }
        let doubtful = self.model.is_doubtful();
        let Some(seen) = seen else {
            // An alarm behind the frontier has the machine take the beam's level there for that at the frontier: what it breaks is
            // a plant of no width, which closes its margins and harms nothing.
            let settings = self.controller.settings();
            let margins = settings.wheel().ticks(2 * settings.get(Setting::MarginMm));
            let is_nothing =
                |(vote, _, plan): (Vote, Position, Plan)| vote.class == Class::Unknown && plan.hold == margins;
            prop_assert!(told.is_none_or(is_nothing), "{told:?} was told and not seen");
            self.model.perhaps(told_as_seen);
            return Ok(());
        };
        self.model.settle();
        let Some((vote, leading, plan)) = told else {
            prop_assert!(doubtful, "{seen:?} was not told");
            return Ok(());
        };
        let settings = self.controller.settings();
        let width = plan.hold - settings.wheel().ticks(2 * settings.get(Setting::MarginMm));
        if !doubtful {
            let expected = (Position::new(seen.leading as i32), seen.trailing - seen.leading);
            prop_assert_eq!((leading, i64::from(width.0)), expected, "another object was told");
        }
        let width_mm = settings.wheel().millimetres(width);
        let is_cut = vote.class == Class::Unknown;
        // The machine may take a whole object for what is left of one, which it treats as a plant, but not the other way round.
        prop_assert!(is_cut || !seen.cut || doubtful);
        if !is_cut {
            prop_assert!(vote.class == Class::Plant || width_mm < PLANT_MM, "a plant of {width_mm} mm");
            prop_assert!(vote.class == Class::Weed || width_mm >= PLANT_MM, "a weed of {width_mm} mm");
        }
        if vote.class != Class::Weed {
            self.model.keep(Seen { leading: seen.trailing - i64::from(width.0), ..seen });
        }
        Ok(())
    }

    fn tool(&self) -> i64 {
        let read = self.controller.readings().position;
        let count = self.count + i64::from((read - Position::new(self.count as i32)).0);
        count - i64::from(self.controller.settings().ticks(Setting::BeamToToolMm).0)
    }

    fn margin(&self) -> i64 {
        let Ticks(margin) = self.controller.settings().ticks(Setting::MarginMm);
        margin.into()
    }

    fn merge_gap(&self) -> i64 {
        self.controller.settings().get(Setting::MergeGapTicks).into()
    }
}
