//! The board's pins, and levels on them at cycles.
//!
//! A [`Pin`] has the board's number. A [`PinChange`] is a new level of a pin, driven by either side. A [`Wire`]
//! describes the connection of a pin. This module is what the crate has without its default features.

use std::fmt;

/// Cycles of the Uno's clock in a second.
pub const CYCLES_PER_SECOND: u64 = 16_000_000;

/// A pin of the Uno, by its name on the board; [`Pin::port_and_bit`] has its name on the chip. D2 and D3 are the inputs
/// INT0 and INT1. Outputs A and B are D6 and D5 of Timer0, D9 and D10 of Timer1, D11 and D3 of Timer2. D13 has the
/// board's LED. The serial line's bytes are no levels of D0 and D1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
#[expect(missing_docs, reason = "the names are printed on the board")]
pub enum Pin {
    D0,
    D1,
    D2,
    D3,
    D4,
    D5,
    D6,
    D7,
    D8,
    D9,
    D10,
    D11,
    D12,
    D13,
    A0,
    A1,
    A2,
    A3,
    A4,
    A5,
}

impl Pin {
    /// Every pin, in the order of the board's numbering.
    pub const ALL: [Pin; 20] = {
        use Pin::*;
        [D0, D1, D2, D3, D4, D5, D6, D7, D8, D9, D10, D11, D12, D13, A0, A1, A2, A3, A4, A5]
    };

    /// Its number, as the Arduino core counts: 0 to 13, and 14 to 19 for A0 to A5.
    pub const fn number(self) -> u8 {
        self as u8
    }

    /// The ATmega328P's port letter and bit: D0 to D7 are port D, D8 to D13 port B, A0 to A5 port C.
    pub const fn port_and_bit(self) -> (char, u8) {
        match self.number() {
            number @ ..8 => ('D', number),
            number @ 8..14 => ('B', number - 8),
            number => ('C', number - 14),
        }
    }

    /// The pin's channel of the ADC, 0 to 5; `None` for D0 to D13.
    pub const fn adc_channel(self) -> Option<u8> {
        self.number().checked_sub(14)
    }
}

impl fmt::Display for Pin {
    fn fmt(&self, to: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Debug::fmt(self, to)
    }
}

/// A wire on a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wire {
    /// The pin.
    pub pin: Pin,
    /// Its name in a waveform file.
    pub name: &'static str,
    /// Its level at rest.
    pub high_at_rest: bool,
}

/// A pin that took a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinChange {
    /// Its time, in cycles since power-up.
    pub cycle: u64,
    /// Which pin.
    pub pin: Pin,
    /// The new level.
    pub high: bool,
}

/// A pulse on a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Pulse {
    /// Rising edge, in cycles since power-up.
    pub rise: u64,
    /// Falling edge, in cycles since power-up.
    pub fall: u64,
}

impl Pulse {
    /// The pulse's width in microseconds.
    pub fn width_us(self) -> f64 {
        (self.fall - self.rise) as f64 * 1e6 / CYCLES_PER_SECOND as f64
    }
}
