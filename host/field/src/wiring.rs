//! The wiring: the connections of the Uno's contacts. The manual's table is made from this one, and a test compares its
//! diagram, docs/wiring.svg.
//!
//! The firmware's own pins are in its peripherals' files. The constants here repeat them for the simulated machine. The
//! firmware's tests run on that machine, so they fail if a pin here is wrong. Supply and ground are not in the table:
//! the diagram shows them.

use std::fmt::Write;
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

/// Optional second beam, low = broken.
pub const SECOND_BEAM: Pin = Pin::D10;

/// Servo signal, an output.
pub const SERVO: Pin = Pin::D9;

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

/// A connection of one contact of the Uno, or of a pair of them.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// The pin that the weeder reads or drives. `None` for D0 and D1: the serial line, also at the Uno's USB plug.
    pub pin: Option<Pin>,
    /// The other side.
    pub goes_to: &'static str,
    /// The resistor that keeps the line high when nothing pulls it low. It is empty for an output, and for a line that
    /// is driven both ways.
    pub pull_up: &'static str,
    /// A note for the builder.
    pub note: &'static str,
}

/// A pull-up to be soldered. The chip's own of 20 to 50 k is too weak for a long cable in a noisy place.
pub const EXTERNAL: &str = "4.7 k to 5 V";

/// The chip's own pull-up.
const INTERNAL: &str = "in the chip";

/// Every connection of a contact that carries a signal, in the order of the board's numbering.
pub const CONNECTIONS: [Connection; 9] = [
    of_pin(ENCODER_A, "encoder A", EXTERNAL, "forward is A before B"),
    of_pin(ENCODER_B, "encoder B", EXTERNAL, "swap A and B if the position counts backwards"),
    of_pin(WORK_SWITCH, "work switch to ground", INTERNAL, "closed = work"),
    of_pin(END_SWITCH, "end switch to ground, optional", INTERNAL, "closed = tool out; `set end_switch on` enables it"),
    of_pin(BEAM, "beam's output", EXTERNAL, "low = broken; never above 5 V, or use an optocoupler"),
    of_pin(SERVO, "servo's signal", "", "1500 us = 0 degrees, tool in the row; 2000 us = 45 degrees, out"),
    of_pin(SECOND_BEAM, "second beam's output, optional", EXTERNAL, "low = broken; `set second_beam_mm` enables it"),
    of_pin(LED, "the Uno's own LED", "", "on = work; one flash a second = hold; groups of flashes = alarm code"),
    Connection {
        pin: None,
        goes_to: "serial, 115200 baud 8N1",
        pull_up: "",
        note: "through the Uno's USB; connect nothing else",
    },
];

const fn of_pin(pin: Pin, goes_to: &'static str, pull_up: &'static str, note: &'static str) -> Connection {
    Connection { pin: Some(pin), goes_to, pull_up, note }
}

/// The connections as a table in Markdown.
pub fn table() -> String {
    let mut table = "| Uno | goes to | pull-up | notes |\n| --- | --- | --- | --- |\n".to_owned();
    for Connection { pin, goes_to, pull_up, note } in CONNECTIONS {
        let contact = pin.map_or("D0, D1".to_owned(), |pin| pin.to_string());
        // Writing to a String does not fail.
        let _ = writeln!(table, "| {contact} | {goes_to} | {pull_up} | {note} |");
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_is_wired_once() {
        for Wire { pin, .. } in WIRES {
            let wired = CONNECTIONS.iter().filter(|connection| connection.pin == Some(pin));
            assert_eq!(wired.count(), 1, "{pin:?}");
        }
    }
}
