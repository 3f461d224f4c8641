//! The wheel encoder on D2 and D3: four counts a cycle, signed, 32 bits.
//!
//! # How it works
//!
//! The channels request INT0 and INT1 (data sheet, 13.2.1). Both interrupts share one handler, which samples both
//! levels at once. It looks up the step in a table and counts it. It handles the count's upper bytes only if they
//! change.
//!
//! The compiler makes the table from the decoder of `control`, for each state and each pair of levels. So there is no
//! second decoder that could differ.
//!
//! The time between two samples limits the wheel's speed. The last direction resolves two edges between samples, but
//! not three. So the handler is in assembly.
//!
//! No interrupt has a higher priority than INT0 and INT1. So a sample waits for one other handler only. PCINT2 would
//! serve both pins, but the beam's PCINT0 has a higher priority. A sample could then wait for a handler that has just
//! begun, and for the beam's handler too.
//!
//! # Limits
//!
//! - Three edges between two samples make the count wrong. `weeder bounds` proves up to which rate this never happens.
//!   At that rate the edges leave the loop no time. So the loop's need of time is the real limit.
//! - Two edges between samples count in the last direction. This is wrong if the wheel reversed within them. Before the
//!   first step there is no direction, and the handler counts them as lost.
//! - Noise on both channels looks like two edges. The handler has no time to tell them apart. Below 20,000 ticks a
//!   second the `Odometer` of `control` removes these ticks.
//! - The handler clears both requests, and then samples. It relies on the chip: a level passes the synchroniser one
//!   cycle before its request. The virtual Uno has no synchroniser, and no real board has shown this.
//! - No real board has shown the proved rate.

use crate::{handler::handler, shared::Shared};
use avr_device::{
    atmega328p::{CPU, EXINT, PORTD},
    interrupt,
};
use control::measure::quadrature::{Quadrature, Step};

/// The count's lower half, which the beam's handler reads too, and its upper half.
pub static COUNT_LOW: Shared<u16> = Shared::new(0);
static COUNT_HIGH: Shared<u16> = Shared::new(0);
/// Ticks lost in jumps without a direction.
static LOST: Shared<u16> = Shared::new(0);
/// All jumps.
static JUMPS: Shared<u16> = Shared::new(0);

/// The encoder's counters since power-up.
#[derive(Clone, Copy)]
pub struct Counts {
    /// Ticks forward minus ticks backward.
    pub position: i32,
    /// Ticks lost in jumps of two without a direction, modulo 65,536.
    pub lost: u16,
    /// All jumps of two ticks, modulo 65,536. A sound encoder that is not too fast makes none.
    pub jumps: u16,
}

/// The decoder's state, in GPIOR1, which the handler accesses in one cycle. Bits 0 (A) and 1 (B) are the last levels, bits 4 and 5
/// the last direction. The port's new levels go into bits 2 and 3 between them. All six bits are the index into the table.
mod state {
    pub const LEVELS: u8 = 0b11;
    pub const FORWARD: u8 = 1 << 4;
    pub const BACKWARD: u8 = 1 << 5;
    /// In table entries only: both channels changed.
    pub const JUMP: u8 = 1 << 6;
    /// In table entries only: not a step of one tick.
    pub const NO_STEP: u8 = 1 << 7;
}

/// The new state for each state and each new pair of levels. Its direction is that of the step or jump; a jump without a direction
/// is lost.
///
/// Aligned, so that all entries have the same upper address byte.
#[repr(align(64))]
struct Table(#[expect(dead_code, reason = "the handler's assembly reads it")] [u8; 64]);

/// The table in flash, read with LPM only.
#[unsafe(link_section = ".progmem.data")]
// SAFETY: only the handler's assembly refers to it, and reads it from flash.
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
        // What the handler counts: the marks give the number of ticks, the state gives the direction.
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

/// Levels from the port's order (A in bit 0, B in bit 1) to the decoder's.
const fn channels(levels: u8) -> u8 {
    (levels & 1) << 1 | levels >> 1 & 1
}

/// Starts counting from the channels' present levels.
pub fn watch(interrupts: &EXINT, port: &PORTD, cpu: &CPU) {
    let levels = port.pind.read().bits() >> 2 & state::LEVELS;
    cpu.gpior1.write(|w| w.bits(levels));
    interrupts.eicra.write(|w| w.isc0().val_0x01().isc1().val_0x01());
    interrupts.eimsk.write(|w| w.int0().set_bit().int1().set_bit());
}

/// The counters, for the loop.
pub fn counts() -> Counts {
    interrupt::free(|_| Counts { position: count(), lost: LOST.get(), jumps: JUMPS.get() })
}

/// The position, for the loop.
pub fn position() -> i32 {
    interrupt::free(|_| count())
}

/// The whole count; the caller has turned interrupts off.
#[inline(always)]
fn count() -> i32 {
    i32::from(COUNT_HIGH.get() as i16) << 16 | i32::from(COUNT_LOW.get())
}

handler! {
    /// The handler of INT0 and INT1: 46 cycles for a step forward, 48 for a step back. It takes more if upper bytes of the count
    /// change, and for a jump.
    ///
    /// It samples in its 12th cycle. An edge that comes when another handler begins waits for that handler, one instruction of the
    /// loop, and these 12 cycles. If that instruction opens a critical section, the edge also waits for the section and the
    /// instruction after it. `weeder bounds` proves the longest wait. This wait gives the rate up to which at most one edge is
    /// missed between two samples. Edges that keep this rate leave the loop no time, so the loop's need of time is the real limit.
    on_change = "__vector_1" {
        ".globl __vector_2",
        ".set __vector_2, __vector_1",
        // The sample of PIND answers both requests. A request's edge passes the same synchroniser, one cycle after the level. A
        // later edge requests again.
        "ldi  r24, 3",
        "out  0x1c, r24", // EIFR
        "in   r24, 0x09", // PIND
        "push r30",
        "push r31",
        // Z = TABLE + (state | new levels)
        "andi r24, 0x0c",
        "in   r30, 0x2a", // GPIOR1
        "or   r30, r24",
        "ldi  r31, hi8({table})",
        "subi r30, lo8(-({table}))",
        "lpm  r24, Z", // the new state
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
        // The lowest byte went below 0: decrement the upper three.
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
        // A step forward: the lowest byte went above 255. Increment the next one.
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
        // No step. Without a jump, the state is unchanged.
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
        // No direction: the ticks are lost.
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

// The handler's assembly relies on these bits.
const _: () = {
    assert!(state::FORWARD == 1 << 4 && state::BACKWARD == 1 << 5);
    assert!(state::JUMP == 1 << 6 && state::NO_STEP == 1 << 7);
};
