//! A machine on a row that never ends, with the controller in it, its console typed at as the firmware's main loop does it, and
//! the model beside it; every step is checked.

use crate::{
    eeprom::{Eeprom, Half},
    model::{Model, Run},
    walk::{Beginning, Happening, TICKS_A_MM, Walk},
};
use control::{
    alarm::Alarm,
    classifier::{Class, Classifier, Full, Listed, Nearest, Vote},
    console::LineBuffer,
    controller::{Controller, Orders, Readings, Reason, State, WakeUp},
    examples::EXAMPLES,
    features::Features,
    line::Line,
    quadrature::Odometer,
    reply::{self, Answer, LINE},
    reset::Cause,
    servo,
    settings::{Setting, Settings},
    units::{Grain, Instant, Interval, Position},
};
use knn::Example;
use proptest::prelude::*;
use std::{cell::Cell, collections::VecDeque, rc::Rc};

/// What a test asserts is what its caller reports.
pub type Checked = Result<(), TestCaseError>;

/// Narrower than this is a weed.
const PLANT_MM: i16 = 60;

/// What the features add to a width, in millimetres.
const MARGINS_MM: i16 = 100;

/// The measured speed is that of some moment in this time, give or take the grain of a tick in 10 ms, twice.
const MEMORY_OF_SPEED_US: u64 = 1_000_000;
const GRAIN_OF_SPEED: f64 = 200.0;

/// At a steady speed, the measured one is right after this time, if it is no slower than this.
const STEADY_US: u64 = 1_200_000;
const STEADY_SPEED: f64 = 60.0;

/// The end switch follows the tool by this.
const SWITCH_DELAY_US: u64 = 60_000;

/// So many ticks behind the row, no monitor counts what stood there.
const BEHIND_THE_ROW: i64 = 500;

/// Turns in which every line is answered, whatever is still to be written to the EEPROM.
const PATIENCE: u32 = 20_000;

/// Takes for a weed what is narrow, and for a plant what is not, but keeps examples as the firmware does.
struct ByWidth {
    nearest: Nearest<&'static [Example<5>], Half>,
    /// The width of what was last taken for a weed, in millimetres.
    weed: Rc<Cell<Option<i16>>>,
}

impl Classifier for ByWidth {
    fn wake_up(&mut self) {
        self.nearest.wake_up();
    }

    fn classify(&self, features: &Features, _: u8) -> Vote {
        let width_mm = features.hold_mm - MARGINS_MM;
        if width_mm >= PLANT_MM {
            return Vote { class: Class::Plant, votes: 1 };
        }
        self.weed.set(Some(width_mm));
        Vote { class: Class::Weed, votes: 1 }
    }

    fn built_in_class(&self, _: &Features) -> Class {
        Class::Unknown
    }

    fn teach(&mut self, features: &Features, label: u8) -> Result<(), Full> {
        self.nearest.teach(features, label)
    }

    fn forget(&mut self, number: u8) -> bool {
        self.nearest.forget(number)
    }

    fn listed(&self, place: u8) -> Option<(Listed, u8)> {
        self.nearest.listed(place)
    }

    fn spoiled(&self) -> u8 {
        self.nearest.spoiled()
    }

    fn carry_on(&mut self) -> bool {
        self.nearest.carry_on()
    }
}

type Weeder = Controller<ByWidth, Half>;

/// The console, as the firmware's main loop has it: a line is carried out once the one before it has been answered.
struct Console {
    line: LineBuffer,
    answer: Answer,
    /// Bytes on their way, and the lines that they make.
    typed: VecDeque<u8>,
    lines: VecDeque<String>,
    /// The line that is being answered.
    current: String,
    written: String,
}

impl Console {
    fn new() -> Self {
        Self {
            line: LineBuffer::new(),
            answer: Answer::Greeting,
            typed: VecDeque::new(),
            lines: VecDeque::new(),
            current: String::new(),
            written: String::new(),
        }
    }

