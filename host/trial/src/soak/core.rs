//! Hours of the decision core on the host: a turn of the loop is a millisecond, and an edge of the beam comes at its tick.
//!
//! Each row has a machine of its own, with a second beam or without, and a wheel whose slip changes. Where there are two beams, now and
//! then one of them misses a plant. The tool must be out of the row at a plant that at least one beam has seen.
//!
//! Clock and count go on over resets, unlike on the chip, and begin shortly before their ends, so that in each hour both run over them.

use super::tally::{Plan, SoakError, Tally, chance, count, total};
use control::{
    ground::{class::Class, examples::EXAMPLES, nearest::Nearest},
    measure::{readings::Readings, reset::Cause},
    memory::{Memory, Volatile},
    operate::{
        event::Event,
        saved::{COPY, SavedSettings},
        state::State,
    },
    settings::{Setting, Settings},
    units::{Instant, Position, Ticks},
};
use field::machine::Machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::row::{Kind, Row};
use field::wheel::{Wheel, most_slip};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rig::{Beams, ByExamples, Rig};
use std::{cell::RefCell, ops::Range, rc::Rc};

/// A turn of the loop.
const TURN_US: u32 = 1000;
const TURN_S: f64 = TURN_US as f64 / 1e6;

/// Bytes of the stack that were never used.
const STACK_FREE: u16 = 300;

/// Where clock and count begin: the clock a minute before its end, the count two hundred metres.
const FIRST_STEPS: u32 = u32::MAX - 15_000_000;
const FIRST_COUNT: i32 = i32::MAX - 382_000;

/// Simulated time between two reports of progress.
const PROGRESS_TURNS: u64 = 1_000_000;

/// The rows: plants half a metre apart, as the examples were trained.
const PLANTING: Planting = Planting {
    plants: 40,
    spacing_mm: 500.0,
    spacing_scatter_mm: 40.0,
    canopy_mm: 150.0,
    canopy_scatter_mm: 25.0,
    weeds: 10,
    ragged: false,
};

/// A stand in which plants are too near for two beams.
const DENSE: Planting = Planting {
    spacing_mm: 260.0,
    spacing_scatter_mm: 20.0,
    canopy_mm: 120.0,
    canopy_scatter_mm: 15.0,
    weeds: 0,
    ..PLANTING
};

/// Ground between the second beam and the tool: the tool swings out over it, at 3 km/h and with the margin.
const SECOND_BEAM_TO_TOOL_MM: u16 = 300;

/// Either of two beams misses a thing as rarely as this.
pub(super) const MISSED_ONCE_IN: usize = 16;

/// Ground before and behind each row.
const HEADLAND_MM: f64 = 1000.0;

/// The measured speed is right again so long after the encoder was silent.
const SPEED_SETTLES_TURNS: u64 = 100;

/// An offset between the ground and the count from which on the firmware cannot know: a quarter of the margin. The rest is
/// what a push, a jerk or slip may use up.
const BLIND_TICKS: f64 = 24.0;

/// What the ends of an object may be off by.
const EDGE_TICKS: i64 = 4;

type Weeder = Rig<ByExamples<Shared>, Shared>;

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

impl Shared {
    /// What is found when the power is back.
    fn recover(&self) {
        let found = self.0.borrow().clone().with_power();
        *self.0.borrow_mut() = found;
    }
}

/// A row in ticks of a wheel that does not slip.
struct Ground {
    /// Whether each beam is broken over each tick.
    broken: [Vec<bool>; 2],
    plants: Vec<Range<i64>>,
    /// What the tool must not reach of each plant.
    kept: Vec<Range<i64>>,
}

