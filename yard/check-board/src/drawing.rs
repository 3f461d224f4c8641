//! The drawing of the wires between the two boards, made from the table of both firmwares' pins.

use svg::Document;
use svg::node::element::{Line, Rectangle, Text};
use tester_core::pins::WIRES;

/// Pixels: the drawing's width, the boards' width, and the distance between two wires.
const WIDTH: usize = 720;
const BOARD: usize = 150;
const PITCH: usize = 34;

/// Pixels above the first wire.
const TOP: usize = 70;

/// The resistor in a wire. A board may pull its reset up by 1 k, as the Nano does, so that wire has a smaller one.
fn resistor(name: &str) -> &str {
    if name == "reset" { "220" } else { "1 k" }
}

/// The drawing.
pub fn wires() -> Document {
    let height = TOP + WIRES.len() * PITCH;
    let mut drawing = Document::new()
        .set("viewBox", (0, 0, WIDTH, height + 10))
        .set("font-family", "sans-serif")
        .set("font-size", 15)
        .add(Rectangle::new().set("width", WIDTH).set("height", height + 10).set("fill", "white"));
    for (x, name) in [(10, "tester"), (WIDTH - BOARD - 10, "weeder")] {
        let board = Rectangle::new().set("x", x).set("y", 10).set("width", BOARD).set("height", height - 10);
        drawing = drawing
            .add(board.set("rx", 8).set("fill", "#e8f0f8").set("stroke", "#345"))
            .add(text(x + BOARD / 2, 36, "middle", name).set("font-weight", "bold"));
    }
    for (number, wire) in WIRES.iter().enumerate() {
        let y = TOP + number * PITCH;
        let (left, right) = (10 + BOARD, WIDTH - BOARD - 10);
        let line = Line::new().set("x1", left).set("y1", y).set("x2", right).set("y2", y);
        drawing = drawing
            .add(line.set("stroke", "#345").set("stroke-width", 2))
            .add(text(left - 10, y + 5, "end", wire.tester))
            .add(text(right + 10, y + 5, "start", wire.weeder))
            .add(text(left + 20, y - 5, "start", wire.name));
        if wire.name != "ground" {
            let outline = Rectangle::new().set("x", WIDTH / 2 + 40).set("y", y - 10).set("width", 46).set("height", 20);
            drawing = drawing.add(outline.set("fill", "white").set("stroke", "#345")).add(text(
                WIDTH / 2 + 63,
                y + 5,
                "middle",
                resistor(wire.name),
            ));
        }
    }
    drawing
}

fn text(x: usize, y: usize, anchor: &str, words: &str) -> Text {
    Text::new(words).set("x", x).set("y", y).set("text-anchor", anchor)
}
