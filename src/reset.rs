//! The cause of a start: MCUSR, saved by the start-up code, and marks from the previous run.
//!
//! The mark is in SRAM that the start-up code does not clear. `control` interprets both. So is whether the machine was at work: a
//! program that opens the serial line resets it.

use crate::shared::Shared;
use avr_device::atmega328p::CPU;
use control::measure::reset::{Cause, mark};

#[unsafe(link_section = ".noinit")]
// SAFETY: at power-up it holds two random bytes, which are a valid number.
static MARK: Shared<u16> = Shared::new(mark::NONE);

/// Not `AT_WORK` unless the machine was at work. The check against random bytes at power-up is its length; `control` also knows the
/// cause.
#[unsafe(link_section = ".noinit")]
// SAFETY: as for `MARK`.
static WORK: Shared<u16> = Shared::new(0);
const AT_WORK: u16 = 0xC35A;

/// Whether the machine was at work when it was reset.
pub fn was_working() -> bool {
    WORK.get() == AT_WORK
}

/// Keeps over a reset whether the machine is at work.
pub fn keep(works: bool) {
    WORK.set(if works { AT_WORK } else { 0 });
}

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
