//! A picture of a table's decisions: hold against spacing, a panel for each speed class.
//!
//! The background of a panel shows the class of a detection with that spacing and hold. The dots are the training
//! detections. Those that were chosen as examples have a ring. Delay and actuation follow from the other features, so
//! the two drawn ones suffice.

use super::model::Model;
use super::{Labelled, Training};
use control::ground::class::Class;
use control::ground::features::{Features, SPEED_CLASSES_MM_S, speed_class};
use drawing::{INK, Legend, MARK_SIZE, PALE_INK, document, line, rectangle, swatch, tenth, words};
use field::row::Kind;
use std::ops::Range;
use svg::Document;
use svg::node::element::{Circle, Group};

/// A panel's size in pixels, and the grain of its ground.
const PANEL_WIDTH: f64 = 420.0;
const PANEL_HEIGHT: f64 = 260.0;
const CELL: f64 = 4.0;

/// Room for the legend above, and around each panel for its axes.
const HEAD: f64 = 44.0;
const LEFT: f64 = 58.0;
const ABOVE: f64 = 28.0;
const BELOW: f64 = 42.0;
const RIGHT: f64 = 16.0;
const PANELS_ABREAST: usize = 2;

/// Hold of a detection without width: the two margins of the reference machine.
const LEAST_HOLD_MM: f64 = 100.0;

const PLANT: &str = "#2f7d34";
const WEED: &str = "#a0521c";
const PLANT_GROUND: &str = "#d3e8d0";
const WEED_GROUND: &str = "#f0d9c2";
const UNKNOWN_GROUND: &str = "#eeece6";

/// Draws the table that `training` made of `objects`.
pub fn draw(training: &Training, objects: &[Labelled]) -> Document {
    let model = training.model();
    let is_of = |object: &Labelled, class: i16| speed_class(object.features.speed_mm_s()) == class;
    let classes: Vec<i16> =
        SPEED_CLASSES_MM_S.into_iter().filter(|&class| objects.iter().any(|object| is_of(object, class))).collect();
    let axes = Axes::around(objects);
    let (across, down) = (LEFT + PANEL_WIDTH + RIGHT, ABOVE + PANEL_HEIGHT + BELOW);
    let width = across * classes.len().min(PANELS_ABREAST) as f64;
    let height = HEAD + down * classes.len().div_ceil(PANELS_ABREAST) as f64;
    let mut document = document(width, height).add(legend());
    for (index, class) in classes.into_iter().enumerate() {
        let (column, line) = (index % PANELS_ABREAST, index / PANELS_ABREAST);
        let corner = (column as f64 * across + LEFT, HEAD + line as f64 * down + ABOVE);
        let here = |from: &[Labelled]| from.iter().copied().filter(|object| is_of(object, class)).collect::<Vec<_>>();
        let panel = ground(&model, class, &axes)
            .add(dots(&here(objects), &axes, false))
            .add(dots(&here(&training.kept), &axes, true))
            .add(axes.draw(class));
        document = document.add(panel.set("transform", format!("translate({} {})", corner.0, corner.1)));
    }
    document
}

/// The ranges of spacing and hold.
struct Axes {
    spacing_mm: Range<f64>,
    hold_mm: Range<f64>,
}

impl Axes {
    /// From 0 to a little more than the detections' values.
    fn around(objects: &[Labelled]) -> Self {
        let greatest = |value: fn(&Features) -> i16| {
            objects.iter().map(|object| f64::from(value(&object.features))).fold(LEAST_HOLD_MM, f64::max)
        };
        let up_to = |value: f64| (value * 1.05 / 50.0).ceil() * 50.0;
        Self {
            spacing_mm: 0.0..up_to(greatest(|features| features.spacing_mm())),
            hold_mm: LEAST_HOLD_MM..up_to(greatest(|features| features.hold_mm())).max(2.0 * LEAST_HOLD_MM),
        }
    }

    fn x(&self, spacing_mm: f64) -> f64 {
        (spacing_mm - self.spacing_mm.start) / (self.spacing_mm.end - self.spacing_mm.start) * PANEL_WIDTH
    }

    fn y(&self, hold_mm: f64) -> f64 {
        PANEL_HEIGHT - (hold_mm - self.hold_mm.start) / (self.hold_mm.end - self.hold_mm.start) * PANEL_HEIGHT
    }

    /// The detection at a point of the panel.
    fn features_at(&self, class_mm_s: i16, x: f64, y: f64) -> Features {
        let share = |part: f64, range: &Range<f64>| range.start + part * (range.end - range.start);
        let spacing_mm = share(x / PANEL_WIDTH, &self.spacing_mm);
        let hold_mm = share(1.0 - y / PANEL_HEIGHT, &self.hold_mm);
        Features::describe(class_mm_s, spacing_mm.round() as i16, (hold_mm - LEAST_HOLD_MM).round() as i16)
    }

