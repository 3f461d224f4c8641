//! Timer1: the clock in cycles, the plan's events, and the servo's pulses on ICP1 (D8).
//!
//! The timer counts cycles and overflows every 4.096 ms; an interrupt counts the overflows. The compare interrupt fires the plan's
//! events. Each wait counts from the time at which the last event was due. So a late event does not delay the next. The capture
//! unit stamps the servo's edges (data sheet, 16.6), so other interrupts do not change the measurement.

use crate::burst;
use crate::lines::{self, Lines};
use avr_device::{
    atmega328p::{TC1, tc1::RegisterBlock as Timer},
    interrupt::{self, Mutex},
};
use core::cell::RefCell;
use heapless::Deque;
use tester_core::message::{Record, Step};
use tester_core::player::{Next, Player};
use tester_core::station::Board;

/// Longest wait set in the compare unit at once, in cycles. It is below half of the timer's range, which separates future from
/// past.
const STRIDE: u16 = 0x4000;

/// From the command to the plan's start, in cycles: 200 us.
const LEAD: u16 = 3200;

// TIMSK1 and TIFR1.
const CAPTURE: u8 = 1 << 5;
const COMPARE: u8 = 1 << 1;
const OVERFLOW: u8 = 1;

// TCCR1B.
const RISING: u8 = 1 << 6;
const NO_PRESCALER: u8 = 1;

struct Inner {
    player: Player,
    /// The compare unit's time, and the cycles from there to the event.
    armed: u16,
    left: u32,
    overflows: u16,
    /// The time of the pulse's beginning.
    rise: Option<u32>,
    measured: Deque<Record, 4>,
    /// Pulses without room in `measured`.
    lost: u16,
}

static INNER: Mutex<RefCell<Inner>> = Mutex::new(RefCell::new(Inner {
    player: Player::new(),
    armed: 0,
    left: 0,
    overflows: 0,
    rise: None,
    measured: Deque::new(),
    lost: 0,
}));

/// The hardware as the loop uses it.
pub struct Tester {
    pub lines: Lines,
}

impl Tester {
    /// Starts the clock.
    pub fn new(timer: TC1, lines: Lines) -> Self {
        // SAFETY: normal mode, the next edge is rising.
        timer.tccr1b.write(|w| unsafe { w.bits(RISING | NO_PRESCALER) });
        // SAFETY: the handlers of all three interrupts are below.
        timer.timsk1.write(|w| unsafe { w.bits(CAPTURE | COMPARE | OVERFLOW) });
        Self { lines }
    }

    /// The oldest measurement.
    pub fn measured(&self) -> Option<Record> {
        with(|inner, _| {
            inner.measured.pop_front().or_else(|| {
                let lost = core::mem::take(&mut inner.lost);
                (lost > 0).then_some(Record::Lost(lost))
            })
        })
    }
}

impl Board for Tester {
    fn now(&mut self) -> u32 {
        with(|inner, timer| inner.time(timer, timer.tcnt1.read().bits()))
    }

    fn player<R>(&mut self, access: impl FnOnce(&mut Player) -> R) -> R {
        with(|inner, _| access(&mut inner.player))
    }

    fn start(&mut self) -> u32 {
        with(|inner, timer| {
            let begin = timer.tcnt1.read().bits().wrapping_add(LEAD);
            let time = inner.time(timer, timer.tcnt1.read().bits());
            let time = time.wrapping_add(begin.wrapping_sub(time as u16).into());
            inner.armed = begin;
            let next = inner.player.start();
            inner.follow(next, timer);
            time
        })
    }

    fn set(&mut self, mask: u8, levels: u8) {
        with(|inner, _| {
            inner.player.set(mask, levels);
            lines::show(inner.player.levels());
        });
    }

    fn reset(&mut self, pulled: bool) {
        self.lines.pull_reset(pulled);
    }

