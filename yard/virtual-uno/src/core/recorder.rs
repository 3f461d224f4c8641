//! The callbacks from simavr: levels on output pins, interrupts, transmitted bytes, and resets.
//!
//! The callbacks write events into the [`Recorder`]. They also correct simavr's clock and the pace of its UART, because
//! this is the only time for it. They call no function of simavr. Their parameter is the recorder's address, which
//! [`super::Core`] registers and keeps alive. Its text explains why no other code accesses the recorder
//! meanwhile.
//!
//! A pin is an output while its bit in DDRx is set. Its level is its bit in PORTx, or that of a connected timer output
//! (data sheet, section 14.3). simavr copies a timer's level into PORTx. A firmware that reads PORTx before an edge and
//! writes it back after the edge would undo the edge. So the recorder stores the level of a connected output.

use super::adc::{self, ADC_CHANNELS};
use super::chip::Chip;
use super::eeprom::Eeprom;
use super::measuring::{InterruptRecorder, TurnRecorder};
use super::timer::Timer1;
use super::uart;
use crate::pins::{Pin, PinChange};
use simavr_ffi as simavr;
use std::ffi::c_void;

/// Cycles from the end of an instruction to the first one of the vector (data sheet, section 7.7.1).
const INTERRUPT_ENTRY_CYCLES: u64 = 4;

/// Cycles of `reti`; its end is the end of the handler.
const RETURN_CYCLES: u64 = 4;

/// Why the chip restarted, by its flag in MCUSR (data sheet, 11.9.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResetCause {
    /// Power came back ([`Uno::power_cycle`](crate::Uno::power_cycle)).
    PowerOn = 1 << 0,
    /// The reset pin was pulled ([`Uno::reset`](crate::Uno::reset)).
    External = 1 << 1,
    /// The supply sagged ([`Uno::brown_out`](crate::Uno::brown_out)).
    BrownOut = 1 << 2,
    /// The watchdog ran out.
    Watchdog = 1 << 3,
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
    /// The time at which the firmware passed it to the transmitter.
    pub cycle: u64,
    /// The byte.
    pub byte: u8,
}

/// The recorded events, which outlive the chip.
#[derive(Default)]
pub(crate) struct Log {
    /// Edges of the output pins, oldest first.
    pub(crate) changes: Vec<PinChange>,
    /// Bytes that the firmware has handed to its transmitter, oldest first.
    pub(crate) received: Vec<ReceivedByte>,
    /// Resets since the first power-up, oldest first.
    pub(crate) resets: Vec<Reset>,
    pub(crate) interrupts: InterruptRecorder,
    pub(crate) turns: TurnRecorder,
}

/// The state that simavr's callbacks change.
pub(crate) struct Recorder {
    pub(super) chip: Chip,
    pub(super) timer: Timer1,
    pub(super) eeprom: Eeprom,
    /// Voltage at each channel of the ADC.
    pub(crate) millivolts: [u16; ADC_CHANNELS],
    /// Levels of the timers' outputs, in the order of [`TIMER_OUTPUTS`].
    pub(super) timer_levels: [bool; TIMER_OUTPUTS.len()],
    /// The pins that the firmware drives high.
    pub(super) driven_high: [bool; Pin::ALL.len()],
    pub(crate) log: Log,
    /// Cycle of a reset that simavr is in the middle of.
    pub(super) reset_at: Option<u64>,
}

impl Recorder {
    /// Records a level of an output pin, if it differs from the last one.
    fn record_level(&mut self, pin: Pin, high: bool, cycle: u64) {
        let level = &mut self.driven_high[usize::from(pin.number())];
        if *level != high {
            *level = high;
            self.log.changes.push(PinChange { cycle, pin, high });
        }
    }

    /// Records the levels of a port, from the present values of its registers.
    fn record_port(&mut self, name: char, direction: u8, port: u8) {
        for pin in Pin::ALL.into_iter().filter(|pin| pin.port_and_bit().0 == name) {
            let (_, bit) = pin.port_and_bit();
            let timer = timer_level(self.chip, pin, &self.timer_levels);
            let high = direction & 1 << bit != 0 && timer.unwrap_or(port & 1 << bit != 0);
            if self.is_driven_high(pin) != high {
                self.record_level(pin, high, due_cycle(self.chip));
            }
        }
    }