    /// Puts a line onto the wire, or several.
    fn put(&mut self, text: &str) {
        self.typed.extend(text.bytes().chain(*b"\n"));
        self.lines.extend(text.split(['\r', '\n']).map(str::trim).filter(|line| !line.is_empty()).map(str::to_owned));
    }

    /// Has the machine carry out a line that has come; whether there was one.
    fn carry_out(&mut self, machine: &mut Weeder) -> bool {
        while self.answer.is_done()
            && let Some(byte) = self.typed.pop_front()
        {
            if let Some(command) = self.line.take(byte) {
                self.current = self.lines.pop_front().unwrap_or_default();
                self.answer = reply::answer(command, machine);
                return true;
            }
        }
        false
    }

    /// Writes what there is room for.
    fn write(&mut self, machine: &mut Weeder) -> Checked {
        let mut line = Line::new();
        if !machine.carry_on() {
        } else if !self.answer.is_done() {
            self.answer.write_line(machine, &mut line);
        } else if let Some(event) = machine.next_event() {
            reply::write_event(&event, &mut line);
        } else if let Some(plot) = machine.next_plot() {
            reply::write_plot(machine, plot, &mut line);
        }
        self.written = line.map(char::from).collect();
        prop_assert!(self.written.len() <= LINE, "{:?} is too long a line", self.written);
        Ok(())
    }

    /// Whether everything that was typed has been answered.
    fn is_done(&self) -> bool {
        self.typed.is_empty() && self.answer.is_done()
    }
}

/// The lowest and the highest of what was in the last second.
struct Extremes(VecDeque<(u64, f64, f64)>);

impl Extremes {
    const SHARE_US: u64 = MEMORY_OF_SPEED_US / 20;

    fn take(&mut self, now_us: u64, value: f64) {
        let share = now_us / Self::SHARE_US;
        match self.0.back_mut() {
            Some((last, least, greatest)) if *last == share => {
                (*least, *greatest) = (least.min(value), greatest.max(value))
            }
            _ => self.0.push_back((share, value, value)),
        }
        while self.0.front().is_some_and(|&(first, ..)| first + MEMORY_OF_SPEED_US / Self::SHARE_US < share) {
            self.0.pop_front();
        }
    }

    fn get(&self) -> (f64, f64) {
        let all = self.0.iter().map(|&(_, least, greatest)| (least, greatest));
        all.reduce(|(least, greatest), (one, other)| (least.min(one), greatest.max(other))).unwrap_or((0.0, 0.0))
    }
}

/// The machine, see the module's words.
pub struct Drive {
    odometer: Odometer,
    machine: Weeder,
    console: Console,
    /// What it has just taken for a weed.
    weed: Rc<Cell<Option<i16>>>,
    eeprom: Eeprom,
    /// What is kept for sure, and what is being written.
    saved: Option<Settings>,
    saving: Option<Settings>,
    taught: Vec<Listed>,
    model: Model,
    beginning: Beginning,
    row: Vec<bool>,
    /// From which tick of it on it is bare; the farthest that the beam has come to.
    bare_from: i64,
    farthest: i64,
    time_us: u64,
    /// Where the machine really is, in ticks, and the encoder's count without wrapping.
    ground: f64,
    count: i64,
    /// In ticks a second: what it is, and what it is becoming.
    speed: f64,
    target: f64,
    /// The speeds of the encoder's count.
    speeds: Extremes,
    /// Since when the machine has rolled steadily, and nothing has come in between.
    calm_since_us: u64,
    /// The canopy for which the tool last left the row in that time.
    left_for: Option<Run>,
    broken: bool,
    /// Whether something is tried on the bench, so that the tool may be in the row.
    is_tried: bool,
    encoder_is_silent: bool,
    edges_get_lost: bool,
    switch_on: bool,
    stack_free: u16,
    jumps: u16,
    tool_is_stuck: bool,
    /// Whether it was stuck since the machine woke up.
    tool_was_stuck: bool,
    out_since_us: Option<u64>,
    pub steps: u64,
    /// Swings out at a steady speed, each for a window of its own.
    pub steady_swings: u32,
}

