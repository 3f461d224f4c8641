//! Logs as jobs, and their maps: a machine that rolls along a row, with a receiver's lines between the machine's.

use geojson::{FeatureCollection, GeometryValue};
use gps::job::{Did, Event, EventKind};
use gps::picture::Words;
use gps::plane::{Metres, Place, Plane};
use gps::sentence::{Quality, framed};
use gps::simulated::gga;
use gps::summary::{Stand, Summary};
use gps::{Antenna, Job, Wanted, map, picture};
use link::Class;
use logbook::log::{Entry, Kind};
use proptest::prelude::*;

const TICKS_A_MM: f64 = 2.0;

/// The machine rolls so fast, in mm/s.
const SPEED: f64 = 500.0;

/// Noon, in milliseconds of a day.
const NOON_MS: i64 = 43_200_000;

/// The antenna's first position, near the 180th meridian.
const FROM: Place = Place { latitude: -16.8, longitude: 179.999_9 };

/// The log of a machine that rolls 30 m to the east. It is at work from 5 m to 25 m, with a plant every half metre.
/// `change` can change the receiver's line of each second, from 2 s on.
fn record(change: impl Fn(u64, String) -> Vec<(Kind, String)>) -> Vec<Entry> {
    let plane = Plane::around(FROM);
    let mut lines = vec![
        (0, Kind::Antenna, "beam_ahead_mm=1000 beam_right_mm=0 delay_ms=0".to_owned()),
        (0, Kind::Connected, "0.2.0".to_owned()),
        (0, Kind::Setting, "ticks_per_m=2000".to_owned()),
        (0, Kind::Setting, "margin_mm=50".to_owned()),
        (0, Kind::Setting, "beam_to_tool_mm=400".to_owned()),
    ];
    for tenth in 0..=600_u64 {
        let (time_ms, distance_mm) = (100 * tenth, SPEED * tenth as f64 / 10.0);
        let is_at_work = (5000.0..25_000.0).contains(&distance_mm);
        // The tool is out over the first 200 of each 500 mm.
        let is_out = !is_at_work || distance_mm % 500.0 < 200.0;
        let (mode, tool) = (if is_at_work { "work" } else { "hold" }, if is_out { "out" } else { "in" });
        if tenth.is_multiple_of(10) && tenth >= 20 {
            let place = plane.place(Metres { east: distance_mm / 1000.0, north: 0.0 });
            lines.extend(
                change(tenth / 10, framed(&gga(NOON_MS + time_ms as i64, Some((place, Quality::Rtk)))))
                    .into_iter()
                    .map(|(kind, line)| (time_ms, kind, line)),
            );
        }
        let position = (TICKS_A_MM * distance_mm) as i64;
        if is_at_work && (distance_mm % 500.0 == 200.0 || distance_mm % 500.0 == 0.0) {
            lines.push((time_ms, Kind::Event, format!("swing tool={tool} pos={position}")));
        }
        let status = format!("state={mode} tool={tool} pos={position} speed_mm_s=500 windows=0 unseen_mm=0");
        lines.push((time_ms, Kind::Status, status));
        if is_at_work && distance_mm % 500.0 == 250.0 {
            // The canopy is 100 mm wide, and ended here. The hold includes both margins.
            let leading = position - 200;
            let plant = format!("plant pos={leading} votes=3 spacing=1000 delay=600 hold=400 actuation=1000");
            lines.push((time_ms + 1, Kind::Event, plant));
        }
    }
    let entry = |(at, (time_ms, kind, text))| Entry { number: at as u64 + 2, time_ms, kind, text };
    lines.into_iter().enumerate().map(entry).collect()
}

fn whole() -> Vec<Entry> {
    record(|_, line| vec![(Kind::Gps, line)])
}