    /// Whether the firmware drives the pin high.
    pub(crate) fn is_driven_high(&self, pin: Pin) -> bool {
        self.driven_high[usize::from(pin.number())]
    }

    /// The chip restarts at `cycle`, and drives no pin.
    pub(crate) fn restart(&mut self, cycle: u64, cause: ResetCause) {
        self.timer_levels = Default::default();
        for pin in Pin::ALL {
            self.record_level(pin, false, cycle);
        }
        self.timer.reset();
        self.log.interrupts.reset();
        self.log.turns.reset();
        self.log.resets.push(Reset { cycle, cause });
    }
}

/// simavr's type for the callback of a line.
pub(super) type Callback = unsafe extern "C" fn(*mut simavr::avr_irq_t, u32, *mut c_void);

/// An output of a timer.
pub(super) struct TimerOutput {
    pub(super) pin: Pin,
    /// The timer's name for simavr, and the output's number there.
    pub(super) timer: [u8; 4],
    pub(super) output: u32,
    /// The register that connects it, TCCRnA: bits 7 and 6 for output A (0), 5 and 4 for B (1).
    control: u16,
    pub(super) callback: Callback,
}

/// The timers' outputs (data sheet, tables 14-3, 14-6 and 14-9; TCCRnA in the register summary).
pub(super) const TIMER_OUTPUTS: [TimerOutput; 6] = [
    TimerOutput { pin: Pin::D6, timer: *b"tmr0", output: 0, control: 0x44, callback: on_timer_output::<0> },
    TimerOutput { pin: Pin::D5, timer: *b"tmr0", output: 1, control: 0x44, callback: on_timer_output::<1> },
    TimerOutput { pin: Pin::D9, timer: *b"tmr1", output: 0, control: 0x80, callback: on_timer_output::<2> },
    TimerOutput { pin: Pin::D10, timer: *b"tmr1", output: 1, control: 0x80, callback: on_timer_output::<3> },
    TimerOutput { pin: Pin::D11, timer: *b"tmr2", output: 0, control: 0xB0, callback: on_timer_output::<4> },
    TimerOutput { pin: Pin::D3, timer: *b"tmr2", output: 1, control: 0xB0, callback: on_timer_output::<5> },
];

/// The level of the timer output that is connected to a pin; `None` without one.
fn timer_level(chip: Chip, pin: Pin, levels: &[bool; TIMER_OUTPUTS.len()]) -> Option<bool> {
    let index = TIMER_OUTPUTS.iter().position(|output| output.pin == pin)?;
    let TimerOutput { control, output, .. } = TIMER_OUTPUTS[index];
    (chip.read(control) & 0b1100_0000 >> (2 * output) != 0).then_some(levels[index])
}

/// The ports' letters and callbacks.
pub(super) const PORTS: [(char, Callback); 3] = [('B', on_port::<'B'>), ('C', on_port::<'C'>), ('D', on_port::<'D'>)];

/// The contents of a port's registers.
#[derive(Clone, Copy)]
pub(super) struct Port {
    /// PINx: the levels at the pins.
    pub(super) pins: u8,
    /// DDRx: the bits of outputs are set.
    pub(super) direction: u8,
    /// PORTx: the levels of outputs, and the pull-ups of inputs.
    pub(super) levels: u8,
}

impl Port {
    /// The port with this letter.
    pub(super) fn of(chip: Chip, name: char) -> Port {
        let first = first_register(name);
        Port { pins: chip.read(first), direction: chip.read(first + 1), levels: chip.read(first + 2) }
    }

    /// simavr's state of the port with this letter.
    pub(super) fn peripheral(chip: Chip, name: char) -> *mut simavr::avr_ioport_t {
        chip.peripheral(first_register(name))
    }
}

/// The address of PINx in the data space. DDRx and PORTx follow (data sheet, register summary).
fn first_register(port: char) -> u16 {
    match port {
        'B' => 0x23,
        'C' => 0x26,
        _ => 0x29,
    }
}

