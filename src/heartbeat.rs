//! The loop's heartbeat: who stops turning has the tool put out, and then the machine reset.
//!
//! The loop beats once a turn; the clock's interrupt, every 1.024 ms, counts down from the last beat. Where 200 ms pass
//! without one, it gives the servo the pulse for out, leaves a mark for the next start and never returns: nothing can
//! feed the watchdog any more, which lets the servo a frame or two to take the pulse and then resets the machine.
//! What the watchdog alone would do is to leave the servo without a signal where the tool happens to be.

use crate::{
    reset, servo,
    shared::{Byte, Shared},
};
use control::{reset::mark, servo::HalfMicros};
use core::arch::asm;

/// Periods of the clock's interrupt that may pass without a beat: 200 ms. The watchdog's 250 ms come after them.
const PERIODS: u8 = 195;

/// Periods left. The first count-down goes from 0 round to 255, so the loop has 262 ms to begin.
static LEFT: Byte = Byte::new(0);

/// The pulse width that has the tool out.
static OUT: Shared<HalfMicros> = Shared::new(0);

/// The loop turns; `out` is the pulse width that has the tool out.
pub fn beat(out: HalfMicros) {
    // First the time, so that it cannot run out between the two bytes of the width.
    LEFT.set(PERIODS);
    OUT.set(out);
}

/// Another period has passed; called by the clock's interrupt handler.
#[inline(always)]
pub fn count_down() {
    let left = LEFT.get().wrapping_sub(1);
    LEFT.set(left);
    if left == 0 {
        // A call would have the handler save every time what the callee may change, and so would the word that there
        // is no return. There is none.
        // SAFETY: `stalled` needs a stack, which the handler has, and a zero in r1; nothing behind this is ever run.
        unsafe { asm!("clr r1", "jmp {stalled}", stalled = sym stalled) }
    }
}

/// The loop stands still, and so does everything from here on, until the watchdog resets the machine.
extern "C" fn stalled() -> ! {
    // SAFETY: this runs in an interrupt handler and never returns, so the servo's owner, the loop, does not go on.
    unsafe { servo::take_over(OUT.get()) };
    reset::leave_mark(mark::LOOP_STALLED);
    loop {
        core::hint::spin_loop();
    }
}