    fn draw(&self, class_mm_s: i16) -> Group {
        let title = format!("{:.1} km/h", f64::from(class_mm_s) * 0.0036);
        let mut drawn = Group::new()
            .add(words(0.0, -8.0, &title, INK).set("font-weight", "bold"))
            .add(line(0.0, PANEL_HEIGHT, PANEL_WIDTH, PANEL_HEIGHT, PALE_INK))
            .add(line(0.0, 0.0, 0.0, PANEL_HEIGHT, PALE_INK))
            .add(words(PANEL_WIDTH, PANEL_HEIGHT + 34.0, "spacing, mm", INK).set("text-anchor", "end"))
            .add(
                words(0.0, 0.0, "hold, mm", INK)
                    .set("text-anchor", "end")
                    .set("transform", "translate(-42 0) rotate(-90)"),
            );
        for spacing_mm in marks(&self.spacing_mm) {
            let x = self.x(spacing_mm);
            drawn = drawn
                .add(line(x, PANEL_HEIGHT, x, PANEL_HEIGHT + 4.0, PALE_INK))
                .add(words(x, PANEL_HEIGHT + 17.0, &spacing_mm.to_string(), PALE_INK).set("text-anchor", "middle"));
        }
        for hold_mm in marks(&self.hold_mm) {
            let y = self.y(hold_mm);
            drawn = drawn
                .add(line(-4.0, y, 0.0, y, PALE_INK))
                .add(words(-8.0, y + 4.0, &hold_mm.to_string(), PALE_INK).set("text-anchor", "end"));
        }
        drawn
    }
}

/// Round values along an axis, four to nine of them.
fn marks(range: &Range<f64>) -> impl Iterator<Item = f64> + use<> {
    let length = range.end - range.start;
    let step = [20.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0].into_iter().find(|step| length / step <= 8.0);
    let step = step.unwrap_or(5000.0);
    let (first, last) = ((range.start / step).ceil() as i32, (range.end / step).floor() as i32);
    (first..=last).map(move |mark| f64::from(mark) * step)
}

/// The table's classes, as stripes of equal cells.
fn ground(model: &Model, class_mm_s: i16, axes: &Axes) -> Group {
    let mut ground = Group::new().set("shape-rendering", "crispEdges");
    let (columns, lines) = ((PANEL_WIDTH / CELL) as usize, (PANEL_HEIGHT / CELL) as usize);
    for line in 0..lines {
        let y = line as f64 * CELL;
        let colour = |column: usize| {
            let x = column as f64 * CELL;
            match model.class(&axes.features_at(class_mm_s, x + CELL / 2.0, y + CELL / 2.0)) {
                Class::Plant => PLANT_GROUND,
                Class::Weed => WEED_GROUND,
                Class::Unknown => UNKNOWN_GROUND,
            }
        };
        let colours: Vec<&str> = (0..columns).map(colour).collect();
        let mut column = 0;
        for stripe in colours.chunk_by(|one, next| one == next) {
            let (x, width) = (column as f64 * CELL, stripe.len() as f64 * CELL);
            ground = ground.add(rectangle(x, y, width, CELL, stripe[0]));
            column += stripe.len();
        }
    }
    ground
}

/// A dot an object, or a ring an example.
fn dots(objects: &[Labelled], axes: &Axes, ringed: bool) -> Group {
    let mut dots = Group::new();
    for Labelled { features, kind } in objects {
        let (x, y) = (axes.x(f64::from(features.spacing_mm())), axes.y(f64::from(features.hold_mm())));
        let dot = Circle::new().set("cx", tenth(x)).set("cy", tenth(y));
        dots = dots.add(match (ringed, kind) {
            (true, _) => dot.set("r", 3.6).set("fill", "none").set("stroke", INK).set("stroke-width", 1.3),
            (false, Kind::Plant) => dot.set("r", 1.5).set("fill", PLANT),
            (false, Kind::Weed) => dot.set("r", 1.5).set("fill", WEED),
        });
    }
    dots
}

fn legend() -> Group {
    let entries = [
        (PLANT, "plant"),
        (WEED, "tall weed"),
        (PLANT_GROUND, "known as a plant"),
        (WEED_GROUND, "known as a weed"),
        (UNKNOWN_GROUND, "unknown: spared like a plant"),
    ];
    // Some of the colours are almost the paper's.
    let outlined = |x, y, colour| swatch(x, y, colour).set("stroke", PALE_INK).set("stroke-width", 0.5);
    let ring = |x, y| {
        let (x, y) = (x + MARK_SIZE / 2.0, y + MARK_SIZE / 2.0);
        Circle::new().set("cx", x).set("cy", y).set("r", 4).set("fill", "none").set("stroke", INK)
    };
    let mut legend = Legend::new(LEFT, 18.0);
    for (colour, meaning) in entries {
        legend.explain(|x, y| outlined(x, y, colour), meaning);
    }
    legend.explain(ring, "kept as an example");
    legend.drawn()
}
