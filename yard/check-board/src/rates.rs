//! Rates: whether the weeder loses a count in bursts of the encoder beyond the proved rate, or by glitches.
//!
//! The tester counts cycles between two edges, so a rate is exact by its clock. The weeder is in hold. Busy means that
//! it prints all its settings meanwhile, and that the beam changes once in 128 counts.

use crate::{Boards, CheckError};
use link::ConsoleLine;
use tester_core::message::{Command, PATTERN_STEPS, REPEAT_CYCLES, STEP_CYCLES, Step, step_cycles};
use tester_core::pins::Line;
use uno::CYCLES_PER_SECOND;

/// Counts of a burst after its run-up: 0.1 s at the highest rate, less than the timeout of the weeder's main loop.
const COUNTS: u32 = 29_000;

/// Counts of the run-up, and the length of its steps, in units of [`STEP_CYCLES`]: 40,000 counts a second. Without it
/// the weeder takes the jumps of a suddenly fast wheel for noise.
const RUN_UP_COUNTS: u32 = 1280;
const SLOWER: u8 = 115;

/// Cycles between two counts at the rate that `weeder bounds` proves: 290,909 a second.
pub const PROVED_CYCLES: u32 = 55;

/// Greatest shortening in [`Boards::highest_rate`], in cycles. Every handler takes longer than the rest.
const SHORTER_CYCLES: u32 = 42;

/// How early or late an edge comes, as a share of the time between two, as with a worn or eccentric disc.
const JITTER: f64 = 0.3;

/// Time in which the weeder answers the last question, in ms.
const SETTLE_MS: u32 = 100;

/// Reads of 20 ms until it must have answered.
const ANSWER_READS: usize = 100;

/// How the encoder turns.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Turning {
    /// Mean cycles between two counts, 13 or more.
    pub cycles: u32,
    /// The direction.
    pub forward: bool,
    /// Whether edges jitter.
    pub jittered: bool,
    /// Whether the weeder prints and the beam changes.
    pub busy: bool,
}

impl Turning {
    /// The rate in counts a second, by the tester's clock.
    pub fn per_s(self) -> f64 {
        CYCLES_PER_SECOND as f64 / f64::from(self.cycles)
    }

    /// The pattern: one change of a channel in each step, from these levels.
    fn pattern(self, levels: u8) -> Vec<Step> {
        let is_even = (levels & Line::EncoderA.bit() != 0) == (levels & Line::EncoderB.bit() != 0);
        let mut next_is_a = is_even == self.forward;
        let (mut due, mut done) = (0.0, 0.0);
        let mut random = 1_u32;
        let step = |number| {
            let line = if next_is_a { Line::EncoderA } else { Line::EncoderB };
            next_is_a = !next_is_a;
            let beam = if self.busy && number == 0 { Line::Beam.bit() } else { 0 };
            due += f64::from(self.cycles);
            // The multiplier of Numerical Recipes' generator; the upper bits are random enough for a wheel.
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            let share = f64::from(random >> 16) / f64::from(1 << 15) - 1.0;
            let shift = if self.jittered { JITTER * share * f64::from(self.cycles) } else { 0.0 };
            let repeated = if number == 0 { f64::from(REPEAT_CYCLES) } else { 0.0 };
            let wait = due + shift - done - repeated - f64::from(step_cycles(0));
            let delay = (wait / f64::from(STEP_CYCLES)).round().clamp(1.0, f64::from(u8::MAX - SLOWER));
            done += f64::from(step_cycles(delay as u8)) + repeated;
            Step { delay: delay as u8, toggle: line.bit() | beam }
        };
        (0..PATTERN_STEPS).map(step).collect()
    }
}

/// Lengths of glitches in cycles, from 0.8 us to longer than both handlers of the encoder together.
const GLITCH_CYCLES: [u32; 8] = [13, 16, 22, 31, 43, 55, 79, 121];

/// How often the pattern of 64 glitches is played for each length.
const GLITCH_REPEATS: u16 = 4;

