//! What every interrupt handler has in common: the way in, the way out, and the registers that it may use.
//!
//! The handlers are written in assembly, because the encoder waits for each of them: their longest, together with the
//! longest critical section, decides how fast the wheel may turn (see `encoder`). None turns interrupts on, so one runs at a
//! time, and all share what would be too little for two: SREG waits in GPIOR0 and r24 in GPIOR2, where a byte is put
//! away and fetched in a cycle each; the stack takes two. GPIOR1 is the encoder's. Whoever needs a pointer pushes Z by
//! himself, and nobody touches another register: not r1 either, which need not be 0 in here.
//!
//! A handler's budget counts from the interrupt's response to the end of its `reti`. Four cycles of it are the response, two
//! the vector's jump, and ten this file's. What a handler stores and the loop reads is in `shared` and `ring`.

/// Defines the handler of an interrupt vector, by the vector's symbol, from the lines of its assembly and their operands. It has
/// r24 and the flags to itself, and returns behind its last line. Lines that run seldom stand aside, behind the return,
/// and jump back.
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
        /// To be called by the chip, through its vector table, alone.
        #[unsafe(naked)]
        // SAFETY: the symbol is that of this interrupt's vector (data sheet, table 12-6), and nobody else defines it.
        #[unsafe(export_name = $vector)]
        // The first section behind the vectors in avr-gcc's linker script: they reach it by the short jump, however much
        // else there is.
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
