//! The wheel encoder on D2 and D3: four counts a cycle, signed, 32 bits.
//!
//! Both channels raise one pin-change interrupt, PCINT18 and PCINT19 (data sheet, 13.2.4), which reads both levels at
//! once: two edges that come together are one interrupt, not two. The decoder is the one of `control`.

use avr_device::{
    atmega328p::{EXINT, PORTD},
    interrupt::{self, CriticalSection, Mutex},
};
use control::quadrature::{Quadrature, Step};
use core::cell::Cell;

static DECODER: Mutex<Cell<Quadrature>> = Mutex::new(Cell::new(Quadrature::new(0)));
static COUNT: Mutex<Cell<i32>> = Mutex::new(Cell::new(0));
static LOST: Mutex<Cell<u16>> = Mutex::new(Cell::new(0));

/// Begins to count, from where the channels now stand.
pub fn watch(interrupts: &EXINT, port: &PORTD) {
    interrupt::free(|cs| {
        DECODER
            .borrow(cs)
            .set(Quadrature::new(channels(port.pind().read().bits())))
    });
    // SAFETY: these are the mask bits of PCINT18 and PCINT19.
    interrupts
        .pcmsk2()
        .write(|w| unsafe { w.pcint().bits(1 << 2 | 1 << 3) });
    // SAFETY: bit 2 is PCIE2; the other bits are kept.
    interrupts
        .pcicr()
        .modify(|r, w| unsafe { w.pcie().bits(r.pcie().bits() | 1 << 2) });
}

/// The position and the ticks known to be lost, from the loop.
pub fn position_and_lost() -> (i32, u16) {
    interrupt::free(|cs| (position(cs), LOST.borrow(cs).get()))
}

/// The position.
pub fn position(cs: CriticalSection) -> i32 {
    COUNT.borrow(cs).get()
}

/// A channel changed.
pub fn on_change(cs: CriticalSection) {
    // SAFETY: PIND is only read here, which has no side effect on anybody.
    let levels = unsafe { (*PORTD::ptr()).pind().read().bits() };
    let mut decoder = DECODER.borrow(cs).get();
    let step = decoder.step(channels(levels));
    DECODER.borrow(cs).set(decoder);
    match step {
        Step::Ticks(ticks) => {
            let count = COUNT.borrow(cs);
            count.set(count.get().wrapping_add(i32::from(ticks)));
        }
        Step::Lost => {
            let lost = LOST.borrow(cs);
            lost.set(lost.get().saturating_add(2));
        }
    }
}

/// A (PD2) in bit 1 and B (PD3) in bit 0.
const fn channels(port: u8) -> u8 {
    (port >> 1 & 0b10) | (port >> 3 & 0b01)
}
