//! A picture of the row along the ground: plants and weeds, what the beam saw, and the tool's path.
//!
//! The row is divided into lanes, to be read like lines of a text.

use drawing::{
    DOUBTFUL, LEFT_ALONE, Legend, MARK_SIZE, NOTE, PALE_INK, PAPER, PLANT, WEED, WEEDED, WRONG, document, line,
    rectangle, swatch, tenth, words,
};
use field::row::{Canopy, Kind, Row};
use field::verdict::{Judgement, Verdict};
use std::ops::Range;
use svg::Document;
use svg::node::element::path::Data;
use svg::node::element::{ClipPath, Definitions, Ellipse, Group, Path, Polyline};

/// Ground in a lane, and pixels for a millimetre.
const LANE_MM: f64 = 2500.0;
const PIXELS_PER_MM: f64 = 0.4;

const LANE_WIDTH: f64 = LANE_MM * PIXELS_PER_MM;
const SIDE: f64 = 86.0;
const HEAD: f64 = 58.0;
const LANE_HEIGHT: f64 = 168.0;

/// Heights within a lane, downwards.
const CANOPY_Y: f64 = 30.0;
const CANOPY_HALF_HEIGHT: f64 = 19.0;
const BEAM_Y: f64 = 56.0;
const WINDOW_Y: f64 = 63.0;
const STRIP_HEIGHT: f64 = 4.0;
const TOOL_Y: f64 = 72.0;
const TOOL_HEIGHT: f64 = 12.0;
const IN_Y: f64 = 132.0;
const OUT_Y: f64 = 96.0;
const SCALE_Y: f64 = 140.0;

const BEAM: &str = "#6a6fb5";
const WINDOW: &str = "#c58fb8";

/// Draws a row and its result.
pub fn draw(row: &Row, judgement: &Judgement) -> Document {
    let span = row.span_mm();
    let lanes = ((span.end - span.start) / LANE_MM).ceil().max(1.0) as usize;
    let (width, height) = (LANE_WIDTH + 2.0 * SIDE, HEAD + lanes as f64 * LANE_HEIGHT + 8.0);
    let mut document = document(width, height).add(legend());
    for lane in 0..lanes {
        let start_mm = span.start + lane as f64 * LANE_MM;
        let ground = start_mm..(start_mm + LANE_MM).min(span.end);
        let top = HEAD + lane as f64 * LANE_HEIGHT;
        let drawn = draw_lane(row, judgement, &ground, &format!("lane-{lane}"));
        document = document.add(drawn.set("transform", format!("translate({SIDE} {top})")));
    }
    document
}

