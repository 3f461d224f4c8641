//! The board's pins, and levels on them at cycles.
//!
//! A [`Pin`] has the board's number. A [`PinChange`] is a new level of a pin, driven by either side. A [`Wire`]
//! describes the connection of a pin. This module needs no simulator: programs that only write or check signals use the
//! crate without its default features.

use std::fmt;

/// Cycles of the Uno's clock in a second.
pub const CYCLES_PER_SECOND: u64 = 16_000_000;

/// A pin of the Uno, by its name on the board. The serial line's bytes are no levels of D0 and D1.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pin {
    /// PD0, the serial line's input.
    D0,
    /// PD1, the serial line's output.
    D1,
    /// PD2, INT0.
    D2,
    /// PD3, INT1 and output B of Timer2.
    D3,
    /// PD4.
    D4,
    /// PD5, output B of Timer0.
    D5,
    /// PD6, output A of Timer0.
    D6,
    /// PD7.
    D7,
    /// PB0.
    D8,
    /// PB1, output A of Timer1.
    D9,
    /// PB2, output B of Timer1.
    D10,
    /// PB3, output A of Timer2.
    D11,
    /// PB4.
    D12,
    /// PB5, with the board's LED.
    D13,
    /// PC0, channel 0 of the ADC.
    A0,
    /// PC1, channel 1 of the ADC.
    A1,
    /// PC2, channel 2 of the ADC.
    A2,
    /// PC3, channel 3 of the ADC.
    A3,
    /// PC4, channel 4 of the ADC.
    A4,
    /// PC5, channel 5 of the ADC.
    A5,
}

impl Pin {
    /// Every pin, in the order of the board's numbering.
    pub const ALL: [Pin; 20] = [
        Pin::D0,
        Pin::D1,
        Pin::D2,
        Pin::D3,
        Pin::D4,
        Pin::D5,
        Pin::D6,
        Pin::D7,
        Pin::D8,
        Pin::D9,
        Pin::D10,
        Pin::D11,
        Pin::D12,
        Pin::D13,
        Pin::A0,
        Pin::A1,
        Pin::A2,
        Pin::A3,
        Pin::A4,
        Pin::A5,
    ];

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

    /// The pin at a bit of a port; `None` if the board has none there.
    pub const fn at(port: char, bit: u8) -> Option<Pin> {
        let number = match (port, bit) {
            ('D', 0..8) => bit,
            ('B', 0..6) => bit + 8,
            ('C', 0..6) => bit + 14,
            _ => return None,
        };
        Some(Pin::ALL[number as usize])
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_is_at_its_port_and_bit() {
        for (number, pin) in (0..).zip(Pin::ALL) {
            assert_eq!(pin.number(), number);
            let (port, bit) = pin.port_and_bit();
            assert_eq!(Pin::at(port, bit), Some(pin));
        }
        assert_eq!([Pin::at('B', 6), Pin::at('C', 6), Pin::at('D', 8), Pin::at('E', 0)], [None; 4]);
        assert_eq!(Pin::A3.to_string(), "A3");
        assert_eq!(Pin::ALL.map(Pin::adc_channel)[13..16], [None, Some(0), Some(1)]);
    }
}
