//! The watchdog: resets a machine whose loop has stopped. The machine then starts in HOLD with the tool out.
//!
//! After a watchdog reset the watchdog stays on with its shortest period (data sheet, 11.8). Start-up code must switch it off at
//! once, or the machine, or an old bootloader, resets for ever.

use avr_device::interrupt;
use core::arch::{asm, naked_asm};

/// WDTCSR: allows a change within the next four cycles.
const ALLOW_CHANGE: u8 = 0x18;

/// WDTCSR: reset after 16 ms.
const RESET_SOON: u8 = 0x08;

/// WDTCSR: reset after 250 ms, much longer than any turn of the loop.
const RESET_LATER: u8 = 0x0C;

/// Switches the watchdog off during start-up, before SRAM is cleared.
///
/// MCUSR is cleared first, because its watchdog flag keeps the watchdog on. GPIOR2 keeps its value for `reset::cause`, until the
/// first interrupt.
#[unsafe(naked)]
#[unsafe(no_mangle)]
// SAFETY: execution runs through .init3 into the next start-up section; it is not called. It changes r24 only, which no code uses
// that early. r1 is 0 since .init2.
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

/// Starts the watchdog: the loop must feed it every 250 ms. Called before interrupts are turned on.
pub fn start() {
    set(RESET_LATER);
}

/// Restarts the watchdog's time.
pub fn feed() {
    // SAFETY: the instruction changes only the watchdog's counter.
    unsafe { asm!("wdr") };
}

/// Resets the machine.
pub fn reset() -> ! {
    interrupt::disable();
    set(RESET_SOON);
    // Restarts the time, so that the new period counts from here.
    feed();
    loop {
        core::hint::spin_loop();
    }
}

/// Sets the control register, with interrupts off: none may delay the second write.
fn set(control: u8) {
    // SAFETY: only this file uses WDTCSR (0x60). The two writes are within four cycles (data sheet, 11.9.2), because both callers have
    // interrupts off.
    unsafe {
        asm!(
            "wdr",
            "sts 0x60, {allow}",
            "sts 0x60, {control}",
            allow = in(reg_upper) ALLOW_CHANGE,
            control = in(reg_upper) control,
        );
    }
}
