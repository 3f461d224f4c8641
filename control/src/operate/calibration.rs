//! Calibration: what the machine measures of itself.
//!
//! [`Distance`] counts the ticks over a stretch that the operator has measured. So tyre wear and wheel slip are included.
//! [`Swings`] times the servo with the end switch: from the command until the tool is out, and until it begins to come back.
//! Without an end switch, the operator can film and time the same swings: the LED shows the commands.

use crate::{
    operate::command_error::CommandError,
    units::{Coarse, Instant, Position, share},
};
use core::num::NonZero;

/// The shortest stretch that gives the ticks a metre to better than 0.1 %.
pub const SHORTEST_MM: u16 = 1000;

/// How far a calibrated wheel may differ from its diameter, in thousandths.
const TOLERANCE_PERMILLE: u16 = 300;

/// A stretch that is being measured.
#[derive(Clone, Copy, Debug)]
pub struct Distance {
    begin: Option<Position>,
    counted: u16,
    off_permille: u16,
}

impl Distance {
    /// No stretch.
    pub const NONE: Self = Self { begin: None, counted: 0, off_permille: 0 };

    /// The stretch begins here.
    pub const fn begin(&mut self, position: Position) {
        self.begin = Some(position);
    }

    /// Ticks a metre, from a stretch of `length_mm` that ends at `position`, forward or back. `nominal` is the value from the
    /// wheel's diameter; `forced` allows any difference from it.
    ///
    /// # Errors
    /// [`CommandError::NotBegun`], [`CommandError::TooShort`] and [`CommandError::WheelDiffers`]. The operator may end the stretch
    /// again.
    pub fn end(&mut self, position: Position, length_mm: u16, nominal: u16, forced: bool) -> Result<u16, CommandError> {
        let begin = self.begin.ok_or(CommandError::NotBegun)?;
        if length_mm < SHORTEST_MM {
            return Err(CommandError::TooShort);
        }
        let length_mm = u32::from(length_mm);
        // Limited to 4 million ticks, 250 m with the finest wheel: longer than a hand-measured stretch.
        let ticks = (position - begin).0.unsigned_abs().min(u32::MAX / 1000 - 33);
        let counted = ((ticks * 1000 + length_mm / 2) / length_mm).min(u16::MAX.into()) as u16;
        self.counted = counted;
        // Rounded up, so that the tolerance is exact.
        self.off_permille =
            ((u32::from(counted.abs_diff(nominal)) * 1000 + u32::from(nominal - 1)) / u32::from(nominal)) as u16;
        if counted == 0 {
            return Err(CommandError::TooShort);
        }
        if self.off_permille > TOLERANCE_PERMILLE && !forced {
            return Err(CommandError::WheelDiffers);
        }
        Ok(counted)
    }

    /// Ticks a metre of the last measurement, at most 65,535.
    pub const fn counted(&self) -> u16 {
        self.counted
    }

    /// How far the last measurement is from the wheel's diameter, in thousandths.
    pub const fn off_permille(&self) -> u16 {
        self.off_permille
    }
}

/// Swings in and out: enough to meet the servo's quick and slow swings.
const ROUNDS: u8 = 6;

/// Time for a swing, several times as long as any servo needs. It is no multiple of the servo's frame (20 ms), so the six swings in
/// meet its start at different moments, and one of them hardly waits for the next pulse.
pub const SWING_MS: u16 = 1503;
const SWING: u16 = Coarse::steps_in_ms(SWING_MS);

/// Longest wait of a command besides the servo's gap: the longest pulse on the line, and some turns of the loop.
const SPARE_MS: u8 = 7;

/// Longest wait of a command in fixed frames.
const FRAME_MS: u8 = 20;

/// Coarse steps in 8 ms.
const STEPS_IN_8_MS: NonZero<u16> = NonZero::new(Coarse::steps_in_ms(8)).unwrap();

/// How late the end switch may be read: the loop sleeps until the clock's interrupt, every 1.024 ms.
const LATE_MS: u16 = 1;

/// The servo's measured times.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SwingTimes {
    /// The longest time from the command until the tool was out, plus the longest wait of a command.
    pub out_ms: u16,
    /// The shortest time from the command until the tool began to come back, less a millisecond: the switch is read late.
    pub in_ms: u16,
}

/// The result of the swings.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The end switch gave the times.
    Measured(SwingTimes),
    /// There is no end switch: the operator times the swings.
    Shown,
    /// The end switch did not follow a swing.
    Failed,
}

/// Timed swings of the tool. The end switch shows when the tool arrives and when it leaves.
#[derive(Clone, Debug)]
pub struct Swings {
    /// Swings left, this one included; even numbers are swings in. The first, out of the row, is not timed.
    left: u8,
    since: Coarse,
    /// Whether the switch has followed this swing.
    followed: bool,
    watched: bool,
    /// Longest wait of a command at its worst moment, which the measured swings may not have had.
    spare_ms: u8,
    leads: SwingTimes,
}

impl Swings {
    /// Starts with a swing out of the row: the operator may have put the tool in. `watched` tells whether there is an end switch.
    /// `gap_ms` is the shortest gap between servo pulses; 0 stands for fixed frames.
    pub const fn new(now: Instant, watched: bool, gap_ms: u8) -> Self {
        let wait_ms = if gap_ms == 0 { FRAME_MS } else { gap_ms };
        Self {
            left: 2 * ROUNDS + 1,
            since: now.coarse(),
            followed: true,
            watched,
            spare_ms: SPARE_MS + wait_ms,
            leads: SwingTimes { out_ms: 0, in_ms: u16::MAX },
        }
    }

