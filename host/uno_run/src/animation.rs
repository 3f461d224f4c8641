//! An animated picture of a row being weeded, seen from above: an SVG that plays without scripts or other programs.
//!
//! The machine rolls at its speed along the simulated row. The tool's angle at each position is the recorded one.
//! Weeded ground darkens behind the tool, and cut weeds disappear. The beam turns dark while it is broken.

use drawing::{INK, LEFT_ALONE, MARK_SIZE, NOTE, PALE_INK, PLANT, WEED, WEEDED, WRONG};
use drawing::{Legend, document, line, rectangle, swatch, tenth, words};
use field::conditions::Arm;
use field::ground::interpolated;
use field::machine::Machine;
use field::row::Row;
use field::verdict::{Judgement, Verdict};
use std::iter;
use svg::Document;
use svg::node::Node;
use svg::node::element::{Animate, AnimateTransform, Circle, ClipPath, Definitions, Group};

/// Length of a millimetre of ground, in pixels, and the picture's parts, downwards.
const PIXELS_PER_MM: f64 = 0.36;
const SIDE: f64 = 24.0;
const LEGEND_Y: f64 = 14.0;
const ROW_Y: f64 = 150.0;
const HEIGHT: f64 = 256.0;

/// The servo's length along the row, in pixels.
const SERVO: f64 = 12.0;

/// How far the weeded strip, the beam and the frame reach from the row's line, in pixels.
const STRIP: f64 = 18.0;
const BEAM: f64 = 84.0;

