//! What the stack has left: SRAM is painted before `main`, and the loop looks how far the paint is still whole.
//!
//! The stack grows down towards the static data and wipes the paint off. A look at all of it would take the loop a
//! millisecond, so it looks at one byte a turn, from the lowest one known to be used downwards and round again. A byte
//! that the stack holds may have the paint's colour by chance; the one beyond it has not, and tells a round later at
//! the latest.

use core::{arch::naked_asm, ptr};

/// The paint, which is also what the virtual Uno fills SRAM with at power-up.
const PAINT: u8 = 0xC5;

unsafe extern "C" {
    /// The end of all static data, .noinit included; from avr-gcc's linker script.
    static _end: u8;
}

/// The stack pointer behind the start-up code: the last byte of SRAM (RAMEND).
const SRAM_LAST: usize = 0x08FF;

/// Paints all SRAM behind the static data in the start-up code: the stack is empty then.
#[unsafe(naked)]
#[unsafe(no_mangle)]
// SAFETY: .init8 is run through, not called; the code falls into .init9, which calls `main`. The stack is empty, so no byte
// of it matters, and the registers that it changes are nobody's before `main`.
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

/// What is known of the stack's paint. Both are bytes counted from the static data's end.
pub struct Stack {
    /// Below it, no byte was found used.
    free: u16,
    /// Where the next look goes is the byte below.
    probe: u16,
}

impl Stack {
    /// The stack, of which nothing is known yet; it is after as many calls of [`free`](Self::free) as it has bytes.
    pub fn new() -> Self {
        let free = (SRAM_LAST + 1 - start()) as u16;
        Self { free, probe: free }
    }

    /// Looks at one more byte and tells how many were never used, as far as is known.
    pub fn free(&mut self) -> u16 {
        if self.probe == 0 {
            self.probe = self.free;
        }
        if let Some(probe) = self.probe.checked_sub(1) {
            self.probe = probe;
            let place = ptr::with_exposed_provenance::<u8>(start() + usize::from(probe));
            // SAFETY: the byte lies between the static data and the end of SRAM. It is read and nothing else, by one
            // instruction, and any value will do.
            let byte = unsafe { place.read_volatile() };
            if byte != PAINT {
                self.free = probe;
            }
        }
        self.free
    }
}

/// The address of the first byte behind the static data.
fn start() -> usize {
    (&raw const _end).expose_provenance()
}
