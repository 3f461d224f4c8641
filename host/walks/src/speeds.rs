//! The speeds of the last second, between which a measured one lies.

use std::collections::VecDeque;

/// The measured speed is that of some moment in this time.
const MEMORY_US: u64 = 1_000_000;

/// A share of it that is kept as one.
const SHARE_US: u64 = MEMORY_US / 20;

/// The lowest and the highest of what was in the last second, in ticks a second, for each share of it.
#[derive(Debug, Default)]
pub struct Speeds(VecDeque<(u64, f64, f64)>);

impl Speeds {
    /// Takes a speed at a time.
    pub fn take(&mut self, now_us: u64, speed: f64) {
        let share = now_us / SHARE_US;
        match self.0.back_mut() {
            Some((last, least, greatest)) if *last == share => {
                (*least, *greatest) = (least.min(speed), greatest.max(speed));
            }
            _ => self.0.push_back((share, speed, speed)),
        }
        while self.0.front().is_some_and(|&(first, ..)| first + MEMORY_US / SHARE_US < share) {
            self.0.pop_front();
        }
    }

    /// The lowest and the highest.
    pub fn extremes(&self) -> (f64, f64) {
        let all = self.0.iter().map(|&(_, least, greatest)| (least, greatest));
        all.reduce(|(least, greatest), (one, other)| (least.min(one), greatest.max(other))).unwrap_or((0.0, 0.0))
    }
}
