//! The encoder benchmark: the highest rate at which the firmware loses no count.
//!
//! A trial turns the encoder at one rate and then asks the firmware for its position. It passes under four conditions.
//! The position is exact. The firmware reports no lost count. The firmware did not restart. Its telemetry continued
//! meanwhile: a trial lasts longer than the heartbeat and the watchdog wait for a starved loop.
//!
//! Each rate has two trials. [`turn`] turns the encoder evenly, or with random jitter. This leaves the loop as little
//! time as the rate allows. But an edge comes at the worst moment only by chance, and each change of the code changes
//! the chance. [`turn_at_worst`] makes the worst case. The edge waits until another interrupt's handler begins, but
//! comes no earlier than the rate allows. The next two edges then come as soon as they may. The beam's edges and the
//! received bytes come directly before the loop turns interrupts off, so the edge also waits for the critical section.
//!
//! [`highest_rates`] finds each rate by bisection to [`RESOLUTION`]. Then it tries rates below it, because edges in step
//! with other events may pass at one rate by chance.
//!
//! The firmware is in HOLD. Weeding adds less load than [`Load::Telemetry`], which requests more output than the serial
//! line can carry, and makes the beam flicker as fast as its sensor can.

use super::load::{EDGE_CYCLES, Telemetry, flicker};
use crate::console::{ConsoleError, Status, ask};
use crate::run;
use anyhow::Result;
use field::machine::encoder_edge;
use field::wiring;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};
use uno::{CYCLES_PER_SECOND, PinChange, Place, SENT_BYTE_CYCLES, Uno};

/// Fewest counts of a trial: the count's second byte changes more than a hundred times.
const FEWEST_COUNTS: f64 = 40_000.0;

/// Shortest trial: twice the watchdog's timeout.
const SHORTEST_S: f64 = 0.5;

/// Share of the serial line below which the telemetry counts as silent: some eight lines of status a second.
const SILENT_SHARE: f64 = 0.1;

/// Relative distance, at the end of the search, between a rate that passed and one that failed.
pub const RESOLUTION: f64 = 0.01;

/// The firmware's other work.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Load {
    /// No further load: clock, loop and servo.
    Idle,
    /// Continuous status requests at 115200 baud, and a flickering beam.
    Telemetry,
}

/// The encoder's direction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Direction {
    /// AB = 00, 10, 11, 01.
    Forward,
    /// Backward.
    Backward,
}

/// The encoder's motion, and the firmware's other work.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Turning {
    /// The other load.
    pub load: Load,
    /// The direction.
    pub direction: Direction,
    /// Each edge comes early or late by up to this share of the time between two, evenly distributed; from 0 to 0.5.
    pub jitter: f64,
}

impl Turning {
    /// Without further load and with it: evenly and with [`JITTER`], each forward and backward.
    pub fn all() -> [Self; 8] {
        std::array::from_fn(|way| Self {
            load: [Load::Idle, Load::Telemetry][way / 4],
            direction: [Direction::Forward, Direction::Backward][way % 2],
            jitter: [0.0, JITTER][way / 2 % 2],
        })
    }
}

/// The jitter of an encoder whose disc is worn or off its centre.
pub const JITTER: f64 = 0.3;

/// The result of a trial.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RateResult {
    /// The other load.
    pub load: Load,
    /// Counts that came, net.
    pub true_ticks: i64,
    /// The firmware's count. `None` if it no longer answered.
    pub position_ticks: Option<i64>,
    /// Lost counts that the firmware knows of.
    pub lost_ticks: u64,
    /// Number of restarts.
    pub restarts: usize,
    /// Share of the serial line's capacity that was used, from 0 to 1.
    pub line_share: f64,
}

impl RateResult {
    /// Whether no count was lost and the rest of the firmware ran on.
    pub fn is_passed(&self) -> bool {
        let is_heard = self.load == Load::Idle || self.line_share >= SILENT_SHARE;
        self.position_ticks == Some(self.true_ticks) && self.lost_ticks == 0 && self.restarts == 0 && is_heard
    }
}

/// Time from the last edge to the question. Pending answers end in this time.
const SETTLE_MS: u64 = 100;

/// Turns the encoder of the firmware at `elf` for half a second and by 40,000 counts at least.
///
/// # Errors
/// If the ELF cannot be run.
pub fn turn(elf: &Path, turning: Turning, counts_per_s: f64) -> Result<RateResult> {
    let mut uno = run::boot(elf, &[])?;
    ask(&mut uno, "events on")?;
    let step_cycles = CYCLES_PER_SECOND as f64 / counts_per_s;
    let counts = (counts_per_s * SHORTEST_S).max(FEWEST_COUNTS).ceil() as u32;
    let begin = uno.cycle() + step_cycles.ceil() as u64;
    let end = begin + (f64::from(counts) * step_cycles).ceil() as u64;
    uno.drive(edges(turning, step_cycles, begin).take(counts as usize));
    let mut telemetry = Telemetry::default();
    if turning.load == Load::Telemetry {
        uno.drive(flicker(begin, end));
        telemetry.run_until(&mut uno, end)?;
    }
    uno.run_until(end)?;
    let line_share = telemetry.line_share(end - begin);
    counted(&mut uno, turning, counts.into(), line_share)
}