fn wake(eeprom: &Eeprom, weed: &Rc<Cell<Option<i16>>>, wake_up: WakeUp) -> Weeder {
    let [for_settings, for_examples] = eeprom.halves();
    let classifier = ByWidth { nearest: Nearest::asleep(&EXAMPLES[..], for_examples), weed: Rc::clone(weed) };
    Controller::new(classifier, for_settings, wake_up)
}

impl Drive {
    /// A new board, told that its settings are right.
    pub fn new(walk: &Walk) -> Result<Self, TestCaseError> {
        let (beginning, row, eeprom) = (walk.beginning.clone(), walk.levels(), Eeprom::new());
        let readings = Readings::new(Instant::new(beginning.steps), Position::new(beginning.count));
        let weed = Rc::default();
        let wake_up = WakeUp { readings, beam_broken: row[0], cause: Cause::PowerOn };
        let mut drive = Self {
            machine: wake(&eeprom, &weed, wake_up),
            odometer: Odometer::new(readings.position, 0),
            console: Console::new(),
            weed,
            eeprom,
            saved: None,
            saving: None,
            taught: Vec::new(),
            model: Model::new(beginning.count.into(), row[0]),
            count: beginning.count.into(),
            broken: row[0],
            beginning,
            row,
            bare_from: i64::MAX,
            farthest: 0,
            time_us: 0,
            ground: 0.0,
            speed: 0.0,
            target: 0.0,
            speeds: Extremes(VecDeque::new()),
            calm_since_us: 0,
            left_for: None,
            is_tried: false,
            encoder_is_silent: false,
            edges_get_lost: false,
            switch_on: false,
            stack_free: u16::MAX,
            jumps: 0,
            tool_is_stuck: false,
            tool_was_stuck: false,
            out_since_us: Some(0),
            steps: 0,
            steady_swings: 0,
        };
        drive.say("clear")?;
        Ok(drive)
    }

    /// Has it happen.
    pub fn happen(&mut self, happening: &Happening) -> Checked {
        match *happening {
            Happening::Type(ref line) => self.say(line),
            Happening::Roll { mm, mm_s } => self.roll(f64::from(mm) * TICKS_A_MM, f64::from(mm_s) * TICKS_A_MM),
            Happening::Stand { ms } => {
                self.target = 0.0;
                self.turns((u64::from(ms) * 1000 / self.beginning.turn_us) as u32)
            }
            Happening::Tremble { times } => {
                self.stop();
                (0..times).try_for_each(|time| {
                    self.ground += f64::from(time % 2 * 2) - 1.0;
                    self.turn()
                })
            }
            Happening::Switch { on } => {
                self.switch_on = on;
                self.turn()
            }
            Happening::Dust { times } => (0..2 * times).try_for_each(|_| self.edge(!self.broken)),
            Happening::LoseEdges { turns } => {
                self.edges_get_lost = true;
                self.turns(turns)?;
                self.find_edges_lost()
            }
            Happening::Silence { ms } => {
                (self.encoder_is_silent, self.model.is_shifted) = (true, true);
                self.turns((u64::from(ms) * 1000 / self.beginning.turn_us) as u32)?;
                self.encoder_is_silent = false;
                Ok(())
            }
            Happening::Spike { ticks, times } => (0..times).try_for_each(|_| {
                self.model.is_shifted = true;
                self.count += i64::from(ticks);
                self.jumps = self.jumps.wrapping_add(1);
                // A spike is a speed of its own, to whoever divides by 10 ms.
                self.speeds.take(self.time_us, self.speed + f64::from(ticks) / 0.01);
                self.turn()
            }),
            Happening::Reset(cause) => {
                self.eeprom.reset();
                self.wake_up(cause)
            }
            Happening::CutPower { line, turns, byte } => {
                self.type_in(line);
                self.turns(turns)?;
                self.eeprom.lose_power(byte);
                self.wake_up(Cause::PowerOn)
            }
            Happening::LowerStack { turns } => {
                self.stack_free = 40;
                self.turns(turns)?;
                self.stack_free = 300;
                Ok(())
            }
            Happening::StickTool { stuck } => {
                self.tool_is_stuck = stuck;
                self.tool_was_stuck |= stuck;
                self.turn()
            }
        }
    }