/// Inserts these lines into the middle of a log, at one moment.
fn insert(log: &mut Vec<Entry>, lines: Vec<(Kind, &str)>) {
    let middle = log.len() / 2;
    let time_ms = log[middle].time_ms;
    let entry = |(kind, text): (Kind, &str)| Entry { number: 99_999, time_ms, kind, text: text.to_owned() };
    let entries: Vec<Entry> = lines.into_iter().map(entry).collect();
    log.splice(middle..middle, entries);
}

fn is_detection(event: &&Event) -> bool {
    matches!(event.kind, EventKind::Detection { .. })
}

/// Plants, and the swings between.
const PLANTS: usize = 40;
const SWINGS: usize = 80;

#[test]
fn a_plant_is_the_middle_of_its_canopy_and_stands_where_the_beam_was() {
    let job = Job::read(&whole(), &Wanted::default());
    let plane = Plane::around(FROM);
    let plants: Vec<_> = job.events().filter(is_detection).collect();
    assert_eq!(plants.len(), PLANTS);
    for (number, plant) in plants.iter().enumerate() {
        // The leading edge was 100 mm before, the middle is 50 mm behind that, and the beam is a metre ahead of the
        // antenna.
        let distance_m = 5.2 + 0.5 * number as f64;
        assert!((plant.distance_m - distance_m).abs() < 1e-9 && plant.width_mm == 100.0, "{plant:?}");
        let at = plane.metres(plant.found.expect("it has a place").place);
        assert!((at.east - distance_m - 1.0).abs() < 1e-3 && at.north.abs() < 1e-3, "{at:?}");
    }
}

#[test]
fn a_summary_counts_the_stand_and_the_ground() {
    let mut log = whole();
    let stand = Stand { row_spacing_mm: 500.0, spacing_mm: None };
    let summary = Summary::of(&Job::read(&log, &Wanted::default()), &stand);
    assert_eq!((summary.plants, summary.missing, summary.swings), (PLANTS as u64, 0, 40));
    assert!((summary.worked_m - 20.0).abs() < 1e-6 && (summary.weeded_m - 12.0).abs() < 0.1, "{summary:?}");
    assert!((summary.area_ha - 0.001).abs() < 1e-9 && (summary.work_h - 40.0 / 3600.0).abs() < 1e-4, "{summary:?}");
    assert_eq!(summary.spacing_mean_mm.map(f64::round), Some(500.0));
    // Three are missing, two of them side by side.
    let plants: Vec<u64> =
        log.iter().filter(|entry| entry.text.starts_with("plant")).map(|entry| entry.number).collect();
    log.retain(|entry| ![plants[7], plants[20], plants[21]].contains(&entry.number));
    let summary = Summary::of(&Job::read(&log, &Wanted::default()), &stand);
    assert_eq!((summary.plants, summary.missing), (37, 3));
    assert_eq!(summary.spacing_mean_mm.map(f64::round), Some(500.0), "without the gaps");
}

