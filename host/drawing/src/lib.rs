//! The shared style of all pictures: paper, ink, colours, and a few shapes and texts in SVG.
//!
//! A picture has its own light background, so it looks the same on light and dark pages. Positions and sizes are
//! pixels, downwards and to the right, rounded to a tenth.

use svg::Document;
use svg::node::Node;
use svg::node::element::{Group, Line, Rectangle, Text};

/// The background.
pub const PAPER: &str = "#fbfaf6";

/// Colour of text.
pub const INK: &str = "#33312c";

/// Colour of axes and their marks.
pub const PALE_INK: &str = "#8a857a";

/// A plant.
pub const PLANT: &str = "#4c9a50";

/// A weed.
pub const WEED: &str = "#a0672c";

/// Ground that was weeded.
pub const WEEDED: &str = "#b99a72";

/// Ground that was left alone.
pub const LEFT_ALONE: &str = "#dfe7ee";

/// Colour of doubtful results: a cut margin, an unknown plant.
pub const DOUBTFUL: &str = "#e0a526";

/// Colour of errors: a damaged plant, an alarm.
pub const WRONG: &str = "#cf3a32";

/// Colour of notes and measurements: a label, the tool's curve.
pub const NOTE: &str = "#2a6f97";

/// Width and height of a legend's mark.
pub const MARK_SIZE: f64 = 12.0;

/// A picture of this size: paper without anything on it.
pub fn document(width: f64, height: f64) -> Document {
    let paper = rectangle(0.0, 0.0, width, height, PAPER).set("rx", 10);
    Document::new()
        .set("viewBox", (0, 0, width.round() as i32, height.round() as i32))
        .set("font-family", "system-ui, sans-serif")
        .set("font-size", 12)
        .add(paper)
}

/// A value with one decimal place, which is finer than a screen shows.
pub fn tenth(value: f64) -> f64 {
    (value * 10.0).round() / 10.0
}

/// A filled rectangle, from its upper left corner.
pub fn rectangle(x: f64, y: f64, width: f64, height: f64, fill: &str) -> Rectangle {
    Rectangle::new()
        .set("x", tenth(x))
        .set("y", tenth(y))
        .set("width", tenth(width))
        .set("height", tenth(height))
        .set("fill", fill)
}

/// A straight line.
pub fn line(x1: f64, y1: f64, x2: f64, y2: f64, stroke: &str) -> Line {
    Line::new()
        .set("x1", tenth(x1))
        .set("y1", tenth(y1))
        .set("x2", tenth(x2))
        .set("y2", tenth(y2))
        .set("stroke", stroke)
}

/// A line of text with its left end at `x` and its baseline at `y`.
pub fn words(x: f64, y: f64, words: &str, fill: &str) -> Text {
    Text::new(words).set("x", tenth(x)).set("y", tenth(y)).set("fill", fill)
}

/// A legend's mark for a colour.
pub fn swatch(x: f64, y: f64, colour: &str) -> Rectangle {
    rectangle(x, y, MARK_SIZE, MARK_SIZE, colour).set("rx", 2)
}

/// A legend: marks side by side, each followed by its meaning.
pub struct Legend {
    drawn: Group,
    x: f64,
    y: f64,
}

impl Legend {
    /// A legend. Its first mark has its upper left corner at this position.
    pub fn new(x: f64, y: f64) -> Self {
        Self { drawn: Group::new(), x, y }
    }

    /// Adds an entry: `mark` draws the mark at its upper left corner.
    pub fn explain<Mark: Node>(&mut self, mark: impl FnOnce(f64, f64) -> Mark, meaning: &str) {
        const LETTER_WIDTH: f64 = 6.4;
        self.drawn.append(mark(self.x, self.y));
        self.drawn.append(words(self.x + MARK_SIZE + 5.0, self.y + MARK_SIZE - 2.0, meaning, INK));
        self.x += MARK_SIZE + 30.0 + LETTER_WIDTH * meaning.chars().count() as f64;
    }

    /// The legend as a part of a picture.
    pub fn drawn(self) -> Group {
        self.drawn
    }
}