    /// Every fault is mended, and the row is at its end; the operator clears the alarm, starts, and drives on until the tool is
    /// in. On the way back through the row there may be more alarms.
    pub fn come_back_to_work(&mut self) -> Checked {
        (self.tool_is_stuck, self.switch_on, self.bare_from) = (false, false, self.farthest);
        self.stop();
        self.turns((1_500_000 / self.beginning.turn_us) as u32)?;
        if self.ticks(Setting::BeamToToolMm) > 4000 {
            self.say("clear")?;
            self.say("defaults")?;
        }
        let metre = f64::from(self.machine.settings().wheel().ticks(1000).0);
        // Over what was seen, and forgotten, and on until ground that is known comes to the tool.
        let end = self.farthest.max(self.ground as i64)
            + 2 * self.ticks(Setting::BeamToToolMm)
            + self.ticks(Setting::MarginMm)
            + metre as i64;
        self.target = 0.5 * self.ticks(Setting::TopSpeedMmS) as f64;
        while self.machine.tool_out() {
            if self.machine.state() != State::Work {
                self.say("clear")?;
                self.say("start")?;
            }
            self.turn()?;
            let there = self.ground as i64;
            // What the last turn has rolled past is still counted.
            let is_bare = there > self.bare_from + BEHIND_THE_ROW;
            prop_assert!(!is_bare || !is_alarm(self.machine.state()), "{:?} on bare ground", self.machine.state());
            prop_assert!(there < end, "the tool does not come back to work: {:?}", self.machine.reason());
        }
        Ok(())
    }

    pub fn state(&self) -> State {
        self.machine.state()
    }

    pub fn tool_out(&self) -> bool {
        self.machine.tool_out()
    }

    fn ticks(&self, setting: Setting) -> i64 {
        self.machine.settings().ticks(setting).0.into()
    }

    /// Types a line, or several, and waits until each of them has been answered: once.
    fn say(&mut self, text: &str) -> Checked {
        self.type_in(text);
        let lines = self.console.lines.clone();
        let mut ends = 0;
        for _ in 0..PATIENCE {
            if self.console.is_done() {
                prop_assert_eq!(ends, lines.len(), "ends of answers to {:?}", lines);
                return Ok(());
            }
            self.turn()?;
            ends += self.console.written.lines().filter(|line| is_end(line)).count();
        }
        prop_assert!(false, "{text:?} is not answered");
        Ok(())
    }

    fn type_in(&mut self, text: &str) {
        self.disturb();
        self.console.put(text);
    }

    /// Something came in between.
    fn disturb(&mut self) {
        (self.calm_since_us, self.left_for) = (self.time_us, None);
    }

