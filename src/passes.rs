//! How often loops turn, said at the loop, for `weeder bounds`.
//!
//! A record in the ELF's section `.loop_bounds`, which takes no flash and no cycle, names a place in the loop and how often the program
//! comes by it at most. The tool takes it at its word; what it says is to be seen in the source around it.

use core::arch::{asm, global_asm};

// Nothing in the program refers to the records, so the linker is asked for them by this name (memory.x).
global_asm!(".pushsection .loop_bounds, \"\", @progbits", ".globl loop_bounds", "loop_bounds:", ".popsection");

/// The program comes by this place so often at most, each time that it comes to the innermost loop around it.
#[inline(always)]
pub fn at_most<const PASSES: u8>() {
    // SAFETY: there is no instruction in it, only a label and a record elsewhere in the ELF.
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
