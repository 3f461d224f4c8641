//! How fast the encoder may turn: the highest rate at which the firmware loses no count.
//!
//! A trial turns the encoder at one rate and then asks the firmware for its position. It is passed where that is exact, where
//! the firmware knows of no lost count, where it did not start anew, and where its telemetry went on meanwhile: a
//! trial lasts longer than its heartbeat and its watchdog wait for a loop that gets no time any more. [`highest_rate`] finds
//! the rate by bisection to [`RESOLUTION`], and then tries rates below it: edges that come in step with something else may
//! pass at a rate by chance.
//!
//! The firmware is in HOLD. What weeding adds is less than [`Load::Telemetry`], which asks for more than the serial line can
//! carry and has the beam flicker as fast as its sensor can.

use super::BenchError;
use super::load::{Telemetry, flicker};
use crate::console::{ConsoleError, Status, ask};
use crate::signal::{CYCLES_PER_SECOND, Pin, PinChange};
use crate::trial;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// Fewest counts of a trial: the count's second byte changes more than a hundred times.
const FEWEST_COUNTS: f64 = 40_000.0;

/// Shortest trial: twice what the watchdog waits.
const SHORTEST_S: f64 = 0.5;

/// Share of the serial line below which the telemetry counts as silent: some eight lines of status a second.
const SILENT_SHARE: f64 = 0.1;

/// Relative distance between a rate that was passed and one that was not, at the end of the search.
pub const RESOLUTION: f64 = 0.01;

/// What else the firmware does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// What it does by itself: clock, loop and servo.
    Idle,
    /// Its status is asked for without an end at 115200 baud, and the beam flickers.
    Telemetry,
}

/// Which way the encoder turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// AB = 00, 10, 11, 01.
    Forward,
    /// The other way.
    Backward,
}

/// How the encoder turns, and beside what.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turning {
    /// What else the firmware does.
    pub load: Load,
    /// Which way.
    pub direction: Direction,
    /// Each edge comes early or late by up to this share of the time between two, evenly spread; from 0 to 0.5.
    pub jitter: f64,
}

/// The jitter of an encoder whose disc is worn or off its centre.
pub const JITTER: f64 = 0.3;

/// What a trial showed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Counted {
    /// What else the firmware did.
    pub load: Load,
    /// Counts that came, net.
    pub true_ticks: i64,
    /// Counts that the firmware has; `None` where it could not be asked any more.
    pub position_ticks: Option<i64>,
    /// Counts that it knows to have lost.
    pub lost_ticks: u64,
    /// How often it started anew.
    pub restarts: usize,
    /// Share of the serial line's capacity that it used meanwhile, from 0 to 1.
    pub line_share: f64,
}

impl Counted {
    /// Whether nothing was lost and the rest of the firmware went on.
    pub fn is_passed(&self) -> bool {
        let is_heard = self.load == Load::Idle || self.line_share >= SILENT_SHARE;
        self.position_ticks == Some(self.true_ticks) && self.lost_ticks == 0 && self.restarts == 0 && is_heard
    }
}

/// Time from the last edge to the question, in which answers under way come to their end.
const SETTLE_MS: u64 = 100;

/// Turns the encoder of the firmware at `elf` for half a second and by 40,000 counts at least.
///
/// # Errors
/// Where the ELF cannot be run.
pub fn turn(elf: &Path, turning: Turning, counts_per_s: f64) -> Result<Counted, BenchError> {
    let mut uno = trial::boot(elf, &[])?;
    ask(&mut uno, "events on")?;
    let step_cycles = CYCLES_PER_SECOND as f64 / counts_per_s;
    let counts = (counts_per_s * SHORTEST_S).max(FEWEST_COUNTS).ceil() as u32;
    let begin = uno.cycle() + step_cycles.ceil() as u64;
    let end = begin + (f64::from(counts) * step_cycles).ceil() as u64;
    uno.drive(edges(turning, step_cycles, begin).take(counts as usize));
    let mut telemetry = Telemetry::default();
    match turning.load {
        Load::Idle => uno.run_until(end)?,
        Load::Telemetry => {
            uno.drive(flicker(begin, end));
            telemetry.run_until(&mut uno, end)?;
        }
    }
    uno.run_for_ms(SETTLE_MS)?;
    let status = match Status::ask(&mut uno) {
        Ok(status) => Some(status),
        Err(ConsoleError::Uno(error)) => return Err(error.into()),
        // A console that was starved is as bad as a count that was lost.
        Err(_) => None,
    };
    let counts = i64::from(counts);
    Ok(Counted {
        load: turning.load,
        true_ticks: if turning.direction == Direction::Forward { counts } else { -counts },
        position_ticks: status.as_ref().map(|status| status.position_ticks),
        lost_ticks: status.map_or(0, |status| status.lost_ticks),
        restarts: uno.resets().len(),
        line_share: telemetry.line_share(end - begin),
    })
}

