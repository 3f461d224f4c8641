//! The clock: Timer0 in steps of 4 us, carried on to 32 bits by its overflow interrupt.
//!
//! Timer0 counts freely behind a prescaler of 64 (data sheet, 15.9) and runs over every 1.024 ms; the interrupt counts
//! the overflows. The clock wraps after 4.77 hours, which `control` is made for.

use avr_device::{
    atmega328p::TC0,
    interrupt::{self, CriticalSection, Mutex},
};
use control::units::Instant;
use core::cell::Cell;

static OVERFLOWS: Mutex<Cell<u32>> = Mutex::new(Cell::new(0));

/// The running clock.
pub struct Clock(TC0);

impl Clock {
    /// Starts the clock.
    pub fn new(timer: TC0) -> Self {
        timer.tccr0b().write(|w| w.cs0().prescale_64());
        timer.timsk0().write(|w| w.toie0().set_bit());
        Self(timer)
    }

    /// The time.
    pub fn now(&self) -> Instant {
        let (overflows, steps) = interrupt::free(|cs| {
            let overflows = OVERFLOWS.borrow(cs).get();
            let steps = self.0.tcnt0().read().bits();
            // An overflow that happened in here waits for its interrupt; it belongs to the count when the steps were
            // read after it, which a small number tells.
            let pending = self.0.tifr0().read().tov0().bit_is_set() && steps < 128;
            (overflows.wrapping_add(u32::from(pending)), steps)
        });
        Instant::new(overflows << 8 | u32::from(steps))
    }
}

// The clock's counter ran over.
#[avr_device::interrupt(atmega328p)]
fn TIMER0_OVF() {
    // SAFETY: the chip turns interrupts off while a handler runs, and this one does not turn them on.
    let cs = unsafe { CriticalSection::new() };
    let overflows = OVERFLOWS.borrow(cs);
    overflows.set(overflows.get().wrapping_add(1));
}
