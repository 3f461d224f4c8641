//! What simavr calls back: levels on the output pins, interrupts, bytes to transmit, and resets.
//!
//! The callbacks only write down what happened in the [`Recorder`] and set simavr's clock and its UART's pace right, while there is
//! time for it; they call nothing of simavr's. Their parameter is the recorder's address, which [`super::core::Core`]
//! registers and keeps alive; its text says why nobody else looks at the recorder meanwhile.

use std::ffi::c_void;

use simavr_ffi as simavr;

use super::eeprom::Eeprom;
use super::interrupts::InterruptRecorder;
use super::timer::Timer1;
use super::turns::TurnRecorder;
use super::uart;
use signal::{Pin, PinChange};

/// Cycles from the end of an instruction to the first one of the vector (data sheet, section 7.7.1).
const INTERRUPT_ENTRY_CYCLES: u64 = 4;

/// Cycles of `reti`; its end is the end of the handler.
const RETURN_CYCLES: u64 = 4;

/// Why the chip started anew.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Power came back ([`Uno::power_cycle`](crate::Uno::power_cycle)).
    PowerOn,
    /// The reset pin was pulled ([`Uno::reset`](crate::Uno::reset)).
    External,
    /// The supply sagged ([`Uno::brown_out`](crate::Uno::brown_out)).
    BrownOut,
    /// The watchdog ran out.
    Watchdog,
}

/// A reset after the first power-up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reset {
    /// When.
    pub cycle: u64,
    /// Why.
    pub cause: ResetCause,
}

/// A byte from the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceivedByte {
    /// When the firmware handed it to the transmitter.
    pub cycle: u64,
    /// The byte.
    pub byte: u8,
}

/// The pins that are recorded as outputs: Timer1's output A, and the board's LED.
pub(super) const OUTPUTS: [Pin; 2] = [Pin::D9, Pin::D13];

/// Whether the firmware drives the pin.
pub(super) fn is_output(pin: Pin) -> bool {
    OUTPUTS.contains(&pin)
}

/// What simavr's callbacks have seen.
pub(super) struct Recorder {
    pub(super) chip: *mut simavr::avr_t,
    pub(super) uart: *mut simavr::avr_uart_t,
    pub(super) timer: Timer1,
    pub(super) eeprom: Eeprom,
    pub(super) d9_high: bool,
    pub(super) d13_high: bool,
    /// Edges of the output pins, oldest first.
    pub(super) changes: Vec<PinChange>,
    /// Bytes that the firmware has handed to its transmitter, oldest first.
    pub(super) received: Vec<ReceivedByte>,
    /// Resets since the first power-up, oldest first.
    pub(super) resets: Vec<Reset>,
    pub(super) interrupts: InterruptRecorder,
    pub(super) turns: TurnRecorder,
    /// Cycle of a reset that simavr is in the middle of.
    pub(super) reset_at: Option<u64>,
}

impl Recorder {
    /// Records a level of an output pin, where it differs from the last one.
    pub(super) fn record_level(&mut self, pin: Pin, high: bool, cycle: u64) {
        let level = match pin {
            Pin::D9 => &mut self.d9_high,
            Pin::D13 => &mut self.d13_high,
            _ => return,
        };
        if *level != high {
            *level = high;
            self.changes.push(PinChange { cycle, pin, high });
        }
    }
}

/// When the peripheral that simavr is serving was due. It serves one at the end of the instruction in which it falls due, up
/// to four cycles late; its slot still says when it was. Without one, an instruction is running, and it began at `cycle`.
///
/// # Safety
///
/// `avr` must be an initialised chip.
unsafe fn due_cycle(avr: *mut simavr::avr_t) -> u64 {
    // SAFETY: the caller vouches for `avr`. Both lists run through the pool's own slots and end in null. The slot being
    // served is in neither.
    unsafe {
        let pool = &raw const (*avr).cycle_timers;
        let first = (&raw const (*pool).timer_slots).cast::<simavr::avr_cycle_timer_slot_t>();
        let mut listed = 0_u64;
        for head in [(*pool).timer, (*pool).timer_free] {
            let mut slot = head.cast_const();
            while !slot.is_null() {
                listed |= 1 << slot.offset_from(first);
                slot = (*slot).next;
            }
        }
        match listed.trailing_ones() {
            64.. => (*avr).cycle,
            served => (*first.add(served as usize)).when,
        }
    }
}

/// simavr's callback for a level on an output pin's port.
pub(super) unsafe extern "C" fn on_output(irq: *mut simavr::avr_irq_t, level: u32, recorder: *mut c_void) {
    // SAFETY: `recorder` is what `Core::new` registered, alive and not borrowed (see the module's text).
    let recorder = unsafe { &mut *recorder.cast::<Recorder>() };
    // SAFETY: simavr passes the line that it raises; the recorder's chip is the one that is running.
    let (bit, cycle) = unsafe { ((*irq).irq, due_cycle(recorder.chip)) };
    let port_high = level & 1 != 0;
    if bit == u32::from(Pin::D9.port_and_bit().1) {
        // SAFETY: as above.
        let high = unsafe { recorder.timer.pin_is_high(recorder.chip, port_high) };
        recorder.record_level(Pin::D9, high, cycle);
    } else {
        recorder.record_level(Pin::D13, port_high, cycle);
    }
}

/// simavr's callback for a level that Timer1 puts on its output A.
pub(super) unsafe extern "C" fn on_timer_output(_: *mut simavr::avr_irq_t, level: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_output`. A timer's output carries a flag beside the level.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        recorder.timer.output_becomes(level & 1 != 0);
        let high = recorder.timer.pin_is_high(recorder.chip, recorder.d9_high);
        recorder.record_level(Pin::D9, high, due_cycle(recorder.chip));
    }
}

/// simavr's callback for an interrupt handler that begins (1) or has returned (0).
pub(super) unsafe extern "C" fn on_interrupt(irq: *mut simavr::avr_irq_t, begins: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_output`. The chip's clock is simavr's to read only after this callback.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        let clock = &raw mut (*recorder.chip).cycle;
        // simavr numbers a vector's lines from 256 times the vector.
        let vector = ((*irq).irq >> 8) as u8;
        if begins != 0 {
            recorder.interrupts.begins(vector, *clock);
            *clock += INTERRUPT_ENTRY_CYCLES;
        } else {
            recorder.interrupts.ends(vector, *clock + RETURN_CYCLES);
        }
    }
}

/// simavr's callback for a byte that the firmware hands to the transmitter, before simavr decides how long it takes.
pub(super) unsafe extern "C" fn on_transmit(_: *mut simavr::avr_irq_t, byte: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_output`; the UART is part of the chip.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        (*recorder.uart).cycles_per_byte = uart::cycles_per_byte(recorder.chip);
        recorder.received.push(ReceivedByte { cycle: (*recorder.chip).cycle, byte: byte as u8 });
    }
}

/// simavr's callback in the middle of a reset, before the peripherals' own resets and before it zeroes its clock.
pub(super) unsafe extern "C" fn on_reset(avr: *mut simavr::avr_t) {
    // SAFETY: simavr passes the chip that it resets, whose `custom.data` is the recorder (see `Core::new`).
    unsafe {
        let recorder = &mut *(*avr).custom.data.cast::<Recorder>();
        recorder.reset_at = Some((*avr).cycle);
    }
}
