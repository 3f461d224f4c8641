//! A job as a drawing: weeded and unweeded ground, plants, weeds and alarms from above, north at the top.
//!
//! Points less than a pixel apart are drawn once. Events without a position are not drawn; the legend has their
//! number.

use crate::job::{Did, EventKind, Job};
use crate::plane::{Metres, Place, Plane};
use drawing::{
    DOUBTFUL, INK, LEFT_ALONE, Legend, NOTE, PALE_INK, PLANT, WEED, WEEDED, WRONG, document, line, swatch, tenth,
    words as text_at,
};
use link::Class;
use std::collections::HashSet;
use svg::Document;
use svg::node::element::{Circle, Group, Polyline};

/// The longer side of the ground, and the frame around it, in pixels.
const SIDE: f64 = 900.0;
const FRAME: f64 = 40.0;
const HEAD: f64 = 56.0;

/// The least that is drawn, in metres: a map of a point has no scale.
const LEAST_M: f64 = 5.0;

/// The words of a picture.
#[derive(Clone, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Words {
    /// The colours' legend: ground weeded and not weeded, a plant, an unknown one, a tall weed, a label, an alarm.
    pub legend: [String; 7],
    /// The text before the number of events without a position.
    pub without_place: String,
    /// The text after the scale's metres.
    pub north: String,
}

impl Default for Words {
    fn default() -> Self {
        let legend = ["weeded", "not weeded", "plant", "unknown, kept", "tall weed", "label", "alarm, restart"];
        let [without_place, north] = ["without a position:", "north is up"].map(str::to_owned);
        Self { legend: legend.map(str::to_owned), without_place, north }
    }
}

/// The colour and the size of a point.
fn mark(kind: EventKind) -> Option<(&'static str, f64)> {
    match kind {
        EventKind::Detection { class: Class::Plant, .. } => Some((PLANT, 2.5)),
        EventKind::Detection { class: Class::Unknown, .. } => Some((DOUBTFUL, 2.5)),
        EventKind::Detection { class: Class::Weed, .. } => Some((WEED, 2.0)),
        EventKind::Label(_) => Some((NOTE, 3.0)),
        EventKind::Alarm | EventKind::Restart => Some((WRONG, 4.0)),
        EventKind::Guarded | EventKind::SwingOut | EventKind::SwingIn | EventKind::WheelSpun | EventKind::WheelGap => {
            None
        }
    }
}

/// Draws some jobs. `None` if nothing in them has a position.
pub fn draw(jobs: &[&Job], words: &Words) -> Option<Document> {
    let stretches = || jobs.iter().flat_map(|job| &job.stretches);
    let grounds = || stretches().flat_map(|stretch| &stretch.ground);
    let events = || stretches().flat_map(|stretch| &stretch.events);
    let of_lines = grounds().flat_map(|ground| ground.lines.iter().flatten().copied());
    let of_events = events().filter_map(|event| Some(event.found.ok()?.place));
    let places: Vec<Place> = of_lines.chain(of_events).collect();
    let plane = Plane::around(*places.first()?);
    let metres: Vec<Metres> = places.iter().map(|&place| plane.metres(place)).collect();
    let bound = |value: fn(&Metres) -> f64| {
        let least = metres.iter().map(value).fold(f64::INFINITY, f64::min);
        let most = metres.iter().map(value).fold(f64::NEG_INFINITY, f64::max);
        let more = (LEAST_M - (most - least)).max(0.0) / 2.0;
        (least - more, most + more)
    };
    let ((west, east), (south, north)) = (bound(|at| at.east), bound(|at| at.north));
    let scale = SIDE / (east - west).max(north - south);
    let (width, height) = ((east - west) * scale + 2.0 * FRAME, (north - south) * scale + HEAD + 2.0 * FRAME);
    // The legend needs its room.
    let width = width.max(SIDE);
    let pixel = |place: Place| {
        let at = plane.metres(place);
        (FRAME + (at.east - west) * scale, HEAD + (north - at.north) * scale)
    };

    let mut ground_drawn = Group::new();
    for ground in grounds() {
        let colour = if ground.did == Did::Weeded { WEEDED } else { LEFT_ALONE };
        for line in &ground.lines {
            let points: Vec<String> =
                line.iter().map(|&place| pixel(place)).map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let drawn = Polyline::new().set("points", points.join(" ")).set("fill", "none");
            ground_drawn = ground_drawn.add(drawn.set("stroke", colour).set("stroke-width", 4));
        }
    }
    let mut drawn_at = HashSet::new();
    let mut points = Group::new();
    for event in events() {
        let (Some((colour, radius)), Ok(found)) = (mark(event.kind), event.found) else { continue };
        let (x, y) = pixel(found.place);
        if drawn_at.insert((colour, x.round() as i64, y.round() as i64)) {
            points =
                points.add(Circle::new().set("cx", tenth(x)).set("cy", tenth(y)).set("r", radius).set("fill", colour));
        }
    }
    let missing = events().filter(|event| event.found.is_err()).count();
    let mut legend = Legend::new(FRAME, 16.0);
    let colours = [WEEDED, LEFT_ALONE, PLANT, DOUBTFUL, WEED, NOTE, WRONG];
    for (colour, meaning) in colours.into_iter().zip(&words.legend) {
        legend.explain(|x, y| swatch(x, y, colour), meaning);
    }
    let mut drawn = document(width, height).add(legend.drawn()).add(ground_drawn).add(points).add(scale_bar(
        scale,
        height,
        &words.north,
    ));
    if missing > 0 {
        let text = format!("{} {missing}", words.without_place);
        drawn = drawn.add(text_at(width - FRAME, height - 14.0, &text, INK).set("text-anchor", "end"));
    }
    Some(drawn)
}

/// A bar of a round length, a tenth to a fourth of the picture.
fn scale_bar(scale: f64, height: f64, north: &str) -> Group {
    let most_m = SIDE / 4.0 / scale;
    let power = 10_f64.powf(most_m.log10().floor());
    let length_m = [5.0, 2.0, 1.0].into_iter().map(|factor| factor * power).find(|&it| it <= most_m).unwrap_or(power);
    let (y, end) = (height - 18.0, FRAME + length_m * scale);
    Group::new().add(line(FRAME, y, end, y, PALE_INK).set("stroke-width", 2)).add(text_at(
        end + 6.0,
        y + 4.0,
        &format!("{length_m} m, {north}"),
        PALE_INK,
    ))
}
