//! The native run: weeds a row with the firmware's own decisions, compiled for the host.
//!
//! [`weed`] runs the loop of `src/main.rs` with the same [`control`] code and examples. A turn reads clock and encoder, takes
//! the beam's edges with their positions, and commands the servo. It takes a millisecond; the chip is faster. Nothing else
//! is simplified: motion, beam, encoder and servo are the same as for the virtual Uno. It is some twenty thousand times
//! faster than real time, for studies of many rows. It also returns why the tool was out, for the
//! [loss budget](crate::budget).
//!
//! It has no console, EEPROM, interrupts or cycles. The virtual Uno has.

use crate::budget::{Part, Reasons, part_of};
use crate::machine::{Machine, PULSE_TICKS, time_at_s};
use crate::motion::{Motion, marks};
use crate::pass::{Pass, Start, Weeded};
use crate::wiring;
use control::ground::AtTool;
use control::ground::class::label;
use control::ground::examples::EXAMPLES;
use control::ground::nearest::Nearest;
use control::measure::readings::Readings;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::operate::event::Event;
use control::operate::servo::{self, Action, FRAME, HalfMicros};
use control::operate::{state::State, tool};
use control::settings::Setting;
use control::units::{Instant, Interval, Position};
use rig::{Beams, ByExamples, Rig};
use thiserror::Error;
use uno::{CYCLES_PER_SECOND, Pulse};

type Weeder = Rig<ByExamples>;

/// A turn of the loop.
pub const TURN_S: f64 = 0.001;
const STEPS_A_TURN: u32 = Interval::STEPS_PER_SECOND / 1000;

/// The machine stands for 0.1 s before it rolls, so that the clock does not start at 0.
const STILL_STEPS: u32 = Interval::STEPS_PER_SECOND / 10;

/// Turns between two samples of the reasons: 3 mm at 2.5 km/h. A zone's begin and end are late by the same mean, so its
/// length is right.
const LOOK_TURNS: u32 = 4;

/// Longest wait of a command for the servo's frame.
const SERVO_FRAME_S: f64 = 0.020;

/// Cycles in a step of Timer1, whose prescaler is 8.
const CYCLES_A_STEP: u64 = 8;

/// The firmware or its decisions refused a line.
#[derive(Debug, Error, PartialEq)]
#[error("the firmware answers `{command}` with `{answer}`")]
pub struct Refused {
    /// The typed line.
    pub command: String,
    /// The console's answer, which begins with `error:`.
    pub answer: String,
}

/// The servo's line: the pulses for the widths that the loop commands.
#[derive(Clone, Debug)]
pub struct ServoLine {
    width: HalfMicros,
    gap_ms: u8,
    /// The beginning of the last pulse with a new width, in steps of half a microsecond.
    rise: u64,
    pulses: Vec<Pulse>,
}

impl ServoLine {
    /// A line with pulses of a width since time 0. The servo needs `gap_ms` between pulses; 0 for fixed frames.
    pub fn new(width: HalfMicros, gap_ms: u8) -> Self {
        let mut line = Self { width, gap_ms, rise: 0, pulses: Vec::new() };
        line.begin(width, 0);
        line
    }

    /// Commands a width. Call it in each turn of the loop, as the firmware does (`src/servo.rs`).
    #[inline]
    pub fn command(&mut self, width: HalfMicros, time_s: f64) {
        if width == self.width {
            return;
        }
        let now = (time_s * CYCLES_PER_SECOND as f64) as u64 / CYCLES_A_STEP;
        let since_rise = now.saturating_sub(self.rise) % u64::from(FRAME);
        match servo::action(since_rise as HalfMicros, self.width, self.gap_ms) {
            Action::Wait => {}
            Action::Change => self.begin(width, now + u64::from(FRAME) - since_rise),
            Action::Restart => self.begin(width, now),
        }
    }

    fn begin(&mut self, width: HalfMicros, rise: u64) {
        (self.width, self.rise) = (width, rise);
        let cycle = rise * CYCLES_A_STEP;
        self.pulses.push(Pulse { rise: cycle, fall: cycle + u64::from(width) * CYCLES_A_STEP });
    }

    /// The first pulse of each width.
    pub fn into_pulses(self) -> Vec<Pulse> {
        self.pulses
    }
}

/// The readings of the machine's sensors, turn by turn: the encoder's count, and the beams' edges since the turn
/// before.
///
/// They do not depend on the firmware: every controller of the same row with the same machine and motion gets the same
/// readings.
pub struct Sensors {
    turn_s: f64,
    /// The encoder's count in each turn.
    counts: Vec<i32>,
    edges: Vec<Seen>,
}

