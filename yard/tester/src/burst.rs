//! Bursts: a pattern of levels on port C, faster than an interrupt can output it.
//!
//! The steps are timed in cycles with interrupts off, so nothing is measured or received meanwhile. A step takes
//! `message::step_cycles`, and the last one of a pattern `REPEAT_CYCLES` more.

use avr_device::interrupt;
use core::arch::asm;
use tester_core::message::{REPEAT_CYCLES, Step, step_cycles};

/// Plays these steps `repeats` times from `levels`, each delay longer by `slower`. Returns the levels at the end.
pub fn play(steps: &[Step], repeats: u16, slower: u8, mut levels: u8) -> u8 {
    if steps.is_empty() || steps.len() > u8::MAX.into() || repeats == 0 {
        return levels;
    }
    let count = steps.len() as u8;
    // SAFETY: X reads exactly `count` steps of two bytes each before it returns to the first. Port C (0x08) belongs to `lines` and
    // has no invalid level. Interrupts are off, and all registers and flags are declared.
    interrupt::free(|_| unsafe {
        asm!(
            "1:",
            "movw r26, {first}", // X
            "mov {left}, {count}",
            "2:",
            "ld {delay}, X+",
            "ld {toggle}, X+",
            "add {delay}, {slower}",
            "3:",
            "dec {delay}",
            "brne 3b",
            "eor {levels}, {toggle}",
            "nop",
            "out 0x08, {levels}",
            "dec {left}",
            "brne 2b",
            "nop",
            "sbiw {repeats}, 1",
            "brne 1b",
            first = in(reg_pair) steps.as_ptr(),
            count = in(reg) count,
            slower = in(reg) slower,
            left = out(reg) _,
            delay = out(reg) _,
            toggle = out(reg) _,
            levels = inout(reg) levels,
            repeats = inout(reg_iw) repeats => _,
            out("r26") _,
            out("r27") _,
        );
    });
    levels
}

// Two loads of two cycles, the sum, minus one for the delay's last turn. Four for levels and count, two to repeat. After the last
// step: minus one to continue, and 1 + 2 + 2 to restart with 1 + 1. The `nop` makes 55 cycles possible, the proved rate.
const _: () = assert!(step_cycles(1) == 2 + 2 + 1 + 3 - 1 + 4 + 2 && REPEAT_CYCLES == 1 + 2 + 2 + 1 + 1 - 1);

// The assembly reads `delay` first, then `toggle`.
const _: () = assert!(
    size_of::<Step>() == 2 && core::mem::offset_of!(Step, delay) == 0 && core::mem::offset_of!(Step, toggle) == 1
);
