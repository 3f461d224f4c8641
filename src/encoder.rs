//! The wheel encoder on D2 and D3: four counts a cycle, signed, 32 bits.
//!
//! Both channels raise one pin-change interrupt, PCINT18 and PCINT19 (data sheet, 13.2.4), which reads both levels at
//! once: two edges that come together are one interrupt, not two. How often it can run decides how fast the wheel may
//! turn, so its handler is written in assembly: it looks the step up in a table and adds it to the count, and goes on to
//! the count's upper bytes only when they change. The table is the decoder of `control`, worked out by the compiler for
//! every state and every pair of levels, so there is no second decoder that could differ from it.

use avr_device::{
    atmega328p::{CPU, EXINT, PORTD},
    interrupt::{self, CriticalSection},
};
use control::quadrature::{Quadrature, Step};
use core::{arch::naked_asm, cell::UnsafeCell};

/// What the handler and the loop share. Only whole critical sections and the handler touch it.
#[repr(transparent)]
struct Shared<T>(UnsafeCell<T>);

// SAFETY: the loop reads inside critical sections, and the handler cannot be interrupted.
unsafe impl<T> Sync for Shared<T> {}

impl<T: Copy> Shared<T> {
    const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    fn get(&self, _: CriticalSection) -> T {
        // SAFETY: with interrupts off, as the argument shows, the handler does not write.
        unsafe { self.0.get().read_volatile() }
    }
}

static COUNT: Shared<i32> = Shared::new(0);
/// Ticks lost in jumps that nothing resolved, modulo 65,536.
static LOST: Shared<u16> = Shared::new(0);

/// The decoder's memory, in GPIOR1, where the handler reaches it in a cycle: the channels' last levels in bits 0 (A) and
/// 1 (B), the last step's direction in bits 4 and 5. The new levels come from the port in bits 2 and 3, right between,
/// and all six together are the place in the table.
mod state {
    pub const LEVELS: u8 = 0b11;
    pub const DIRECTION_SHIFT: u8 = 4;
    /// Set in a table entry, never in the memory: ticks were lost.
    pub const LOST: u8 = 0x80;
}

/// For each memory and each new pair of levels: the new memory, and the step in ticks.
type Table = [[u8; 2]; 64];

/// The table in flash, to be read by LPM alone.
#[unsafe(link_section = ".progmem.data")]
// SAFETY: nothing but the handler's assembly refers to it, and that reads it from flash.
static TABLE: Table = table();

const fn table() -> Table {
    let mut table = [[0; 2]; 64];
    let mut index = 0;
    while index < table.len() {
        let last = index as u8 & state::LEVELS;
        let new = index as u8 >> 2 & state::LEVELS;
        let direction = match index as u8 >> state::DIRECTION_SHIFT {
            1 => 1,
            2 => -1,
            _ => 0,
        };
        let mut decoder = Quadrature::moving(channels(last), direction);
        let (lost, ticks) = match decoder.step(channels(new)) {
            Step::Ticks(ticks) => (0, ticks),
            Step::Lost => (state::LOST, 0),
        };
        let direction = match decoder.direction() {
            1 => 1,
            -1 => 2,
            _ => 0,
        };
        table[index] = [new | direction << state::DIRECTION_SHIFT | lost, ticks as u8];
        index += 1;
    }
    table
}

/// Levels with A in bit 0 and B in bit 1, as the port has them, as the decoder wants them.
const fn channels(levels: u8) -> u8 {
    (levels & 1) << 1 | levels >> 1 & 1
}

/// Begins to count, from where the channels now stand.
pub fn watch(interrupts: &EXINT, port: &PORTD, cpu: &CPU) {
    let levels = port.pind().read().bits() >> 2 & state::LEVELS;
    cpu.gpior1().write(|w| w.set(levels));
    // SAFETY: these are the mask bits of PCINT18 and PCINT19.
    interrupts.pcmsk2().write(|w| unsafe { w.pcint().bits(1 << 2 | 1 << 3) });
    // SAFETY: bit 2 is PCIE2; the other bits are kept.
    interrupts.pcicr().modify(|r, w| unsafe { w.pcie().bits(r.pcie().bits() | 1 << 2) });
}

/// The position and the ticks known to be lost, from the loop.
pub fn position_and_lost() -> (i32, u16) {
    interrupt::free(|cs| (position(cs), LOST.get(cs)))
}

/// The position.
pub fn position(cs: CriticalSection) -> i32 {
    COUNT.get(cs)
}

/// The handler of PCINT2: 55 cycles from the interrupt's response to its return, 74 where all four bytes change.
///
/// # Safety
/// To be called by the chip, through its vector table, alone.
#[unsafe(naked)]
// SAFETY: this is vector 5, PCINT2 (data sheet, table 12-6), and nobody else defines it.
#[unsafe(export_name = "__vector_5")]
unsafe extern "C" fn on_change() {
    naked_asm!(
        "push r24",
        "in   r24, 0x3f", // SREG
        "push r24",
        "push r30",
        "push r31",
        // Z = TABLE + 2 * (memory | new levels)
        "in   r24, 0x09", // PIND
        "andi r24, 0x0c",
        "in   r30, 0x2a", // GPIOR1
        "or   r30, r24",
        "lsl  r30",
        "ldi  r31, 0",
        "subi r30, lo8(-({table}))",
        "sbci r31, hi8(-({table}))",
        "lpm  r24, Z+", // the new memory
        "lpm  r31, Z",  // the step
        "sbrc r24, 7",
        "rjmp 3f",
        "out  0x2a, r24",
        // The lowest byte. Above it something changes only if the step and its carry disagree.
        "lds  r30, {count}",
        "add  r30, r31",
        "sts  {count}, r30",
        "brcs 1f",
        "sbrc r31, 7",
        "rjmp 4f",
        "rjmp 2f",
        "1:",
        "sbrs r31, 7",
        "rjmp 5f",
        "2:",
        "pop  r31",
        "pop  r30",
        "pop  r24",
        "out  0x3f, r24",
        "pop  r24",
        "reti",
        // Two ticks are lost.
        "3:",
        "andi r24, 0x7f",
        "out  0x2a, r24",
        "lds  r30, {lost}",
        "lds  r31, {lost}+1",
        "adiw r30, 2",
        "sts  {lost}+1, r31",
        "sts  {lost}, r30",
        "rjmp 2b",
        // A step back took the lowest byte below 0: one less in the upper three.
        "4:",
        "lds  r30, {count}+1",
        "subi r30, 1",
        "sts  {count}+1, r30",
        "brcc 2b",
        "lds  r30, {count}+2",
        "subi r30, 1",
        "sts  {count}+2, r30",
        "brcc 2b",
        "lds  r30, {count}+3",
        "subi r30, 1",
        "sts  {count}+3, r30",
        "rjmp 2b",
        // A step forward took it above 255: one more.
        "5:",
        "lds  r30, {count}+1",
        "subi r30, 0xff",
        "sts  {count}+1, r30",
        "brcs 2b",
        "lds  r30, {count}+2",
        "subi r30, 0xff",
        "sts  {count}+2, r30",
        "brcs 2b",
        "lds  r30, {count}+3",
        "subi r30, 0xff",
        "sts  {count}+3, r30",
        "rjmp 2b",
        table = sym TABLE,
        count = sym COUNT,
        lost = sym LOST,
    )
}