/// Asks the firmware for its position after `counts` edges, when the encoder stands.
fn counted(uno: &mut Uno, turning: Turning, counts: i64, line_share: f64) -> Result<RateResult> {
    uno.run_for_ms(SETTLE_MS)?;
    let status = match Status::ask(uno) {
        Ok(status) => Some(status),
        Err(ConsoleError::Uno(error)) => return Err(error.into()),
        // A console that was starved is as bad as a count that was lost.
        Err(_) => None,
    };
    Ok(RateResult {
        load: turning.load,
        true_ticks: if turning.direction == Direction::Forward { counts } else { -counts },
        position_ticks: status.as_ref().map(|status| status.position_ticks),
        lost_ticks: status.map_or(0, |status| status.lost_ticks),
        restarts: uno.resets().len(),
        line_share,
    })
}

/// Time in which edges wait for the worst moments, in cycles.
const WORST_CYCLES: u64 = (SHORTEST_S * CYCLES_PER_SECOND as f64) as u64;

/// The least and greatest number of successive edges after the first has met its moment.
const RUN: std::ops::RangeInclusive<u32> = 3..=12;

/// Edges of the run-up, and the cycles between two of them: a tenth of a second at 40,000 a second.
const RUN_UP: u32 = 4000;
const RUN_UP_CYCLES: u64 = CYCLES_PER_SECOND / 40_000;

/// The most critical sections of the loop between two that are made worse: some turns of the loop. The loop sleeps up to a
/// millisecond between two turns, and the wheel stands meanwhile. After a longer stand the firmware would take the jumps
/// for noise.
const SECTIONS_PASSED: u32 = 12;

/// Turns the encoder of the firmware at `elf` for half a second, with edges that wait for the moments at which they have to wait
/// longest themselves, and are never closer together than `counts_per_s` and the jitter have them.
///
/// # Errors
/// If the ELF cannot be run.
pub fn turn_at_worst(elf: &Path, turning: Turning, counts_per_s: f64) -> Result<RateResult> {
    let mut uno = run::boot(elf, &[])?;
    ask(&mut uno, "events on")?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let step_cycles = CYCLES_PER_SECOND as f64 / counts_per_s;
    let begin = uno.cycle();
    let end = begin + WORST_CYCLES;
    let telemetry = Telemetry::default();
    let byte_after = begin + SENT_BYTE_CYCLES;
    let mut world = World { load: turning.load, telemetry, beam: true, beam_after: begin, byte_after };
    // A slow first edge. Its direction lets the firmware resolve a jump.
    let PinChange { pin, high, .. } = nth_edge(turning.direction, 0);
    uno.set(pin, high);
    uno.run_for_ms(1)?;
    // A real wheel accelerates gradually. Without a run-up the firmware would take the jumps for noise.
    let run_up = uno.cycle();
    uno.drive((1..=RUN_UP).map(|number| PinChange {
        cycle: run_up + u64::from(number) * RUN_UP_CYCLES,
        ..nth_edge(turning.direction, number)
    }));
    uno.run_until(run_up + u64::from(RUN_UP + 1) * RUN_UP_CYCLES)?;
    let mut number = RUN_UP + 1;
    while uno.cycle() < end {
        let moment = world.worst_moment(&mut uno, rng.random_range(0..SECTIONS_PASSED))?;
        // The first edge comes late, the second in time and the third early, and so on.
        let shift = |edge: u32| turning.jitter * (1.0 - f64::from(edge % 3));
        let edges = rng.random_range(RUN);
        for edge in 0..edges {
            let steps = f64::from(edge) + shift(edge) - shift(0);
            let cycle = moment + (steps * step_cycles).round() as u64;
            uno.drive([PinChange { cycle, ..nth_edge(turning.direction, number) }]);
            number += 1;
        }
        // An edge's own shift does not matter here: the next edge comes late.
        let next = moment + (f64::from(edges) * step_cycles).ceil() as u64;
        uno.run_until(next)?;
        while uno.place() == Place::InHandler {
            uno.run_instruction()?;
        }
        world.telemetry.take(&uno.received_bytes());
    }
    uno.set(wiring::BEAM, true);
    uno.send(world.telemetry.rest_of_question());
    let line_share = world.telemetry.line_share(uno.cycle() - begin);
    counted(&mut uno, turning, number.into(), line_share)
}

/// The firmware's other inputs, with their chosen moments.
struct World {
    load: Load,
    telemetry: Telemetry,
    beam: bool,
    /// When the beam and the serial line may change again.
    beam_after: u64,
    byte_after: u64,
}