impl Ground {
    /// A row as the beams of a machine see it: of two, now and then one misses a thing. Of a plant the stem's zone is kept, where there
    /// is one.
    fn of(row: &Row, machine: &Machine, stem_zone_mm: u16, rng: &mut ChaCha8Rng) -> Self {
        let start_mm = row.span_mm().start - HEADLAND_MM;
        let tick = |mm: f64| ((mm - start_mm) / machine.tick_mm()).round() as i64;
        let length = tick(row.span_mm().end + HEADLAND_MM + machine.beam_to_tool_mm);
        let mut broken = [vec![false; length as usize], vec![false; length as usize]];
        for thing in row.things() {
            let span = thing.span_mm();
            let missed = if machine.has_second_beam() { rng.random_range(0..MISSED_ONCE_IN) } else { MISSED_ONCE_IN };
            for (beam, broken) in broken.iter_mut().enumerate().filter(|&(beam, _)| beam != missed) {
                // The second beam has nothing to see where there is none.
                let is_there = beam == 0 || machine.has_second_beam();
                broken[tick(span.start) as usize..tick(span.end) as usize].fill(is_there);
            }
        }
        let spans = |most_mm: f64| {
            let plants = row.things().iter().filter(|thing| thing.kind == Kind::Plant).map(|plant| plant.span_mm());
            let plants = plants.map(|Range { start, end }| {
                let cut_mm = ((end - start - most_mm) / 2.0).max(0.0);
                tick(start + cut_mm)..tick(end - cut_mm)
            });
            plants.collect::<Vec<_>>()
        };
        let zone_mm = if stem_zone_mm > 0 { stem_zone_mm.into() } else { f64::INFINITY };
        Self { broken, plants: spans(f64::INFINITY), kept: spans(zone_mm) }
    }

    fn is_broken(&self, beam: usize, place: i64) -> bool {
        usize::try_from(place).is_ok_and(|place| self.broken[beam].get(place).copied().unwrap_or(false))
    }
}

/// The machine in the field, with its operator.
struct Field {
    rng: ChaCha8Rng,
    machine: Machine,
    weeder: Weeder,
    memories: [Shared; 2],
    turns: u64,
    /// Where the machine is in its row, in ticks.
    place: f64,
    wheel: Wheel,
    speed: f64,
    /// What the firmware is told of the machine.
    told: [(Setting, u16); 3],
    /// Turns for which the encoder is yet to be dead, and whether one of its channels is alive then.
    silent_turns: u32,
    one_channel_lives: bool,
    /// Ticks that the count lacks since the firmware last forgot its ground.
    lost_ticks: i64,
    blind_until_turn: u64,
    /// What went wrong last, and at which turn.
    last_fault: (&'static str, u64),
    /// Turns since the tool's last order, and whether it was fully out before that.
    order_turns: u64,
    was_clear: bool,
    tool_out: bool,
    /// Plants of the row that were mistaken or reached blindly.
    excused: Vec<Excuse>,
    tally: Tally,
}

/// What may have become of a plant.
#[derive(Clone, Copy, Default)]
struct Excuse {
    mistaken: bool,
    blind: bool,
    passed: bool,
    harmed: bool,
}

/// Works for so many simulated hours; `progress` is told the share done, from 0 to 1.
///
/// # Errors
/// [`SoakError::Planting`].
pub fn hours(plan: Plan, hours: f64, mut progress: impl FnMut(f64)) -> Result<Tally, SoakError> {
    total((0..hours.ceil() as u64).map(|number| {
        let begun = number as f64;
        hour(plan, number, (hours - begun).min(1.0), |share| progress((begun + share) / hours))
    }))
}

/// Works for an hour of a soak, with this number from 0, or for a part of it; `progress` is told how much of an hour is done.
///
/// # Errors
/// [`SoakError::Planting`].
pub fn hour(plan: Plan, number: u64, part: f64, mut progress: impl FnMut(f64)) -> Result<Tally, SoakError> {
    let turns = (part * 3600.0 / TURN_S) as u64;
    let field = Field::new(chance(plan, number), Machine::default());
    let mut tally = field.work_until(turns, plan.faults_an_hour, &mut |share| progress(share * part))?;
    tally.violations = tally.violations.iter().map(|what| format!("hour {}, {what}", number + 1)).collect();
    Ok(tally)
}

impl Field {
    fn new(rng: ChaCha8Rng, machine: Machine) -> Self {
        let memories = [Shared::default(), Shared::default()];
        let mut readings = Readings::new(Instant::new(FIRST_STEPS), Position::new(FIRST_COUNT));
        readings.stack_free = STACK_FREE;
        let weeder = init(&memories, readings, Beams::default(), Cause::PowerOn);
        Self {
            rng,
            machine,
            weeder,
            memories,
            turns: 0,
            place: 0.0,
            wheel: Wheel::default(),
            speed: 0.0,
            told: told(&machine, 0),
            silent_turns: 0,
            one_channel_lives: false,
            lost_ticks: 0,
            blind_until_turn: 0,
            last_fault: ("nothing", 0),
            order_turns: 0,
            was_clear: true,
            tool_out: true,
            excused: Vec::new(),
            tally: Tally::default(),
        }
    }

