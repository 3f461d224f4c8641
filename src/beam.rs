//! The beam across the row on D8, and a second one on D10: every edge with the encoder's position at which it came.
//!
//! The pin-change interrupt PCINT0 stamps an edge and queues it; the loop takes it from there. A queue that is full loses
//! the edge and says so. What the edges mean is not known here, nor which beam one is of: a stamp has both levels. Low = broken.
//! This is the one file beside main.rs that looks into another peripheral's: what the handler stamps is the encoder's count.
//!
//! An edge is kept as the lower 14 bits of the count, and one for each level. The loop takes it long before the wheel has
//! turned on by half of what 14 bits hold, 8192 ticks, and so knows the rest: that is a second and a half at 10 km/h, where
//! a loop that hangs is reset after a quarter of one.
//!
//! D10 may be left open where there is no second beam: then it asks for no interrupt, and its level means nothing.

use crate::{
    encoder,
    handler::handler,
    passes,
    ring::Ring,
    shared::{Byte, Shared},
};
use avr_device::atmega328p::{EXINT, PORTB};
use control::{measure::readings::Edge, units::Position};

/// Edges that can wait for the loop, which a sensor with a response of 1 ms cannot make in less than 8 ms. No turn of the loop takes a
/// tenth of that (tests/end_to_end/turns_of_the_loop.rs); the longest that can be proved has as many edges in it as can wait.
const SLOTS: usize = 8;

/// Edges that wait for the loop: 14 bits of the count between the beams' levels, the first's below and the second's above them.
static EDGES: Ring<SLOTS> = Ring::new();
static STAMPS: [Shared<u16>; SLOTS] = [const { Shared::new(0) }; SLOTS];

/// Not 0 when an edge found no room.
static LOST: Byte = Byte::new(0);

/// The beam's bit, of port B and of a stamp.
const BEAM: u8 = 1;

/// The second beam's, of port B and of a stamp.
const SECOND_BEAM: u8 = 1 << 2;
const SECOND_STAMPED: u16 = 1 << 15;

/// The beam, as the loop sees it.
pub struct Beam<'a> {
    interrupts: &'a EXINT,
    port: &'a PORTB,
}

impl<'a> Beam<'a> {
    /// Begins to watch the beam.
    pub fn new(interrupts: &'a EXINT, port: &'a PORTB) -> Self {
        let beam = Self { interrupts, port };
        beam.watch_second(false);
        // SAFETY: bit 0 is PCIE0, and no other group of pins is watched.
        interrupts.pcicr().write(|w| unsafe { w.pcie().bits(1) });
        beam
    }

    /// Watches the second beam from now on, or no longer.
    pub fn watch_second(&self, is_there: bool) {
        let beams = if is_there { BEAM | SECOND_BEAM } else { BEAM };
        // SAFETY: these are the mask bits of PCINT0 and PCINT2.
        self.interrupts.pcmsk0().write(|w| unsafe { w.pcint().bits(beams) });
    }

    /// Whether the beam is broken now.
    pub fn is_broken(&self) -> bool {
        self.port.pinb().read().bits() & BEAM == 0
    }

    /// The edges that wait; behind them, that some found no room, if any did.
    pub fn edges(&mut self) -> impl Iterator<Item = Edge> {
        // Asked before the edges are taken: all that waited at a loss is then taken, and none of it comes behind the level that is
        // read.
        let mut lost = take_lost();
        // No more edges than can wait: those that keep coming must not keep the loop from turning.
        let mut left = SLOTS as u8;
        core::iter::from_fn(move || {
            // The edges, that some were lost, and the end.
            passes::at_most::<{ SLOTS as u8 + 2 }>();
            if left > 0 {
                left -= 1;
                if let Some(edge) = next_edge() {
                    return Some(edge);
                }
                left = 0;
            }
            core::mem::take(&mut lost).then(|| Edge::Lost { broken: self.is_broken() })
        })
    }
}

/// The oldest edge that was not taken yet.
fn next_edge() -> Option<Edge> {
    let stamp = EDGES.take(|slot| STAMPS[slot].get())?;
    let now = encoder::position();
    // Both in quarters of a tick, which leaves the sign to the machine.
    let rolled_since = ((now as u16) << 2).wrapping_sub(stamp << 1 & !3) as i16 >> 2;
    let position = Position::new(now.wrapping_sub(rolled_since.into()));
    let (broken, second_broken) = (stamp & u16::from(BEAM) == 0, stamp & SECOND_STAMPED == 0);
    Some(Edge::Seen { position, broken, second_broken })
}

/// Whether edges were lost since this was last asked.
fn take_lost() -> bool {
    let lost = LOST.get() != 0;
    if lost {
        // An edge that is lost right before this is among those that the answer tells of.
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
        "sub  r31, r30", // less as many as wait
        "cpi  r31, -{slots}",
        "breq 3f",
        "inc  r30",
        "sts  {edges}+{pushed}, r30",
        "andi r30, {mask}",
        "lsl  r30",
        "ldi  r31, 0",
        "subi r30, lo8(-({stamps}))",
        "sbci r31, hi8(-({stamps}))",
        // The stamp is twice the count and the level, which goes in from the carry; the second beam's takes the highest bit.
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

// The handler takes the beam's bit for the lowest one, of the port and of a stamp, and the second's for these.
const _: () = assert!(BEAM == 1 && SECOND_BEAM == 1 << 2 && SECOND_STAMPED == 1 << 15);