/// The encoder's edges without an end, in order of time.
fn edges(turning: Turning, step_cycles: f64, begin: u64) -> impl Iterator<Item = PinChange> {
    // Forward, A leads B; backward, B leads A.
    let (first, second) = match turning.direction {
        Direction::Forward => (Pin::EncoderA, Pin::EncoderB),
        Direction::Backward => (Pin::EncoderB, Pin::EncoderA),
    };
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    (0_u32..).map(move |number| {
        let early = rng.random_range(-1.0..=1.0) * turning.jitter;
        let cycle = begin + ((f64::from(number) + turning.jitter + early) * step_cycles).round() as u64;
        let pin = if number % 2 == 0 { first } else { second };
        PinChange { cycle, pin, high: number % 4 < 2 }
    })
}

/// The highest rate without a lost count.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rate {
    /// Counts a second.
    pub counts_per_s: f64,
    /// Share of the serial line's capacity that the firmware used at that rate, from 0 to 1.
    pub line_share: f64,
}

/// Where the search begins: a rate that is passed in any case, and one that an ATmega328P cannot pass: 20 cycles a count.
const LOWEST_PER_S: f64 = 10_000.0;
const HIGHEST_PER_S: f64 = 800_000.0;

/// Shares of the rate found that have to be passed as well.
const BELOW: [f64; 8] = [0.99, 0.98, 0.97, 0.95, 0.9, 0.8, 0.7, 0.5];

/// Searches the highest rate of the firmware at `elf`. `progress` is told the share of the search done, from 0 to 1.
///
/// # Errors
/// Where the ELF cannot be run.
pub fn highest_rate(elf: &Path, turning: Turning, mut progress: impl FnMut(f64)) -> Result<Rate, BenchError> {
    let mut passed = Rate { counts_per_s: LOWEST_PER_S, line_share: 0.0 };
    let mut failed = HIGHEST_PER_S;
    let bisections = ((HIGHEST_PER_S / LOWEST_PER_S).ln() / RESOLUTION.ln_1p()).log2().ceil();
    let trials = bisections + BELOW.len() as f64;
    let mut done = 0.0;
    loop {
        while failed > passed.counts_per_s * (1.0 + RESOLUTION) {
            let middle = (failed * passed.counts_per_s).sqrt();
            let counted = turn(elf, turning, middle)?;
            if counted.is_passed() {
                passed = Rate { counts_per_s: middle, line_share: counted.line_share };
            } else {
                failed = middle;
            }
            done += 1.0;
            progress((done / trials).min(1.0));
        }
        let mut below = BELOW.iter().map(|share| share * passed.counts_per_s);
        let chance = loop {
            let Some(rate) = below.next() else { break None };
            if !turn(elf, turning, rate)?.is_passed() {
                break Some(rate);
            }
            done += 1.0;
            progress((done / trials).min(1.0));
        };
        match chance {
            Some(rate) => {
                failed = rate;
                passed = Rate { counts_per_s: LOWEST_PER_S, line_share: 0.0 };
            }
            None => return Ok(passed),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_go_through_the_four_states_in_order_and_never_change_places() {
        for (direction, first) in [(Direction::Forward, Pin::EncoderA), (Direction::Backward, Pin::EncoderB)] {
            let turning = Turning { load: Load::Idle, direction, jitter: JITTER };
            let edges: Vec<PinChange> = edges(turning, 80.0, 1000).take(1000).collect();
            assert!(
                edges.windows(2).all(|pair| pair[1].cycle - pair[0].cycle >= 31),
                "40 % of a step and its rounding"
            );
            let levels: Vec<_> = edges.iter().take(4).map(|edge| (edge.pin == first, edge.high)).collect();
            assert_eq!(levels, [(true, true), (false, true), (true, false), (false, false)]);
        }
    }
}