    fn roll(&mut self, ticks: f64, speed: f64) -> Checked {
        let (from, begun_us) = (self.ground, self.time_us);
        // What it may take to turn round is not rolled.
        let most_us = ((ticks / speed).abs() * 1e6) as u64 + 5_000_000;
        if self.target != speed {
            self.disturb();
        }
        self.target = speed;
        while (self.ground - from) * ticks.signum() < ticks.abs() && self.time_us < begun_us + most_us {
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

    /// A turn of the firmware's loop.
    fn turn(&mut self) -> Checked {
        let before = self.readings();
        let settings = self.machine.settings();
        let merge_gap = i64::from(settings.get(Setting::MergeGapTicks));
        let metre = settings.wheel().ticks(1000).0;
        self.model.follow(self.here(), merge_gap, metre.into());

        self.time_us += self.beginning.turn_us;
        let seconds = self.beginning.turn_us as f64 / 1e6;
        let most = f64::from(self.beginning.mm_s2) * TICKS_A_MM * seconds;
        self.speed += (self.target - self.speed).clamp(-most, most);
        let from = self.ground.floor() as i64;
        self.ground += self.speed * seconds;
        let to = self.ground.floor() as i64;
        let (moves, direction) = ((to - from).abs(), (to - from).signum());
        self.speeds.take(self.time_us, if self.encoder_is_silent { 0.0 } else { self.speed });
        for place in 1..=moves {
            self.count += if self.encoder_is_silent { 0 } else { direction };
            self.beam_at(from + place * direction)?;
        }
        self.beam_at(to)?;
        let readings = if self.beginning.reads_first { before } else { self.readings() };
        self.step(readings)?;
        self.attend_to_the_console()
    }

    fn beam_at(&mut self, ground: i64) -> Checked {
        self.farthest = self.farthest.max(ground);
        let broken = ground <= self.bare_from && self.row[ground.rem_euclid(self.row.len() as i64) as usize];
        if broken == self.broken { Ok(()) } else { self.edge(broken) }
    }

    /// The beam changes its level.
    fn edge(&mut self, broken: bool) -> Checked {
        self.broken = broken;
        if !self.edges_get_lost {
            self.machine.beam_edge(Position::new(self.count as i32), broken);
            self.check_weed()?;
        }
        self.model.edge(self.here(), broken, self.blur());
        Ok(())
    }

    /// The machine finds that edges were lost.
    fn find_edges_lost(&mut self) -> Checked {
        self.edges_get_lost = false;
        self.machine.beam_edges_lost(self.broken);
        prop_assert!(matches!(self.machine.state(), State::Alarm(_)) || self.is_tried, "lost edges are no alarm");
        Ok(())
    }

    /// How far off the machine may have a place for its sensor's sake: the sensor of this machine answers at once.
    fn blur(&self) -> i64 {
        let (slowest, fastest) = self.speeds.get();
        let response_ms = self.machine.settings().get(Setting::BeamResponseMs);
        (fastest.max(-slowest) * f64::from(response_ms) / 1000.0) as i64 + 1
    }

    /// The encoder's count, without its wrapping, that a reading shows.
    fn unwrapped(&self, position: Position) -> i64 {
        self.count + i64::from((position - Position::new(self.count as i32)).0)
    }

    /// The place that the machine takes itself to be at: the encoder's count without the noise that it does not believe.
    fn here(&self) -> i64 {
        self.unwrapped(self.odometer.place(Position::new(self.count as i32)))
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
        let (before, was_out) = (self.machine.state(), self.machine.tool_out());
        self.odometer.read(readings.position, readings.jumps, self.machine.believes_jumps());
        let count = self.unwrapped(self.odometer.place(readings.position));
        self.model.roll_to(count, self.blur());
        let orders = self.machine.step(readings);
        let (state, out) = (self.machine.state(), self.machine.tool_out());
        self.check_weed()?;
        self.is_tried &= state == before;
        self.check_orders(orders)?;
        self.out_since_us = (orders.pulse == orders.pulse_out).then(|| self.out_since_us.unwrap_or(self.time_us));
        if state != before {
            self.disturb();
            prop_assert!(state != State::Work || self.switch_on, "the machine went to work by itself");
            prop_assert!(!is_alarm(before) || !self.switch_on, "{before:?} went away by itself");
            let is_false = state == State::Alarm(Alarm::ToolStuck) && !self.tool_was_stuck;
            prop_assert!(!is_false, "an end switch that follows the tool within {SWITCH_DELAY_US} us is an alarm");
        }
        prop_assert!(self.stack_free > 40 || is_alarm(state), "a low stack is no alarm");
        if state == State::Work {
            self.check_place(count - self.ticks(Setting::BeamToToolMm))?;
            if out && !was_out {
                self.check_swing(count - self.ticks(Setting::BeamToToolMm))?;
            }
        }
        Ok(())
    }

    /// The servo has the pulse that is due: out in every state but at work, or where it is tried by hand.
    fn check_orders(&self, orders: Orders) -> Checked {
        let pulse_of = |setting| servo::from_us(self.machine.settings().get(setting));
        let (inside, outside) = (pulse_of(Setting::ServoInUs), pulse_of(Setting::ServoOutUs));
        prop_assert_eq!(orders.pulse_out, outside);
        let (state, out) = (self.machine.state(), self.machine.tool_out());
        if state == State::Work {
            prop_assert_eq!(orders.pulse, if out { outside } else { inside });
        } else if is_alarm(state) || !self.is_tried {
            prop_assert!(out && orders.pulse == outside, "the tool is in the row in {state:?}");
        }
        Ok(())
    }

    /// The tool is out wherever it has to be.
    fn check_place(&self, tool: i64) -> Checked {
        if self.machine.tool_out() {
            return Ok(());
        }
        let settings = self.machine.settings();
        // The machine adds a millisecond to each lead, for the command's way to the pin.
        let lead = |milliseconds: u16| f64::from(milliseconds + u16::from(milliseconds > 0)) / 1000.0;
        let lead_out = lead(settings.get(Setting::LeadOutMs));
        let lead_in = (1.25 * lead(settings.get(Setting::LeadInMs))).min(lead_out);
        let (slowest, fastest) = self.speeds.get();
        let (slowest, fastest) = (slowest - GRAIN_OF_SPEED, fastest + GRAIN_OF_SPEED);
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
    fn check_swing(&mut self, tool: i64) -> Checked {
        let is_calm = self.speed == self.target
            && self.speed.abs() > STEADY_SPEED
            && self.calm_since_us + STEADY_US < self.time_us
            && self.machine.reason() == Some(Reason::Plant)
            && !self.model.is_shifted;
        if !is_calm {
            self.left_for = None;
            return Ok(());
        }
        // A window is left, and over, by the lead before its end, the less as the measured speed wavers.
        let settings = self.machine.settings();
        let lead_in_ms = settings.get(Setting::LeadInMs).min(settings.get(Setting::LeadOutMs));
        let ahead = tool + (0.8 * self.speed * f64::from(lead_in_ms) / 1000.0) as i64;
        let window = self.model.next_window(ahead, self.speed > 0.0, self.ticks(Setting::MarginMm));
        let again = window.is_some() && window.map(|run| run.leading) == self.left_for.map(|run| run.leading);
        prop_assert!(!again, "at {tool} the tool leaves again for {window:?}, at {:.0} ticks/s", self.speed);
        self.left_for = window;
        self.steady_swings += 1;
        Ok(())
    }

    /// What the machine has just taken for a weed was one, as the model saw it.
    fn check_weed(&mut self) -> Checked {
        let Some(width_mm) = self.weed.take() else { return Ok(()) };
        let wheel = self.machine.settings().wheel();
        // A millimetre, and what lies between it and the next.
        let millimetre = i64::from(wheel.ticks(1).0) + 1;
        let told = self.model.weed(self.here(), wheel.ticks(width_mm as u16).0.into(), millimetre);
        prop_assert!(told.is_ok() || self.model.is_shifted, "{}", told.unwrap_err());
        Ok(())
    }

    /// The console's part of a turn.
    fn attend_to_the_console(&mut self) -> Checked {
        let (before, unseen_mm, grain) = (self.machine.state(), self.machine.unseen_mm(), self.grain());
        if self.console.carry_out(&mut self.machine) {
            let (line, after) = (self.console.current.clone(), self.machine.state());
            let words: Vec<&str> = line.split([' ', '\t']).filter(|word| !word.is_empty()).collect();
            prop_assert!(after == before || after != State::Work || words[0] == "start", "{line:?} had it work");
            prop_assert!(after == before || !is_alarm(before) || words == ["clear"], "{line:?} cleared an alarm");
            self.is_tried |= matches!(words[0], "servo" | "calibrate" | "test");
            self.is_tried &= after == State::Hold && !matches!(words[..], ["hold"] | ["servo", "out"]);
            self.saving = (words == ["save"]).then(|| self.machine.settings().clone());
            if words == ["start", "now"] && after == State::Work {
                let read = self.unwrapped(self.machine.readings().position);
                let tool = read - self.ticks(Setting::BeamToToolMm);
                let unseen =
                    f64::from(unseen_mm + 1) * f64::from(self.machine.settings().wheel().ticks(1000).0) / 1000.0;
                if unseen_mm > 0 {
                    self.model.trust(tool - self.ticks(Setting::MarginMm), tool + unseen as i64);
                }
            }
            if self.grain() != grain {
                self.model.begin_anew(self.unwrapped(self.machine.readings().position));
            }
        }
        self.console.write(&mut self.machine)?;
        if is_end(&self.console.written) {
            if let Some(saving) = self.saving.take()
                && self.console.written.starts_with("ok")
            {
                self.saved = Some(saving);
            }
            if matches!(self.console.current.split([' ', '\t']).next(), Some("label" | "forget")) {
                self.taught = self.examples();
            }
        }
        Ok(())
    }

    /// In what steps the machine remembers the ground: for other ones it begins anew.
    fn grain(&self) -> Grain {
        Grain::of(self.machine.settings().wheel().ticks(1000))
    }

    /// The examples from the field.
    fn examples(&self) -> Vec<Listed> {
        let all = std::iter::successors(self.machine.classifier().listed(0), |&(_, next)| {
            self.machine.classifier().listed(next)
        });
        all.map(|(listed, _)| listed).filter(|listed| listed.from_field).collect()
    }

    /// The machine has been reset: in HOLD or with an alarm, the tool out, and with all that it said that it keeps.
    fn wake_up(&mut self, cause: Cause) -> Checked {
        let is_answered = self.console.is_done();
        let maybe = self.examples();
        self.console = Console::new();
        self.machine =
            wake(&self.eeprom, &self.weed, WakeUp { readings: self.readings(), beam_broken: self.broken, cause });
        let is_lost = self.machine.state() == State::Alarm(Alarm::SettingsLost);
        prop_assert!(is_lost || self.machine.state() == State::Hold, "woken up in {:?}", self.machine.state());
        let found = (!is_lost).then(|| self.machine.settings().clone());
        // What was not acknowledged is there, or is not.
        if self.saving.is_some() && self.saving == found {
            self.saved = found;
        } else {
            prop_assert_eq!(&found, &self.saved, "other settings than were saved");
        }
        prop_assert!(self.machine.tool_out() && self.machine.orders().pulse == self.machine.orders().pulse_out);
        let examples = self.examples();
        if is_answered {
            prop_assert_eq!(&examples, &self.taught, "other examples than were taught");
        } else {
            prop_assert!(examples.iter().all(|example| maybe.contains(example) || self.taught.contains(example)));
        }
        self.taught = examples;
        self.odometer = Odometer::new(Position::new(self.count as i32), self.jumps);
        self.model = Model::new(self.here(), self.broken);
        // It takes itself for standing until it has measured.
        self.speeds = Extremes(VecDeque::from([(self.time_us / Extremes::SHARE_US, 0.0, 0.0)]));
        (self.saving, self.is_tried, self.tool_was_stuck) = (None, false, self.tool_is_stuck);
        self.out_since_us = Some(self.time_us);
        self.disturb();
        Ok(())
    }
}

fn is_alarm(state: State) -> bool {
    matches!(state, State::Alarm(_))
}

/// Whether a line is the last one of an answer.
fn is_end(line: &str) -> bool {
    line.trim_end() == "ok" || line.starts_with("error: ")
}
