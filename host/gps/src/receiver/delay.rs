//! How far the log's clock is ahead of UTC, by the receiver's quickest lines.

/// The least delay is searched among the lines of this time and the one before, in ms of the log.
const DELAYS_MS: f64 = 10_000.0;

/// The greatest difference of a delay from the least. If a receiver's time jumps by more, it has only now found the
/// right time.
pub(super) const LONGEST_DELAY_MS: f64 = 30_000.0;

/// By how much the log's clock is ahead of UTC and of the least delay, in ms: the least value of this period and of the one
/// before.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct LeastAhead {
    ms: [Option<f64>; 2],
    /// The start of this period.
    since_ms: f64,
}

impl LeastAhead {
    /// The least value. `None` if no line has come since the clock has stepped.
    pub(super) fn ms(&self) -> Option<f64> {
        self.ms.into_iter().flatten().reduce(f64::min)
    }

    /// The receiver's clock has stepped.
    pub(super) fn forget(&mut self) {
        self.ms = [None; 2];
    }

    /// Takes the value of a line that came at this time. Returns the least value.
    pub(super) fn take(&mut self, arrived_ms: f64, ahead_ms: f64) -> f64 {
        if self.ms.into_iter().flatten().any(|least| (ahead_ms - least).abs() > LONGEST_DELAY_MS) {
            self.forget();
        }
        if !(0.0..DELAYS_MS).contains(&(arrived_ms - self.since_ms)) {
            (self.ms, self.since_ms) = ([None, self.ms[0]], arrived_ms);
        }
        self.ms[0] = Some(self.ms[0].map_or(ahead_ms, |least| least.min(ahead_ms)));
        self.ms().unwrap_or(ahead_ms)
    }
}