/// The due time of the peripheral that simavr is serving. simavr serves it at the end of the instruction in which it
/// falls due, up to four cycles late; its slot still has the due time. If simavr serves none, an instruction is
/// running, and it began at `cycle`.
fn due_cycle(chip: Chip) -> u64 {
    // SAFETY: both lists run through the pool's own slots and end in null. The slot being served is in neither.
    unsafe {
        let pool = &raw const (*chip.avr()).cycle_timers;
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
            64.. => chip.cycle(),
            served => (*first.add(served as usize)).when,
        }
    }
}

/// simavr's callback for a write of PORTx, after it, and of DDRx, before it.
unsafe extern "C" fn on_port<const NAME: char>(line: *mut simavr::avr_irq_t, value: u32, recorder: *mut c_void) {
    // SAFETY: `recorder` is the one that `Core::new` registered, alive and not borrowed (see the module's text). simavr
    // passes a valid line.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        let Port { direction, levels, .. } = Port::of(recorder.chip, NAME);
        match (*line).irq {
            simavr::IOPORT_IRQ_DIRECTION_ALL => recorder.record_port(NAME, value as u8, levels),
            _ => recorder.record_port(NAME, direction, value as u8),
        }
    }
}

/// simavr's callback for a new level of a timer's output, by its index in [`TIMER_OUTPUTS`].
unsafe extern "C" fn on_timer_output<const INDEX: usize>(_: *mut simavr::avr_irq_t, level: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_port`.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        // A timer's output carries a flag beside the level.
        let (high, pin) = (level & 1 != 0, TIMER_OUTPUTS[INDEX].pin);
        recorder.timer_levels[INDEX] = high;
        if pin == Pin::D9 {
            recorder.timer.output_becomes(high);
        }
        let name = pin.port_and_bit().0;
        let Port { direction, levels, .. } = Port::of(recorder.chip, name);
        recorder.record_port(name, direction, levels);
    }
}

/// simavr's callback for a conversion of the ADC that takes its sample.
pub(crate) unsafe extern "C" fn on_sample(_: *mut simavr::avr_irq_t, _: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_port`.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        adc::set_right(recorder.chip, &recorder.millivolts);
    }
}

/// simavr's callback for the start (1) or return (0) of an interrupt handler.
pub(crate) unsafe extern "C" fn on_interrupt(irq: *mut simavr::avr_irq_t, begins: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_port`. The chip's clock is simavr's to read only after this callback.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        let clock = &raw mut (*recorder.chip.avr()).cycle;
        // simavr numbers a vector's lines from 256 times the vector.
        let vector = ((*irq).irq >> 8) as u8;
        if begins != 0 {
            recorder.log.interrupts.begins(vector, *clock);
            *clock += INTERRUPT_ENTRY_CYCLES;
        } else {
            recorder.log.interrupts.ends(vector, *clock + RETURN_CYCLES);
        }
    }
}

/// simavr's callback for a byte that the firmware passes to the transmitter, before simavr decides how long it takes.
pub(crate) unsafe extern "C" fn on_transmit(_: *mut simavr::avr_irq_t, byte: u32, recorder: *mut c_void) {
    // SAFETY: as in `on_port`; the UART is part of the chip.
    unsafe {
        let recorder = &mut *recorder.cast::<Recorder>();
        (*uart::of(recorder.chip)).cycles_per_byte = uart::cycles_per_byte(recorder.chip);
        recorder.log.received.push(ReceivedByte { cycle: recorder.chip.cycle(), byte: byte as u8 });
    }
}

/// simavr's callback in the middle of a reset, before the peripherals' own resets and before it zeroes its clock.
pub(crate) unsafe extern "C" fn on_reset(avr: *mut simavr::avr_t) {
    // SAFETY: simavr passes the chip that it resets, whose `custom.data` is the recorder (see `Core::new`).
    unsafe {
        let recorder = &mut *(*avr).custom.data.cast::<Recorder>();
        recorder.reset_at = Some((*avr).cycle);
    }
}
