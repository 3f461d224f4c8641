//! The beam across the row on D8, and a second one on D10: each edge with the encoder's position at that moment.
//!
//! # How it works
//!
//! A beam's edge calls the handler of the pin-change interrupt PCINT0. The handler stamps the edge and queues it; the
//! loop takes it. If the queue is full, the handler drops the edge and reports that.
//!
//! A stamp has the lower 14 bits of the encoder's count, and one bit for each beam's level. Low is broken. The loop
//! restores the upper bits from the present count.
//!
//! Apart from main.rs, this is the only file that uses another peripheral's data: the encoder's count.
//!
//! D10 may be open if there is no second beam. The loop then turns its interrupt off, and the controller ignores its
//! level.
//!
//! # Limits
//!
//! - This file does not interpret edges. It does not tell which beam an edge belongs to: a stamp has both levels.
//! - The loop can restore a count until the wheel has turned by 8192 ticks. That is half the range of 14 bits. With the
//!   default wheel it takes 1.5 s at 10 km/h. The watchdog resets a stopped loop after a quarter of a second.
//! - The handler stamps the count when it runs, not when the edge comes. `weeder bounds` proves the longest wait
//!   (vector 3).
//! - A torn wire looks like bare ground. Only an optocoupler or a second beam shows it (docs/safety.md).
//! - The queue's length assumes a sensor with a response of 1 ms, and turns as short as simulated. No real board has
//!   shown either.

use crate::{
    encoder,
    handler::handler,
    ring::Ring,
    shared::{Byte, Shared},
};
use avr_device::atmega328p::{EXINT, PORTB};
use control::{measure::readings::Edge, units::Position};

/// Edges in the queue. A sensor with a response of 1 ms needs at least 8 ms for these. A turn of the loop takes less than a tenth
/// of that (tests/end_to_end/turns_of_the_loop.rs). The longest proved turn sees as many edges as the queue holds.
pub const SLOTS: usize = 8;

/// The queue of stamps: the first beam's level in bit 0, 14 bits of the count, the second beam's level in bit 15.
static EDGES: Ring<SLOTS> = Ring::new();
static STAMPS: [Shared<u16>; SLOTS] = [const { Shared::new(0) }; SLOTS];

/// Not 0 after an edge was dropped.
static LOST: Byte = Byte::new(0);

/// The first beam's bit, in port B and in a stamp.
const BEAM: u8 = 1;

/// The second beam's bit, in port B and in a stamp.
const SECOND_BEAM: u8 = 1 << 2;
const SECOND_STAMPED: u16 = 1 << 15;

/// The loop's side of the beams.
pub struct Beam<'a> {
    interrupts: &'a EXINT,
    port: &'a PORTB,
}

impl<'a> Beam<'a> {
    /// Turns on the first beam's interrupt.
    pub fn new(interrupts: &'a EXINT, port: &'a PORTB) -> Self {
        let beam = Self { interrupts, port };
        beam.watch_second(false);
        // Bit 0 is PCIE0, and no other pin group's interrupt is used.
        interrupts.pcicr.write(|w| w.pcie().bits(1));
        beam
    }

    /// Turns the second beam's interrupt on or off. Returns whether it was off and is on: its level is then yet to be told.
    pub fn watch_second(&self, is_there: bool) -> bool {
        let beams = if is_there { BEAM | SECOND_BEAM } else { BEAM };
        // The mask bits of PCINT0 and PCINT2.
        let before = self.interrupts.pcmsk0.read().bits();
        self.interrupts.pcmsk0.write(|w| w.pcint().bits(beams));
        before < beams
    }

    /// Whether the first beam and the second are broken now.
    pub fn are_broken(&self) -> (bool, bool) {
        let levels = self.port.pinb.read().bits();
        (levels & BEAM == 0, levels & SECOND_BEAM == 0)
    }
}

/// The oldest queued edge.
pub fn next_edge() -> Option<Edge> {
    let stamp = EDGES.take(|slot| STAMPS[slot].get())?;
    let now = encoder::position();
    // Both in quarters of a tick, so that the processor's sign bit is the count's.
    let rolled_since = ((now as u16) << 2).wrapping_sub(stamp << 1 & !3) as i16 >> 2;
    let position = Position::new(now.wrapping_sub(rolled_since.into()));
    let (broken, second_broken) = (stamp & u16::from(BEAM) == 0, stamp & SECOND_STAMPED == 0);
    Some(Edge::Seen { position, broken, second_broken })
}

/// Whether edges were dropped since the last call.
pub fn take_lost() -> bool {
    let lost = LOST.get() != 0;
    if lost {
        // An edge dropped just before this line belongs to the same loss.
        LOST.set(0);
    }
    lost
}

handler! {
    /// A beam's level changed: 53 cycles.
    on_change = "__vector_3" {
        "push r30",
        "push r31",
        "lds  r30, {edges}+{pushed}",
        "lds  r31, {edges}+{taken}",
        "sub  r31, r30", // minus the number waiting
        "cpi  r31, -{slots}",
        "breq 3f",
        "inc  r30",
        "sts  {edges}+{pushed}, r30",
        "andi r30, {mask}",
        "lsl  r30",
        "ldi  r31, 0",
        "subi r30, lo8(-({stamps}))",
        "sbci r31, hi8(-({stamps}))",
        // The stamp is twice the count plus the first level, shifted in from the carry. The second level becomes the highest bit.
        "in   r24, 0x03", // PINB
        "bst  r24, 2",
        "lsr  r24",
        "lds  r24, {count}",
        "rol  r24",
        "st   Z, r24",
        "lds  r24, {count}+1",
        "rol  r24",
        "bld  r24, 7",
        "std  Z+1, r24",
        "2:",
        "pop  r31",
        "pop  r30",
    }
    aside {
        "3:",
        "ldi  r24, 1",
        "sts  {lost}, r24",
        "rjmp 2b",
    }
    edges = sym EDGES,
    pushed = const Ring::<SLOTS>::PUSHED,
    taken = const Ring::<SLOTS>::TAKEN,
    mask = const Ring::<SLOTS>::MASK,
    slots = const SLOTS,
    stamps = sym STAMPS,
    count = sym encoder::COUNT_LOW,
    lost = sym LOST,
}

// The handler's assembly relies on these bits.
const _: () = assert!(BEAM == 1 && SECOND_BEAM == 1 << 2 && SECOND_STAMPED == 1 << 15);