#[test]
fn each_map_feature_has_a_geometry_or_a_reason_for_none() {
    // No fix from 20 to 30 s, which is 5 m, and none at the end.
    let lost = |second: u64, line: String| {
        if (20..30).contains(&second) || second > 45 { vec![] } else { vec![(Kind::Gps, line)] }
    };
    let job = Job::read(&record(lost), &Wanted::default());
    let text = map::features(&[("field.csv", &job)]).to_string();
    let map: FeatureCollection = text.parse().expect("it is GeoJSON");
    let of_kind = |kind: &str| -> Vec<_> {
        map.features.iter().filter(|feature| feature.property("kind").is_some_and(|it| it == kind)).collect()
    };
    let plants = of_kind("plant");
    let placed = |how: &str| plants.iter().filter(|plant| plant.property("place").is_some_and(|it| it == how)).count();
    // The last fix is at 22.5 m.
    assert_eq!((plants.len(), placed("none")), (PLANTS, 5));
    assert!((10..=12).contains(&placed("interpolated")), "{}", placed("interpolated"));
    for plant in plants {
        let why = plant.property("why").is_some_and(|why| why == "no fix behind it");
        assert_eq!((plant.geometry.is_none(), plant.contains_property("error_m")), (why, !why));
        assert!(plant.property("record").is_some_and(|record| record == "field.csv"));
    }
    // No line crosses the 180th meridian: RFC 7946 requires a cut there.
    let (mut ends, mut length) = ([0, 0], 0.0);
    for feature in of_kind("weeded").into_iter().chain(of_kind("not_weeded")) {
        length += feature.property("length_m").and_then(serde_json::Value::as_f64).expect("a number");
        let parts = match feature.geometry.as_ref().map(|geometry| &geometry.value) {
            Some(GeometryValue::LineString { coordinates }) => vec![coordinates.clone()],
            Some(GeometryValue::MultiLineString { coordinates }) => coordinates.clone(),
            None => Vec::new(),
            other => panic!("{other:?}"),
        };
        for part in parts {
            assert!(part.len() > 1 && part.windows(2).all(|two| (two[0][0] - two[1][0]).abs() < 1.0), "{part:?}");
            ends[0] += part.iter().filter(|place| place[0] == 180.0).count();
            ends[1] += part.iter().filter(|place| place[0] == -180.0).count();
        }
    }
    assert!((length - 20.0).abs() < 0.01, "{length}");
    assert_eq!(ends, [1, 1]);
}

#[test]
fn the_drawing_has_a_circle_for_each_plant_and_none_without_a_place() {
    let job = Job::read(&whole(), &Wanted::default());
    let drawn = picture::draw(&[&job], &Words::default()).expect("it has places").to_string();
    assert_eq!(drawn.matches("<circle").count(), PLANTS);
    assert!(drawn.contains("5 m, north is up"), "{drawn}");
    assert!(picture::draw(&[&Job::read(&record(|_, _| vec![]), &Wanted::default())], &Words::default()).is_none());
}

#[test]
fn a_reopened_log_or_a_reset_uno_restarts_the_distance() {
    let job = Job::read(&[whole(), whole()].concat(), &Wanted::default());
    assert_eq!(job.events().filter(|event| event.found.is_ok()).count(), 2 * (PLANTS + SWINGS));
    assert_eq!(job.stretches.len(), 2);
    let mut log = whole();
    let reset = vec![
        (Kind::Lost, "the Uno was reset"),
        (Kind::Connected, "0.2.0"),
        (Kind::Setting, "ticks_per_m=2000"),
        (Kind::Setting, "margin_mm=50"),
    ];
    insert(&mut log, reset);
    let job = Job::read(&log, &Wanted::default());
    assert_eq!((job.stretches.len(), job.events().count()), (2, PLANTS + SWINGS));
    // Objects between the last fix before it and the first after it have no position.
    let missing = job.events().filter(|event| event.found.is_err()).count();
    assert!((1..=8).contains(&missing), "{missing}");
}

#[test]
fn each_session_has_its_own_antenna_and_the_user_s_offsets_replace_all() {
    let mut moved = whole();
    moved[0].text = "beam_ahead_mm=0 beam_right_mm=0 delay_ms=0".to_owned();
    let log = [whole(), moved].concat();
    let ahead = |antenna: Antenna| Antenna { beam_ahead_mm: 300.0, ..antenna };
    let replaced = Wanted { antenna: &ahead, ..Wanted::default() };
    let plane = Plane::around(FROM);
    for (wanted, ahead_m) in [(Wanted::default(), [1.0, 0.0]), (replaced, [0.3, 0.3])] {
        let job = Job::read(&log, &wanted);
        assert_eq!(job.stretches.len(), 2);
        for (stretch, ahead_m) in job.stretches.iter().zip(ahead_m) {
            for plant in stretch.events.iter().filter(is_detection) {
                let at = plane.metres(plant.found.expect("it has a place").place);
                assert!((at.east - plant.distance_m - ahead_m).abs() < 1e-3, "{ahead_m}: {plant:?}");
            }
        }
    }
}

