//! The servo's line of a native run: which pulses its commands give.

use control::operate::servo::{self, Action, FRAME, HalfMicros};
use uno::{CYCLES_PER_SECOND, Pulse};

/// Cycles in a step of Timer1, whose prescaler is 8.
const CYCLES_A_STEP: u64 = 8;

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
