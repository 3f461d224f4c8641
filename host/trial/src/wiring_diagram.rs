//! The wiring diagram, drawn from the table of connections.
//!
//! The Uno stands on the left, and every line of the table leaves it to the right, at its own height, towards what it
//! goes to. Supplies and ground are not drawn as wires but as marks: all marks of a kind are joined. The places are
//! pixels; what is drawn of a part is what one has to know to wire it, not what it looks like.

use drawing::{INK, Legend, PALE_INK, document, line, paper, rectangle, swatch, tenth, words};
use field::wiring::{self, CONNECTIONS, Contact, PullUp};
use signal::Pin;
use svg::Document;
use svg::node::element::{Circle, Group, Path, Rectangle, Text};

const WIDTH: f64 = 1040.0;
const HEIGHT: f64 = 826.0;

/// The Uno's board.
const UNO_X: f64 = 60.0;
const UNO_Y: f64 = 216.0;
const UNO_WIDTH: f64 = 190.0;
const UNO_HEIGHT: f64 = 400.0;
const PINS_X: f64 = UNO_X + UNO_WIDTH;

/// Where the parts begin, and where pull-ups stand.
const PARTS_X: f64 = 560.0;
const PULL_UP_X: f64 = 340.0;
const PULL_UP_HEIGHT: f64 = 34.0;

const SIGNAL: &str = "#2a6f97";
const FIVE_VOLTS: &str = "#b07d12";
const TWELVE_VOLTS: &str = "#cf3a32";
const SERVO_SUPPLY: &str = "#8d4fa8";
const GROUND: &str = INK;
const BOARD: &str = "#d5e6e3";
const PART: &str = "#efece2";
const PANEL: &str = "#f4f2ea";
const PANEL_EDGE: &str = "#d8d4c6";
const PLANT: &str = "#4c9a50";
const LIGHT: &str = "#e0655e";
const LAMP: &str = "#e0a526";

/// Draws the wiring.
pub fn draw() -> Document {
    let mut diagram = document(WIDTH, HEIGHT).add(paper(WIDTH, HEIGHT)).add(power()).add(uno());
    for connection in CONNECTIONS {
        let Contact::Pin(pin) = connection.contact else { continue };
        let y = height(pin);
        diagram =
            diagram.add(words(PINS_X - 10.0, y + 4.0, &connection.contact.label(), INK).set("text-anchor", "end"));
        if pin == wiring::LED {
            diagram = diagram.add(dot(UNO_X + 126.0, y, 6.0, LAMP));
            continue;
        }
        diagram = diagram.add(wire(&[(PINS_X, y), (PARTS_X, y)], SIGNAL)).add(contact(PINS_X, y));
        if connection.pull_up == PullUp::External {
            // Neighbours' resistors stand side by side.
            let x = if pin == wiring::ENCODER_B { PULL_UP_X + 70.0 } else { PULL_UP_X };
            diagram = diagram.add(pull_up(x, y, PULL_UP_HEIGHT + if pin == wiring::ENCODER_B { 44.0 } else { 0.0 }));
        }
        diagram = diagram.add(part(pin, y));
    }
    diagram.add(optocoupler()).add(legend())
}

/// The height at which a pin leaves the board.
const fn height(pin: Pin) -> f64 {
    match pin {
        wiring::ENCODER_A => 252.0,
        wiring::ENCODER_B => 296.0,
        wiring::WORK_SWITCH => 354.0,
        wiring::END_SWITCH => 408.0,
        wiring::BEAM => 490.0,
        wiring::SERVO => 560.0,
        wiring::LED => 596.0,
        _ => panic!("nothing is wired to this pin"),
    }
}

