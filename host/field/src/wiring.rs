//! The wiring: the connected pins of the Uno. A test compares the manual's table and its diagrams.
//!
//! The firmware's own pins are in its peripherals' files. The constants here repeat them for the simulated machine. The
//! firmware's tests run on that machine, so they fail if a pin here is wrong.

use uno::{Pin, Wire};

/// Encoder channel A.
pub const ENCODER_A: Pin = Pin::D2;
/// Encoder channel B.
pub const ENCODER_B: Pin = Pin::D3;
/// Work switch, low = work.
pub const WORK_SWITCH: Pin = Pin::D4;
/// Optional end switch, low = tool out.
pub const END_SWITCH: Pin = Pin::D5;
/// Beam, low = broken.
pub const BEAM: Pin = Pin::D8;
/// Servo signal, an output.
pub const SERVO: Pin = Pin::D9;
/// Optional second beam, low = broken.
pub const SECOND_BEAM: Pin = Pin::D10;
/// Status LED, an output.
pub const LED: Pin = Pin::D13;

/// The wires of the pins, in the order of the board's numbering. At rest both channels of the encoder are low and the
/// beam is clear. The switches are open on their pull-ups, and the outputs are not driven yet.
pub const WIRES: [Wire; 8] = [
    Wire { pin: ENCODER_A, name: "encoder_a", high_at_rest: false },
    Wire { pin: ENCODER_B, name: "encoder_b", high_at_rest: false },
    Wire { pin: WORK_SWITCH, name: "work_switch", high_at_rest: true },
    Wire { pin: END_SWITCH, name: "end_switch", high_at_rest: true },
    Wire { pin: BEAM, name: "beam", high_at_rest: true },
    Wire { pin: SERVO, name: "servo", high_at_rest: false },
    Wire { pin: SECOND_BEAM, name: "second_beam", high_at_rest: true },
    Wire { pin: LED, name: "led", high_at_rest: false },
];
