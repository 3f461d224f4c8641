//! The tool's command: in or out, since when, and whether it was in time; and why the tool may be out while the machine works.

use crate::{
    named::named,
    operate::servo::HalfMicros,
    units::{Slow, count},
};

named! {
    /// Why the tool is out of the row while the machine works.
    Reason {
        /// A plant is at the tool or comes up.
        Plant = "plant",
        /// The beam has not seen the ground.
        UnseenGround = "unseen_ground",
        /// The machine would reach a plant just behind the beam before the tool is out.
        TooFast = "too_fast",
        /// The encoder fell silent while the machine rolled, or the beam broke while it stands.
        EncoderDoubtful = "encoder_doubtful",
    }
}

/// Steps of 1.024 ms after which a pulse counts as this old, because the clock wraps: longer than any lead.
const SETTLED: u16 = 0x7FFF;

/// Swings out in a row without the end switch after which the tool is stuck.
const UNFOLLOWED: u8 = 3;

/// The tool.
#[derive(Clone, Debug)]
pub struct Tool {
    out: bool,
    /// The servo's pulse, and since when it has this width.
    pulse: HalfMicros,
    since: Slow,
    /// Whether the ground for which the tool left the row is yet to come.
    awaits_ground: bool,
    late: u16,
    /// Swings out in a row that the end switch has not followed.
    unfollowed: u8,
}

impl Tool {
    /// A tool before [`init`](Self::init).
    pub const NONE: Self =
        Self { out: false, pulse: 0, since: Slow::ZERO, awaits_ground: false, late: 0, unfollowed: 0 };

    /// Starts with the tool out of the row.
    pub const fn init(&mut self, now: Slow) {
        (self.out, self.since) = (true, now);
    }

    /// Whether it is commanded out.
    pub const fn is_out(&self) -> bool {
        self.out
    }

    /// Commands it out of the row or back. `for_ground`: the reason is ground that is yet to come.
    pub const fn send(&mut self, out: bool, for_ground: bool) {
        (self.out, self.awaits_ground) = (out, for_ground);
    }

    /// Records the servo's pulse.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub const fn order(&mut self, pulse: HalfMicros, now: Slow) {
        if pulse != self.pulse {
            (self.pulse, self.since) = (pulse, now);
        } else if now.since(self.since) > SETTLED {
            self.since = now.before(SETTLED);
        }
    }

    /// Whether the servo has had this pulse for this many milliseconds.
    pub fn has_held(&self, pulse: HalfMicros, now: Slow, milliseconds: u16) -> bool {
        pulse == self.pulse && self.is_settled(now, milliseconds)
    }

    /// A swing ends. One out of at least `least_ms` counts if the end switch has not followed it.
    pub fn end_swing(&mut self, now: Slow, least_ms: u16, followed: bool) {
        if followed {
            self.unfollowed = 0;
        } else if self.out && self.is_settled(now, least_ms) {
            self.unfollowed += 1;
        }
    }

    /// Whether the end switch has followed none of the last swings out.
    pub const fn follows_no_swing(&self) -> bool {
        self.unfollowed == UNFOLLOWED
    }

    /// Counts those swings from here on.
    pub const fn forget_swings(&mut self) {
        self.unfollowed = 0;
    }

    /// Closed ground has reached the tool. Returns whether the command came less than `milliseconds` before, and counts that.
    pub fn count_if_late(&mut self, now: Slow, milliseconds: u16) -> bool {
        self.awaits_ground = false;
        let is_late = !self.is_settled(now, milliseconds);
        if is_late {
            count(&mut self.late);
        }
        is_late
    }

    /// Whether the ground for which it left the row is yet to come.
    pub const fn awaits_ground(&self) -> bool {
        self.awaits_ground
    }

    /// Times that closed ground came before the tool could be out.
    pub const fn late(&self) -> u16 {
        self.late
    }

    /// Whether the servo has had its pulse for this many milliseconds.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn is_settled(&self, now: Slow, milliseconds: u16) -> bool {
        now.since(self.since) >= milliseconds
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Instant;

    #[test]
    fn a_pulse_that_is_older_than_the_clock_counts_is_still_held() {
        let mut tool = Tool::NONE;
        tool.init(Slow::ZERO);
        let at = |seconds: f64| Instant::at_ms((seconds * 1000.0) as u32).slow();
        for quarter in 0..1200 {
            let seconds = 0.25 * f64::from(quarter);
            tool.order(3000, at(seconds));
            assert_eq!(tool.has_held(3000, at(seconds), 600), seconds >= 0.75, "{seconds} s");
            assert!(!tool.has_held(4000, at(seconds), 0), "it has not had this pulse");
        }
        tool.order(4000, at(300.0));
        assert!(!tool.has_held(4000, at(300.0), 600) && tool.has_held(4000, at(301.0), 600));
    }

    #[test]
    fn a_run_of_long_swings_not_followed_means_a_stuck_tool() {
        let at = |ms: u32| Instant::at_ms(ms).slow();
        for (lasts_ms, followed_at, stuck) in [(200, None, false), (300, None, true), (300, Some(2), false)] {
            let mut tool = Tool::NONE;
            tool.init(Slow::ZERO);
            for swing in 0..4_u32 {
                let begin = 1000 * swing;
                tool.send(true, false);
                tool.order(4000, at(begin));
                if swing < 3 || followed_at.is_none() {
                    tool.end_swing(at(begin + lasts_ms), 270, followed_at == Some(swing));
                }
                tool.send(false, false);
                tool.order(3000, at(begin + lasts_ms));
                tool.end_swing(at(begin + 900), 270, false);
                if tool.follows_no_swing() {
                    break;
                }
            }
            assert_eq!(tool.follows_no_swing(), stuck, "{lasts_ms} ms, {followed_at:?}");
        }
    }
}