    /// Whether the tool is commanded out.
    pub const fn tool_out(&self) -> bool {
        !self.left.is_multiple_of(2)
    }

    /// Takes the end switch's level, on for "tool out". Returns the result once all swings are done, or one has failed.
    pub fn step(&mut self, now: Instant, switch_on: bool) -> Option<Outcome> {
        let lasted = now.coarse().since(self.since);
        if self.watched && !self.followed && switch_on == self.tool_out() {
            self.followed = true;
            // A step more, because both moments are rounded down.
            let lasted_ms = share(lasted + 1, 8, STEPS_IN_8_MS) as u16;
            // No servo is that fast: the switch is stuck or in the wrong position.
            if lasted_ms < 5 {
                return Some(Outcome::Failed);
            }
            if self.tool_out() {
                self.leads.out_ms = self.leads.out_ms.max(lasted_ms + 1 + u16::from(self.spare_ms));
            } else {
                self.leads.in_ms = self.leads.in_ms.min(lasted_ms - LATE_MS);
            }
        }
        if lasted < SWING {
            return None;
        }
        if self.watched && !self.followed {
            return Some(Outcome::Failed);
        }
        (self.since, self.followed) = (now.coarse(), false);
        self.left -= 1;
        match (self.left, self.watched) {
            (0, true) => Some(Outcome::Measured(self.leads)),
            (0, false) => Some(Outcome::Shown),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::{Interval, Ticks};

    /// Ends a stretch of these ticks, where the counter wraps. A refusal comes with the count.
    fn end(ticks: i32, length_mm: u16, forced: bool) -> Result<u16, (CommandError, u16)> {
        let begin = Position::new(i32::MAX - 100);
        let mut distance = Distance::NONE;
        distance.begin(begin);
        distance.end(begin + Ticks(ticks), length_mm, 1910, forced).map_err(|error| (error, distance.counted()))
    }

    #[test]
    fn calibration_takes_a_plausible_stretch_or_a_forced_one() {
        let differs = |counted| Err((CommandError::WheelDiffers, counted));
        for (ticks, length_mm, forced, expected) in [
            (18_900, 10_000, false, Ok(1890)),
            (-18_900, 10_000, false, Ok(1890)),
            (1905, 1000, false, Ok(1905)),
            (1900, 999, false, Err((CommandError::TooShort, 0))),
            // Rounded.
            (18_904, 10_000, false, Ok(1890)),
            (18_905, 10_000, false, Ok(1891)),
            // Up to 30 % from the nominal value.
            (24_830, 10_000, false, Ok(2483)),
            (24_840, 10_000, false, differs(2484)),
            (13_360, 10_000, false, differs(1336)),
            (24_840, 10_000, true, Ok(2484)),
            (0, 10_000, true, Err((CommandError::TooShort, 0))),
            (i32::MIN, 1000, false, differs(u16::MAX)),
        ] {
            assert_eq!(end(ticks, length_mm, forced), expected, "{ticks} in {length_mm} mm");
        }
    }

    fn at_ms(milliseconds: u32) -> Instant {
        Instant::new(u32::MAX - 500_000) + Interval::from_ms(milliseconds)
    }

    /// Runs the swings with a switch that follows each command after this many milliseconds, in turn.
    fn run(follows_ms: [u32; 6]) -> (Outcome, u32) {
        let mut swings = Swings::new(at_ms(0), true, 3);
        let (mut commanded, mut out, mut count) = (0, true, 0);
        for now in 0_u32.. {
            if swings.tool_out() != out {
                // The previous step gave this command.
                (commanded, out, count) = (now.saturating_sub(1), swings.tool_out(), count + 1);
            }
            let arrived = now - commanded >= follows_ms[(count.max(1) - 1) % 6];
            if let Some(outcome) = swings.step(at_ms(now), out == arrived) {
                return (outcome, now);
            }
        }
        unreachable!("the swings end")
    }

    #[test]
    fn the_end_switch_gives_the_longest_swing_out_and_the_shortest_swing_in() {
        let (outcome, lasted_ms) = run([61, 180, 57, 195, 70, 170]);
        assert_eq!(outcome, Outcome::Measured(SwingTimes { out_ms: 195 + 11, in_ms: 57 - LATE_MS }));
        assert_eq!(lasted_ms, 19_539);
    }

    #[test]
    fn one_of_the_swings_in_waits_less_than_a_third_of_a_frame_for_its_pulse() {
        let (frame, swing) = (1000 * u32::from(FRAME_MS), u32::from(SWING) * (1_000_000 / Coarse::STEPS_PER_SECOND));
        let mut moments = [0, 1, 2, 3, 4, 5, 6].map(|round| 2 * round * swing % frame);
        // The last stands for the first one of the next frame.
        moments[usize::from(ROUNDS)] = frame;
        moments.sort_unstable();
        assert!(moments.windows(2).all(|pair| 3 * (pair[1] - pair[0]) < frame), "{moments:?}");
    }

    #[test]
    fn a_switch_that_does_not_follow_or_follows_too_soon_fails() {
        assert_eq!(run([60, 180, 60, 9999, 60, 180]).0, Outcome::Failed);
        assert_eq!(run([9999, 180, 60, 180, 60, 180]).0, Outcome::Failed);
        assert_eq!(run([4, 180, 60, 180, 60, 180]).0, Outcome::Failed);
        assert_eq!(
            run([5, 180, 60, 180, 60, 180]).0,
            Outcome::Measured(SwingTimes { out_ms: 180 + 11, in_ms: 5 - LATE_MS })
        );
    }
}