#[test]
fn over_a_gap_of_the_statuses_no_ground_counts_and_no_plant_is_missing() {
    // The machine rolls on for 25 s. The clock of a computer that sleeps stands still.
    for clock_ms in [0, 24_900] {
        let mut log = whole();
        log.retain(|entry| !(20_001..45_000).contains(&entry.time_ms));
        log.iter_mut().filter(|entry| entry.time_ms >= 45_000).for_each(|entry| entry.time_ms -= clock_ms);
        let job = Job::read(&log, &Wanted::default());
        let summary = Summary::of(&job, &Stand { row_spacing_mm: 500.0, spacing_mm: None });
        assert_eq!((summary.plants, summary.missing, summary.wheel_gaps, summary.jumps), (15, 0, 1, 0), "{clock_ms}");
        assert!((summary.worked_m - 7.5).abs() < 1e-6 && (summary.weeded_m - 4.5).abs() < 0.1, "{summary:?}");
    }
}

#[test]
fn a_change_of_the_wheel_begins_a_new_stretch() {
    let mut log = whole();
    let set = vec![
        (Kind::Command, "set ticks_per_m 1000"),
        (Kind::Answer, "ok"),
        (Kind::Command, "label plant"),
        (Kind::Event, "swing tool=out pos=30100"),
        (Kind::Answer, "error: there is no object to label"),
    ];
    insert(&mut log, set);
    let job = Job::read(&log, &Wanted::default());
    assert_eq!(job.events().count(), PLANTS + SWINGS + 1, "nothing told is left out");
    let [one, other] = job.stretches.as_slice() else { panic!("{}", job.stretches.len()) };
    let spacing_m = |events: &[Event]| {
        let plants: Vec<f64> = events.iter().filter(is_detection).map(|plant| plant.distance_m).collect();
        plants[2] - plants[1]
    };
    assert!((spacing_m(&one.events) - 0.5).abs() < 1e-9 && (spacing_m(&other.events) - 1.0).abs() < 1e-9);
}

#[test]
fn a_command_whose_answer_is_lost_makes_the_wheel_unknown() {
    let mut log = whole();
    // The answer was an error, because the machine was at work.
    insert(&mut log, vec![(Kind::Command, "set wheel_mm 800"), (Kind::Command, "status"), (Kind::Answer, "ok")]);
    let job = Job::read(&log, &Wanted::default());
    assert!(job.without_wheel > 0 && job.stretches.len() == 1, "{} {}", job.without_wheel, job.stretches.len());
    // A hold does not wait for the answer before it.
    let mut log = whole();
    let held = [(Kind::Command, "set wheel_mm 800"), (Kind::Command, "hold")];
    let answers = [(Kind::Answer, "error: hold first"), (Kind::Answer, "ok")];
    insert(&mut log, [held, answers].concat());
    assert_eq!(Job::read(&log, &Wanted::default()).without_wheel, 0);
}

#[test]
fn a_change_of_wheel_and_its_revert_each_begin_a_stretch() {
    let mut log = whole();
    let set = vec![
        (Kind::Setting, "ticks_per_rev=2400"),
        (Kind::Command, "set wheel_mm 410"),
        (Kind::Answer, "ok"),
        (Kind::Command, "revert"),
        (Kind::Answer, "ok"),
        (Kind::Answer, "ticks_per_m=2000 from 0 to 20000, default 0, saved 2000"),
    ];
    insert(&mut log, set);
    // Each change of the tick's length begins a stretch.
    assert_eq!(Job::read(&log, &Wanted::default()).stretches.len(), 3);
}

