//! The cause of a start: MCUSR, saved by the start-up code, and a mark from the previous run.
//!
//! The mark is in SRAM that the start-up code does not clear. `control` interprets both.

use crate::shared::Shared;
use avr_device::atmega328p::CPU;
use control::measure::reset::{Cause, mark};

#[unsafe(link_section = ".noinit")]
// SAFETY: at power-up it holds two random bytes, which are a valid number.
static MARK: Shared<u16> = Shared::new(mark::NONE);

/// The cause of this start. Called once, because it clears the mark, and with interrupts off, because the handlers overwrite
/// GPIOR2.
pub fn cause(cpu: &CPU) -> Cause {
    let left = MARK.get();
    leave_mark(mark::NONE);
    // GPIOR2 holds MCUSR: the start-up code saved it before clearing it.
    Cause::of(cpu.gpior2.read().bits(), left)
}

/// Leaves a mark for the next start.
pub fn leave_mark(mark: u16) {
    MARK.set(mark);
}
