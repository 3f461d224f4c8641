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
    /// The Uno's side.
    pub contact: Contact,
    /// The other side.
    pub goes_to: &'static str,
    /// The resistor that keeps the line high when nothing pulls it low.
    pub pull_up: PullUp,
    /// A note for the builder.
    pub note: &'static str,
}

/// A contact of the Uno.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// A pin that the weeder reads or drives.
    Pin(Pin),
    /// D0 and D1, the serial line, which is also at the Uno's USB plug.
    Serial,
}

impl Contact {
    /// Its label on the board.
    pub fn label(self) -> String {
        match self {
            Contact::Serial => "D0, D1".to_owned(),
            Contact::Pin(pin) => format!("D{}", pin.number()),
        }
    }
}

/// A resistor to 5 V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PullUp {
    /// 4.7 k, to be soldered. The chip's own of 20 to 50 k is too weak for a long cable in a noisy place.
    External,
    /// The chip's own.
    Internal,
    /// None: the line is an output, or driven both ways.
    None,
}

impl PullUp {
    /// In a table's cell.
    fn text(self) -> &'static str {
        match self {
            PullUp::External => "4.7 k to 5 V",
            PullUp::Internal => "in the chip",
            PullUp::None => "",
        }
    }
}

/// Every connection of a contact that carries a signal, in the order of the board's numbering.
pub const CONNECTIONS: [Connection; 9] = [
    Connection {
        contact: Contact::Pin(ENCODER_A),
        goes_to: "encoder A",
        pull_up: PullUp::External,
        note: "forward is A before B",
    },
    Connection {
        contact: Contact::Pin(ENCODER_B),
        goes_to: "encoder B",
        pull_up: PullUp::External,
        note: "swap A and B if the position counts backwards",
    },
    Connection {
        contact: Contact::Pin(WORK_SWITCH),
        goes_to: "work switch to ground",
        pull_up: PullUp::Internal,
        note: "closed = work",
    },
    Connection {
        contact: Contact::Pin(END_SWITCH),
        goes_to: "end switch to ground, optional",
        pull_up: PullUp::Internal,
        note: "closed = tool out; `set end_switch on` enables it",
    },
    Connection {
        contact: Contact::Pin(BEAM),
        goes_to: "beam's output",
        pull_up: PullUp::External,
        note: "low = broken; never above 5 V, or use an optocoupler",
    },
    Connection {
        contact: Contact::Pin(SERVO),
        goes_to: "servo's signal",
        pull_up: PullUp::None,
        note: "1500 us = 0 degrees, tool in the row; 2000 us = 45 degrees, out",
    },
    Connection {
        contact: Contact::Pin(SECOND_BEAM),
        goes_to: "second beam's output, optional",
        pull_up: PullUp::External,
        note: "low = broken; `set second_beam_mm` enables it",
    },
    Connection {
        contact: Contact::Pin(LED),
        goes_to: "the Uno's own LED",
        pull_up: PullUp::None,
        note: "on = work; one flash a second = hold; groups of flashes = alarm code",
    },
    Connection {
        contact: Contact::Serial,
        goes_to: "serial, 115200 baud 8N1",
        pull_up: PullUp::None,
        note: "through the Uno's USB; connect nothing else",
    },
];

/// The connections as a table in Markdown.
pub fn table() -> String {
    let mut table = "| Uno | goes to | pull-up | notes |\n| --- | --- | --- | --- |\n".to_owned();
    for Connection { contact, goes_to, pull_up, note } in CONNECTIONS {
        // Writing to a String does not fail.
        let _ = writeln!(table, "| {} | {goes_to} | {} | {note} |", contact.label(), pull_up.text());
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pin_is_wired_once() {
        for Wire { pin, .. } in WIRES {
            let wired = CONNECTIONS.iter().filter(|connection| connection.contact == Contact::Pin(pin));
            assert_eq!(wired.count(), 1, "{pin:?}");
        }
    }

    #[test]
    fn contacts_are_called_as_on_the_board() {
        let labels: Vec<String> = CONNECTIONS.iter().map(|connection| connection.contact.label()).collect();
        assert_eq!(labels, ["D2", "D3", "D4", "D5", "D8", "D9", "D10", "D13", "D0, D1"]);
    }
}