/// The weeded ground of a machine that rolls to these distances in mm. Its swings have no lines.
fn weeded_m(passes: &[(&str, &str, &[i64])]) -> f64 {
    let entry = |kind, text: &str| Entry { number: 1, time_ms: 0, kind, text: text.to_owned() };
    let mut log = vec![entry(Kind::Connected, "0.2.0"), entry(Kind::Setting, "ticks_per_m=2000")];
    for &(state, tool, distances_mm) in passes {
        for distance_mm in distances_mm {
            let pos = 2 * distance_mm;
            let text = format!("state={state} tool={tool} pos={pos} speed_mm_s=0 windows=0 unseen_mm=0");
            log.push(Entry { number: 1, time_ms: 200 * log.len() as u64, kind: Kind::Status, text });
        }
    }
    let job = Job::read(&log, &Wanted::default());
    let weeded = job.stretches[0].ground.iter().filter(|ground| ground.did == Did::Weeded);
    weeded.map(|ground| ground.distance_m.end - ground.distance_m.start).sum()
}

#[test]
fn ground_covered_again_counts_once_unless_in_another_row() {
    let row: &[i64] = &[0, 1000, 2000, 3000];
    for (passes, expected_m) in [
        (&[("work", "in", &[0, 500, 1000, 500, 200, 700, 1200][..])][..], 1.2),
        (&[("work", "in", row), ("hold", "out", &[2000, 1500]), ("work", "in", &[1500, 2500, 3500])], 3.5),
        (&[("work", "in", row), ("hold", "out", &[3000, 2000, 1000, 0]), ("work", "in", row)], 6.0),
    ] {
        let found_m = weeded_m(passes);
        assert!((found_m - expected_m).abs() < 1e-9, "{passes:?}: {found_m}");
    }
}

#[test]
fn a_damaged_position_adds_no_ground() {
    let log = whole();
    let worked = |log: &[Entry]| {
        let summary =
            Summary::of(&Job::read(log, &Wanted::default()), &Stand { row_spacing_mm: 500.0, spacing_mm: None });
        (summary.worked_m, summary.weeded_m, summary.missing)
    };
    let (worked_m, weeded_m, missing) = worked(&log);
    for at in (0..log.len()).step_by(7) {
        let Some((before, position)) = log[at].text.split_once(" pos=") else { continue };
        let (position, behind) = position.split_once(' ').unwrap_or((position, ""));
        for by in [1_000_000, 100_000, -100_000] {
            let mut log = log.clone();
            let damaged = position.parse::<i32>().expect("it is a number") + by;
            log[at].text = format!("{before} pos={damaged} {behind}");
            let (found_m, found_weeded_m, found_missing) = worked(&log);
            // At most the ground between the statuses around it is unknown, and that up to a swing.
            assert!((-0.5..0.1).contains(&(found_m - worked_m)), "{}: {by}: {found_m} of {worked_m}", log[at].text);
            assert!((-0.5..0.1).contains(&(found_weeded_m - weeded_m)), "{}: {by}: {found_weeded_m}", log[at].text);
            // The damaged detection itself is missing.
            assert!((missing..=missing + 1).contains(&found_missing), "{}: {by}: {found_missing}", log[at].text);
        }
    }
}

#[test]
fn plants_that_a_start_sees_again_count_once_and_another_row_for_itself() {
    // Half metres. A plant of 350 mm stands every metre, one of them in the beam at each start. The machine is drawn
    // back in hold.
    for (back_to, expected) in [(5, 5), (1, 9)] {
        let entry = |kind, text: &str| Entry { number: 1, time_ms: 0, kind, text: text.to_owned() };
        let mut log = vec![entry(Kind::Connected, "0.2.0"), entry(Kind::Setting, "ticks_per_m=2000")];
        let (back, on) = ((back_to..8).rev().map(|at| ("hold", 8, at)), (back_to..=10).map(|at| ("work", back_to, at)));
        for (state, start, at) in (1..=8).map(|at| ("work", 1, at)).chain(back).chain(on) {
            let time_ms = 200 * log.len() as u64;
            let text = format!("state={state} tool=out pos={} speed_mm_s=0 windows=0 unseen_mm=400", 1000 * at);
            log.push(Entry { time_ms, ..entry(Kind::Status, &text) });
            if state == "work" && at % 2 == 0 {
                let (seen, trailing) = (i64::max(1000 * at - 1600, 1000 * start), 1000 * at - 900);
                let hold = trailing - seen + 200;
                let text = format!("plant pos={seen} votes=3 spacing=0 delay=0 hold={hold} actuation=0");
                log.push(Entry { time_ms, ..entry(Kind::Event, &text) });
            }
        }
        let job = Job::read(&log, &Wanted::default());
        assert_eq!(job.events().filter(is_detection).count(), expected, "{back_to}");
    }
}

