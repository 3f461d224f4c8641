//! The beam across the row on D8: every edge with the encoder's position at which it came.
//!
//! The pin-change interrupt PCINT0 stamps an edge and queues it; the loop takes it from there. A queue that is full loses
//! the edge and says so. What the edges mean is not known here. Low = broken. This is the one file beside main.rs that
//! uses another peripheral's: what the handler stamps is the encoder's count.

use crate::encoder;
use avr_device::{
    atmega328p::{EXINT, PORTB, portb},
    interrupt::{self, CriticalSection, Mutex},
};
use core::cell::{Cell, RefCell};
use heapless::spsc::Queue;

/// Position and level of an edge: the beam is broken from here on, or clear.
pub type Edge = (i32, bool);

/// Edges that wait for the loop: 15 of them, which a sensor with a response of 1 ms cannot make in less than 15 ms.
static EDGES: Mutex<RefCell<Queue<Edge, 16>>> = Mutex::new(RefCell::new(Queue::new()));
static LOST: Mutex<Cell<bool>> = Mutex::new(Cell::new(false));

/// The beam, as the loop sees it.
pub struct Beam<'a>(&'a portb::RegisterBlock);

impl<'a> Beam<'a> {
    /// Begins to watch the beam.
    pub fn new(interrupts: &EXINT, port: &'a PORTB) -> Self {
        // SAFETY: this is the mask bit of PCINT0.
        interrupts.pcmsk0().write(|w| unsafe { w.pcint().bits(1) });
        // SAFETY: bit 0 is PCIE0; the other bits are kept.
        interrupts.pcicr().modify(|r, w| unsafe { w.pcie().bits(r.pcie().bits() | 1) });
        Self(port)
    }

    /// Whether the beam is broken now.
    pub fn is_broken(&self) -> bool {
        self.0.pinb().read().pb0().bit_is_clear()
    }

    /// The oldest edge that was not taken yet.
    pub fn next_edge(&mut self) -> Option<Edge> {
        interrupt::free(|cs| EDGES.borrow(cs).borrow_mut().dequeue())
    }

    /// Whether edges were lost since this was last asked.
    pub fn take_lost(&mut self) -> bool {
        interrupt::free(|cs| LOST.borrow(cs).replace(false))
    }
}

// The beam's level changed.
#[avr_device::interrupt(atmega328p)]
fn PCINT0() {
    // SAFETY: the chip turns interrupts off while a handler runs, and this one does not turn them on.
    let cs = unsafe { CriticalSection::new() };
    let position = encoder::position(cs);
    // SAFETY: PINB is only read here, which has no side effect on anybody.
    let broken = unsafe { (*PORTB::ptr()).pinb().read().pb0().bit_is_clear() };
    if EDGES.borrow(cs).borrow_mut().enqueue((position, broken)).is_err() {
        LOST.borrow(cs).set(true);
    }
}
