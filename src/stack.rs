//! The free stack: start-up code paints SRAM, and the loop checks how much of the paint is left.
//!
//! The stack grows down towards the static data and overwrites the paint. A full check would take the loop a millisecond, so each
//! turn checks one byte: downwards from the lowest byte known as used, and then again from there. A used byte may have the paint's
//! value by chance. The next used byte below it then shows the use, at most one round later.

use core::{arch::naked_asm, ptr};

/// The paint. The virtual Uno fills SRAM with the same value at power-up.
const PAINT: u8 = 0xC5;

unsafe extern "C" {
    /// The end of all static data with .noinit, from memory.x.
    static _end: u8;
}

/// The stack pointer after start-up: the last byte of SRAM (RAMEND).
const SRAM_LAST: usize = 0x08FF;

/// Paints all SRAM after the static data during start-up, while the stack is empty.
#[unsafe(naked)]
#[unsafe(no_mangle)]
// SAFETY: execution runs through .init8 into .init9, which calls `main`; it is not called. The stack is empty, so it overwrites
// nothing, and no code uses its registers before `main`.
#[unsafe(link_section = ".init8")]
unsafe extern "C" fn paint_stack() {
    naked_asm!(
        "ldi  r26, lo8(_end)",
        "ldi  r27, hi8(_end)",
        "ldi  r24, {paint}",
        "ldi  r25, hi8({last}+1)",
        "1:",
        "st   X+, r24",
        "cpi  r26, lo8({last}+1)",
        "cpc  r27, r25",
        "brne 1b",
        paint = const PAINT,
        last = const SRAM_LAST,
    )
}

/// The known use of the stack, in bytes from the end of the static data.
pub struct Stack {
    /// No byte below this one is known as used.
    free: u16,
    /// The next check reads the byte below this one.
    probe: u16,
}

impl Stack {
    /// A stack before its first check. A complete round takes as many calls of [`free`](Self::free) as it has bytes.
    pub fn new() -> Self {
        let free = (SRAM_LAST + 1 - start()) as u16;
        Self { free, probe: free }
    }

    /// Checks one more byte. Returns the number of bytes never used, as far as is known.
    pub fn free(&mut self) -> u16 {
        if self.probe == 0 {
            self.probe = self.free;
        }
        if let Some(probe) = self.probe.checked_sub(1) {
            self.probe = probe;
            let place = ptr::with_exposed_provenance::<u8>(start() + usize::from(probe));
            // SAFETY: the byte lies between the static data and the end of SRAM. One instruction reads it, and any value is valid.
            let byte = unsafe { place.read_volatile() };
            if byte != PAINT {
                self.free = probe;
            }
        }
        self.free
    }
}

/// The address of the first byte after the static data.
fn start() -> usize {
    (&raw const _end).expose_provenance()
}