#[test]
fn without_the_lines_of_swings_the_statuses_show_the_weeded_ground() {
    let passes: &[(&str, &str, &[i64])] =
        &[("work", "in", &[0, 500, 1000]), ("work", "out", &[1500, 2000]), ("work", "in", &[2500, 3000, 3500])];
    assert!((weeded_m(passes) - 2.5).abs() < 1e-9, "{}", weeded_m(passes));
}

#[test]
fn a_label_lies_where_the_last_object_does_and_a_refused_one_is_none() {
    let mut log = whole();
    let said = vec![
        (Kind::Command, "label weed"),
        (Kind::Answer, "ok"),
        (Kind::Command, "label plant"),
        (Kind::Answer, "error: there is no object to label"),
    ];
    insert(&mut log, said);
    let labels = |job: &Job| -> Vec<EventKind> {
        job.events().map(|event| event.kind).filter(|kind| matches!(kind, EventKind::Label(_))).collect()
    };
    // The firmware takes capital letters.
    for (line, class) in [("LABEL PLANT", Class::Plant), (" Label  weed force", Class::Weed)] {
        let mut log = whole();
        insert(&mut log, vec![(Kind::Command, line), (Kind::Answer, "ok")]);
        assert_eq!(labels(&Job::read(&log, &Wanted::default())), [EventKind::Label(class)], "{line}");
    }
    let job = Job::read(&log, &Wanted::default());
    let events: Vec<_> = job.events().collect();
    let at = events.iter().position(|event| matches!(event.kind, EventKind::Label(_))).expect("a label");
    assert_eq!(events[at].kind, EventKind::Label(Class::Weed));
    let object = events[..at].iter().rev().find(|event| is_detection(event)).expect("an object");
    assert_eq!((object.found, object.distance_m), (events[at].found, events[at].distance_m));
    assert_eq!(labels(&job).len(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    #[test]
    fn faults_in_the_receivers_lines_lose_no_line_of_the_machine(
        hurt in prop::collection::vec((2..60_u64, 0..100_usize, any::<u8>(), 0..4_u8), 0..40),
    ) {
        let change = |second: u64, line: String| {
            let mut line = line.into_bytes();
            let mut kind = Kind::Gps;
            for &(_, at, byte, how) in hurt.iter().filter(|(when, ..)| *when == second) {
                let at = at % line.len().max(1);
                match how {
                    0 => line.truncate(at),
                    1 => line.get_mut(at).into_iter().for_each(|it| *it = byte),
                    2 => kind = Kind::GpsDamaged,
                    _ => return vec![(Kind::GpsLost, "unplugged".to_owned())],
                }
            }
            vec![(kind, String::from_utf8_lossy(&line).into_owned())]
        };
        let job = Job::read(&record(change), &Wanted::default());
        prop_assert_eq!(job.events().count(), PLANTS + SWINGS);
        let plane = Plane::around(FROM);
        for event in job.events() {
            let Ok(found) = event.found else { continue };
            let ahead_m = if is_detection(&event) { 1.0 } else { 0.6 };
            let at = plane.metres(found.place);
            prop_assert!((at.east - event.distance_m - ahead_m).abs() < 2e-3 && at.north.abs() < 2e-3, "{:?}", event);
        }
        prop_assert!(map::features(&[("a record", &job)]).features.len() >= PLANTS + SWINGS);
    }
}