    fn time_s(&self) -> f64 {
        self.turns as f64 * TURN_S
    }

    fn distance(&self) -> i64 {
        (self.machine.beam_to_tool_mm / self.machine.tick_mm()).round() as i64
    }

    /// Works row after row until so many turns are done, or something was violated.
    fn work_until(
        mut self,
        last_turn: u64,
        faults_an_hour: f64,
        progress: &mut impl FnMut(f64),
    ) -> Result<Tally, SoakError> {
        let chance = faults_an_hour * TURN_S / 3600.0;
        while self.turns < last_turn && self.tally.violations.is_empty() {
            let stem_zone_mm = self.take_a_machine();
            let is_dense = self.machine.has_second_beam() && self.rng.random_bool(0.25);
            let row = if is_dense { DENSE } else { PLANTING }.grow(self.rng.random())?;
            let ground = Ground::of(&row, &self.machine, stem_zone_mm, &mut self.rng);
            self.work(&ground, chance, last_turn, progress);
        }
        self.tally.seconds = self.time_s();
        Ok(self.tally)
    }

    /// Takes the machine for a row, and tells its firmware of it; the zone of a stem.
    fn take_a_machine(&mut self) -> u16 {
        (self.machine.beam_to_tool_mm, self.machine.second_beam_mm) = if self.rng.random() {
            let to_tool_mm = self.rng.random_range(470..=1000_u16);
            let apart_mm = self.rng.random_range(to_tool_mm * 7 / 20..=to_tool_mm - SECOND_BEAM_TO_TOOL_MM);
            (to_tool_mm.into(), apart_mm.into())
        } else {
            (Machine::default().beam_to_tool_mm, 0.0)
        };
        let stem_zone_mm = if self.rng.random_bool(0.25) { 90 } else { 0 };
        self.told = told(&self.machine, stem_zone_mm);
        self.weeder.hold();
        self.tell();
        if self.weeder.save().is_err() {
            self.tally.violated(self.time_s(), "a machine in HOLD does not save");
        }
        while !self.weeder.carry_on() {}
        stem_zone_mm
    }

    /// Tells the firmware what the machine is like.
    fn tell(&mut self) {
        self.weeder.clear();
        let none = (Setting::SecondBeamMm, 0);
        for (setting, value) in [none].into_iter().chain(self.told) {
            if self.weeder.set(setting, value).is_err() {
                self.tally.violated(self.time_s(), format_args!("{value} is refused for {}", setting as u8));
            }
        }
    }