/// Battery, fuses, emergency stop and the servo's regulator, along the top.
fn power() -> Group {
    const Y: f64 = 120.0;
    const STOP_Y: f64 = 56.0;
    let battery = boxed(40.0, Y - 34.0, 110.0, 68.0, &["battery", "12 V"])
        .add(wire(&[(95.0, Y + 34.0), (95.0, Y + 48.0)], GROUND))
        .add(ground(95.0, Y + 48.0));
    let servo_fuse = fuse(206.0, Y, "fuse", "10 A");
    let stop = Group::new()
        .add(line(345.0, STOP_Y, 345.0, Y - 2.0, PALE_INK).set("stroke-dasharray", "4 3"))
        .add(line(345.0, STOP_Y, 700.0, STOP_Y, PALE_INK).set("stroke-dasharray", "4 3"))
        .add(closed(320.0, Y, TWELVE_VOLTS))
        .add(rectangle(325.0, STOP_Y - 14.0, 40.0, 14.0, TWELVE_VOLTS).set("rx", 7))
        .add(words(376.0, STOP_Y - 8.0, "emergency stop: cuts the servo's supply, latches", INK))
        .add(boxed(700.0, STOP_Y - 24.0, 190.0, 48.0, &["second contact", "stops engine or drive"]));
    let regulator = boxed(450.0, Y - 26.0, 150.0, 54.0, &["regulator", "to the servo's voltage"])
        .add(wire(&[(525.0, Y + 28.0), (525.0, Y + 36.0)], GROUND))
        .add(ground(525.0, Y + 36.0));
    let logic_fuse = Group::new()
        .add(wire(&[(262.0, Y), (262.0, 176.0), (178.0, 176.0)], TWELVE_VOLTS))
        .add(dot(262.0, Y, 3.5, TWELVE_VOLTS))
        .add(fuse_body(222.0, 176.0))
        .add(words(222.0, 198.0, "fuse 1 A", INK).set("text-anchor", "middle"))
        .add(mark(178.0, 176.0, Side::Left, "12 V", TWELVE_VOLTS));
    let servo_y = height(wiring::SERVO) + 18.0;
    Group::new()
        .add(wire(&[(150.0, Y), (320.0, Y)], TWELVE_VOLTS))
        .add(wire(&[(370.0, Y), (450.0, Y)], TWELVE_VOLTS))
        .add(wire(&[(600.0, Y), (1004.0, Y), (1004.0, servo_y), (PARTS_X + 150.0, servo_y)], SERVO_SUPPLY))
        .add(capacitor(PARTS_X + 330.0, servo_y))
        .add(battery)
        .add(servo_fuse)
        .add(logic_fuse)
        .add(stop)
        .add(regulator)
}

/// The board, with what is wired to its supply and USB.
fn uno() -> Group {
    let (jack_y, five_y, ground_y, usb_y) = (UNO_Y + 40.0, UNO_Y + 96.0, UNO_Y + 140.0, UNO_Y + 330.0);
    let inside = |y: f64, label: &str| words(UNO_X + 12.0, y + 4.0, label, INK);
    Group::new()
        .add(rectangle(UNO_X, UNO_Y, UNO_WIDTH, UNO_HEIGHT, BOARD).set("rx", 12).set("stroke", PALE_INK))
        .add(title(UNO_X + 84.0, UNO_Y + 206.0, "Arduino Uno"))
        .add(words(UNO_X + 126.0, height(wiring::LED) - 12.0, "LED", INK).set("text-anchor", "middle"))
        .add(inside(jack_y, "jack, Vin"))
        .add(wire(&[(UNO_X - 16.0, jack_y), (UNO_X, jack_y)], TWELVE_VOLTS))
        .add(contact(UNO_X, jack_y))
        .add(mark(UNO_X - 16.0, jack_y, Side::Left, "12 V", TWELVE_VOLTS))
        .add(inside(five_y, "5V"))
        .add(wire(&[(UNO_X - 16.0, five_y), (UNO_X, five_y)], FIVE_VOLTS))
        .add(contact(UNO_X, five_y))
        .add(mark(UNO_X - 16.0, five_y, Side::Left, "5 V", FIVE_VOLTS))
        .add(inside(ground_y, "GND"))
        .add(wire(&[(UNO_X, ground_y), (UNO_X - 24.0, ground_y), (UNO_X - 24.0, ground_y + 12.0)], GROUND))
        .add(contact(UNO_X, ground_y))
        .add(ground(UNO_X - 24.0, ground_y + 12.0))
        .add(rectangle(UNO_X - 12.0, usb_y - 16.0, 40.0, 32.0, "#c9c6bd").set("rx", 3))
        .add(words(UNO_X + 34.0, usb_y + 4.0, "USB", INK))
        .add(wire(&[(UNO_X - 12.0, usb_y), (UNO_X - 30.0, usb_y), (UNO_X - 30.0, UNO_Y + 430.0)], SIGNAL))
        .add(words(UNO_X - 34.0, UNO_Y + 448.0, "laptop: serial monitor", INK))
        .add(words(UNO_X - 34.0, UNO_Y + 464.0, "at 115200 baud (D0, D1)", PALE_INK))
}