    fn burst(&mut self, steps: &[Step], run_up: u16, repeats: u16, slower: u8) {
        let levels = self.player(|player| player.levels());
        let levels = interrupt::free(|_| {
            let levels = burst::play(steps, run_up, slower, levels);
            burst::play(steps, repeats, 0, levels)
        });
        self.set(u8::MAX, levels);
        // The clock has lost time, so a pulse that has begun is dropped.
        with(|inner, timer| {
            inner.rise = None;
            // SAFETY: the next edge is rising, and a captured edge is dropped.
            timer.tccr1b.write(|w| unsafe { w.bits(RISING | NO_PRESCALER) });
            // SAFETY: writing 1 clears the flag.
            timer.tifr1.write(|w| unsafe { w.bits(CAPTURE) });
        });
    }

    fn check_capture(&mut self, width: u16) {
        // A wire that nothing drives may have stayed high. Its falling edge is taken first.
        for (high, cycles) in [(false, 1600), (true, width)] {
            self.lines.drive_capture(high);
            let begin = self.now();
            while self.now().wrapping_sub(begin) < cycles.into() {}
        }
        self.lines.drive_capture(false);
    }
}

impl Inner {
    /// The time at which the counter's lower half was `low`, at most half of its range ago.
    fn time(&self, timer: &Timer, low: u16) -> u32 {
        // A pending overflow belongs to a small number, not to a large one.
        let is_pending = timer.tifr1.read().bits() & OVERFLOW != 0 && low < 1 << 15;
        let high = self.overflows.wrapping_add(is_pending.into());
        u32::from(high) << 16 | u32::from(low)
    }

    /// Waits for the next event, or records the end.
    fn follow(&mut self, next: Next, timer: &Timer) {
        match next {
            Next::After(wait) => self.wait(wait, timer),
            Next::Ended => self.measure(Record::Ended(self.player.position())),
            Next::Dry => self.measure(Record::Dry),
        }
    }

    fn wait(&mut self, wait: u32, timer: &Timer) {
        let now = if wait > STRIDE.into() { STRIDE } else { wait as u16 };
        self.left = wait - u32::from(now);
        self.armed = self.armed.wrapping_add(now);
        timer.ocr1a.write(|w| w.bits(self.armed));
    }

    /// Fires all events that are due.
    fn fire(&mut self, timer: &Timer) {
        while self.player.is_playing() {
            let since = timer.tcnt1.read().bits().wrapping_sub(self.armed);
            if (since as i16) < 0 {
                return;
            }
            if self.left > 0 {
                self.wait(self.left, timer);
                continue;
            }
            let next = self.player.fire();
            lines::show(self.player.levels());
            self.follow(next, timer);
        }
    }

    /// Takes an edge on the servo's line.
    fn capture(&mut self, timer: &Timer) {
        let time = self.time(timer, timer.icr1.read().bits());
        let rise = self.rise.take();
        if rise.is_none() {
            self.rise = Some(time);
        }
        let edge = if self.rise.is_none() { RISING } else { 0 };
        // SAFETY: the next edge is the other one.
        timer.tccr1b.write(|w| unsafe { w.bits(edge | NO_PRESCALER) });
        // Changing the edge may set the flag (data sheet, 16.6.3).
        // SAFETY: writing 1 clears the flag.
        timer.tifr1.write(|w| unsafe { w.bits(CAPTURE) });
        if let Some(start) = rise {
            self.measure(Record::Pulse { start, width: time.wrapping_sub(start) });
        }
    }

    fn measure(&mut self, record: Record) {
        if self.measured.push_back(record).is_err() {
            self.lost = self.lost.saturating_add(1);
        }
    }
}

/// Runs a change from the loop or a handler, without an interrupt meanwhile.
fn with<R>(change: impl FnOnce(&mut Inner, &Timer) -> R) -> R {
    // SAFETY: once `Tester::new` has started the timer, only this critical section uses it.
    let timer = unsafe { &*TC1::PTR };
    interrupt::free(|cs| change(&mut INNER.borrow(cs).borrow_mut(), timer))
}

// An edge on the servo's line.
#[avr_device::interrupt(atmega328p)]
fn TIMER1_CAPT() {
    with(Inner::capture);
}

// An event is due.
#[avr_device::interrupt(atmega328p)]
fn TIMER1_COMPA() {
    with(Inner::fire);
}

// The counter has overflowed.
#[avr_device::interrupt(atmega328p)]
fn TIMER1_OVF() {
    with(|inner, _| inner.overflows = inner.overflows.wrapping_add(1));
}