    /// Works a row from its headland to its end, or to the soak's end.
    fn work(&mut self, ground: &Ground, chance: f64, last_turn: u64, progress: &mut impl FnMut(f64)) {
        self.tally.rows += 1;
        self.excused = vec![Excuse::default(); ground.plants.len()];
        // The machine was turned round and stands in the headland: the operator knows, and tells it.
        self.weeder.hold();
        (self.place, self.speed, self.wheel) = (0.0, 0.0, Wheel::default());
        self.reset(Beams::default(), Cause::ResetPin);
        let (mut target, mut leg_turns) = (0.0_f64, 0_u32);
        while (self.place as usize) < ground.broken[0].len()
            && self.turns < last_turn
            && self.tally.violations.is_empty()
        {
            if leg_turns == 0 {
                target = self.next_speed();
                let most =
                    most_slip(f64::from(self.weeder.settings().get(Setting::MarginMm)), self.machine.beam_to_tool_mm);
                self.wheel.turns_a_tick = 1.0 + self.rng.random_range(-most..=most);
                leg_turns =
                    if target < 0.0 { self.rng.random_range(300..1500) } else { self.rng.random_range(500..6000) };
                self.start_again();
            }
            leg_turns -= 1;
            // A person pushes, and brakes, with 1 m/s2.
            let most = 1000.0 / self.machine.tick_mm() * TURN_S;
            self.speed += (target - self.speed).clamp(-most, most);
            if self.rng.random_bool(chance) {
                self.fail(ground);
            }
            self.turn(ground);
            if self.turns.is_multiple_of(PROGRESS_TURNS) {
                progress(self.turns as f64 / last_turn as f64);
            }
        }
        for excuse in &self.excused {
            self.tally.plants += u64::from(excuse.passed);
            if excuse.harmed {
                match excuse {
                    Excuse { mistaken: true, .. } => self.tally.mistaken += 1,
                    Excuse { blind: true, .. } => self.tally.blind += 1,
                    _ => self.tally.harmed += 1,
                }
            }
        }
    }

    /// The next leg's speed in ticks/s: mostly a walk, now and then a stop or some way back.
    fn next_speed(&mut self) -> f64 {
        let km_h = match self.rng.random_range(0..10) {
            0 => 0.0,
            1 if self.place > 5000.0 => -self.rng.random_range(0.5..1.5),
            _ => self.rng.random_range(0.8..3.0),
        };
        mm_s(km_h) / self.machine.tick_mm()
    }

    /// The operator clears what is latched, and starts.
    fn start_again(&mut self) {
        if self.weeder.state() == State::Work {
            return;
        }
        self.weeder.clear();
        if self.weeder.start(false).is_err() || self.weeder.state() != State::Work {
            self.tally.violated(self.time_s(), "the machine does not start when it is told to");
        }
    }

    /// What the beams see with the machine at a place.
    fn beams_at(&self, ground: &Ground, place: i64) -> Beams {
        let apart = (self.machine.second_beam_mm / self.machine.tick_mm()).round() as i64;
        Beams { broken: ground.is_broken(0, place), second_broken: ground.is_broken(1, place - apart) }
    }

    /// A turn of the loop.
    fn turn(&mut self, ground: &Ground) {
        self.turns += 1;
        let from = self.place.floor() as i64;
        self.place += self.speed * TURN_S;
        let to = self.place.floor() as i64;
        self.tally.metres += (to - from).abs() as f64 * self.machine.tick_mm() / 1000.0;
        let direction = (to - from).signum();
        for step in 1..=(to - from).abs() {
            let place = from + step * direction;
            let turned = self.wheel.roll(place - direction, direction > 0);
            let counted = match (self.silent_turns, self.one_channel_lives) {
                (0, _) => turned,
                (_, true) => turned.abs() * (1 - 2 * (self.wheel.ticks() & 1)),
                (_, false) => 0,
            };
            self.weeder.readings.position = self.weeder.readings.position + Ticks(counted as i32);
            self.lost_ticks += turned - counted;
            let beams = self.beams_at(ground, place);
            self.weeder.see(beams);
        }
        if self.silent_turns > 0 {
            self.silent_turns -= 1;
            // The measured speed was wrong, and with it the leads: a swing may be late by that.
            self.blind_until_turn = self.turns + self.swing_ms() as u64 + SPEED_SETTLES_TURNS;
        }
        self.weeder.turn_after(TURN_US);
        if !self.weeder.tool_out() {
            self.tally.weeded_metres += (to - from).abs() as f64 * self.machine.tick_mm() / 1000.0;
        }
        self.weeder.readings.stack_free = STACK_FREE;
        self.listen(ground);
        self.judge(ground, to - self.distance());
    }

