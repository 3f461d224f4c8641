//! The native twin of the virtual Uno: the firmware's own decisions, compiled for the host, weed a row.
//!
//! [`weed`] does what `src/main.rs` does with the same [`control`] code and the same examples: a turn of the loop reads clock
//! and encoder, takes the beam's edges with the position at which each came, and commands the servo. Turns come every
//! millisecond, not as fast as a chip can; nothing else is simplified: motion, beam, encoder and servo are those that
//! the virtual Uno is given. It is some ten thousand times faster than real time, for studies of many rows.
//!
//! Console, EEPROM, interrupts and cycles are not in it: for those there is the virtual Uno.

use crate::machine::{Machine, time_at_s};
use crate::motion::{Course, marks};
use crate::trial::{Start, Trial};
use crate::wiring;
use control::ground::class::label;
use control::ground::examples::EXAMPLES;
use control::ground::features;
use control::ground::nearest::Nearest;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::operate::servo::{self, Action, FRAME, HalfMicros};
use control::say;
use control::say::command::LineBuffer;
use control::say::line::Line;
use control::units::{Instant, Interval, Position};
use control::{
    measure::readings::{Edge, Readings, WakeUp},
    operate::state::State,
    weeder::Controller,
};
use signal::{CYCLES_PER_SECOND, PinChange, Pulse};
use thiserror::Error;

type Weeder = Controller<Nearest<&'static [knn::Example<{ features::COUNT }>], Volatile>, Volatile>;

/// A turn of the loop.
const TURN_S: f64 = 0.001;
const STEPS_A_TURN: u32 = Interval::STEPS_PER_SECOND / 1000;

/// How long the machine stands before it rolls, so that the clock is not at its beginning: 0.1 s.
const STILL_STEPS: u32 = Interval::STEPS_PER_SECOND / 10;

/// Cycles in a step of Timer1, behind its prescaler of 8.
const CYCLES_A_STEP: u64 = 8;

/// The decisions refuse to be set up or started.
#[derive(Debug, Error, PartialEq)]
#[error("the firmware answers `{command}` with `{answer}`")]
pub struct Refused {
    /// The line that was typed.
    command: String,
    /// What the console said.
    answer: String,
}

/// What the decisions did.
#[derive(Clone, Debug, PartialEq)]
pub struct Weeded {
    /// The first of the servo's pulses of each width.
    pub pulses: Vec<Pulse>,
    /// The machine's state at the end.
    pub state: State,
}

/// The servo's line: which pulses come of the widths that the loop commands.
#[derive(Clone, Debug)]
pub struct ServoLine {
    width: HalfMicros,
    gap_ms: u8,
    /// Steps of half a microsecond at which the last pulse of another width began.
    rise: u64,
    pulses: Vec<Pulse>,
}

impl ServoLine {
    /// A line with pulses of a width since time 0, for a servo that needs `gap_ms` between them; with 0, frames are fixed.
    pub fn new(width: HalfMicros, gap_ms: u8) -> Self {
        let mut line = Self { width, gap_ms, rise: 0, pulses: Vec::new() };
        line.begin(width, 0);
        line
    }

    /// Commands a width, to be called each turn of the loop as the firmware's is (`src/servo.rs`).
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

/// What the machine's sensors say, turn by turn: the encoder's count, and the beam's edges since the turn before.
pub struct Sensors<'a> {
    machine: &'a Machine,
    course: Course<'a>,
    start_mm: f64,
    tick_mm: f64,
    /// The beams' edges to come, and when the next one does.
    edges: std::vec::IntoIter<PinChange>,
    next: Option<(f64, Levels)>,
    /// Which of the beams are broken behind the last edge that was asked for.
    levels: Levels,
    /// The pulse in which a clean encoder is, whether dirt hides it, and the counts that it has hidden before.
    pulse: i64,
    is_hidden: bool,
    hidden_ticks: i64,
}

impl<'a> Sensors<'a> {
    /// Those of a trial, whose motion begins at time 0.
    pub fn new(trial: &'a Trial) -> Self {
        let Trial { machine, motion, row, .. } = trial;
        let mut edges = machine.beam_changes(row, motion, 0);
        edges.extend(machine.second_beam_changes(row, motion, 0));
        edges.sort_by_key(|edge| edge.cycle);
        let levels = Levels {
            broken: !machine.beam_before(row, motion).high,
            second_broken: machine.second_beam_before(row, motion).is_some_and(|before| !before.high),
        };
        let mut edges = edges.into_iter();
        Self {
            machine,
            course: Course::along(motion),
            start_mm: motion.start_mm(),
            tick_mm: machine.tick_mm(),
            next: edges.next().map(|edge| levels.behind(edge)),
            edges,
            levels,
            pulse: 0,
            is_hidden: machine.dirt.hides(0),
            hidden_ticks: 0,
        }
    }

