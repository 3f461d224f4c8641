//! The entry, exit and register use that all interrupt handlers share.
//!
//! # How it works
//!
//! The encoder waits for each handler. So the longest handler and the longest critical section limit the wheel's speed
//! (see `encoder`). This is why the handlers are in assembly.
//!
//! No handler turns interrupts on. So only one runs at a time, and all share the same save locations: SREG in GPIOR0,
//! r24 in GPIOR2. A save there takes one cycle, and a restore one. On the stack each takes two. A handler that needs a
//! pointer pushes Z itself. No handler uses any other register, not even r1, which need not be 0 here.
//!
//! The encoder keeps its state in GPIOR1. Bit 7 of GPIOR0 tells the loop whether a handler has run (`idle`). `shared`
//! and `ring` hold the data that handlers share with the loop.
//!
//! A handler's budget (`handler_cycles` in budgets.toml) runs from the interrupt's response to the end of `reti`. Every
//! handler spends these cycles of it:
//!
//! | part | cycles |
//! | --- | ---: |
//! | response of the chip | 4 |
//! | wake-up, only after sleep | 4 |
//! | jump in the vector table | 2 |
//! | save and restore of r24 and SREG, in this file | 6 |
//! | `reti`, in this file | 4 |
//! | sum | 20, without sleep 16 |
//!
//! # Limits
//!
//! - A handler that turns interrupts on could lose the saved SREG and r24 to the next handler. `weeder bounds` refuses
//!   such a program.
//! - `weeder bounds` proves the cycles from the ELF, and the virtual Uno measures them. No real board has shown them.

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