/// Draws the row while a machine weeds it at this speed. The animation repeats.
pub fn draw(row: &Row, machine: &Machine, judgement: &Judgement, speed_mm_s: f64) -> Document {
    let ground = row.span_mm();
    let length_mm = ground.end - ground.start;
    let pixels = |length_mm: f64| tenth(length_mm * PIXELS_PER_MM);
    let x = |position_mm: f64| pixels(position_mm - ground.start);
    let share = |position_mm: f64| ((position_mm - ground.start) / length_mm).clamp(0.0, 1.0);
    let animate = Run { seconds: length_mm / speed_mm_s };
    let length = x(ground.end);

    let behind_tool = rectangle(0.0, ROW_Y - STRIP, 0.0, 2.0 * STRIP, INK).add(animate.value(
        "width",
        &[(0.0, "0".to_owned()), (1.0, length.to_string())],
        "linear",
    ));
    let clip = Definitions::new().add(ClipPath::new().set("id", "behind-tool").add(behind_tool));
    let mut weeded = Group::new().set("clip-path", "url(#behind-tool)");
    for stretch in &judgement.weeded_mm {
        let (from, to) = (x(stretch.start.max(ground.start)), x(stretch.end.min(ground.end)));
        weeded = weeded.add(rectangle(from, ROW_Y - STRIP, (to - from).max(0.0), 2.0 * STRIP, WEEDED));
    }

    let mut standing = Group::new();
    for plant in &judgement.plants {
        let colour = if plant.verdict == Verdict::Damaged { WRONG } else { PLANT };
        let canopy = Circle::new().set("cx", x(plant.plant.position_mm)).set("cy", ROW_Y);
        let stem = canopy.clone().set("r", 3).set("fill", INK);
        let canopy = canopy.set("r", pixels(plant.plant.width_mm / 2.0)).set("fill", colour).set("fill-opacity", 0.75);
        standing = standing.add(canopy).add(stem);
    }
    for weed in &judgement.weeds {
        let at = x(weed.weed.position_mm);
        let mut drawn = Circle::new().set("cx", at).set("cy", ROW_Y).set("r", 5).set("fill", WEED);
        if weed.cut {
            let gone = share(weed.weed.position_mm);
            let shown = [(0.0, "1".to_owned()), (gone, "0".to_owned()), (1.0, "0".to_owned())];
            drawn = drawn.add(animate.value("opacity", &shown, "discrete"));
        }
        standing = standing.add(drawn);
    }

    // From above, a pendulum is a line from the servo's shaft, above the row's line, to the tool beside it. A trailing
    // arm begins at a pivot ahead of the tool.
    let shaft = match machine.arm {
        Arm::Pendulum => 0.0,
        Arm::Trailing => pixels(machine.arm_mm),
    };
    // The machine's position at each point of the path. Its arm may have carried the tool forward.
    let path: Vec<(f64, f64)> =
        judgement.path.iter().map(|&(tool_mm, degrees)| (tool_mm - machine.forward_mm(degrees), degrees)).collect();
    let [start, end] = [ground.start, ground.end].map(|mm| (mm, interpolated(&path, mm).unwrap_or(0.0)));
    let between = path.into_iter().filter(|(mm, _)| start.0 < *mm && *mm < end.0);
    let swing = |(mm, degrees): (f64, f64)| {
        (share(mm), [machine.forward_mm(degrees), 0.0 - machine.across_mm(degrees)].map(pixels))
    };
    let swings: Vec<(f64, [f64; 2])> = iter::once(start).chain(between).chain([end]).map(swing).collect();
    let each = |text: fn(&[f64; 2]) -> String| swings.iter().map(|(at, way)| (*at, text(way))).collect::<Vec<_>>();
    let width = pixels(machine.tool_width_mm);
    let blade = rectangle(-5.0, ROW_Y - width / 2.0, 10.0, width, NOTE)
        .set("rx", 2)
        .add(animate.transform("translate", &each(|[forward, aside]| format!("{forward} {aside}"))));
    let arm = line(shaft, ROW_Y, 0.0, ROW_Y, INK)
        .set("stroke-width", 3)
        .add(animate.value("x2", &each(|[forward, _]| forward.to_string()), "linear"))
        .add(animate.value("y2", &each(|[_, aside]| tenth(ROW_Y + aside).to_string()), "linear"));
    let servo = rectangle(shaft, ROW_Y - SERVO / 2.0, SERVO, SERVO, INK).set("rx", 2);
    let tool = Group::new().add(arm).add(blade).add(servo);

    // The beam is ahead of the tool by this distance.
    let reach = pixels(machine.beam_to_tool_mm);
    let mut colours = vec![(0.0, LEFT_ALONE.to_owned())];
    for block in row.blocks_mm() {
        let broken = [(block.start, NOTE), (block.end, LEFT_ALONE)];
        colours.extend(broken.map(|(edge, colour)| (share(edge - machine.beam_to_tool_mm), colour.to_owned())));
    }
    colours.push((1.0, LEFT_ALONE.to_owned()));
    let beam = line(reach, ROW_Y - BEAM, reach, ROW_Y + BEAM, LEFT_ALONE)
        .set("stroke-width", 4)
        .add(animate.value("stroke", &colours, "discrete"));
    let post = shaft + SERVO;
    let frame = line(post, ROW_Y - BEAM, reach, ROW_Y - BEAM, PALE_INK).set("stroke-width", 6);
    let post = line(post, ROW_Y - BEAM, post, ROW_Y, PALE_INK).set("stroke-width", 3);
    let way = [(0.0, "0 0".to_owned()), (1.0, format!("{length} 0"))];
    let rolling = Group::new().add(frame).add(post).add(beam).add(tool).add(animate.transform("translate", &way));

    let full_width = length + reach + 2.0 * SIDE;
    let row = Group::new()
        .set("transform", format!("translate({SIDE} 0)"))
        .add(clip)
        .add(weeded)
        .add(line(0.0, ROW_Y, length, ROW_Y, PALE_INK).set("stroke-dasharray", "4 6"))
        .add(standing)
        .add(rolling);
    document(full_width, HEIGHT).add(legend(speed_mm_s)).add(row)
}

/// One pass along the row.
struct Run {
    seconds: f64,
}

impl Run {
    /// An attribute that takes these values at these shares of the row.
    fn value(&self, attribute: &str, frames: &[(f64, String)], mode: &str) -> Animate {
        self.scheduled(Animate::new().set("attributeName", attribute).set("calcMode", mode), frames)
    }