/// What a pin goes to.
fn part(pin: Pin, y: f64) -> Group {
    match pin {
        wiring::ENCODER_A => encoder(y),
        wiring::WORK_SWITCH => switch(y, "work switch", "closed = work", false),
        wiring::END_SWITCH => switch(y, "end switch, optional", "closed = the tool is out", true),
        wiring::BEAM => beam(y),
        wiring::SERVO => servo(y),
        // Encoder B is drawn with channel A, and the LED on the board.
        _ => Group::new(),
    }
}

fn encoder(y: f64) -> Group {
    let right = PARTS_X + 150.0;
    boxed(PARTS_X, y - 22.0, 150.0, 88.0, &["encoder", "600 lines,", "on the ground wheel"])
        .add(words(PARTS_X - 8.0, y - 5.0, "A", SIGNAL).set("text-anchor", "end"))
        .add(words(PARTS_X - 8.0, height(wiring::ENCODER_B) - 5.0, "B", SIGNAL).set("text-anchor", "end"))
        .add(wire(&[(right, y), (right + 24.0, y)], FIVE_VOLTS))
        .add(mark(right + 24.0, y, Side::Right, "5 V", FIVE_VOLTS))
        .add(wire(&[(right, y + 44.0), (right + 30.0, y + 44.0), (right + 30.0, y + 52.0)], GROUND))
        .add(ground(right + 30.0, y + 52.0))
}

fn switch(y: f64, name: &str, meaning: &str, optional: bool) -> Group {
    let end = PARTS_X + 96.0;
    let mut contacts = Group::new()
        .add(wire(&[(PARTS_X, y), (PARTS_X + 24.0, y)], SIGNAL))
        .add(opened(PARTS_X + 24.0, y, SIGNAL))
        .add(wire(&[(PARTS_X + 74.0, y), (end, y), (end, y + 10.0)], GROUND));
    if optional {
        contacts = contacts.set("stroke-dasharray", "5 3");
    }
    Group::new()
        .add(contacts)
        .add(ground(end, y + 10.0))
        .add(words(end + 24.0, y - 2.0, name, INK).set("font-weight", 600))
        .add(words(end + 24.0, y + 14.0, meaning, PALE_INK))
}

fn beam(y: f64) -> Group {
    const EMITTER_X: f64 = 860.0;
    let right = PARTS_X + 120.0;
    let supplied = |x: f64| {
        Group::new()
            .add(wire(&[(x + 20.0, y - 22.0), (x + 20.0, y - 32.0)], TWELVE_VOLTS))
            .add(mark(x + 20.0, y - 32.0, Side::Up, "12 V", TWELVE_VOLTS))
            .add(wire(&[(x + 90.0, y + 22.0), (x + 90.0, y + 26.0)], GROUND))
            .add(ground(x + 90.0, y + 26.0))
    };
    Group::new()
        .add(
            line(right, y, EMITTER_X, y, LIGHT)
                .set("stroke-width", 3)
                .set("stroke-dasharray", "9 5")
                .set("opacity", 0.8),
        )
        .add(plant((right + EMITTER_X) / 2.0, y))
        .add(boxed(PARTS_X, y - 22.0, 120.0, 44.0, &["beam's receiver", "open collector"]))
        .add(boxed(EMITTER_X, y - 22.0, 110.0, 44.0, &["beam's emitter"]))
        .add(supplied(PARTS_X))
        .add(supplied(EMITTER_X))
        .add(words(PARTS_X - 8.0, y - 5.0, "output", SIGNAL).set("text-anchor", "end"))
}

