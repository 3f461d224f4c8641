//! The wiring: which contact of the Uno goes where, as the one table behind the manual's table and its diagram.
//!
//! The firmware's own pins stand in its peripherals' files; [`Pin`] says the same for the virtual Uno, which the firmware is
//! tested on, so that a pin that is wrong here fails there. Supply and ground are no contacts of the table: the
//! [`diagram`] draws them.

pub mod diagram;

use crate::signal::Pin;
use std::fmt::Write;

/// What one contact of the Uno, or a pair of them, is wired to.
#[derive(Clone, Copy, Debug)]
pub struct Connection {
    /// The Uno's side.
    pub contact: Contact,
    /// The other side.
    pub goes_to: &'static str,
    /// What keeps the line high when nothing pulls it low.
    pub pull_up: PullUp,
    /// What to know of it.
    pub note: &'static str,
}

/// A contact of the Uno.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Contact {
    /// A pin that the weeder reads or drives.
    Pin(Pin),
    /// D0 and D1, the serial line, which is at the Uno's USB plug too.
    Serial,
}

impl Contact {
    /// What is printed beside it on the board.
    pub fn label(self) -> String {
        match self {
            Contact::Serial => "D0, D1".to_owned(),
            // The Uno's digital pins are the chip's port D, and then its port B.
            Contact::Pin(pin) => match pin.port_and_bit() {
                ('D', bit) => format!("D{bit}"),
                (_, bit) => format!("D{}", 8 + bit),
            },
        }
    }
}

/// A resistor to 5 V.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PullUp {
    /// Of 4.7 k, to be soldered: the chip's own of 20 to 50 k is too weak for a long cable in a noisy place.
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
pub const CONNECTIONS: [Connection; 8] = [
    Connection {
        contact: Contact::Pin(Pin::EncoderA),
        goes_to: "encoder A",
        pull_up: PullUp::External,
        note: "forward is A before B",
    },
    Connection {
        contact: Contact::Pin(Pin::EncoderB),
        goes_to: "encoder B",
        pull_up: PullUp::External,
        note: "change it for A where the position counts backwards",
    },
    Connection {
        contact: Contact::Pin(Pin::WorkSwitch),
        goes_to: "work switch to ground",
        pull_up: PullUp::Internal,
        note: "closed = work",
    },
    Connection {
        contact: Contact::Pin(Pin::EndSwitch),
        goes_to: "end switch to ground, optional",
        pull_up: PullUp::Internal,
        note: "closed = tool out; `set end_switch on` has it watched",
    },
    Connection {
        contact: Contact::Pin(Pin::Beam),
        goes_to: "beam's output",
        pull_up: PullUp::External,
        note: "low = broken; never above 5 V, else by an optocoupler",
    },
    Connection {
        contact: Contact::Pin(Pin::Servo),
        goes_to: "servo's signal",
        pull_up: PullUp::None,
        note: "1500 us = 0 degrees, tool in the row; 2000 us = 45 degrees, out",
    },
    Connection {
        contact: Contact::Pin(Pin::Led),
        goes_to: "the Uno's own LED",
        pull_up: PullUp::None,
        note: "steady at work, a flash a second in hold, flashes in a row = an alarm's code",
    },
    Connection {
        contact: Contact::Serial,
        goes_to: "serial, 115200 baud 8N1",
        pull_up: PullUp::None,
        note: "through the Uno's USB; leave the contacts free",
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
        for pin in Pin::ALL {
            let wired = CONNECTIONS.iter().filter(|connection| connection.contact == Contact::Pin(pin));
            assert_eq!(wired.count(), 1, "{pin:?}");
        }
    }

    #[test]
    fn contacts_are_called_as_on_the_board() {
        let labels: Vec<String> = CONNECTIONS.iter().map(|connection| connection.contact.label()).collect();
        assert_eq!(labels, ["D2", "D3", "D4", "D5", "D8", "D9", "D13", "D0, D1"]);
    }
}