impl World {
    /// Runs until a handler begins or the loop is about to turn interrupts off. Returns the cycle of the handler's entry.
    /// After `sections` critical sections it causes another interrupt.
    fn worst_moment(&mut self, uno: &mut Uno, mut sections: u32) -> Result<u64> {
        loop {
            let cycle = uno.cycle();
            if uno.place() == Place::BeforeCriticalSection {
                sections = sections.saturating_sub(1);
                if sections == 0 && self.load == Load::Idle {
                    return Ok(cycle);
                }
                if sections == 0 {
                    self.act(uno);
                }
            }
            uno.run_instruction()?;
            if uno.place() == Place::InHandler {
                return Ok(cycle);
            }
        }
    }

    /// Changes the beam or sends a byte, whichever is possible.
    fn act(&mut self, uno: &mut Uno) {
        let cycle = uno.cycle();
        if cycle >= self.beam_after {
            self.beam = !self.beam;
            uno.set(wiring::BEAM, self.beam);
            self.beam_after = cycle + EDGE_CYCLES;
        } else if cycle >= self.byte_after
            && let Some(byte) = self.telemetry.next_byte()
        {
            uno.receive(byte);
            self.byte_after = cycle + SENT_BYTE_CYCLES;
        }
    }
}

/// Endless edges of the encoder, in order of time.
pub(super) fn edges(turning: Turning, step_cycles: f64, begin: u64) -> impl Iterator<Item = PinChange> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0_u32..).map(move |number| {
        let early = rng.random_range(-1.0..=1.0) * turning.jitter;
        let cycle = begin + ((f64::from(number) + turning.jitter + early) * step_cycles).round() as u64;
        PinChange { cycle, ..nth_edge(turning.direction, number) }
    })
}

/// An edge, counted from 0. Its cycle is 0.
fn nth_edge(direction: Direction, number: u32) -> PinChange {
    let number = i64::from(number);
    match direction {
        Direction::Forward => encoder_edge(0, number, number + 1),
        Direction::Backward => encoder_edge(0, -number, -number - 1),
    }
}

/// The highest rate without a lost count.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Rate {
    /// How the encoder turns.
    #[serde(flatten)]
    pub turning: Turning,
    /// Counts a second.
    pub counts_per_s: f64,
    /// Share of the serial line's capacity that the firmware used at that rate, from 0 to 1.
    pub line_share: f64,
}

/// The search's limits: a rate that always passes, and one that an ATmega328P cannot follow, with 20 cycles a count.
const LOWEST_PER_S: f64 = 10_000.0;
const HIGHEST_PER_S: f64 = 800_000.0;

/// Shares of the found rate that must pass as well.
const BELOW: [f64; 8] = [0.99, 0.98, 0.97, 0.95, 0.9, 0.8, 0.7, 0.5];

/// Both trials of a rate; `None` where one of them was not passed.
fn follow(elf: &Path, turning: Turning, counts_per_s: f64) -> Result<Option<Rate>> {
    let mut line_share = 1.0_f64;
    for trial in [turn_at_worst, turn] {
        let counted = trial(elf, turning, counts_per_s)?;
        if !counted.is_passed() {
            return Ok(None);
        }
        line_share = line_share.min(counted.line_share);
    }
    Ok(Some(Rate { turning, counts_per_s, line_share }))
}

/// Searches the highest rate of the firmware at `elf` for each of [`Turning::all`], in parallel. `progress` gets the share
/// of the searches done, from 0 to 1.
///
/// # Errors
/// If the ELF cannot be run.
pub fn highest_rates(elf: &Path, progress: impl Fn(f64) + Sync) -> Result<Vec<Rate>> {
    let bisections = ((HIGHEST_PER_S / LOWEST_PER_S).ln() / RESOLUTION.ln_1p()).log2().ceil();
    let turnings = Turning::all();
    let trials = (bisections + BELOW.len() as f64) * turnings.len() as f64;
    let done = AtomicUsize::new(0);
    let tried = || progress(((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / trials).min(1.0));
    turnings.into_par_iter().map(|turning| highest_rate(elf, turning, tried)).collect()
}

/// Searches the highest rate. Calls `tried` after each trial.
fn highest_rate(elf: &Path, turning: Turning, tried: impl Fn()) -> Result<Rate> {
    let follow = |counts_per_s: f64| {
        let followed = follow(elf, turning, counts_per_s);
        tried();
        followed
    };
    let mut failed = HIGHEST_PER_S;
    loop {
        let mut passed = Rate { turning, counts_per_s: LOWEST_PER_S, line_share: 0.0 };
        while failed > passed.counts_per_s * (1.0 + RESOLUTION) {
            let middle = (failed * passed.counts_per_s).sqrt();
            match follow(middle)? {
                Some(rate) => passed = rate,
                None => failed = middle,
            }
        }
        let fails = |rate: f64| follow(rate).map(|followed| followed.is_none().then_some(rate)).transpose();
        match BELOW.iter().map(|share| share * passed.counts_per_s).find_map(fails).transpose()? {
            // The rate had passed by chance.
            Some(rate) => failed = rate,
            None => return Ok(passed),
        }
    }
}
