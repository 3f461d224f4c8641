//! The speeds of the last second. A measured speed must lie between them.

use std::collections::VecDeque;

/// The measured speed is that of some moment in this time.
const MEMORY_US: u64 = 1_000_000;

/// A share of it that is kept as one.
const SHARE_US: u64 = MEMORY_US / 20;

/// The speeds of the last second.
#[derive(Debug, Default)]
pub struct Speeds {
    /// Each share of it: its number, and the lowest and the highest in ticks a second.
    shares: VecDeque<(u64, f64, f64)>,
    /// The lowest and the highest of all shares, which are asked for far more often than a share begins.
    extremes: (f64, f64),
}

impl Speeds {
    /// Takes a speed at a time.
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

    /// The lowest and the highest.
    pub fn extremes(&self) -> (f64, f64) {
        self.extremes
    }
}
