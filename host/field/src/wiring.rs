//! The wiring: the connections of the Uno's contacts. The manual's table is made from this one, and a test compares its
//! diagram, docs/wiring.svg.
//!
//! The firmware's own pins are in its peripherals' files. The constants here repeat them for the simulated machine. The
//! firmware's tests run on that machine, so they fail if a pin here is wrong. Supply and ground are not in the table:
//! the diagram shows them.

use std::fmt::Write;
use uno::{Pin, Wire};

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

/// Makes the constants, [`WIRES`] and [`CONNECTIONS`] from the one table of pins.
macro_rules! pins {
    ($($(#[doc = $about:literal])*
    $PIN:ident: $pin:ident $name:literal $high_at_rest:literal, $goes_to:literal, $pull_up:expr, $note:literal;)*) => {
        $($(#[doc = $about])* pub const $PIN: Pin = Pin::$pin;)*

        /// The wires of the pins, in the order of the board's numbering. At rest both channels of the encoder are low
        /// and the beam is clear. The switches are open on their pull-ups, and the outputs are not driven yet.
        pub const WIRES: [Wire; 8] = [$(Wire { pin: Pin::$pin, name: $name, high_at_rest: $high_at_rest },)*];

        /// Every connection of a contact that carries a signal, in the order of the board's numbering.
        pub const CONNECTIONS: [Connection; 9] = [
            $(Connection { pin: Some(Pin::$pin), goes_to: $goes_to, pull_up: $pull_up, note: $note },)*
            Connection {
                pin: None,
                goes_to: "serial, 115200 baud 8N1",
                pull_up: "",
                note: "through the Uno's USB; connect nothing else",
            },
        ];
    };
}

pins! {
    /// Encoder channel A.
    ENCODER_A: D2 "encoder_a" false, "encoder A", EXTERNAL, "forward is A before B";
    /// Encoder channel B.
    ENCODER_B: D3 "encoder_b" false, "encoder B", EXTERNAL, "swap A and B if the position counts backwards";
    /// Work switch, low = work.
    WORK_SWITCH: D4 "work_switch" true, "work switch to ground", INTERNAL, "closed = work";
    /// Optional end switch, low = tool out.
    END_SWITCH: D5 "end_switch" true, "end switch to ground, optional", INTERNAL,
        "closed = tool out; `set end_switch on` enables it";
    /// Beam, low = broken.
    BEAM: D8 "beam" true, "beam's output", EXTERNAL, "low = broken; never above 5 V, or use an optocoupler";
    /// Servo signal, an output.
    SERVO: D9 "servo" false, "servo's signal", "", "1500 us = 0 degrees, tool in the row; 2000 us = 45 degrees, out";
    /// Optional second beam, low = broken.
    SECOND_BEAM: D10 "second_beam" true, "second beam's output, optional", EXTERNAL,
        "low = broken; `set second_beam_mm` enables it";
    /// Status LED, an output.
    LED: D13 "led" false, "the Uno's own LED", "", "on = work, or tool out in a test; one flash a second = hold; groups = alarm";
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