/// The readings of a turn.
pub struct Turn<'a> {
    /// Its time.
    pub time_s: f64,
    /// The encoder's count.
    pub position: i64,
    /// The beams' edges since the turn before, in their order.
    pub edges: &'a [Seen],
}

/// An edge of a beam.
#[derive(Clone, Copy, Debug)]
pub struct Seen {
    /// Its time.
    time_s: f64,
    /// The encoder's count at that time.
    pub position: i64,
    /// The beams that are broken after it.
    pub beams: Beams,
}

impl Sensors {
    /// The readings of a pass, for a loop with turns of `turn_s`. The motion begins at time 0.
    pub fn new(pass: &Pass, turn_s: f64) -> Self {
        let Pass { machine, motion, row, .. } = pass;
        let mut edges = machine.beam_changes(row, motion, 0);
        edges.sort_by_key(|edge| edge.cycle);
        let mut beams = beams_before(pass);
        let edges = edges.into_iter().map(|edge| {
            let broken = if edge.pin == wiring::BEAM { &mut beams.broken } else { &mut beams.second_broken };
            *broken = !edge.high;
            Seen { time_s: time_at_s(0, edge.cycle), position: 0, beams }
        });
        let mut edges: Vec<Seen> = edges.collect();
        let mut to_come = edges.iter_mut().peekable();
        let (mut wheel_mm, mut encoder) = (motion.wheel_course(), Encoder::of(machine, motion));
        let counts = (0..=turns(pass, turn_s)).map(|turn| {
            let time_s = f64::from(turn) * turn_s;
            while let Some(edge) = to_come.next_if(|edge| edge.time_s <= time_s) {
                edge.position = encoder.count(encoder.clean_ticks(motion.wheel_mm(edge.time_s)));
            }
            encoder.count(encoder.clean_ticks(wheel_mm(time_s))) as i32
        });
        let counts = counts.collect();
        Self { turn_s, counts, edges }
    }

    /// The turns, from the first to some after the end of the motion.
    #[inline]
    pub fn turns(&self) -> impl Iterator<Item = Turn<'_>> {
        let mut to_come = &self.edges[..];
        self.counts.iter().zip(0..).map(move |(&position, turn)| {
            let time_s = f64::from(turn) * self.turn_s;
            let mut edges = &to_come[..0];
            // Most turns have no edge.
            if to_come.first().is_some_and(|edge| edge.time_s <= time_s) {
                (edges, to_come) = to_come.split_at(to_come.partition_point(|edge| edge.time_s <= time_s));
            }
            Turn { time_s, position: position.into(), edges }
        })
    }
}

/// The encoder's count, as the wheel turns.
#[derive(Clone, Copy)]
struct Encoder<'a> {
    machine: &'a Machine,
    start_mm: f64,
    tick_mm: f64,
    /// The present pulse of a clean encoder, whether dirt hides it, and the counts hidden before it.
    pulse: i64,
    is_hidden: bool,
    hidden_ticks: i64,
}

impl<'a> Encoder<'a> {
    /// The encoder of a machine at the beginning of its motion.
    fn of(machine: &'a Machine, motion: &Motion) -> Self {
        Self {
            machine,
            start_mm: motion.start_mm(),
            tick_mm: machine.tick_mm(),
            pulse: 0,
            is_hidden: machine.dirt.hides(0),
            hidden_ticks: 0,
        }
    }

    /// The count of a clean encoder when the wheel's rim is at a position.
    #[inline]
    fn clean_ticks(&self, wheel_mm: f64) -> i64 {
        marks(wheel_mm - self.start_mm, self.tick_mm)
    }

    /// The count when a clean encoder has `ticks`. The time grows with the distance from the last call.
    #[inline(always)]
    fn count(&mut self, ticks: i64) -> i64 {
        let pulse = self.machine.pulse(ticks);
        if pulse != self.pulse {
            self.roll_to(pulse);
        }
        let in_pulse = if self.is_hidden { self.machine.hidden_in_pulse(ticks) } else { 0 };
        ticks - self.hidden_ticks - in_pulse
    }

    /// Rolls to a pulse and counts the hidden ticks. Rolling back restores them.
    #[inline(always)]
    fn roll_to(&mut self, pulse: i64) {
        let step = (pulse - self.pulse).signum();
        while self.pulse != pulse {
            // The whole pulse was passed, forward or back.
            self.hidden_ticks += if self.is_hidden && step > 0 { PULSE_TICKS } else { 0 };
            self.pulse += step;
            self.is_hidden = self.machine.dirt.hides(self.pulse);
            self.hidden_ticks -= if self.is_hidden && step < 0 { PULSE_TICKS } else { 0 };
        }
    }
}

