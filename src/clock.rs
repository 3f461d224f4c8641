//! The clock: Timer0 in steps of 4 us, extended to 32 bits by its overflow interrupt.
//!
//! Timer0 counts freely with a prescaler of 64 (data sheet, 15.9) and overflows every 1.024 ms. The interrupt counts the overflows
//! up and the heartbeat down. The clock wraps after 4.77 hours; `control` allows for that.

use crate::{
    handler::handler,
    heartbeat,
    shared::{Byte, Shared},
};
use avr_device::{atmega328p::TC0, interrupt};
use control::units::Instant;

/// Overflows since power-up, modulo 2^24: the lowest byte, and the others.
static OVERFLOWS_LOW: Byte = Byte::new(0);
static OVERFLOWS_HIGH: Shared<u16> = Shared::new(0);

/// The running clock.
pub struct Clock(TC0);

impl Clock {
    /// Starts the clock.
    pub fn new(timer: TC0) -> Self {
        timer.tccr0b.write(|w| w.cs0().prescale_64());
        timer.timsk0.write(|w| w.toie0().set_bit());
        Self(timer)
    }

    /// The time.
    pub fn now(&self) -> Instant {
        let (high, low, steps, flags) = interrupt::free(|_| {
            (OVERFLOWS_HIGH.get(), OVERFLOWS_LOW.get(), self.0.tcnt0.read().bits(), self.0.tifr0.read())
        });
        // An overflow during these reads is still pending. It counts if the steps were read after it, which a small number shows.
        let is_pending = flags.tov0().bit_is_set() && steps < 128;
        let (low, carry) = low.overflowing_add(is_pending.into());
        let high = high.wrapping_add(carry.into());
        Instant::new(u32::from(high) << 16 | u32::from(u16::from_le_bytes([steps, low])))
    }
}

handler! {
    /// Timer0 has overflowed: 28 cycles, up to 42 if the upper bytes change, while the loop runs.
    on_overflow = "__vector_16" {
        "lds  r24, {left}",
        "dec  r24",
        "sts  {left}, r24",
        "breq 3f",
        "lds  r24, {low}",
        "inc  r24",
        "sts  {low}, r24",
        "breq 4f",
        "2:",
    }
    aside {
        // The loop has stopped. This branch never returns. The code that it jumps to needs only a stack, and a zero in r1.
        "3:",
        "clr  r1",
        "jmp  {stalled}",
        // The lowest byte has wrapped: increment the upper two.
        "4:",
        "lds  r24, {high}",
        "inc  r24",
        "sts  {high}, r24",
        "brne 2b",
        "lds  r24, {high}+1",
        "inc  r24",
        "sts  {high}+1, r24",
        "rjmp 2b",
    }
    low = sym OVERFLOWS_LOW,
    high = sym OVERFLOWS_HIGH,
    left = sym heartbeat::LEFT,
    stalled = sym heartbeat::stalled,
}