    /// Takes what the machine tells.
    fn listen(&mut self, ground: &Ground) {
        while let Some(event) = self.weeder.next_event() {
            match event {
                Event::Alarm { alarm, .. } => {
                    count(&mut self.tally.alarms, &link::advice::name(alarm));
                    self.see_anew();
                }
                Event::Warning(warning) => count(&mut self.tally.warnings, &name(warning.text().bytes())),
                Event::Detection { vote, leading, plan, .. } if vote.class == Class::Weed => {
                    let behind = i64::from((leading - self.weeder.readings.position).0);
                    let place = self.place as i64 + behind;
                    let margin = self.weeder.settings().ticks(Setting::MarginMm);
                    // Over ground the wheel has slipped since.
                    let edge_ticks = EDGE_TICKS + behind.abs() / 16;
                    let object = place - edge_ticks..place + i64::from(plan.hold.0 - 2 * margin.0) + edge_ticks;
                    for (plant, excuse) in ground.plants.iter().zip(&mut self.excused) {
                        excuse.mistaken |= plant.start < object.end && object.start < plant.end;
                    }
                }
                _ => {}
            }
        }
    }

    /// From here on only ground counts that the beam sees again as new. If the count was wrong until now, the tool is
    /// still swinging out of a wrong position.
    fn see_anew(&mut self) {
        if self.is_blind() {
            self.blind_until_turn = self.blind_until_turn.max(self.turns + self.swing_ms() as u64);
        }
        self.lost_ticks = 0;
    }

    /// Whether the count is off the ground by more than the firmware can know. What it is off by between two beams is measured as slip,
    /// and taken for the whole distance to the tool.
    fn is_blind(&self) -> bool {
        let share = if self.machine.has_second_beam() {
            self.machine.second_beam_mm / self.machine.beam_to_tool_mm
        } else {
            1.0
        };
        self.lost_ticks.abs() as f64 >= BLIND_TICKS * share
    }

    fn swing_ms(&self) -> f64 {
        self.machine.servo.dead_time_ms + self.machine.servo.travel_ms
    }

    /// Whether the tool, which stands at a place of the row, does harm there.
    fn judge(&mut self, ground: &Ground, tool: i64) {
        let out = self.weeder.tool_out();
        if !out && self.weeder.state() != State::Work {
            self.tally.violated(self.time_s(), format_args!("the tool is in the row in {:?}", self.weeder.state()));
        }
        let (dead, swing) = (self.machine.servo.dead_time_ms, self.swing_ms());
        let order_ms = self.order_turns as f64;
        let clear = if self.tool_out {
            order_ms >= swing || (self.was_clear && order_ms < swing)
        } else {
            self.was_clear && order_ms < dead
        };
        if out != self.tool_out {
            // A tool that had not begun to move is still where it was.
            (self.was_clear, self.tool_out, self.order_turns) = (clear, out, 0);
        } else {
            self.order_turns += 1;
        }
        let is_blind = self.is_blind();
        let first = ground.kept.partition_point(|plant| plant.end <= tool);
        let Some((plant, excuse)) = ground.kept.get(first).zip(self.excused.get_mut(first)) else { return };
        if !plant.contains(&tool) {
            return;
        }
        excuse.passed = true;
        if clear {
            return;
        }
        excuse.harmed = true;
        excuse.blind |= is_blind || self.turns <= self.blind_until_turn;
        // Rolled back onto ground that it has not seen since it woke up: there is no margin before what it does not know.
        excuse.blind |= out && self.weeder.unseen_mm() > 0;
        if !excuse.mistaken && !excuse.blind {
            let state = self.weeder.state();
            let (time_s, order_ms, row) = (self.time_s(), self.order_turns, self.tally.rows);
            let (fault, fault_turn) = self.last_fault;
            let ago_s = (self.turns - fault_turn) as f64 * TURN_S;
            self.tally.violated(
                time_s,
                format_args!(
                    "a plant was harmed at tick {tool} of row {row}, in {state:?}, {order_ms} ms after the last order, \
                     {ago_s:.3} s after {fault}"
                ),
            );
        }
    }