/// The beams' levels before the motion begins.
pub fn beams_before(pass: &Pass) -> Beams {
    let Pass { machine, motion, row, .. } = pass;
    let before = machine.beams_before(row, motion);
    let is_broken = |pin| before.iter().any(|beam| beam.pin == pin && !beam.high);
    Beams { broken: is_broken(wiring::BEAM), second_broken: is_broken(wiring::SECOND_BEAM) }
}

/// Weeds the pass's row with the firmware's decisions. The motion begins at time and cycle 0. `sensors` must come from this
/// pass, with turns of [`TURN_S`].
///
/// # Errors
/// If they refuse a setting or the start.
pub fn weed(pass: &Pass, sensors: &Sensors) -> Result<Weeded, Refused> {
    run(pass, sensors, false, |_| ())
}

/// The slip that the second beam measures, in thousandths, plant by plant.
///
/// # Errors
/// As [`weed`].
pub fn slips_permille(pass: &Pass, sensors: &Sensors) -> Result<Vec<i16>, Refused> {
    let mut slips = Vec::new();
    run(pass, sensors, true, |weeder| {
        while let Some(event) = weeder.next_event() {
            if let Event::Slip { permille } = event {
                slips.push(permille);
            }
        }
    })?;
    Ok(slips)
}

/// Weeds the row. Calls `listen` after each turn, with events if `is_told`.
#[inline(always)]
fn run(pass: &Pass, sensors: &Sensors, is_told: bool, mut listen: impl FnMut(&mut Weeder)) -> Result<Weeded, Refused> {
    let readings = Readings::new(instant(0), Position::new(0));
    let classifier = Nearest::new(&EXAMPLES[..], Volatile::new());
    let mut weeder: Weeder = Rig::wake_at(classifier, Volatile::new(), readings, beams_before(pass), Cause::PowerOn);
    type_line(&mut weeder, "clear")?;
    for (setting, value) in pass.firmware_settings() {
        type_line(&mut weeder, &format!("set {} {value}", setting.text()))?;
    }
    for example in &pass.examples {
        example.features.into_iter().for_each(|feature| weeder.enter_feature(feature));
        type_line(&mut weeder, if example.label == label::PLANT { "teach plant" } else { "teach weed" })?;
    }
    type_line(&mut weeder, if pass.start == Start::Now { "start now" } else { "start" })?;

    let is_guarding = weeder.settings().get(Setting::GuardSpacingMm) > 0;
    if is_guarding || is_told {
        type_line(&mut weeder, "events on")?;
    }
    let mut why = Why {
        pass,
        reasons: Reasons::default(),
        slowest_s: pass.machine.servo.slowest_s() + SERVO_FRAME_S,
        in_since_s: None,
        zone: None,
        is_guarding,
        guarded: Vec::new(),
    };
    let orders = weeder.orders();
    let mut line = ServoLine::new(orders.pulse, orders.gap_ms);
    for (turn, Turn { time_s, position, edges }) in (0..=turns(pass, TURN_S)).zip(sensors.turns()) {
        for &Seen { position, beams, .. } in edges {
            weeder.edge(Position::new(position as i32), beams);
        }
        let orders = weeder.turn_with(Readings::new(instant(turn), Position::new(position as i32)));
        line.command(orders.pulse, time_s);
        listen(&mut weeder);
        if turn % LOOK_TURNS == 0 {
            why.look(&mut weeder, orders.pulse != orders.pulse_out, time_s);
        }
    }
    let (pulses, reasons) = (line.into_pulses(), why.reasons.until(pass.motion.duration_s()));
    Ok(Weeded { pulses, start_cycle: 0, alarm: weeder.state() != State::Work, reasons })
}

/// Why the decisions keep the tool out, turn by turn.
struct Why<'a> {
    pass: &'a Pass,
    reasons: Reasons,
    /// The slowest swing: after this time a commanded tool has arrived.
    slowest_s: f64,
    /// The time of the command into the row, if it is commanded in.
    in_since_s: Option<f64>,
    /// The last zone, and its part of the budget.
    zone: Option<((Position, Position), Part)>,
    is_guarding: bool,
    /// The middles of the guarded zones that are still ahead of the tool, or at it.
    guarded: Vec<Position>,
}