impl Boards {
    /// Lost counts: the counts that were made less the weeder's. `None` if it has restarted.
    pub fn lost_counts(&mut self, turning: Turning) -> Result<Option<i64>, CheckError> {
        let Self { weeder, tester, .. } = self;
        weeder.to_hold()?;
        let before = weeder.status()?.position;
        let levels = tester.command(&Command::Clock)?.levels;
        tester.load(&turning.pattern(levels))?;
        weeder.drain()?;
        if turning.busy {
            weeder.send("get")?;
        }
        let [run_up, repeats] = [RUN_UP_COUNTS, COUNTS].map(|counts| (counts / PATTERN_STEPS as u32) as u16);
        tester.command(&Command::Burst { steps: PATTERN_STEPS as u8, run_up, slower: SLOWER, repeats })?;
        tester.set(Line::Beam.bit(), Line::Beam.bit())?;
        tester.record_for_ms(SETTLE_MS)?;
        if turning.busy {
            for _ in 0..ANSWER_READS {
                match weeder.next_line()?.map(|line| ConsoleLine::parse(&line)) {
                    Some(ConsoleLine::End { error: None }) => break,
                    Some(ConsoleLine::Greeting { .. }) => {
                        weeder.drain()?;
                        return Ok(None);
                    }
                    _ => {}
                }
            }
        }
        weeder.drain()?;
        let made = i64::from(run_up + repeats) * PATTERN_STEPS as i64 * if turning.forward { 1 } else { -1 };
        let counted = i64::from(weeder.status()?.position.wrapping_sub(before));
        Ok(Some((made - counted).abs()))
    }

    /// The highest rate at which no count is lost, in counts a second. `None` if counts are lost at the proved rate.
    ///
    /// The search goes up from the proved rate, in the steps that the tester can make.
    pub fn highest_rate(&mut self, forward: bool, busy: bool) -> Result<Option<f64>, CheckError> {
        let mut highest = None;
        for shorter in (0..=SHORTER_CYCLES).step_by(STEP_CYCLES as usize) {
            let turning = Turning { cycles: PROVED_CYCLES - shorter, forward, jittered: false, busy };
            if self.lost_counts(turning)? != Some(0) {
                break;
            }
            highest = Some(turning.per_s());
        }
        Ok(highest)
    }

    /// Counts that remain after glitches of a channel (its level changes and changes back), summed over their lengths.
    pub fn left_by_glitches(&mut self, channel: Line) -> Result<f64, CheckError> {
        let Self { weeder, tester, .. } = self;
        weeder.to_hold()?;
        let mut left = 0;
        for cycles in GLITCH_CYCLES {
            let toggle = channel.bit();
            let short = Step { delay: ((cycles - step_cycles(0)) / STEP_CYCLES) as u8, toggle };
            let pattern = [Step { delay: u8::MAX, toggle }, short].repeat(PATTERN_STEPS / 2);
            tester.load(&pattern)?;
            let before = weeder.status()?.position;
            weeder.drain()?;
            let steps = PATTERN_STEPS as u8;
            tester.command(&Command::Burst { steps, run_up: 0, slower: 0, repeats: GLITCH_REPEATS })?;
            tester.record_for_ms(SETTLE_MS)?;
            left += i64::from(weeder.status()?.position.wrapping_sub(before)).abs();
        }
        Ok(left as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cycles at which the counts of two patterns in a row come.
    fn times(turning: Turning) -> Vec<u32> {
        let pattern = turning.pattern(0);
        let twice = pattern.iter().chain(&pattern).enumerate();
        let mut time = 0;
        let count = |(number, step): (usize, &Step)| {
            let repeated = if number % PATTERN_STEPS == 0 && number > 0 { REPEAT_CYCLES } else { 0 };
            time += step_cycles(step.delay) + repeated;
            time
        };
        twice.map(count).collect()
    }

    #[test]
    fn the_proved_rate_is_even_to_the_cycle() {
        let turning = Turning { cycles: 55, forward: true, jittered: false, busy: false };
        let times = times(turning);
        assert!(times.windows(2).all(|two| two[1] - two[0] == 55), "{times:?}");
        assert_eq!(turning.per_s().round(), 290_909.0);
    }

    #[test]
    fn jitter_keeps_the_mean_and_no_gap_is_shorter_than_it_may_be() {
        let turning = Turning { cycles: 79, forward: false, jittered: true, busy: true };
        let times = times(turning);
        let mean = f64::from(times[2 * PATTERN_STEPS - 1] - times[PATTERN_STEPS - 1]) / PATTERN_STEPS as f64;
        assert!((mean - 79.0).abs() < 0.5, "{mean}");
        let gaps = times.windows(2).map(|two| two[1] - two[0]);
        let (shortest, longest) = gaps.fold((u32::MAX, 0), |(least, most), gap| (least.min(gap), most.max(gap)));
        assert!((28..45).contains(&shortest) && (113..130).contains(&longest), "{shortest} {longest}");
    }
}
