//! The beam across the row on D8: every edge with the encoder's position at which it came.
//!
//! The pin-change interrupt PCINT0 stamps an edge and queues it; the loop takes it from there. A queue that is full loses
//! the edge and says so. What the edges mean is not known here. Low = broken.

use crate::handover::Handover;
use avr_device::{
    atmega328p::{EXINT, PORTB, portb},
    interrupt,
};
use core::sync::atomic::{AtomicBool, Ordering};
use heapless::spsc::{Consumer, Producer, Queue};

/// Position and level of an edge: the beam is broken from here on, or clear.
pub type Edge = (i32, bool);

/// Edges that wait for the loop: a turn of the loop is shorter than the sensor's 1 ms, so that more than one already
/// means dust.
pub type EdgeQueue = Queue<Edge, 16>;

static QUEUE: Handover<Producer<'static, Edge>> = Handover::new();
static LOST: AtomicBool = AtomicBool::new(false);

/// The beam, as the loop sees it.
pub struct Beam<'a> {
    port: &'a portb::RegisterBlock,
    edges: Consumer<'static, Edge>,
}

impl<'a> Beam<'a> {
    /// Begins to watch the beam.
    pub fn new(interrupts: &EXINT, port: &'a PORTB, queue: &'static mut EdgeQueue) -> Self {
        let (producer, edges) = queue.split();
        interrupt::free(|cs| QUEUE.give(cs, producer));
        // SAFETY: this is the mask bit of PCINT0.
        interrupts.pcmsk0().write(|w| unsafe { w.pcint().bits(1) });
        // SAFETY: bit 0 is PCIE0; the other bits are kept.
        interrupts.pcicr().modify(|r, w| unsafe { w.pcie().bits(r.pcie().bits() | 1) });
        Self { port, edges }
    }

    /// Whether the beam is broken now.
    pub fn is_broken(&self) -> bool {
        self.port.pinb().read().pb0().bit_is_clear()
    }

    /// The oldest edge that was not taken yet.
    pub fn next_edge(&mut self) -> Option<Edge> {
        self.edges.dequeue()
    }

    /// Whether edges were lost since this was last asked.
    pub fn take_lost(&mut self) -> bool {
        let lost = LOST.load(Ordering::Relaxed);
        if lost {
            LOST.store(false, Ordering::Relaxed);
        }
        lost
    }
}

/// The beam's level changed, at `position`.
///
/// # Safety
/// To be called by the handler of PCINT0 alone.
pub unsafe fn on_change(position: i32) {
    // SAFETY: PINB is only read here, which has no side effect on anybody.
    let broken = unsafe { (*PORTB::ptr()).pinb().read().pb0().bit_is_clear() };
    // SAFETY: the caller is the handler that owns the producer.
    unsafe {
        QUEUE.with(|queue| {
            if queue.enqueue((position, broken)).is_err() {
                LOST.store(true, Ordering::Relaxed);
            }
        });
    }
}