impl Why<'_> {
    /// Records the present reason after a turn. Not inlined, which makes the loop faster.
    #[inline(never)]
    fn look(&mut self, weeder: &mut Weeder, is_in: bool, time_s: f64) {
        while self.is_guarding
            && let Some(event) = weeder.next_event()
        {
            if let Event::Guarded(middle) = event {
                self.guarded.push(middle);
            }
        }
        if !is_in {
            self.in_since_s = None;
        } else if time_s - *self.in_since_s.get_or_insert(time_s) > self.slowest_s {
            // It weeds: no reason to look up, which saves time.
            return self.reasons.turn_to(Part::Swings, time_s);
        }
        let part = self.part(weeder, time_s);
        self.reasons.turn_to(part, time_s);
    }

    fn part(&mut self, weeder: &Weeder, time_s: f64) -> Part {
        if weeder.state() != State::Work {
            return Part::Closed;
        }
        match weeder.ground_at_tool() {
            AtTool::Unknown => Part::Closed,
            AtTool::Open => match weeder.reason() {
                None | Some(tool::Reason::Plant) => Part::Swings,
                Some(_) => Part::Closed,
            },
            AtTool::Kept { tool, begin, end } => {
                let kept_for = match self.zone {
                    Some((zone, part)) if zone == (begin, end) => part,
                    _ => self.kept_for(tool, begin, end, time_s),
                };
                self.zone = Some(((begin, end), kept_for));
                let is_in_margin = begin.is_ahead_of(tool) || tool.is_ahead_of(end);
                if is_in_margin && kept_for == Part::Plants { Part::Margins } else { kept_for }
            }
        }
    }

    /// The part of the budget that a zone belongs to.
    fn kept_for(&mut self, tool: Position, begin: Position, end: Position, time_s: f64) -> Part {
        self.guarded.retain(|middle| !begin.is_ahead_of(*middle));
        if self.guarded.iter().any(|middle| !middle.is_ahead_of(end)) {
            return Part::Guarded;
        }
        let Pass { machine, motion, row, .. } = self.pass;
        let tool_mm = machine.tool_mm(motion.position_mm(time_s));
        let place_mm = |place: Position| tool_mm + f64::from((place - tool).0) * machine.tick_mm();
        part_of(&(place_mm(begin)..place_mm(end)), row)
    }
}

/// The number of the last turn of a loop in a pass.
pub(crate) fn turns(pass: &Pass, turn_s: f64) -> u32 {
    (pass.motion.duration_s() / turn_s).ceil() as u32
}

/// The firmware's clock in a turn.
fn instant(turn: u32) -> Instant {
    Instant::new(turn.wrapping_mul(STEPS_A_TURN).wrapping_add(STILL_STEPS))
}

/// Types a line into the decisions' console.
fn type_line(weeder: &mut Weeder, command: &str) -> Result<(), Refused> {
    match weeder.ask(command).pop() {
        Some(answer) if answer != "ok" => Err(Refused { command: command.to_owned(), answer }),
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::{Dirt, tests::count_at};
    use crate::planting::Planting;
    use crate::verdict::Timing;
    use rand::{RngExt, SeedableRng};
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn counts_that_are_worked_out_together_are_those_of_each_turn_and_each_edge_by_itself() {
        for seed in 0..8 {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let row =
                Planting { plants: 6, weeds: 4, ragged: true, ..Planting::default() }.grow_with_room(seed).unwrap();
            let dirt = Dirt { share: rng.random_range(0.0..0.1), seed };
            let machine = Machine { second_beam_mm: 150.0, dirt, ..Machine::default() };
            let speed_mm_s = rng.random_range(300.0..900.0);
            // It also rolls back behind its start, to negative counts.
            let motion = Motion::starting_at(0.0)
                .change_speed(speed_mm_s, 900.0)
                .stop_at(1000.0, 900.0)
                .go_on_for(0.3)
                .change_speed(-speed_mm_s, 900.0)
                .stop_at(-200.0, 900.0)
                .change_speed(speed_mm_s, 900.0)
                .roll_to(3500.0)
                .with_slip(|| rng.random_range(-0.05..0.1));
            let pass = Pass { motion, ..Pass::at_speed(row, machine, Timing::default(), speed_mm_s) };
            let mut told = 0;
            for Turn { time_s, position, edges } in Sensors::new(&pass, TURN_S).turns() {
                assert_eq!(position, count_at(&pass.machine, &pass.motion, time_s), "seed {seed} at {time_s} s");
                for edge in edges {
                    assert!(time_s - TURN_S < edge.time_s && edge.time_s <= time_s, "seed {seed} at {time_s} s");
                    let count = count_at(&pass.machine, &pass.motion, edge.time_s);
                    assert_eq!(edge.position, count, "seed {seed} at {} s", edge.time_s);
                }
                told += edges.len();
            }
            let all = pass.machine.pin_changes(&pass.row, &pass.motion, 0);
            let of_beams = all.iter().filter(|change| [wiring::BEAM, wiring::SECOND_BEAM].contains(&change.pin));
            assert!(told > 40, "{told}");
            assert_eq!(told, of_beams.count(), "seed {seed}");
        }
    }
}