fn servo(y: f64) -> Group {
    boxed(PARTS_X, y - 16.0, 150.0, 52.0, &["servo", "swings the tool"])
        .add(words(PARTS_X - 8.0, y - 5.0, "signal", SIGNAL).set("text-anchor", "end"))
        .add(wire(&[(PARTS_X + 30.0, y + 36.0), (PARTS_X + 30.0, y + 44.0)], GROUND))
        .add(ground(PARTS_X + 30.0, y + 44.0))
        .add(spring(PARTS_X + 110.0, y + 36.0))
        .add(words(PARTS_X + 190.0, y + 60.0, "a spring rests the tool out of the row", INK))
}

/// What stands between a beam of 12 V and the Uno where its output is not an open collector, or where a torn wire is to be
/// seen.
fn optocoupler() -> Group {
    const X: f64 = 330.0;
    const Y: f64 = 644.0;
    const TOP: f64 = Y + 72.0;
    const BOTTOM: f64 = TOP + 26.0;
    let (diode_x, transistor_x, pull_down_x) = (X + 320.0, X + 386.0, X + 480.0);
    Group::new()
        .add(rectangle(X, Y, 680.0, 136.0, PANEL).set("rx", 8).set("stroke", PANEL_EDGE))
        .add(words(X + 16.0, Y + 24.0, "Safer, instead of D8's pull-up: an optocoupler", INK).set("font-weight", 600))
        .add(words(X + 16.0, Y + 42.0, "No light, no supply or a torn wire then all read as broken.", PALE_INK))
        .add(words(X + 16.0, TOP + 4.0, "beam's output,", INK))
        .add(words(X + 16.0, TOP + 20.0, "12 V while it sees light", INK))
        .add(rectangle(X + 298.0, TOP - 14.0, 110.0, 54.0, PART).set("rx", 4).set("stroke", PALE_INK))
        .add(wire(&[(X + 160.0, TOP), (diode_x, TOP), (diode_x, BOTTOM + 18.0)], SIGNAL))
        .add(resistor_across(X + 236.0, TOP))
        .add(words(X + 236.0, TOP + 24.0, "1 k", INK).set("text-anchor", "middle"))
        .add(symbol(diode_x, TOP, "m-8 6 h16 l-8 13 z m0 13 h16", PART))
        .add(ground(diode_x, BOTTOM + 18.0))
        .add(line(diode_x + 14.0, TOP + 13.0, transistor_x - 22.0, TOP + 13.0, LIGHT).set("stroke-dasharray", "4 3"))
        .add(symbol(transistor_x, TOP, "m-16 2 v22 m0 -14 l16 -10 m-16 16 l16 10 m-3 -7 l3 7 l-8 -1", "none"))
        .add(wire(&[(transistor_x, TOP), (X + 434.0, TOP)], FIVE_VOLTS))
        .add(mark(X + 434.0, TOP, Side::Right, "5 V", FIVE_VOLTS))
        .add(wire(&[(transistor_x, BOTTOM), (X + 560.0, BOTTOM)], SIGNAL))
        .add(words(X + 566.0, BOTTOM + 4.0, "D8", SIGNAL).set("font-weight", 600))
        .add(dot(pull_down_x, BOTTOM, 3.5, SIGNAL))
        .add(resistor(pull_down_x, BOTTOM + 3.0, 20.0))
        .add(ground(pull_down_x, BOTTOM + 23.0))
        .add(words(pull_down_x + 12.0, BOTTOM + 19.0, "4.7 k", INK))
}

