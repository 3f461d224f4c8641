//! The range of speeds in the last second. The machine's measured speed must lie in it.

use std::collections::VecDeque;

/// Longest delay of the measured speed.
const MEMORY_US: u64 = 1_000_000;

/// Interval of one entry.
const SHARE_US: u64 = MEMORY_US / 20;

/// The range of speeds in the last second.
#[derive(Debug, Default)]
pub struct Speeds {
    /// For each interval its number, and the lowest and highest speed in ticks a second.
    shares: VecDeque<(u64, f64, f64)>,
    /// The lowest and highest speed of all intervals. They are read far more often than an interval begins.
    extremes: (f64, f64),
}

impl Speeds {
    /// Adds a speed.
    pub fn take(&mut self, now_us: u64, speed: f64) {
        let number = now_us / SHARE_US;
        if let Some((_, least, greatest)) = self.shares.back_mut().filter(|(last, ..)| *last == number) {
            (*least, *greatest) = (least.min(speed), greatest.max(speed));
            self.extremes = (self.extremes.0.min(speed), self.extremes.1.max(speed));
            return;
        }
        self.shares.push_back((number, speed, speed));
        while self.shares.front().is_some_and(|&(first, ..)| first + MEMORY_US / SHARE_US < number) {
            self.shares.pop_front();
        }
        let others = self.shares.iter().map(|&(_, least, greatest)| (least, greatest));
        self.extremes =
            others.fold((speed, speed), |(least, greatest), (one, other)| (least.min(one), greatest.max(other)));
    }

    /// The lowest and the highest speed.
    pub fn extremes(&self) -> (f64, f64) {
        self.extremes
    }
}
