//! What passes between the simulated machine and the virtual Uno: levels on pins, at cycles.
//!
//! The machine turns a motion past a row into a list of [`PinChange`]s; the virtual Uno plays them to the firmware and
//! gives back what the firmware did to its own pins in the same form. Nothing here knows how either side works.

/// Cycles of the Uno's clock in a second.
pub const CYCLES_PER_SECOND: u64 = 16_000_000;

/// A pin of the Uno that the weeder uses (the README's wiring table).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Pin {
    /// D2: encoder channel A.
    EncoderA,
    /// D3: encoder channel B.
    EncoderB,
    /// D4: work switch, low = work.
    WorkSwitch,
    /// D5: optional end switch, low = tool out.
    EndSwitch,
    /// D8: beam, low = broken.
    Beam,
    /// D9: servo signal, an output.
    Servo,
    /// D13: status LED, an output.
    Led,
}

impl Pin {
    /// Every pin, in the order of the board's numbering.
    pub const ALL: [Pin; 7] =
        [Pin::EncoderA, Pin::EncoderB, Pin::WorkSwitch, Pin::EndSwitch, Pin::Beam, Pin::Servo, Pin::Led];

    /// The pin's name in a waveform file.
    pub const fn name(self) -> &'static str {
        match self {
            Pin::EncoderA => "encoder_a",
            Pin::EncoderB => "encoder_b",
            Pin::WorkSwitch => "work_switch",
            Pin::EndSwitch => "end_switch",
            Pin::Beam => "beam",
            Pin::Servo => "servo",
            Pin::Led => "led",
        }
    }

    /// Whether the firmware drives the pin; the others are driven by the machine.
    pub const fn is_output(self) -> bool {
        matches!(self, Pin::Servo | Pin::Led)
    }

    /// The level before anything has happened: the wheel at a step where both channels are low, the beam clear, the
    /// switches open on their pull-ups, the outputs not driven yet.
    pub const fn level_at_rest(self) -> bool {
        matches!(self, Pin::WorkSwitch | Pin::EndSwitch | Pin::Beam)
    }

    /// The ATmega328P's port letter and bit.
    pub const fn port_and_bit(self) -> (char, u8) {
        match self {
            Pin::EncoderA => ('D', 2),
            Pin::EncoderB => ('D', 3),
            Pin::WorkSwitch => ('D', 4),
            Pin::EndSwitch => ('D', 5),
            Pin::Beam => ('B', 0),
            Pin::Servo => ('B', 1),
            Pin::Led => ('B', 5),
        }
    }
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

/// One pulse on the servo's line.
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