fn legend() -> Group {
    let mut legend = Legend::new(40.0, HEIGHT - 30.0);
    for (colour, meaning) in [
        (SIGNAL, "signal"),
        (FIVE_VOLTS, "5 V of the Uno"),
        (TWELVE_VOLTS, "12 V"),
        (SERVO_SUPPLY, "the servo's own supply"),
        (GROUND, "ground: join all of them at the battery"),
    ] {
        legend.explain(|x, y| swatch(x, y, colour), meaning);
    }
    legend.drawn()
}

/// A part, as a box with its name and what to know of it.
fn boxed(x: f64, y: f64, width: f64, height: f64, lines: &[&str]) -> Group {
    const LINE: f64 = 16.0;
    let first = y + height / 2.0 + 4.0 - LINE * (lines.len() as f64 - 1.0) / 2.0;
    let mut drawn = Group::new().add(rectangle(x, y, width, height, PART).set("rx", 6).set("stroke", PALE_INK));
    for (index, text) in lines.iter().enumerate() {
        let (colour, weight) = if index == 0 { (INK, 600) } else { (PALE_INK, 400) };
        let place = first + LINE * index as f64;
        drawn = drawn
            .add(words(x + width / 2.0, place, text, colour).set("text-anchor", "middle").set("font-weight", weight));
    }
    drawn
}

fn title(x: f64, y: f64, text: &str) -> Text {
    words(x, y, text, INK).set("text-anchor", "middle").set("font-weight", 600).set("font-size", 14)
}

/// A wire along these corners.
fn wire(corners: &[(f64, f64)], colour: &str) -> Path {
    let d: Vec<String> = corners
        .iter()
        .enumerate()
        .map(|(index, &(x, y))| format!("{}{} {}", if index == 0 { 'M' } else { 'L' }, tenth(x), tenth(y)))
        .collect();
    Path::new().set("d", d.join(" ")).set("fill", "none").set("stroke", colour).set("stroke-width", 1.8)
}

/// Where a wire meets the board.
fn contact(x: f64, y: f64) -> Rectangle {
    rectangle(x - 4.0, y - 4.0, 8.0, 8.0, INK).set("rx", 1)
}

fn dot(x: f64, y: f64, radius: f64, colour: &str) -> Circle {
    Circle::new().set("cx", tenth(x)).set("cy", tenth(y)).set("r", radius).set("fill", colour)
}

/// A symbol's strokes, from `x` and `y` on.
fn symbol(x: f64, y: f64, strokes: &str, fill: &str) -> Path {
    Path::new()
        .set("d", format!("M{} {} {strokes}", tenth(x), tenth(y)))
        .set("fill", fill)
        .set("stroke", INK)
        .set("stroke-width", 1.6)
}

/// A mark of ground, hanging from a wire's end.
fn ground(x: f64, y: f64) -> Path {
    symbol(x, y, "m-8 0 h16 m-13 4 h10 m-7 4 h4", "none")
}

/// The side of a wire's end on which its mark stands.
#[derive(Clone, Copy)]
enum Side {
    Left,
    Right,
    Up,
}

/// A supply's mark at a wire's end.
fn mark(x: f64, y: f64, side: Side, supply: &str, colour: &str) -> Group {
    let (text_x, text_y, anchor) = match side {
        Side::Left => (x - 4.0, y - 7.0, "middle"),
        Side::Right => (x + 8.0, y + 4.0, "start"),
        Side::Up => (x, y - 7.0, "middle"),
    };
    Group::new()
        .add(dot(x, y, 3.5, colour))
        .add(words(text_x, text_y, supply, colour).set("text-anchor", anchor).set("font-weight", 600))
}

/// A resistor that hangs down from `y`.
fn resistor(x: f64, y: f64, length: f64) -> Rectangle {
    rectangle(x - 5.0, y, 10.0, length, "#ffffff").set("stroke", INK).set("stroke-width", 1.4)
}

