//! Loop bounds for `weeder bounds`, written at the loop.
//!
//! A record in the ELF's section `.loop_bounds` names a point in the loop and how often it can run. The record takes no flash and
//! no cycle. The tool does not check the number; the source around it has to show it.

use core::arch::{asm, global_asm};

// No code refers to the records, so memory.x makes the linker keep them by this symbol.
global_asm!(".pushsection .loop_bounds, \"\", @progbits", ".globl loop_bounds", "loop_bounds:", ".popsection");

/// Upper bound on executions of this point for each entry to the innermost loop.
#[inline(always)]
pub fn at_most<const PASSES: u8>() {
    // SAFETY: it contains no instruction, only a label and a record in another section.
    unsafe {
        asm!(
            "7: .pushsection .loop_bounds, \"\", @progbits",
            ".long 7b, {passes}",
            ".popsection",
            passes = const PASSES,
            options(nomem, nostack, preserves_flags),
        );
    }
}
