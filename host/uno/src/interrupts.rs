//! Interrupt statistics: for each vector a count and the range of its cycles, and the longest time with interrupts off.
//!
//! The recorder is off by default, because watching every instruction slows the simulation. It does not measure how
//! long an interrupt waited; the longest time off is a bound for that.

use std::collections::BTreeMap;
use std::mem::take;

/// Cycles of one vector's handler, from its entry (4 cycles) to the end of its `reti`, with the handlers that
/// interrupted it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct HandlerCycles {
    /// Times it ran.
    pub count: u64,
    /// Fewest cycles of a run.
    pub fewest: u64,
    /// Most cycles of a run.
    pub most: u64,
    /// Cycles of all runs.
    pub total: u64,
}

impl HandlerCycles {
    /// Mean cycles of a run.
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
    /// By vector, counted from 0 (reset): INT0 is 1, PCINT0 3, Timer1 overflow 13.
    pub handlers: BTreeMap<u8, HandlerCycles>,
    /// Longest stretch of cycles with the interrupt flag of SREG clear, handlers included.
    pub longest_off: u64,
    /// Longest critical section of the main program, outside every handler. It lasts from the end of the instruction
    /// that turns interrupts off to the end of the one that turns them on. The start-up code after a reset, before it
    /// first turns them on, does not count.
    pub longest_critical_section: u64,
}

/// Turns the edges that simavr shows into statistics.
#[derive(Default)]
pub(super) struct InterruptRecorder {
    /// `None` while it does not measure.
    pub(super) statistics: Option<InterruptStatistics>,
    /// Handlers that have begun and not returned: vector and first cycle.
    running: Vec<(u8, u64)>,
    off_since: Option<u64>,
    critical_since: Option<u64>,
    /// Interrupts have been on since measuring began, and since the last reset. So the instruction that turned them off
    /// is known.
    knows_who: bool,
}

impl InterruptRecorder {
    pub(super) fn turn_on(&mut self) {
        *self = Self {
            statistics: Some(InterruptStatistics::default()),
            running: take(&mut self.running),
            ..Self::default()
        };
    }

    pub(super) fn begins(&mut self, vector: u8, cycle: u64) {
        if self.statistics.is_some() {
            self.running.push((vector, cycle));
            self.off_since.get_or_insert(cycle);
        }
    }

    pub(super) fn ends(&mut self, vector: u8, cycle: u64) {
        // Measuring may have begun inside a handler.
        let Some((_, begun)) = self.running.pop_if(|(running, _)| *running == vector) else {
            return;
        };
        let Some(statistics) = &mut self.statistics else {
            return;
        };
        let cycles = cycle - begun;
        let handler = statistics.handlers.entry(vector).or_insert(HandlerCycles {
            count: 0,
            fewest: cycles,
            most: cycles,
            total: 0,
        });
        handler.count += 1;
        handler.fewest = handler.fewest.min(cycles);
        handler.most = handler.most.max(cycles);
        handler.total += cycles;
    }

    /// The interrupt flag of SREG after an instruction.
    pub(super) fn interrupts_enabled(&mut self, enabled: bool, cycle: u64) {
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
    pub(super) fn reset(&mut self) {
        *self = Self { statistics: self.statistics.take(), ..Self::default() };
    }
}
