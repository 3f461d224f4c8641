//! The loop's heartbeat: if the loop stops, this puts the tool out and resets the machine.
//!
//! The loop beats once a turn. The clock's interrupt, every 1.024 ms, counts down from the last beat. After 200 ms without a beat
//! the interrupt does not return: it commands the servo out, leaves a mark for the next start, and lets the watchdog reset the
//! machine. A panic does the same.
//!
//! The watchdog alone would leave the servo in its present position. It could also cut a pulse short, and a servo may take that for
//! a command.

use crate::{
    reset, servo,
    shared::{Byte, Shared},
    watchdog,
};
use avr_device::interrupt;
use control::{measure::reset::mark, operate::servo::HalfMicros};

/// Periods of the clock's interrupt without a beat: 200 ms, less than the watchdog's 250 ms.
const PERIODS: u8 = 195;

/// Periods left; the clock's handler counts them down. The first count-down wraps from 0 to 255, so the loop has 262 ms to start.
pub static LEFT: Byte = Byte::new(0);

/// The pulse width for "tool out"; 0 before the first beat.
static OUT: Shared<HalfMicros> = Shared::new(0);

/// The loop's beat; `out` is the pulse width for "tool out".
pub fn beat(out: HalfMicros) {
    // The time first, so that it cannot expire between the two bytes of the width.
    LEFT.set(PERIODS);
    OUT.set(out);
}

/// The loop has stopped. The clock's handler jumps here when [`LEFT`] reaches 0, with a stack and a zero in r1.
pub extern "C" fn stalled() -> ! {
    give_up(mark::LOOP_STALLED)
}

/// A panic resets the machine too. It then starts in HOLD with the tool out.
#[panic_handler]
fn panic(_: &core::panic::PanicInfo) -> ! {
    give_up(mark::PANIC)
}

/// Puts the tool out and resets the machine.
fn give_up(mark: u16) -> ! {
    interrupt::disable();
    reset::leave_mark(mark);
    // The rest takes less than the watchdog's time from here.
    watchdog::feed();
    let out = OUT.get();
    if out != 0 {
        // SAFETY: interrupts are off and this never returns, so the loop, which owns the servo, does not continue. `out` is not 0,
        // so the loop has beaten. It beats only after it has started the servo's timer.
        unsafe { servo::end_with(out) };
    }
    watchdog::reset()
}
