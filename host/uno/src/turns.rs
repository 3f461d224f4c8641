//! The length of a turn of the firmware's main loop: the cycles from one `wdr` instruction to the next.
//!
//! This works for any loop that feeds the watchdog once a turn. The time of interrupts during a turn is included, sleep
//! is not. The recorder is off by default, because watching every instruction slows the simulation.

/// Cycles of the main loop's turns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Turns {
    /// Turns that were complete.
    pub count: u64,
    /// Cycles of the longest.
    pub longest: u64,
    /// Cycles of all.
    pub total: u64,
}

impl Turns {
    /// Mean cycles of a turn.
    pub fn mean(&self) -> f64 {
        self.total as f64 / self.count as f64
    }
}

/// Counts the turns.
#[derive(Default)]
pub(super) struct TurnRecorder {
    /// `None` while it does not measure.
    pub(super) turns: Option<Turns>,
    begun: Option<u64>,
}

impl TurnRecorder {
    pub(super) fn turn_on(&mut self) {
        *self = Self { turns: Some(Turns::default()), begun: None };
    }

    /// A `wdr` begins.
    pub(super) fn watchdog_is_fed(&mut self, cycle: u64) {
        let begun = self.begun.replace(cycle);
        if let (Some(turns), Some(begun)) = (&mut self.turns, begun) {
            turns.count += 1;
            turns.longest = turns.longest.max(cycle - begun);
            turns.total += cycle - begun;
        }
    }

    /// The processor has slept, which is not a part of the turn.
    pub(super) fn slept(&mut self, cycles: u64) {
        self.begun = self.begun.map(|begun| begun + cycles);
    }

    /// A reset ends a turn, which is not counted.
    pub(super) fn reset(&mut self) {
        self.begun = None;
    }
}
