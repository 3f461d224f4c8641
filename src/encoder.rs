//! The wheel encoder on D2 and D3: four counts a cycle, signed, 32 bits.
//!
//! Both channels' interrupts, INT0 and INT1 (data sheet, 13.2.1), have one handler, which reads both levels at once. How
//! often it can look decides how fast the wheel may turn: two edges between two looks are resolved by their direction,
//! three are not. No interrupt goes before these two. The pins' other interrupt, PCINT2, is one for both, but the beam's
//! PCINT0 goes before it: a look could then be held up by a handler that has just begun and by the beam's as well, where
//! it is by one of the two here.
//!
//! The handler is written in assembly: it looks up in a table which way the step went, counts it, and goes on to the
//! count's upper bytes only when they change. The table is the decoder of `control`, worked out by the compiler for
//! every state and every pair of levels, so there is no second decoder that could differ from it.

use crate::{handler::handler, shared::Shared};
use avr_device::{
    atmega328p::{CPU, EXINT, PORTD},
    interrupt,
};
use control::measure::quadrature::{Quadrature, Step};

/// The count's lower half, which the beam's handler reads too, and its upper.
pub static COUNT_LOW: Shared<u16> = Shared::new(0);
static COUNT_HIGH: Shared<u16> = Shared::new(0);
/// Ticks lost in jumps that nothing resolved.
static LOST: Shared<u16> = Shared::new(0);
/// Jumps, resolved or not.
static JUMPS: Shared<u16> = Shared::new(0);

/// What the encoder has counted since power-up.
#[derive(Clone, Copy)]
pub struct Counts {
    /// Ticks forward less ticks backward.
    pub position: i32,
    /// Ticks lost in jumps of two that nothing resolved, modulo 65,536.
    pub lost: u16,
    /// Jumps of two ticks, resolved or not, modulo 65,536. An encoder that is slow enough and whole makes none.
    pub jumps: u16,
}

/// The decoder's memory, in GPIOR1, where the handler reaches it in a cycle: the channels' last levels in bits 0 (A) and
/// 1 (B), the last step's direction in bits 4 and 5. The new levels come from the port in bits 2 and 3, right between,
/// and all six together are the place in the table.
mod state {
    pub const LEVELS: u8 = 0b11;
    pub const FORWARD: u8 = 1 << 4;
    pub const BACKWARD: u8 = 1 << 5;
    /// Set in a table entry, never in the memory: both channels changed.
    pub const JUMP: u8 = 1 << 6;
    /// Set in a table entry, never in the memory: it is no step of one tick.
    pub const NO_STEP: u8 = 1 << 7;
}

