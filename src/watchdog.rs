//! The watchdog, used to reset the machine.
//!
//! After a watchdog reset the watchdog stays on, at its shortest period (data sheet, 11.8): it must be switched off before
//! anything that takes time, or the machine, or an old bootloader, resets for ever.

use core::arch::{asm, naked_asm};

/// Switches the watchdog off in the start-up code, before SRAM is cleared and long before `main`.
///
/// The cause of the reset moves from MCUSR, which must be cleared for the watchdog to go off, to GPIOR0.
#[unsafe(naked)]
#[unsafe(no_mangle)]
// SAFETY: .init3 is run through, not called; the code falls into the next start-up section and touches r0 and r24 alone,
// which nobody uses that early.
#[unsafe(link_section = ".init3")]
unsafe extern "C" fn switch_watchdog_off() {
    naked_asm!(
        "in r24, 0x34",  // MCUSR
        "out 0x1e, r24", // GPIOR0
        "out 0x34, r1",
        "ldi r24, 0x18", // WDCE and WDE open the four cycles in which WDE may be cleared
        "wdr",
        "sts 0x60, r24", // WDTCSR
        "sts 0x60, r1",
    )
}

/// Resets the machine.
pub fn reset() -> ! {
    avr_device::interrupt::disable();
    // SAFETY: WDTCSR belongs to nobody else; the sequence is the data sheet's (11.9.2): 16 ms from here.
    unsafe {
        asm!("wdr", "sts 0x60, {change}", "sts 0x60, {reset}", change = in(reg_upper) 0x18_u8, reset = in(reg_upper) 0x08_u8)
    };
    loop {}
}
