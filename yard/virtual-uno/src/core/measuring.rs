//! Measuring: count and cycles of each interrupt vector, the longest time with interrupts off, turns of the main loop.
//!
//! A turn lasts from one `wdr` instruction to the next. So this works for any loop that feeds the watchdog once a turn.
//! The time of interrupts during a turn is included, sleep is not. Both recorders are off by default, because watching
//! every instruction slows the simulation. They do not measure how long an interrupt waited; the longest time off is a
//! bound for that.

use std::collections::BTreeMap;
use std::mem::take;

/// Durations in cycles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cycles {
    /// Their number.
    pub count: u64,
    /// The shortest.
    pub fewest: u64,
    /// The longest.
    pub most: u64,
    /// All of them.
    pub total: u64,
}

impl Cycles {
    fn add(&mut self, cycles: u64) {
        self.fewest = if self.count == 0 { cycles } else { self.fewest.min(cycles) };
        self.most = self.most.max(cycles);
        self.count += 1;
        self.total += cycles;
    }

    /// The mean.
    pub fn mean(&self) -> f64 {
        self.total as f64 / self.count as f64
    }
}

/// The program's state between two instructions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In an interrupt's handler.
    InHandler,
    /// In the main program, directly before it turns interrupts off.
    BeforeCriticalSection,
    /// In the main program, elsewhere.
    InMain,
}

/// The statistics since the start of measuring.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct InterruptStatistics {
    /// The runs of each handler, from its entry (4 cycles) to the end of its `reti`, with the handlers that interrupted
    /// it. By vector, counted from 0 (reset): INT0 is 1, PCINT0 3, Timer1 overflow 13.
    pub handlers: BTreeMap<u8, Cycles>,
    /// Longest stretch of cycles with the interrupt flag of SREG clear, handlers included.
    pub longest_off: u64,
    /// Longest critical section of the main program, outside every handler. It lasts from the end of the instruction
    /// that turns interrupts off to the end of the one that turns them on. The start-up code after a reset, before it
    /// first turns them on, does not count.
    pub longest_critical_section: u64,
}

/// Turns the edges that simavr shows into statistics.
#[derive(Default)]
pub(crate) struct InterruptRecorder {
    /// `None` while it does not measure.
    pub(crate) statistics: Option<InterruptStatistics>,
    /// Handlers that have begun and not returned: vector and first cycle.
    running: Vec<(u8, u64)>,
    off_since: Option<u64>,
    critical_since: Option<u64>,
    /// Interrupts have been on since the beginning and the last reset: the instruction that turned them off is known.
    knows_who: bool,
}

impl InterruptRecorder {
    pub(crate) fn turn_on(&mut self) {
        *self = Self {
            statistics: Some(InterruptStatistics::default()),
            running: take(&mut self.running),
            ..Self::default()
        };
    }

    pub(crate) fn begins(&mut self, vector: u8, cycle: u64) {
        if self.statistics.is_some() {
            self.running.push((vector, cycle));
            self.off_since.get_or_insert(cycle);
        }
    }

    pub(crate) fn ends(&mut self, vector: u8, cycle: u64) {
        // Measuring may have begun inside a handler.
        let Some((_, begun)) = self.running.pop_if(|(running, _)| *running == vector) else {
            return;
        };
        if let Some(statistics) = &mut self.statistics {
            statistics.handlers.entry(vector).or_default().add(cycle - begun);
        }
    }

    /// The interrupt flag of SREG after an instruction.
    pub(crate) fn interrupts_enabled(&mut self, enabled: bool, cycle: u64) {
        if !enabled {
            self.off_since.get_or_insert(cycle);
            if self.running.is_empty() && self.knows_who {
                self.critical_since.get_or_insert(cycle);
            }
            return;
        }
        self.knows_who = true;
        if let Some(statistics) = &mut self.statistics {
            let lasted = |since: Option<u64>| since.map_or(0, |since| cycle - since);
            statistics.longest_off = statistics.longest_off.max(lasted(self.off_since));
            statistics.longest_critical_section = statistics.longest_critical_section.max(lasted(self.critical_since));
        }
        self.off_since = None;
        self.critical_since = None;
    }

    /// A reset ends every handler without a return.
    pub(crate) fn reset(&mut self) {
        *self = Self { statistics: self.statistics.take(), ..Self::default() };
    }
}

/// Times the main loop's turns.
#[derive(Default)]
pub(crate) struct TurnRecorder {
    /// The complete turns; `None` while it does not measure.
    pub(crate) turns: Option<Cycles>,
    begun: Option<u64>,
}

impl TurnRecorder {
    pub(crate) fn turn_on(&mut self) {
        *self = Self { turns: Some(Cycles::default()), begun: None };
    }

    /// A `wdr` begins.
    pub(crate) fn watchdog_is_fed(&mut self, cycle: u64) {
        let begun = self.begun.replace(cycle);
        if let (Some(turns), Some(begun)) = (&mut self.turns, begun) {
            turns.add(cycle - begun);
        }
    }

    /// The processor has slept, which is not a part of the turn.
    pub(crate) fn slept(&mut self, cycles: u64) {
        self.begun = self.begun.map(|begun| begun + cycles);
    }

    /// A reset ends a turn, which is not counted.
    pub(crate) fn reset(&mut self) {
        self.begun = None;
    }
}
