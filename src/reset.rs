//! Why the machine started: MCUSR, kept by the start-up code, and a mark that one run leaves for the next.
//!
//! The mark lies in SRAM that the start-up code leaves alone. What both mean is worked out in `control`.

use crate::shared::Shared;
use avr_device::atmega328p::CPU;
use control::measure::reset::{Cause, mark};

#[unsafe(link_section = ".noinit")]
// SAFETY: at power-up it holds any two bytes, which are a number.
static MARK: Shared<u16> = Shared::new(mark::NONE);

/// What started the machine; to be asked once, because it takes the mark away, and with interrupts off, because their handlers use
/// GPIOR2 for something else.
pub fn cause(cpu: &CPU) -> Cause {
    let left = MARK.get();
    leave_mark(mark::NONE);
    // GPIOR2, where the start-up code has put MCUSR before it cleared it.
    Cause::of(cpu.gpior2().read().bits(), left)
}

/// Leaves a mark for the next start.
pub fn leave_mark(mark: u16) {
    MARK.set(mark);
}