/// The part of the row in a lane, with the origin at its left end. A clip of that name cuts it at the lane's ends.
fn draw_lane(row: &Row, judgement: &Judgement, ground: &Range<f64>, clip: &str) -> Group {
    let x = |place_mm: f64| (place_mm - ground.start) * PIXELS_PER_MM;
    let is_here = |stretch: &Range<f64>| stretch.start < ground.end && ground.start < stretch.end;
    let angle_y = |degrees: f64| IN_Y + (OUT_Y - IN_Y) * degrees / field::servo::OUT_DEGREES;
    let length = x(ground.end);

    let mut drawn = Group::new().set("clip-path", format!("url(#{clip})"));
    drawn = drawn.add(rectangle(0.0, TOOL_Y, length, TOOL_HEIGHT, WEEDED));
    let strips = [
        (&judgement.clear_mm, TOOL_Y, TOOL_HEIGHT, LEFT_ALONE),
        (&judgement.windows_mm, WINDOW_Y, STRIP_HEIGHT, WINDOW),
    ];
    for (stretches, y, height, colour) in strips {
        for stretch in stretches.iter().filter(|stretch| is_here(stretch)) {
            drawn = drawn.add(rectangle(x(stretch.start), y, x(stretch.end) - x(stretch.start), height, colour));
        }
    }
    for canopy in row.canopies().iter().filter(|canopy| is_here(&canopy.span_mm())) {
        for block in canopy.blocks_mm() {
            let width = (x(block.end) - x(block.start)).max(2.0);
            drawn = drawn.add(rectangle(x(block.start), BEAM_Y, width, STRIP_HEIGHT, BEAM));
        }
        if canopy.kind == Kind::Weed {
            let x = x(canopy.position_mm);
            let weed = line(x, CANOPY_Y - 10.0, x, CANOPY_Y + CANOPY_HALF_HEIGHT, WEED);
            drawn = drawn.add(weed.set("stroke-width", 4));
        }
    }
    for plant in judgement.plants.iter().filter(|plant| is_here(&plant.plant.span_mm())) {
        drawn = drawn.add(canopy(&plant.plant, x(plant.plant.position_mm), plant.verdict));
    }
    // Between two pieces over this ground the path may go on beyond an end, where the clip cuts it.
    let is_over = |piece: &&[(f64, f64)]| is_here(&(piece[0].0.min(piece[1].0)..piece[0].0.max(piece[1].0)));
    let point = |&(place_mm, degrees): &(f64, f64)| format!("{:.1},{:.1}", x(place_mm), angle_y(degrees));
    let mut points: Vec<String> = judgement.path.windows(2).filter(is_over).flatten().map(point).collect();
    points.dedup();
    drawn = drawn.add(
        Polyline::new()
            .set("points", points.join(" "))
            .set("fill", "none")
            .set("stroke", NOTE)
            .set("stroke-width", 1.6)
            .set("stroke-linejoin", "round"),
    );

    let clip = ClipPath::new().set("id", clip).add(rectangle(0.0, 0.0, length, LANE_HEIGHT, "#000"));
    Group::new()
        .add(Definitions::new().add(clip))
        .add(words(-8.0, BEAM_Y + 5.0, "beam", PALE_INK).set("text-anchor", "end"))
        .add(words(-8.0, TOOL_Y + 10.0, "tool", PALE_INK).set("text-anchor", "end"))
        .add(words(-8.0, OUT_Y + 4.0, "out 45°", PALE_INK).set("text-anchor", "end"))
        .add(words(-8.0, IN_Y + 4.0, "in 0°", PALE_INK).set("text-anchor", "end"))
        .add(drawn)
        .add(scale(ground))
}

fn canopy(plant: &Canopy, x: f64, verdict: Verdict) -> Group {
    let ellipse = Ellipse::new()
        .set("cx", tenth(x))
        .set("cy", CANOPY_Y)
        .set("rx", tenth(plant.width_mm / 2.0 * PIXELS_PER_MM))
        .set("ry", CANOPY_HALF_HEIGHT)
        .set("fill", colour(verdict));
    Group::new().add(ellipse).add(strokes(x, CANOPY_Y, CANOPY_HALF_HEIGHT * 0.5, verdict))
}

fn colour(verdict: Verdict) -> &'static str {
    match verdict {
        Verdict::Kept => PLANT,
        Verdict::MarginCut | Verdict::Reached => DOUBTFUL,
        Verdict::Damaged => WRONG,
    }
}

/// Marks for the verdicts: one stroke for a cut margin, two for a reached zone, and a cross for a damaged plant.
fn strokes(x: f64, y: f64, reach: f64, verdict: Verdict) -> Path {
    let (left, right, top, bottom) = (tenth(x - reach), tenth(x + reach), tenth(y - reach), tenth(y + reach));
    let stroke = Data::new().move_to((left, bottom)).line_to((right, top));
    let drawn = match verdict {
        Verdict::Kept => Data::new(),
        Verdict::MarginCut => stroke,
        Verdict::Reached => stroke.move_to((x, bottom)).line_to((right, tenth(y))),
        Verdict::Damaged => stroke.move_to((left, top)).line_to((right, bottom)),
    };
    Path::new().set("d", drawn).set("stroke", PAPER).set("stroke-width", 2.5).set("stroke-linecap", "round")
}

