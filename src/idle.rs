//! Sleep between turns: the loop starts a turn for each interrupt, and sleeps when none has come since the turn began.
//!
//! In idle mode (data sheet, 10.3) only the processor stops. Every interrupt wakes it, the clock's after 1.024 ms at most. A change that
//! no interrupt reports, such as the work switch, is seen within that time. The handlers save SREG in GPIOR0 with the interrupt flag clear
//! (`handler`), so its bit 7 stays set only if none has run.

use avr_device::atmega328p::CPU;
use core::arch::asm;

/// Allows sleep, in idle mode.
pub fn allow(cpu: &CPU) {
    cpu.smcr.write(|w| w.se().set_bit());
}

/// Notes that a turn begins.
pub fn begin_turn() {
    // SAFETY: outside of handlers, only this file uses GPIOR0, and a handler in between leaves the bit clear, which is right too.
    unsafe { asm!("sbi 0x1e, 7", options(nostack, preserves_flags)) };
}

/// Sleeps until the next interrupt, if none has come since the turn began. The instruction after `sei` comes before any interrupt (data
/// sheet, 7.7), so one that comes after the question ends the sleep.
pub fn sleep() {
    // SAFETY: the instructions change no register and no memory. The loop calls it with interrupts on, as they are left, and the clock
    // ends the sleep.
    unsafe { asm!("cli", "sbis 0x1e, 7", "rjmp 0f", "sei", "sleep", "0: sei", options(nostack, preserves_flags)) };
}