    /// The animation of a part's position.
    fn transform(&self, kind: &str, frames: &[(f64, String)]) -> AnimateTransform {
        self.scheduled(AnimateTransform::new().set("attributeName", "transform").set("type", kind), frames)
    }

    fn scheduled<Animation: Node>(&self, mut animation: Animation, frames: &[(f64, String)]) -> Animation {
        let times: Vec<String> = frames.iter().map(|(share, _)| format!("{share:.7}")).collect();
        let values: Vec<&str> = frames.iter().map(|(_, value)| value.as_str()).collect();
        animation.assign("keyTimes", times.join(";"));
        animation.assign("values", values.join(";"));
        animation.assign("dur", format!("{:.3}s", self.seconds));
        animation.assign("repeatCount", "indefinite");
        animation
    }
}

fn legend(speed_mm_s: f64) -> Group {
    let mut legend = Legend::new(SIDE, LEGEND_Y);
    let marks =
        [(PLANT, "plant, with its stem"), (WEED, "tall weed"), (WEEDED, "weeded ground"), (NOTE, "tool; broken beam")];
    for (colour, meaning) in marks {
        legend.explain(|x, y| swatch(x, y, colour), meaning);
    }
    let pace = format!("real time, {:.1} km/h", speed_mm_s * 3.6 / 1000.0);
    let pace = words(SIDE, LEGEND_Y + 2.5 * MARK_SIZE, &pace, PALE_INK);
    legend.drawn().add(pace)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::tests::ruined_row;

    /// The tool swings in and out over 40 mm, half way at either end of the row's ground.
    fn drawn(arm: Arm) -> String {
        let (pass, mut outcome) = ruined_row();
        let machine = Machine { arm, ..pass.machine };
        let points = [(-150.0, 45.0), (230.0, 45.0), (270.0, 0.0), (1230.0, 0.0), (1270.0, 45.0), (1400.0, 45.0)];
        outcome.judgement.path = points.map(|(mm, degrees)| (mm + machine.forward_mm(degrees), degrees)).to_vec();
        draw(&pass.row, &machine, &outcome.judgement, 500.0).to_string()
    }

    #[test]
    fn the_tool_swings_across_the_row_as_it_did_and_a_damaged_plant_is_red() {
        let drawn = drawn(Arm::Pendulum);
        assert_eq!(drawn.matches(WRONG).count(), 2);
        let (_, blade) = drawn.split_once("type=\"translate\"").unwrap();
        let values = blade.split("values=\"").nth(1).unwrap().split('"').next().unwrap();
        let ways: Vec<&str> = values.split(';').collect();
        // At the row's ends, not the path's. A pendulum of 350 mm is 133.9 mm aside at 22.5 degrees.
        assert_eq!(ways, ["0 -48.2", "0 0", "0 0", "0 -48.2"]);
    }

    #[test]
    fn a_trailing_arm_carries_the_tool_forward_from_a_pivot_ahead_of_it() {
        let drawn = drawn(Arm::Trailing);
        // 26.6 mm forward.
        assert!(drawn.contains("values=\"9.6 -48.2;0 0;"), "{drawn}");
    }

    #[test]
    fn every_animation_runs_over_the_whole_row_and_never_back() {
        let drawn = drawn(Arm::Pendulum);
        let mut found = 0;
        for times in drawn.split("keyTimes=\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            let times: Vec<f64> = times.split(';').map(|time| time.parse().unwrap()).collect();
            assert_eq!((times.first(), times.last()), (Some(&0.0), Some(&1.0)));
            assert!(times.is_sorted(), "{times:?}");
            found += 1;
        }
        assert!(found >= 5, "{found}");
    }

    #[test]
    fn times_are_fine_enough_for_a_long_row_and_a_short_one() {
        let frames = [(0.0, "0".to_owned()), (0.123_456_7, "1".to_owned())];
        let animation = Run { seconds: 0.01 }.value("opacity", &frames, "linear").to_string();
        assert!(animation.contains(";0.1234567\"") && animation.contains("\"0.010s\""), "{animation}");
    }
}