/// The ground with a mark every half metre.
fn scale(ground: &Range<f64>) -> Group {
    const STEP_MM: f64 = 500.0;
    let end = (ground.end - ground.start) * PIXELS_PER_MM;
    let mut scale = Group::new().add(line(0.0, SCALE_Y, end, SCALE_Y, PALE_INK));
    let first = (ground.start / STEP_MM).ceil() as i64;
    let last = (ground.end / STEP_MM).floor() as i64;
    for mark in first..=last {
        let place_mm = mark as f64 * STEP_MM;
        let x = (place_mm - ground.start) * PIXELS_PER_MM;
        scale = scale.add(line(x, SCALE_Y, x, SCALE_Y + 4.0, PALE_INK)).add(
            words(x, SCALE_Y + 16.0, &format!("{:.1} m", place_mm / 1000.0), PALE_INK).set("text-anchor", "middle"),
        );
    }
    scale
}

fn legend() -> Group {
    let verdicts = [
        (Verdict::Kept, "zone and margin kept"),
        (Verdict::MarginCut, "margin cut"),
        (Verdict::Reached, "zone reached"),
        (Verdict::Damaged, "plant damaged"),
    ];
    let entries = [
        (WEED, "tall weed"),
        (BEAM, "beam broken"),
        (WINDOW, "window"),
        (LEFT_ALONE, "tool clear"),
        (WEEDED, "tool not clear"),
        (NOTE, "tool's angle"),
    ];
    let mut legend = Legend::new(SIDE, 22.0);
    for (verdict, meaning) in verdicts {
        let half = MARK_SIZE / 2.0;
        let mark = |x, y| {
            let swatch = swatch(x, y, colour(verdict));
            Group::new().add(swatch).add(strokes(x + half, y + half, half * 0.5, verdict))
        };
        legend.explain(mark, meaning);
    }
    for (colour, meaning) in entries {
        legend.explain(|x, y| swatch(x, y, colour), meaning);
    }
    legend.drawn()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::ruined_row;

    #[test]
    fn the_picture_shows_each_plant_in_the_colour_of_its_verdict() {
        let (pass, outcome) = ruined_row();
        let drawn = draw(&pass.row, &outcome.judgement).to_string();
        assert_eq!(drawn.matches("<ellipse").count(), 2);
        // Both plants, and the legend.
        assert_eq!(drawn.matches(WRONG).count(), 3);
        assert_eq!(drawn.matches(PLANT).count(), 1);
    }

    #[test]
    fn verdicts_differ_in_their_strokes_too() {
        let path = |verdict| strokes(0.0, 0.0, 5.0, verdict).to_string();
        assert_eq!(path(Verdict::Kept).matches('L').count(), 0);
        assert_eq!(path(Verdict::MarginCut).matches('L').count(), 1);
        for verdict in [Verdict::Reached, Verdict::Damaged] {
            assert_eq!(path(verdict).matches('L').count(), 2);
        }
        assert_ne!(path(Verdict::Reached), path(Verdict::Damaged));
    }

    #[test]
    fn a_long_row_is_broken_into_lanes() {
        let (_, outcome) = ruined_row();
        let row = Row::new(vec![Canopy::plant(0.0, 100.0), Canopy::plant(6000.0, 100.0)]).unwrap();
        let drawn = draw(&row, &outcome.judgement).to_string();
        // 12 m of row: half a spacing beyond either plant.
        assert_eq!(drawn.matches("out 45°").count(), 5);
    }

    #[test]
    fn a_lane_shows_the_curve_over_its_own_ground_alone() {
        let (pass, mut outcome) = ruined_row();
        // The machine rolls back over its ground, with the tool out.
        outcome.judgement.path =
            vec![(-1000.0, 45.0), (-500.0, 0.0), (2000.0, 0.0), (2000.0, 45.0), (500.0, 45.0), (500.0, 0.0)];
        let drawn = draw_lane(&pass.row, &outcome.judgement, &(0.0..1000.0), "lane").to_string();
        let curve = drawn.split("points=\"").nth(1).and_then(|rest| rest.split('"').next());
        // The lane's clip cuts what the two pieces across its ends have beyond them.
        assert_eq!(curve, Some("-200.0,132.0 800.0,132.0 800.0,96.0 200.0,96.0 200.0,132.0"));
        let (clip, clipped) = drawn.split_once("clip-path=\"url(#lane)\"").unwrap();
        assert!(clip.contains("<rect fill=\"#000\" height=\"168\" width=\"400\" x=\"0\" y=\"0\"/>"), "{clip}");
        assert!(clipped.contains("<polyline"));
    }
}