    /// Something goes wrong.
    fn fail(&mut self, ground: &Ground) {
        let fault = match self.rng.random_range(0..9) {
            0 => {
                let beams @ Beams { broken, second_broken } = self.weeder.beams();
                let dusty = if self.machine.has_second_beam() && self.rng.random() {
                    Beams { second_broken: !second_broken, ..beams }
                } else {
                    Beams { broken: !broken, ..beams }
                };
                for _ in 0..self.rng.random_range(1..40) {
                    self.weeder.see(dusty);
                    self.weeder.see(beams);
                }
                "dust"
            }
            1 => {
                self.silent_turns = self.rng.random_range(5..600);
                self.one_channel_lives = self.rng.random();
                if self.one_channel_lives { "dead_channel" } else { "silent_encoder" }
            }
            2 => {
                let jumps = &mut self.weeder.readings.jumps;
                *jumps = jumps.wrapping_add(self.rng.random_range(1..60));
                "encoder_jumps"
            }
            3 => {
                let beams = self.beams_at(ground, self.place as i64);
                self.weeder.lose_edges(beams);
                "lost_edges"
            }
            4 => {
                self.weeder.readings.stack_free = 20;
                "low_stack"
            }
            5 => {
                let cause =
                    [Cause::PowerOn, Cause::BrownOut, Cause::Watchdog, Cause::LoopStalled][self.rng.random_range(0..4)];
                self.reset(self.weeder.beams(), cause);
                "reset"
            }
            6 => {
                self.lose_power_in_a_save();
                "power_lost_in_a_save"
            }
            7 => {
                let address = self.rng.random_range(0..control::memory::SIZE);
                let byte = self.rng.random();
                self.memories[self.rng.random_range(0..2)].0.borrow_mut().bytes[address] = byte;
                self.reset(self.weeder.beams(), Cause::PowerOn);
                "spoiled_eeprom"
            }
            _ => {
                self.noise();
                "console_noise"
            }
        };
        self.last_fault = (fault, self.turns);
        count(&mut self.tally.faults, fault);
    }

    /// The chip is reset.
    fn reset(&mut self, beams: Beams, cause: Cause) {
        self.memories.iter().for_each(Shared::recover);
        self.weeder = init(&self.memories, self.weeder.readings, beams, cause);
        self.see_anew();
        if let State::Alarm(alarm) = self.weeder.state() {
            count(&mut self.tally.alarms, &link::advice::name(alarm));
        }
        count(&mut self.tally.resets, &name(cause.text().bytes()));
        if !self.weeder.tool_out() || self.weeder.state() == State::Work {
            self.tally.violated(self.time_s(), "the machine woke up with the tool in the row");
        }
        // Settings that came back old or not at all are put right before it rolls on: the firmware knows the ground by its settings of that time.
        if self.told.iter().any(|&(setting, value)| self.weeder.settings().get(setting) != value) {
            self.tell();
        }
    }

    /// The operator saves, and the power goes away at one of the bytes.
    fn lose_power_in_a_save(&mut self) {
        self.weeder.hold();
        self.weeder.clear();
        let old = self.saved();
        let no_plant_m = self.rng.random_range(1..8);
        if self.weeder.set(Setting::NoPlantM, no_plant_m).is_err() || self.weeder.save().is_err() {
            self.tally.violated(self.time_s(), "a machine in HOLD does not save");
        }
        let new = self.weeder.settings().clone();
        let bytes = self.rng.random_range(0..=COPY);
        self.memories[0].0.borrow_mut().lose_power_after(bytes);
        while !self.weeder.carry_on() {}
        self.reset(self.weeder.beams(), Cause::BrownOut);
        let found = self.saved();
        if found.as_ref() != Some(&new) && (found != old || bytes == COPY) {
            let time_s = self.time_s();
            self.tally.violated(time_s, format_args!("a save cut short after {bytes} bytes left {found:?}"));
        }
    }

