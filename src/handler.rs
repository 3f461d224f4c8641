//! The entry, exit and register use that all interrupt handlers share.
//!
//! The handlers are in assembly because the encoder waits for each of them. The longest handler and the longest critical section
//! limit the wheel's speed (see `encoder`). No handler turns interrupts on, so only one runs at a time and all share the same save
//! locations: SREG in GPIOR0, r24 in GPIOR2. Each takes one cycle to save and one to restore; the stack takes two. GPIOR1 is the
//! encoder's. Bit 7 of GPIOR0 tells the loop whether a handler has run (`idle`). A handler that needs a pointer pushes Z itself. No
//! handler uses any other register, not even r1, which need not be 0 here.
//!
//! A handler's budget runs from the interrupt's response to the end of `reti`. Four cycles are the response, four
//! more after sleep, two the vector's jump, and ten this file's. `shared` and `ring` hold the data that handlers share with the loop.

/// Defines the handler of an interrupt vector from the vector's symbol, its assembly and the operands. The handler may use r24 and
/// the flags. It returns after the last line. Rarely used lines go `aside`, after the return, and jump back.
macro_rules! handler {
    (
        $(#[$about:meta])*
        $name:ident = $vector:literal { $($line:literal,)* } aside { $($aside:literal,)* }
        $($operand:ident = $kind:ident $value:expr,)*
    ) => {
        $(#[$about])*
        ///
        /// # Safety
        ///
        /// Only the chip calls it, through the vector table.
        #[unsafe(naked)]
        // SAFETY: the symbol is this interrupt's vector (data sheet, table 12-6), and no other code defines it.
        #[unsafe(export_name = $vector)]
        // Placed right after the vectors (memory.x), so that their short jump always reaches it.
        #[unsafe(link_section = ".progmem.gcc_handlers")]
        unsafe extern "C" fn $name() {
            core::arch::naked_asm!(
                "out  0x2b, r24", // GPIOR2
                "in   r24, 0x3f", // SREG
                "out  0x1e, r24", // GPIOR0
                $($line,)*
                "in   r24, 0x1e",
                "out  0x3f, r24",
                "in   r24, 0x2b",
                "reti",
                $($aside,)*
                $($operand = $kind $value,)*
            )
        }
    };
}
pub(crate) use handler;
