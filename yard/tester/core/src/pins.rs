//! The tester's pins, by number as printed on the board, and the weeder's pins that they are wired to.
//!
//! The six lines of [`Line`] are port C, so that one write changes all of them. The firmware uses the same bits.

/// A line that the tester drives, and its bit of port C.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Line {
    /// Encoder channel A.
    EncoderA = 1,
    /// Encoder channel B.
    EncoderB = 1 << 1,
    /// The beam: low is broken.
    Beam = 1 << 2,
    /// The second beam: low is broken.
    SecondBeam = 1 << 3,
    /// The end switch: low is out.
    EndSwitch = 1 << 4,
    /// The work switch: low is work.
    WorkSwitch = 1 << 5,
}

impl Line {
    /// All lines, in the order of their bits.
    pub const ALL: [Self; 6] =
        [Self::EncoderA, Self::EncoderB, Self::Beam, Self::SecondBeam, Self::EndSwitch, Self::WorkSwitch];

    /// Its bit of port C, and in each mask of a message.
    pub const fn bit(self) -> u8 {
        self as u8
    }
}

/// The lines that are high at rest: beams clear, switches open. Both encoder channels are low.
pub const AT_REST: u8 = Line::Beam.bit() | Line::SecondBeam.bit() | Line::EndSwitch.bit() | Line::WorkSwitch.bit();

/// All lines.
pub const ALL_LINES: u8 = AT_REST | Line::EncoderA.bit() | Line::EncoderB.bit();

/// A wire between the two boards.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wire {
    /// Its signal.
    pub name: &'static str,
    /// The tester's pin, as printed on the board.
    pub tester: &'static str,
    /// The weeder's pin, as printed on the board.
    pub weeder: &'static str,
}

/// All wires, with ground.
pub const WIRES: [Wire; 10] = [
    Wire { name: "encoder A", tester: "A0", weeder: "D2" },
    Wire { name: "encoder B", tester: "A1", weeder: "D3" },
    Wire { name: "beam", tester: "A2", weeder: "D8" },
    Wire { name: "second beam", tester: "A3", weeder: "D10" },
    Wire { name: "end switch", tester: "A4", weeder: "D5" },
    Wire { name: "work switch", tester: "A5", weeder: "D4" },
    Wire { name: "reset", tester: "D7", weeder: "RESET" },
    Wire { name: "LED", tester: "D6", weeder: "D13" },
    Wire { name: "servo", tester: "D8", weeder: "D9" },
    Wire { name: "ground", tester: "GND", weeder: "GND" },
];
