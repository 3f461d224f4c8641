//! The watchdog: resets a machine whose loop no longer turns, which then wakes up in HOLD with the tool out.
//!
//! After a watchdog reset the watchdog stays on, at its shortest period (data sheet, 11.8): it must be switched off before
//! anything that takes time, or the machine, or an old bootloader, resets for ever.

use avr_device::interrupt;
use core::arch::{asm, naked_asm};

/// WDTCSR: allow a change within the next four cycles.
const ALLOW_CHANGE: u8 = 0x18;

/// WDTCSR: reset after 16 ms.
const RESET_SOON: u8 = 0x08;

/// WDTCSR: reset after 250 ms, many times the loop's longest turn.
const RESET_LATER: u8 = 0x0C;

/// Switches the watchdog off in the start-up code, before SRAM is cleared and long before `main`.
///
/// MCUSR is cleared first: while it tells of a watchdog reset, the watchdog cannot go off. GPIOR2 keeps what it told
/// until `reset::cause` has read it, before the first interrupt.
#[unsafe(naked)]
#[unsafe(no_mangle)]
// SAFETY: .init3 is run through, not called; the code falls into the next start-up section and changes r24 alone,
// which nobody uses that early; r1 is 0 since .init2.
#[unsafe(link_section = ".init3")]
unsafe extern "C" fn switch_watchdog_off() {
    naked_asm!(
        "in  r24, 0x34", // MCUSR
        "out 0x2b, r24", // GPIOR2
        "out 0x34, r1",
        "ldi r24, 0x18", // WDCE and WDE open the four cycles in which WDE may be cleared
        "wdr",
        "sts 0x60, r24", // WDTCSR
        "sts 0x60, r1",
    )
}

/// Starts the watchdog: from here on it must be fed every 250 ms.
pub fn start() {
    set(RESET_LATER);
}

/// Tells the watchdog that the loop turns.
pub fn feed() {
    // SAFETY: the instruction touches nothing but the watchdog's counter.
    unsafe { asm!("wdr") };
}

/// Resets the machine.
pub fn reset() -> ! {
    interrupt::disable();
    set(RESET_SOON);
    // The new time counts from here, whatever had passed of the old one.
    feed();
    loop {
        core::hint::spin_loop();
    }
}

fn set(control: u8) {
    interrupt::free(|_| {
        // SAFETY: WDTCSR (0x60) belongs to this file alone; the two writes follow each other within four cycles, which
        // no interrupt can stretch in here (11.9.2).
        unsafe {
            asm!(
                "wdr",
                "sts 0x60, {allow}",
                "sts 0x60, {control}",
                allow = in(reg_upper) ALLOW_CHANGE,
                control = in(reg_upper) control,
            );
        }
    });
}
