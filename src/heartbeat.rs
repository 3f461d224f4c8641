//! The loop's heartbeat: where it stops, the tool is put out, and then the machine reset.
//!
//! The loop beats once a turn; the clock's interrupt, every 1.024 ms, counts down from the last beat. Where 200 ms pass
//! without one, the interrupt does not return: it has the servo take the pulse for out, leaves a mark for the next
//! start and has the watchdog reset the machine. A panic ends in the same way.
//!
//! The watchdog alone would leave the servo where the tool happens to be, and could cut a pulse short, which a servo may
//! take for a command.

use crate::{
    reset, servo,
    shared::{Byte, Shared},
    watchdog,
};
use avr_device::interrupt;
use control::{measure::reset::mark, operate::servo::HalfMicros};

/// Periods of the clock's interrupt that may pass without a beat: 200 ms. The watchdog's 250 ms come after them.
const PERIODS: u8 = 195;

/// Periods left, which the clock's handler counts down. The first count-down goes from 0 round to 255, so the loop has 262 ms to
/// begin.
pub static LEFT: Byte = Byte::new(0);

/// The pulse width that has the tool out; 0 before the first beat.
static OUT: Shared<HalfMicros> = Shared::new(0);

/// The loop turns; `out` is the pulse width that has the tool out.
pub fn beat(out: HalfMicros) {
    // First the time, so that it cannot run out between the two bytes of the width.
    LEFT.set(PERIODS);
    OUT.set(out);
}

/// The loop stands still, and so does everything from here on: the clock's handler jumps here when it has counted
/// [`LEFT`] down to 0, with a stack and a zero in r1.
pub extern "C" fn stalled() -> ! {
    give_up(mark::LOOP_STALLED)
}

/// A panic is a fault like any other: the machine is reset, and wakes up in HOLD with the tool out.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    give_up(mark::PANIC)
}

/// Puts the tool out and resets the machine.
fn give_up(mark: u16) -> ! {
    interrupt::disable();
    reset::leave_mark(mark);
    // The time that this takes is less than the watchdog's, counted from here.
    watchdog::feed();
    let out = OUT.get();
    if out != 0 {
        // SAFETY: interrupts are off and this never returns, so the servo's owner, the loop, does not go on. It has
        // beaten, which it does behind the servo's start.
        unsafe { servo::end_with(out) };
    }
    watchdog::reset()
}
