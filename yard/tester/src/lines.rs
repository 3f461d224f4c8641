//! The lines to the weeder: six outputs on port C, the reset on D7, the LED's level on D6, and the capture pin on D8.
//!
//! Port C has no other pins, so one write of the port changes a line. D7 is an open drain: it pulls low, or is an input, and then
//! the weeder's own pull-up raises the line.

use avr_device::atmega328p::{PORTB, PORTC, PORTD};
use tester_core::pins::{ALL_LINES, AT_REST};

/// D6, of port D.
const LAMP: u8 = 1 << 6;

/// D7, of port D.
const RESET: u8 = 1 << 7;

/// D8, of port B.
const CAPTURE: u8 = 1;

/// The ports.
pub struct Lines {
    capture: PORTB,
    reset: PORTD,
}

impl Lines {
    /// Sets up the pins, with all lines at rest.
    pub fn new(capture: PORTB, lines: PORTC, reset: PORTD) -> Self {
        // SAFETY: only this file uses port C. The levels are set before the direction, so no line has a wrong level in between.
        lines.portc.write(|w| unsafe { w.bits(AT_REST) });
        // SAFETY: as above.
        lines.ddrc.write(|w| unsafe { w.bits(ALL_LINES) });
        Self { capture, reset }
    }

    /// Whether the weeder's LED is lit.
    pub fn lamp_is_lit(&self) -> bool {
        self.reset.pind.read().bits() & LAMP != 0
    }

    /// Pulls the weeder's reset low, or releases it.
    pub fn pull_reset(&self, pulled: bool) {
        // SAFETY: D7 is the only output of port D, and its level stays low.
        self.reset.ddrd.write(|w| unsafe { w.bits(if pulled { RESET } else { 0 }) });
    }

    /// Drives the capture pin high, or low and then as an input again. The weeder must not drive it.
    pub fn drive_capture(&self, high: bool) {
        // SAFETY: D8 is the only pin of port B that this firmware uses.
        self.capture.portb.write(|w| unsafe { w.bits(if high { CAPTURE } else { 0 }) });
        // The pin is driven low, which ends the pulse, and then released.
        // SAFETY: as above.
        self.capture.ddrb.write(|w| unsafe { w.bits(CAPTURE) });
        if !high {
            // SAFETY: as above.
            self.capture.ddrb.write(|w| unsafe { w.bits(0) });
        }
    }
}

/// Sets the levels of port C.
#[inline(always)]
pub fn show(levels: u8) {
    // SAFETY: one instruction writes one byte, and each level of port C is valid.
    unsafe { (*PORTC::ptr()).portc.write(|w| w.bits(levels)) };
}
