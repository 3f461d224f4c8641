//! A job as GeoJSON (RFC 7946), for QGIS and other map programs.
//!
//! It is one FeatureCollection. A plant, weed, swing, alarm, label, restart, fault of the wheel or jump of the receiver is a point. A piece of
//! ground, weeded or not, is a line. An event without a position has no geometry, and gives the reason. The crate
//! `geojson` writes the file.

use crate::job::{Did, Event, EventKind, Ground, Job};
use crate::plane::Place;
use chrono::DateTime;
use geojson::{Feature, FeatureCollection, Geometry, JsonObject, JsonValue, Position};

/// Decimal places of a degree: the ninth is 0.1 mm.
const DEGREE_DIGITS: i32 = 9;

/// The map of some jobs, each with its record's name.
pub fn features(jobs: &[(&str, &Job)]) -> FeatureCollection {
    let of_job = |&(name, job): &(&str, &Job)| of_job(name, job);
    FeatureCollection::new(jobs.iter().flat_map(of_job))
}

fn of_job(name: &str, job: &Job) -> Vec<Feature> {
    let mut features = Vec::new();
    for (number, stretch) in job.stretches.iter().enumerate() {
        let mut add = |mut feature: Feature| {
            feature.set_property("record", name);
            feature.set_property("stretch", number + 1);
            features.push(feature);
        };
        stretch.ground.iter().filter_map(ground).for_each(&mut add);
        stretch.events.iter().map(|it| event(job, it)).for_each(&mut add);
    }
    for (line, jump) in &job.jumps {
        let mut feature = feature("gps_jump", Some(Geometry::new_point(position(jump.place))));
        feature.set_property("record", name);
        feature.set_property("line", *line);
        feature.set_property("record_s", rounded(jump.time_ms / 1000.0, 3));
        feature.set_property("far_m", rounded(jump.far_m, 3));
        features.push(feature);
    }
    features
}

fn feature(kind: &str, geometry: Option<Geometry>) -> Feature {
    let mut feature = Feature { geometry, properties: Some(JsonObject::new()), ..Feature::default() };
    feature.set_property("kind", kind);
    feature
}

fn event(job: &Job, event: &Event) -> Feature {
    let geometry = event.found.ok().map(|found| Geometry::new_point(position(found.place)));
    let mut feature = feature(event.kind.name(), geometry);
    let found = event.found.ok();
    let time = found.zip(job.midnight_ms).and_then(|(found, midnight)| utc(midnight + found.utc_ms));
    feature.set_property("time", time.map_or(JsonValue::Null, JsonValue::from));
    feature.set_property("record_s", rounded(event.time_ms as f64 / 1000.0, 3));
    feature.set_property("distance_m", rounded(event.distance_m, 3));
    feature.set_property("line", event.line);
    match event.found {
        Ok(found) => {
            feature.set_property("place", <&str>::from(found.basis));
            feature.set_property("error_m", rounded(found.error_m, 3));
        }
        Err(missing) => {
            feature.set_property("place", "none");
            feature.set_property("why", missing.to_string());
        }
    }
    if let EventKind::Detection { votes, .. } = event.kind {
        feature.set_property("votes", votes);
    }
    if event.width_mm > 0.0 {
        feature.set_property("width_mm", event.width_mm.round());
    }
    if matches!(event.kind, EventKind::Alarm | EventKind::Restart | EventKind::WheelSpun | EventKind::WheelGap) {
        feature.set_property("said", event.text.as_str());
    }
    feature
}

/// A line for ground over which the machine was at work.
fn ground(ground: &Ground) -> Option<Feature> {
    let kind = match ground.did {
        Did::Weeded => "weeded",
        Did::Spared => "not_weeded",
        Did::Rolled => return None,
    };
    let length_m = ground.distance_m.end - ground.distance_m.start;
    let parts: Vec<Vec<Position>> = ground.lines.iter().flat_map(|line| cut(line)).collect();
    let geometry = match parts.len() {
        0 => None,
        1 => parts.into_iter().next().map(Geometry::new_line_string),
        _ => Some(Geometry::new_multi_line_string(parts)),
    };
    let mut feature = feature(kind, geometry);
    feature.set_property("record_s", rounded(ground.time_ms.start as f64 / 1000.0, 3));
    feature.set_property("distance_m", rounded(ground.distance_m.start, 3));
    feature.set_property("length_m", rounded(length_m, 3));
    (length_m > 0.0).then_some(feature)
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

/// Longitude before latitude, as in GeoJSON.
fn position(place: Place) -> Position {
    Position::from([rounded(place.longitude, DEGREE_DIGITS), rounded(place.latitude, DEGREE_DIGITS)])
}

fn rounded(value: f64, digits: i32) -> f64 {
    let factor = 10_f64.powi(digits);
    (value * factor).round() / factor
}

/// A time in the form of ISO 8601, which QGIS accepts. `None` for an invalid date.
fn utc(time_ms: i64) -> Option<String> {
    let time = DateTime::from_timestamp_millis(time_ms)?;
    Some(time.to_rfc3339_opts(chrono::SecondsFormat::Millis, true))
}
