//! The real machine on the real row: time, speed, wheel, encoder and servo, and the beams' edges at plants and weeds.

use super::Drive;
use crate::{
    machine::{Checked, Machine, World},
    run::{Beginning, Encoder, Run, TICKS_A_MM},
    stand::Geometry,
};
use control::{alarm::Alarm, operate::state::State, settings::Setting};
use field::wheel::Wheel;
use proptest::prelude::*;

/// The end switch reports the tool's arrival after this time.
const SWITCH_DELAY_US: u64 = 60_000;

/// The real machine on the real row, in ticks of ground.
#[derive(Debug, Default)]
pub(super) struct Physics {
    pub(super) turn_us: u64,
    /// The acceleration, in mm/s2.
    mm_s2: i32,
    /// The level of each beam at each tick of the row.
    row: [Vec<bool>; 2],
    /// The real lengths and times, where the settings may be wrong.
    geometry: Option<Geometry>,
    /// The tick from which on the row is bare, and the farthest tick that the beam has reached.
    pub(super) bare_from: i64,
    pub(super) farthest: i64,
    /// The sensors' levels.
    pub(super) world: World,
    /// The position, and the wheel.
    pub(super) ground: f64,
    pub(super) wheel: Wheel,
    /// The present and the intended speed, in ticks a second.
    pub(super) speed: f64,
    pub(super) target: f64,
    pub(super) encoder: Encoder,
    pub(super) edges_get_lost: bool,
    /// Whether the tool's end switch sticks, and whether it did since the machine started.
    pub(super) tool_is_stuck: bool,
    pub(super) tool_was_stuck: bool,
    /// The time since which the servo has had the pulse for out.
    pub(super) out_since_us: Option<u64>,
    /// Ticks rolled in this row, and those with the tool in the row.
    pub(super) rolled: [f64; 2],
}

impl Physics {
    pub(super) fn new(run: &Run) -> Self {
        let (&Beginning { count, turn_us, mm_s2, .. }, row) = (&run.beginning, run.levels());
        let world = World { count: count.into(), broken: row[0][0], ..World::default() };
        Self { turn_us, mm_s2, row, world, bare_from: i64::MAX, out_since_us: Some(0), ..Self::default() }
    }

    /// Moves the machine to the headland of another row.
    pub(super) fn enter_row(&mut self, run: &Run, geometry: Geometry) {
        (self.row, self.geometry) = (run.levels(), Some(geometry));
        (self.ground, self.farthest, self.wheel) = (0.0, 0, Wheel::default());
        (self.world.broken, self.world.second_broken) = (self.row[0][0], false);
        self.rolled = [0.0; 2];
    }

    /// The real lengths and times. By default the settings are right.
    pub(super) fn geometry(&self, machine: &impl Machine) -> Geometry {
        self.geometry.unwrap_or_else(|| {
            let us = |setting| u64::from(machine.settings().get(setting)) * 1000;
            Geometry {
                beam_to_tool: machine.ticks(Setting::BeamToToolMm),
                second_beam: machine.ticks(Setting::SecondBeamMm),
                dead_us: us(Setting::LeadInMs),
                swing_us: us(Setting::LeadOutMs),
            }
        })
    }

    /// Begins a turn: time and speed go on. Returns the ticks to roll in it.
    fn begin_turn(&mut self) -> f64 {
        self.world.time_us += self.turn_us;
        let seconds = self.turn_us as f64 / 1e6;
        let most = f64::from(self.mm_s2) * TICKS_A_MM * seconds;
        self.speed += (self.target - self.speed).clamp(-most, most);
        self.speed * seconds
    }

    /// Sets the end switch after the tool's order, and counts the ticks that were rolled.
    fn end_turn(&mut self, rolled: f64, tool_out: bool) {
        self.rolled[0] += rolled;
        self.rolled[1] += if tool_out { 0.0 } else { rolled };
        let tool_is_out = self.out_since_us.is_some_and(|since_us| since_us + SWITCH_DELAY_US <= self.world.time_us);
        self.world.end_switch_on = tool_is_out && !self.tool_is_stuck;
    }

    /// The levels of both beams, the second one `apart` ticks behind the first.
    fn levels(&self, ground: i64, apart: i64) -> (bool, bool) {
        let stands_at =
            |row: &[bool], place: i64| place <= self.bare_from && row[place.rem_euclid(row.len() as i64) as usize];
        let [first, second] = &self.row;
        (stands_at(first, ground), apart > 0 && stands_at(second, ground - apart))
    }