/// For each memory and each new pair of levels: the new memory. Its direction says which way the step or the jump went; a jump
/// without one is one that nothing resolved.
///
/// None of it lies farther from its beginning than the lower byte of an address reaches.
#[repr(align(64))]
struct Table(#[expect(dead_code, reason = "the handler's assembly reads it")] [u8; 64]);

/// The table in flash, to be read by LPM alone.
#[unsafe(link_section = ".progmem.data")]
// SAFETY: nothing but the handler's assembly refers to it, and that reads it from flash.
static TABLE: Table = Table(table());

const fn table() -> [u8; 64] {
    let mut table = [0; 64];
    let mut index = 0;
    while index < table.len() {
        let memory = index as u8;
        let (last, new) = (memory & state::LEVELS, memory >> 2 & state::LEVELS);
        let before = match memory & (state::FORWARD | state::BACKWARD) {
            state::FORWARD => 1,
            state::BACKWARD => -1,
            _ => 0,
        };
        let mut decoder = Quadrature::moving(channels(last), before);
        let step = decoder.step(channels(new));
        let direction = match decoder.direction() {
            1 => state::FORWARD,
            -1 => state::BACKWARD,
            _ => 0,
        };
        // What the handler counts: as far as the marks say, and the way that the memory says.
        let (marks, ticks) = match step {
            Step::Ticks(ticks @ (1 | -1)) => (0, ticks),
            Step::Ticks(0) => (state::NO_STEP, 0),
            Step::Ticks(ticks) => (state::NO_STEP | state::JUMP, ticks),
            Step::Lost => (state::NO_STEP | state::JUMP, 0),
        };
        assert!(ticks.signum() == decoder.direction() || ticks == 0 && (direction == 0 || marks == state::NO_STEP));
        table[index] = new | direction | marks;
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
    interrupts.eicra().write(|w| w.isc0().val_0x01().isc1().val_0x01());
    interrupts.eimsk().write(|w| w.int0().set_bit().int1().set_bit());
}

/// What was counted, from the loop.
pub fn counts() -> Counts {
    interrupt::free(|_| Counts { position: count(), lost: LOST.get(), jumps: JUMPS.get() })
}

/// The position, from the loop.
pub fn position() -> i32 {
    interrupt::free(|_| count())
}

/// The whole count, with interrupts off.
#[inline(always)]
fn count() -> i32 {
    i32::from(COUNT_HIGH.get() as i16) << 16 | i32::from(COUNT_LOW.get())
}

handler! {
    /// The handler of INT0 and INT1: 46 cycles for a step forward and 48 for one back, more where upper bytes of the count change, and
    /// for a jump.
    ///
    /// It looks in the 12th. An edge that comes as another handler begins waits for it, for an instruction of the loop, for
    /// a critical section if that instruction opens one, for the instruction behind it, and for these 12 cycles.
    /// `weeder bounds` proves the longest wait, and with it the rate at which two counts never go by between two looks.
    /// Edges that keep coming as fast as that leave the loop no time; so its need of time bounds the rate, and not
    /// the wait.
    on_change = "__vector_1" {
        ".globl __vector_2",
        ".set __vector_2, __vector_1",
        // Both requests are met by what PIND shows now. The edge that asks comes through the same synchroniser, a
        // cycle behind the level; one that comes later asks again.
        "ldi  r24, 3",
        "out  0x1c, r24", // EIFR
        "in   r24, 0x09", // PIND
        "push r30",
        "push r31",
        // Z = TABLE + (memory | new levels)
        "andi r24, 0x0c",
        "in   r30, 0x2a", // GPIOR1
        "or   r30, r24",
        "ldi  r31, hi8({table})",
        "subi r30, lo8(-({table}))",
        "lpm  r24, Z", // the new memory
        "sbrc r24, 7",
        "rjmp 3f",
        "out  0x2a, r24",
        "lds  r30, {low}",
        "sbrc r24, 5",
        "rjmp 5f",
        "inc  r30",
        "breq 1f",
        "4:",
        "sts  {low}, r30",
        "2:",
        "pop  r31",
        "pop  r30",
    }
    aside {
        // A step back.
        "5:",
        "subi r30, 1",
        "brcc 4b",
        // It took the lowest byte below 0: one less in the upper three.
        "6:",
        "sts  {low}, r30",
        "lds  r30, {low}+1",
        "subi r30, 1",
        "sts  {low}+1, r30",
        "brcc 2b",
        "lds  r30, {high}",
        "subi r30, 1",
        "sts  {high}, r30",
        "brcc 2b",
        "lds  r30, {high}+1",
        "subi r30, 1",
        "sts  {high}+1, r30",
        "rjmp 2b",
        // A step forward took the lowest byte above 255: one more.
        "1:",
        "sts  {low}, r30",
        "lds  r30, {low}+1",
        "inc  r30",
        "sts  {low}+1, r30",
        "brne 2b",
        "lds  r30, {high}",
        "inc  r30",
        "sts  {high}, r30",
        "brne 2b",
        "lds  r30, {high}+1",
        "inc  r30",
        "sts  {high}+1, r30",
        "rjmp 2b",
        // No step. Where it is no jump either, the memory is what it was.
        "3:",
        "sbrs r24, 6",
        "rjmp 2b",
        // A jump of two ticks.
        "andi r24, 0x3f",
        "out  0x2a, r24",
        "lds  r30, {jumps}",
        "inc  r30",
        "sts  {jumps}, r30",
        "brne 7f",
        "lds  r30, {jumps}+1",
        "inc  r30",
        "sts  {jumps}+1, r30",
        "7:",
        "lds  r30, {low}",
        "sbrc r24, 5",
        "rjmp 8f",
        "sbrs r24, 4",
        "rjmp 9f",
        // Forward.
        "subi r30, 0xfe",
        "brcc 1b",
        "rjmp 4b",
        // Back.
        "8:",
        "subi r30, 2",
        "brcc 7f",
        "rjmp 6b",
        "7:",
        "rjmp 4b",
        // Nothing resolves it: its ticks are lost.
        "9:",
        "lds  r30, {lost}",
        "lds  r31, {lost}+1",
        "adiw r30, 2",
        "sts  {lost}+1, r31",
        "sts  {lost}, r30",
        "rjmp 2b",
    }
    table = sym TABLE,
    low = sym COUNT_LOW,
    high = sym COUNT_HIGH,
    lost = sym LOST,
    jumps = sym JUMPS,
}

// The handler takes these bits for what they are.
const _: () = {
    assert!(state::FORWARD == 1 << 4 && state::BACKWARD == 1 << 5);
    assert!(state::JUMP == 1 << 6 && state::NO_STEP == 1 << 7);
};