/// A resistor that lies on a wire.
fn resistor_across(x: f64, y: f64) -> Rectangle {
    rectangle(x - 16.0, y - 5.0, 32.0, 10.0, "#ffffff").set("stroke", INK).set("stroke-width", 1.4)
}

/// A resistor from a signal up to 5 V.
fn pull_up(x: f64, y: f64, rise: f64) -> Group {
    Group::new()
        .add(dot(x, y, 3.5, SIGNAL))
        .add(wire(&[(x, y), (x, y - rise - 6.0)], FIVE_VOLTS))
        .add(resistor(x, y - rise, 22.0))
        .add(words(x + 12.0, y - rise + 15.0, "4.7 k", INK))
        .add(mark(x, y - rise - 6.0, Side::Up, "5 V", FIVE_VOLTS))
}

/// A fuse on a wire, with its name above and its current below.
fn fuse(x: f64, y: f64, name: &str, current: &str) -> Group {
    Group::new()
        .add(fuse_body(x, y))
        .add(words(x, y - 14.0, name, INK).set("text-anchor", "middle"))
        .add(words(x, y + 22.0, current, INK).set("text-anchor", "middle"))
}

fn fuse_body(x: f64, y: f64) -> Group {
    Group::new()
        .add(rectangle(x - 18.0, y - 6.0, 36.0, 12.0, "#ffffff").set("stroke", INK).set("stroke-width", 1.4))
        .add(line(x - 18.0, y, x + 18.0, y, INK).set("stroke-width", 1.4))
}

/// A switch's contact, open, from `x` on 50 to the right.
fn opened(x: f64, y: f64, colour: &str) -> Group {
    Group::new()
        .add(dot(x, y, 3.0, colour))
        .add(dot(x + 50.0, y, 3.0, colour))
        .add(line(x, y, x + 46.0, y - 14.0, colour).set("stroke-width", 1.8))
}

/// A switch's contact, closed, from `x` on 50 to the right.
fn closed(x: f64, y: f64, colour: &str) -> Group {
    Group::new()
        .add(dot(x, y, 3.0, colour))
        .add(dot(x + 50.0, y, 3.0, colour))
        .add(line(x, y, x + 52.0, y - 4.0, colour).set("stroke-width", 1.8))
}

/// A capacitor from a supply to ground.
fn capacitor(x: f64, y: f64) -> Group {
    Group::new()
        .add(dot(x, y, 3.5, SERVO_SUPPLY))
        .add(wire(&[(x, y), (x, y + 8.0)], SERVO_SUPPLY))
        .add(line(x - 10.0, y + 8.0, x + 10.0, y + 8.0, INK).set("stroke-width", 2.4))
        .add(line(x - 10.0, y + 13.0, x + 10.0, y + 13.0, INK).set("stroke-width", 2.4))
        .add(wire(&[(x, y + 13.0), (x, y + 20.0)], GROUND))
        .add(ground(x, y + 20.0))
        .add(words(x + 18.0, y + 16.0, "1000 uF", INK))
}

/// A plant in the beam.
fn plant(x: f64, y: f64) -> Path {
    symbol(x, y, "m0 30 v-34 m0 12 q-26 -2 -28 -24 q24 2 28 24 q4 -24 28 -26 q-2 24 -28 26 z", PLANT)
        .set("stroke", PLANT)
        .set("stroke-width", 2.4)
}

/// A spring that hangs down from `y`.
fn spring(x: f64, y: f64) -> Path {
    symbol(x, y, "v4 l7 3 l-14 5 l14 5 l-14 5 l7 3 v5 h70", "none").set("stroke", PALE_INK)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_contact_is_named_and_every_pull_up_is_drawn() {
        let drawn = draw().to_string();
        for connection in CONNECTIONS {
            for label in connection.contact.label().split(", ") {
                assert!(drawn.contains(label), "{label}");
            }
        }
        let pull_ups = CONNECTIONS.iter().filter(|connection| connection.pull_up == PullUp::External).count();
        // And the optocoupler's pull-down.
        assert_eq!(drawn.matches("4.7 k").count(), pull_ups + 1);
    }
}