    /// The settings as the memory has them.
    fn saved(&self) -> Option<Settings> {
        SavedSettings::new(self.memories[0].clone()).load()
    }

    /// Bytes by chance come along the line, and questions among them.
    fn noise(&mut self) {
        let bytes = (0..self.rng.random_range(1..300)).map(|_| match self.rng.random_range(0..4) {
            0 => b'\n',
            _ => self.rng.random(),
        });
        self.weeder.type_in(bytes.chain(*b"\nstatus\nget\ndump\nexamples\n"));
    }
}

/// What the firmware is told of a machine, in this order.
fn told(machine: &Machine, stem_zone_mm: u16) -> [(Setting, u16); 3] {
    [
        (Setting::BeamToToolMm, machine.beam_to_tool_mm as u16),
        (Setting::SecondBeamMm, machine.second_beam_mm as u16),
        (Setting::StemZoneMm, stem_zone_mm),
    ]
}

fn init(memories: &[Shared; 2], readings: Readings, beams: Beams, cause: Cause) -> Weeder {
    let nearest = Nearest::new(&EXAMPLES[..], memories[1].clone());
    let mut weeder = Rig::wake_at(nearest, memories[0].clone(), readings, beams, cause);
    weeder.enable_events(true);
    weeder
}

fn name(bytes: impl Iterator<Item = u8>) -> String {
    bytes.map(char::from).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    /// Six minutes of work without faults by a machine that was told its leads wrongly.
    fn with_leads(lead_out_ms: u16, lead_in_ms: u16) -> Tally {
        let mut field = Field::new(ChaCha8Rng::seed_from_u64(1), Machine::default());
        field.weeder.clear();
        field.weeder.set(Setting::LeadInMs, lead_in_ms).expect("in HOLD");
        field.weeder.set(Setting::LeadOutMs, lead_out_ms).expect("in HOLD");
        field.weeder.save().expect("in HOLD");
        while !field.weeder.carry_on() {}
        field.work_until(360_000, 0.0, &mut |_| {}).expect("rows grow")
    }

    #[test]
    fn a_tool_that_is_told_too_late_is_seen_to_harm_a_plant() {
        let tally = with_leads(0, 0);
        assert!(tally.harmed > 0 && tally.violations[0].contains("a plant was harmed"), "{tally}");
    }

    #[test]
    fn a_plant_that_the_first_beam_misses_is_seen_to_be_harmed_where_the_firmware_ignores_the_second() {
        let mut field = Field::new(ChaCha8Rng::seed_from_u64(1), Machine::default());
        while field.tally.violations.is_empty() && field.tally.rows < 20 {
            let stem_zone_mm = field.take_a_machine();
            // The beam is there, and its wire is not.
            field.told[1].1 = 0;
            field.tell();
            field.weeder.save().expect("in HOLD");
            while !field.weeder.carry_on() {}
            let row = PLANTING.grow(field.rng.random()).expect("rows grow");
            let ground = Ground::of(&row, &field.machine, stem_zone_mm, &mut field.rng);
            field.work(&ground, 0.0, u64::MAX, &mut |_| {});
        }
        assert!(field.tally.violations.iter().any(|what| what.contains("a plant was harmed")), "{}", field.tally);
    }

    #[test]
    fn a_tool_that_is_told_in_time_harms_none_and_weeds() {
        let tally = with_leads(180, 40);
        assert!(tally.harmed == 0 && tally.blind == 0 && tally.violations.is_empty(), "{tally}");
        assert!(tally.plants > 200 && tally.weeded_metres > 0.3 * tally.metres, "{tally}");
    }
}
