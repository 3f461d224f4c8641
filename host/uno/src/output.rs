//! The levels that the firmware drives at the pins: from the ports' registers, and from the timers' outputs that
//! replace them.
//!
//! A pin is an output while its bit in DDRx is set. Its level is its bit in PORTx, or that of a connected timer output
//! (data sheet, section 14.3). simavr copies a timer's level into PORTx. A firmware that reads PORTx before an edge and
//! writes it back after the edge would undo the edge. So this module stores the level of a connected output.

use simavr_ffi as simavr;

use super::chip::Chip;
use crate::pins::Pin;

/// An output of a timer.
pub(super) struct TimerOutput {
    pub(super) pin: Pin,
    /// The timer's name for simavr, and the output's number there.
    pub(super) timer: [u8; 4],
    pub(super) output: u32,
    /// The register that connects it, and the bits in it.
    control: u16,
    connected: u8,
}

const A: u8 = 0b1100_0000;
const B: u8 = 0b0011_0000;

/// The timers' outputs (data sheet, tables 14-3, 14-6 and 14-9; TCCRnA in the register summary).
pub(super) const TIMER_OUTPUTS: [TimerOutput; 6] = [
    TimerOutput { pin: Pin::D6, timer: *b"tmr0", output: 0, control: 0x44, connected: A },
    TimerOutput { pin: Pin::D5, timer: *b"tmr0", output: 1, control: 0x44, connected: B },
    TimerOutput { pin: Pin::D9, timer: *b"tmr1", output: 0, control: 0x80, connected: A },
    TimerOutput { pin: Pin::D10, timer: *b"tmr1", output: 1, control: 0x80, connected: B },
    TimerOutput { pin: Pin::D11, timer: *b"tmr2", output: 0, control: 0xB0, connected: A },
    TimerOutput { pin: Pin::D3, timer: *b"tmr2", output: 1, control: 0xB0, connected: B },
];

/// The level of the timer output that is connected to a pin; `None` without one.
pub(super) fn timer_level(chip: Chip, pin: Pin, levels: &[bool; TIMER_OUTPUTS.len()]) -> Option<bool> {
    let index = TIMER_OUTPUTS.iter().position(|output| output.pin == pin)?;
    let TimerOutput { control, connected, .. } = TIMER_OUTPUTS[index];
    (chip.read(control) & connected != 0).then_some(levels[index])
}

/// The ports' letters.
pub(super) const PORTS: [char; 3] = ['B', 'C', 'D'];

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