    /// Checks that the alarm about a stuck tool is right.
    pub(super) fn check_tool_stuck(&self, state: State) -> Checked {
        let is_false = state == State::Alarm(Alarm::ToolStuck) && !self.tool_was_stuck;
        prop_assert!(!is_false, "an end switch that follows the tool within {SWITCH_DELAY_US} us is an alarm");
        Ok(())
    }
}

impl<M: Machine> Drive<M> {
    pub(super) fn roll(&mut self, ticks: f64, speed: f64) -> Checked {
        let (from, begun_us) = (self.physics.ground, self.physics.world.time_us);
        // The time of a turn in the other direction.
        let most_us = ((ticks / speed).abs() * 1e6) as u64 + 5_000_000;
        if self.physics.target != speed {
            self.disturb();
        }
        self.physics.target = speed;
        while (self.physics.ground - from) * ticks.signum() < ticks.abs()
            && self.physics.world.time_us < begun_us + most_us
        {
            self.turn()?;
        }
        Ok(())
    }

    pub(super) fn stop(&mut self) {
        (self.physics.speed, self.physics.target) = (0.0, 0.0);
        self.disturb();
    }

    pub(super) fn turns_for(&mut self, ms: u32) -> Checked {
        self.turns((u64::from(ms) * 1000 / self.physics.turn_us) as u32)
    }

    pub(super) fn turns(&mut self, turns: u32) -> Checked {
        self.disturb();
        let passed = (0..turns).try_for_each(|_| self.turn());
        self.disturb();
        passed
    }

    /// A turn of the machine's loop.
    pub(super) fn turn(&mut self) -> Checked {
        let before = self.physics.world;
        self.expectations.follow(&self.machine, self.here());
        let ticks = self.physics.begin_turn();
        let Physics { world, speed, encoder, wheel, .. } = &self.physics;
        let turned = if *encoder == Encoder::Works { speed * wheel.turns_a_tick } else { 0.0 };
        self.expectations.speeds.take(world.time_us, turned);
        self.roll_by(ticks)?;
        self.physics.end_turn(ticks.abs(), self.machine.tool_out());
        self.check_turn(&before)?;
        self.attend_to_the_console()
    }

    /// Rolls by this many ticks, past the plants and weeds there.
    pub(super) fn roll_by(&mut self, ticks: f64) -> Checked {
        let from = self.physics.ground.floor() as i64;
        self.physics.ground += ticks;
        let to = self.physics.ground.floor() as i64;
        let (moves, direction) = ((to - from).abs(), (to - from).signum());
        for place in 1..=moves {
            let wheel = &mut self.physics.wheel;
            let turned = wheel.roll(from + (place - 1) * direction, direction > 0);
            let counted = match self.physics.encoder {
                Encoder::Works => turned,
                Encoder::Silent => 0,
                Encoder::OneChannel => turned.abs() * (1 - 2 * (wheel.ticks() & 1)),
            };
            for _ in 0..counted.abs() {
                self.physics.world.count += counted.signum();
                self.machine.count(counted > 0);
            }
            if let Some(stand) = &mut self.expectations.stand {
                stand.lose_ticks(turned - counted);
            }
            self.beam_at(from + place * direction)?;
        }
        self.beam_at(to)
    }

    fn beam_at(&mut self, ground: i64) -> Checked {
        let physics = &mut self.physics;
        physics.farthest = physics.farthest.max(ground);
        let (broken, second_broken) = physics.levels(ground, physics.geometry(&self.machine).second_beam);
        if second_broken != physics.world.second_broken {
            self.second_edge(second_broken);
        }
        if broken == self.physics.world.broken { Ok(()) } else { self.edge(broken) }
    }

    /// The first beam changes its level.
    pub(super) fn edge(&mut self, broken: bool) -> Checked {
        self.physics.world.broken = broken;
        if !self.physics.edges_get_lost {
            self.machine.beam_edge(&self.physics.world);
            self.expectations.check_weed(&mut self.machine, self.physics.world.count)?;
        }
        let (here, blur) = (self.here(), self.expectations.blur());
        self.expectations.model.edge(here, broken, blur);
        Ok(())
    }

    /// The second beam changes its level.
    pub(super) fn second_edge(&mut self, broken: bool) {
        self.physics.world.second_broken = broken;
        if !self.physics.edges_get_lost {
            self.machine.beam_edge(&self.physics.world);
        }
    }
}
