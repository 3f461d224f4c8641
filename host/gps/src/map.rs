//! A job as GeoJSON (RFC 7946), for QGIS and other map programs.
//!
//! It is one FeatureCollection. A plant, weed, swing, alarm, label, restart, fault of the wheel or jump of the receiver is a point. A piece of
//! ground, weeded or not, is a line. An event without a position has no geometry, and gives the reason. The crate
//! `geojson` writes the file.

use crate::job::{Did, Event, EventKind, Job, PassedGround};
use crate::plane::Place;
use chrono::{DateTime, SecondsFormat};
use geojson::{Feature, FeatureCollection, Geometry, JsonValue, Position};

/// The map of some jobs, each with its record's name.
pub fn features(jobs: &[(&str, &Job)]) -> FeatureCollection {
    let of_job = |&(name, job): &(&str, &Job)| of_job(name, job);
    FeatureCollection::new(jobs.iter().flat_map(of_job))
}

fn of_job(name: &str, job: &Job) -> Vec<Feature> {
    let mut features = Vec::new();
    for (number, stretch) in (1..).zip(&job.stretches) {
        let ground = stretch.ground.iter().filter_map(ground);
        let mut of_stretch: Vec<Feature> = ground.chain(stretch.events.iter().map(|it| event(job, it))).collect();
        of_stretch.iter_mut().for_each(|feature| feature.set_property("stretch", number));
        features.extend(of_stretch);
    }
    features.extend(job.jumps.iter().map(|&(line, jump)| {
        let (record_s, far_m) = (rounded(jump.time_ms / 1000.0), rounded(jump.far_m));
        let properties = vec![("line", line.into()), ("record_s", record_s), ("far_m", far_m)];
        feature("gps_jump", Some(Geometry::new_point(position(jump.place))), properties)
    }));
    features.iter_mut().for_each(|feature| feature.set_property("record", name));
    features
}

fn feature(kind: &str, geometry: Option<Geometry>, properties: Vec<(&str, JsonValue)>) -> Feature {
    let properties = properties.into_iter().map(|(name, value)| (name.to_owned(), value));
    let mut feature = Feature { geometry, properties: Some(properties.collect()), ..Feature::default() };
    feature.set_property("kind", kind);
    feature
}

fn event(job: &Job, event: &Event) -> Feature {
    let found = event.found.ok();
    // In the form of ISO 8601 that QGIS accepts; null without a date, or for an invalid one.
    let time = found.and_then(|found| job.utc_ms(&found)).and_then(DateTime::from_timestamp_millis);
    let mut properties = vec![
        ("time", time.map(|time| time.to_rfc3339_opts(SecondsFormat::Millis, true)).into()),
        ("record_s", rounded(event.time_ms as f64 / 1000.0)),
        ("distance_m", rounded(event.distance_m)),
        ("line", event.line.into()),
    ];
    properties.extend(match event.found {
        Ok(found) => [("place", <&str>::from(found.basis).into()), ("error_m", rounded(found.error_m))],
        Err(missing) => [("place", "none".into()), ("why", missing.to_string().into())],
    });
    if event.width_mm > 0.0 {
        properties.push(("width_mm", event.width_mm.round().into()));
    }
    match event.kind {
        EventKind::Detection { votes, .. } => properties.push(("votes", votes.into())),
        EventKind::Alarm | EventKind::Restart | EventKind::WheelSpun | EventKind::WheelGap => {
            properties.push(("said", event.text.as_str().into()));
        }
        EventKind::Guarded | EventKind::Label(_) | EventKind::SwingOut | EventKind::SwingIn => {}
    }
    feature(event.kind.name(), found.map(|found| Geometry::new_point(position(found.place))), properties)
}

/// A line for ground over which the machine was at work.
fn ground(ground: &PassedGround) -> Option<Feature> {
    let kind = match ground.did {
        Did::Weeded => "weeded",
        Did::Spared => "not_weeded",
        Did::Rolled => return None,
    };
    let length_m = ground.distance_m.end - ground.distance_m.start;
    let mut parts: Vec<Vec<Position>> = ground.lines.iter().flat_map(|line| cut(line)).collect();
    let geometry = match parts.len() {
        0 => None,
        1 => parts.pop().map(Geometry::new_line_string),
        _ => Some(Geometry::new_multi_line_string(parts)),
    };
    let properties = vec![
        ("record_s", rounded(ground.time_ms.start as f64 / 1000.0)),
        ("distance_m", rounded(ground.distance_m.start)),
        ("length_m", rounded(length_m)),
    ];
    (length_m > 0.0).then(|| feature(kind, geometry, properties))
}

/// A line, cut at the 180th meridian: RFC 7946, 3.1.9.
fn cut(line: &[Place]) -> Vec<Vec<Position>> {
    let mut parts = vec![Vec::new()];
    let mut last: Option<Place> = None;
    for &place in line {
        if let Some(from) = last.filter(|from| (from.longitude - place.longitude).abs() > 180.0) {
            let edge = 180.0_f64.copysign(from.longitude);
            let beyond = place.longitude + 2.0 * edge;
            let share = (edge - from.longitude) / (beyond - from.longitude);
            let latitude = from.latitude + share * (place.latitude - from.latitude);
            let at_edge = |longitude| position(Place { latitude, longitude });
            parts.last_mut().into_iter().for_each(|part: &mut Vec<Position>| part.push(at_edge(edge)));
            parts.push(vec![at_edge(-edge)]);
        }
        parts.last_mut().into_iter().for_each(|part| part.push(position(place)));
        last = Some(place);
    }
    parts
}

/// Longitude before latitude, as in GeoJSON. The ninth decimal of a degree is 0.1 mm.
fn position(place: Place) -> Position {
    Position::from([place.longitude, place.latitude].map(|degrees| (degrees * 1e9).round() / 1e9))
}

/// Seconds or metres with three decimals.
fn rounded(value: f64) -> JsonValue {
    ((value * 1000.0).round() / 1000.0).into()
}
