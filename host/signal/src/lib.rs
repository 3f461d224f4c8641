//! What passes between a simulated machine and the virtual Uno: levels on pins, at cycles.
//!
//! The machine turns a motion past a row into a list of [`PinChange`]s; the virtual Uno plays them to the firmware and
//! gives back what the firmware did to its own pins in the same form. Nothing here knows how either side works: a [`Pin`] has
//! the board's number, and what is wired to it is told by a table of [`Wire`]s.

/// Cycles of the Uno's clock in a second.
pub const CYCLES_PER_SECOND: u64 = 16_000_000;

/// A digital pin of the Uno, by its number on the board. D0 and D1 are its serial line and carry no levels here.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pin {
    /// PD2.
    D2,
    /// PD3.
    D3,
    /// PD4.
    D4,
    /// PD5.
    D5,
    /// PD6.
    D6,
    /// PD7.
    D7,
    /// PB0.
    D8,
    /// PB1, output A of Timer1.
    D9,
    /// PB2.
    D10,
    /// PB3.
    D11,
    /// PB4.
    D12,
    /// PB5, with the board's LED.
    D13,
}

impl Pin {
    /// Every pin, in the order of the board's numbering.
    pub const ALL: [Pin; 12] = [
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
    ];

    /// Its number on the board, from 2 to 13.
    pub const fn number(self) -> u8 {
        self as u8 + 2
    }

    /// The ATmega328P's port letter and bit: the board's pins are port D, and from D8 on port B.
    pub const fn port_and_bit(self) -> (char, u8) {
        match self.number() {
            number @ ..8 => ('D', number),
            number => ('B', number - 8),
        }
    }
}

/// What is wired to a pin.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wire {
    /// The pin.
    pub pin: Pin,
    /// What it is called in a waveform file.
    pub name: &'static str,
    /// The level before anything has happened.
    pub high_at_rest: bool,
}

/// A pin that took a level.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PinChange {
    /// When, in cycles since power-up.
    pub cycle: u64,
    /// Which pin.
    pub pin: Pin,
    /// The level it has from then on.
    pub high: bool,
}

/// One pulse on a servo's line.
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