    /// The encoder's count at a time, no earlier than the last one asked for.
    pub fn position(&mut self, time_s: f64) -> i64 {
        let ticks = marks(self.course.wheel_mm(time_s) - self.start_mm, self.tick_mm);
        let pulse = self.machine.pulse(ticks);
        if pulse != self.pulse {
            // What is lost on the way there comes back on the way back.
            self.hidden_ticks += if pulse > self.pulse {
                self.machine.hidden_ticks(self.pulse..pulse)
            } else {
                -self.machine.hidden_ticks(pulse..self.pulse)
            };
            self.pulse = pulse;
            self.is_hidden = self.machine.dirt.hides(pulse);
        }
        let in_pulse = if self.is_hidden { self.machine.hidden_in_pulse(ticks) } else { 0 };
        ticks - self.hidden_ticks - in_pulse
    }

    /// The next edge of a beam before a time: when it comes, and which of them are broken from then on.
    pub fn next_edge(&mut self, before_s: f64) -> Option<(f64, Levels)> {
        let edge = self.next.filter(|&(edge_s, _)| edge_s <= before_s)?;
        self.levels = edge.1;
        self.next = self.edges.next().map(|edge| self.levels.behind(edge));
        Some(edge)
    }
}

/// Which of the beams are broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Levels {
    /// The first.
    pub broken: bool,
    /// The second; no, where there is none.
    pub second_broken: bool,
}

impl Levels {
    /// When an edge comes, and which beams are broken from then on.
    fn behind(self, edge: PinChange) -> (f64, Self) {
        let broken = !edge.high;
        let levels =
            if edge.pin == wiring::BEAM { Self { broken, ..self } } else { Self { second_broken: broken, ..self } };
        (time_at_s(0, edge.cycle), levels)
    }
}

/// Has the decisions weed the trial's row. The motion begins at time and cycle 0.
///
/// # Errors
/// Where they refuse a setting, or to start.
pub fn weed(trial: &Trial) -> Result<Weeded, Refused> {
    let mut sensors = Sensors::new(trial);
    let broken = !trial.machine.beam_before(&trial.row, &trial.motion).high;
    let readings = Readings::new(instant(0), Position::new(0));
    let wake_up = WakeUp { readings, beam_broken: broken, cause: Cause::PowerOn };
    let classifier = Nearest::new(&EXAMPLES[..], Volatile::new());
    let mut weeder: Weeder = Controller::new(classifier, Volatile::new(), wake_up);
    type_line(&mut weeder, "clear")?;
    for (setting, value) in trial.firmware_settings() {
        type_line(&mut weeder, &format!("set {} {value}", setting.text()))?;
    }
    for example in &trial.examples {
        example.features.into_iter().for_each(|feature| weeder.tell_feature(feature));
        type_line(&mut weeder, if example.label == label::PLANT { "teach plant" } else { "teach weed" })?;
    }
    type_line(&mut weeder, if trial.start == Start::Now { "start now" } else { "start" })?;

    let orders = weeder.orders();
    let mut line = ServoLine::new(orders.pulse, orders.gap_ms);
    let turns = (trial.motion.duration_s() / TURN_S).ceil() as u64;
    for turn in 0..=turns {
        let time_s = turn as f64 * TURN_S;
        let mut edges = Vec::new();
        while let Some((edge_s, Levels { broken, second_broken })) = sensors.next_edge(time_s) {
            let position = Position::new(sensors.position(edge_s) as i32);
            edges.push(Edge::Seen { position, broken, second_broken });
        }
        let position = Position::new(sensors.position(time_s) as i32);
        let orders = weeder.turn(Readings::new(instant(turn), position), edges);
        line.command(orders.pulse, time_s);
    }
    Ok(Weeded { pulses: line.into_pulses(), state: weeder.state() })
}

/// The firmware's clock in a turn.
fn instant(turn: u64) -> Instant {
    Instant::new((turn as u32).wrapping_mul(STEPS_A_TURN).wrapping_add(STILL_STEPS))
}

/// Types a line into the decisions' console.
fn type_line(weeder: &mut Weeder, command: &str) -> Result<(), Refused> {
    let mut line = LineBuffer::new();
    let Some(typed) = command.bytes().chain(*b"\n").find_map(|byte| line.take(byte)) else { return Ok(()) };
    let mut answer = say::execute(typed, weeder);
    let mut said = String::new();
    while !answer.is_done() {
        let mut written = Line::new();
        answer.write_line(weeder, &mut written);
        said.extend(written.map(char::from));
    }
    if said.trim_end().ends_with("ok") {
        return Ok(());
    }
    Err(Refused { command: command.to_owned(), answer: said.trim_end().to_owned() })
}
