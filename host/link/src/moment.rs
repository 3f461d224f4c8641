//! A point in time by two clocks, so that the time in which a computer sleeps counts.
//!
//! The first clock never goes back, and stands still on some systems while the computer sleeps. The second one is the
//! calendar's. It goes on during a sleep, and is sometimes set. The time between two moments is the longer of the two:
//! a command then counts as too old rather than as new.

use std::time::Duration;

/// A point in time.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Moment {
    /// By the clock that never goes back.
    pub ticking: Duration,
    /// By the calendar.
    pub calendar: Duration,
}

impl Moment {
    /// A deadline that does not pass.
    pub const NEVER: Self = Self { ticking: Duration::MAX, calendar: Duration::MAX };

    /// Now, by this computer's clocks.
    #[cfg(not(target_arch = "wasm32"))]
    pub fn now() -> Self {
        use std::sync::OnceLock;
        use std::time::{Instant, SystemTime};
        static START: OnceLock<Instant> = OnceLock::new();
        let calendar = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        Self { ticking: START.get_or_init(Instant::now).elapsed(), calendar }
    }

    /// The time since an earlier moment, sleep included.
    pub fn since(self, earlier: Self) -> Duration {
        let ticking = self.ticking.saturating_sub(earlier.ticking);
        ticking.max(self.calendar.saturating_sub(earlier.calendar))
    }

    /// Whether a deadline has passed, by either clock.
    pub fn is_after(self, deadline: Self) -> bool {
        self.ticking > deadline.ticking || self.calendar > deadline.calendar
    }

    /// This moment and a time later.
    pub fn after(self, time: Duration) -> Self {
        Self { ticking: self.ticking + time, calendar: self.calendar + time }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sleep_counts_and_a_calendar_that_is_set_back_makes_nothing_new() {
        let moment = |ticking, calendar| Moment {
            ticking: Duration::from_secs(ticking),
            calendar: Duration::from_secs(calendar),
        };
        let before = moment(10, 1000);
        for (now, seconds) in [(moment(12, 1002), 2), (moment(11, 1041), 41), (moment(15, 900), 5), (before, 0)] {
            assert_eq!(now.since(before), Duration::from_secs(seconds), "{now:?}");
        }
    }
}
