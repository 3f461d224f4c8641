//! Files as receivers and loggers write them, recorded beside a machine that rolls, and read as a map reads them. Those
//! in `nmea/` have 60 fixes of RTK at 5 Hz, with a machine at 0.69 m/s. Others are made with habits drawn at random.

use gps::plane::{Metres, Place, Plane};
use gps::receiver::Mark;
use gps::sentence::{DAY_MS, Quality, framed};
use gps::track::Basis;
use gps::{Antenna, Job, Recorder, Wanted, playback};
use link::Status;
use link::session::Happening;
use link::settings::{Setting, Settings};
use logbook::log::{Entry, Kind};
use proptest::prelude::*;
use std::path::Path;

/// The machine's speed in mm/s, and ticks in a metre.
const SPEED: f64 = 690.0;
const TICKS_PER_M: u16 = 2000;

/// The 14th of June 2026 in days from 1970, and a quarter past ten of it in milliseconds.
const DAY: i64 = 20_618;
const BEGAN_MS: i64 = 1_781_432_100_000;

/// The log of a file of a receiver beside a machine. The wheel gives `wheel` metres for each metre at a time in
/// seconds, and has a plant each metre. There are no statuses during `gap_s`.
fn recorded(file: &[u8], wheel: impl Fn(f64) -> f64, gap_s: std::ops::Range<f64>) -> Vec<Entry> {
    let mut pieces = playback::pieces(file).expect("it can be used");
    let (mut recorder, mut lines) = Recorder::new(&Antenna::default());
    lines.extend(recorder.found(0, "a file"));
    let mut settings = Settings::new();
    settings.set(Setting::TicksPerM, TICKS_PER_M).unwrap();
    let (version, shown) = ("0.2.0".to_owned(), vec![]);
    recorder.happened(0, &Happening::Connected { version, settings, shown, examples: vec![] });
    lines.push((Kind::Connected, "0.2.0".to_owned()));
    lines.push((Kind::Setting, format!("ticks_per_m={TICKS_PER_M}")));
    let mut log: Vec<(u64, Kind, String)> = lines.into_iter().map(|(kind, line)| (0, kind, line)).collect();
    let end_ms = pieces.back().unwrap().due_ms + 500;
    for time_ms in (0..=end_ms).step_by(20) {
        let time_s = time_ms as f64 / 1000.0;
        let position = (wheel(time_s) * f64::from(TICKS_PER_M)) as i64;
        if time_ms % 100 == 0 && !gap_s.contains(&time_s) {
            let line = format!("state=work tool=in pos={position} speed_mm_s=690 windows=0 unseen_mm=0");
            recorder.happened(time_ms, &Happening::Status(Status::parse(&line).unwrap(), line.clone()));
            log.push((time_ms, Kind::Status, line));
        }
        if time_ms % 1000 == 500 {
            let line = format!("plant pos={position} votes=3 spacing=1000 delay=600 hold=191 actuation=1000");
            log.push((time_ms, Kind::Event, line));
        }
        while let Some(piece) = pieces.pop_front_if(|piece| piece.due_ms <= time_ms) {
            log.extend(piece.note.map(|note| (time_ms, Kind::GpsMark, note)));
            log.extend(recorder.take(time_ms, &piece.bytes).into_iter().map(|(kind, line)| (time_ms, kind, line)));
        }
    }
    let entry = |(at, (time_ms, kind, text))| Entry { number: at as u64 + 2, time_ms, kind, text };
    log.into_iter().enumerate().map(entry).collect()
}

fn steady(time_s: f64) -> f64 {
    SPEED / 1000.0 * time_s
}

fn case(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/nmea").join(name)).expect("it is there")
}

fn marks(log: &[Entry]) -> Vec<&str> {
    log.iter().filter(|entry| entry.kind == Kind::GpsMark).map(|entry| entry.text.as_str()).collect()
}

/// The days of the events with a position, from 1970, without repetition.
fn days(job: &Job) -> Vec<Option<i64>> {
    let mut days: Vec<_> = job.events().filter_map(|event| event.found.ok()).map(|found| job.utc_ms(&found)).collect();
    days.iter_mut().for_each(|day| *day = day.map(|utc_ms| utc_ms.div_euclid(DAY_MS)));
    days.dedup();
    days
}

/// The greatest distance of an event from the machine's true line, and of the events' errors, in metres.
fn off_m(job: &Job) -> (f64, f64) {
    let plane = Plane::around(Place { latitude: 51.5, longitude: 0.1 });
    let found = job.events().filter_map(|event| Some((event.distance_m, event.found.ok()?)));
    found.fold((0.0, 0.0), |(off_m, error_m), (distance_m, found)| {
        let at = plane.metres(found.place) - Metres::toward(73.0) * distance_m;
        (at.length().max(off_m), found.error_m.max(error_m))
    })
}

#[test]
fn files_of_other_receivers_give_all_their_fixes() {
    let rtk = "fix by RTK";
    for (name, fixes, expected) in [
        ("ubx-before-each-gga.nmea", 60, &[rtk][..]),
        ("two-on-a-line.nmea", 60, &[rtk]),
        ("tag-block.nmea", 60, &[rtk]),
        ("cr-only.nmea", 60, &[rtk]),
        ("rmc-variation-letter-only-rtk.nmea", 60, &[rtk]),
        ("rmc-variation-letter-only-dead-reckoning.nmea", 0, &["no fix"]),
        ("gga-quality-9.nmea", 60, &["fix by differential"]),
        ("rmc-4-digits-before-gga-7.nmea", 60, &[rtk]),
        ("last-date-1024-weeks-back.nmea", 60, &[rtk]),
        ("gap-of-an-hour.nmea", 60, &[rtk, "the file has a pause of 60.0 min: jumped over"]),
        (
            "time-steps-back-one-second.nmea",
            60,
            &[
                rtk,
                "the file's time goes back by 0.8 s: read on without a wait",
                "the receiver's clock went back by 1 s: used as it is now",
            ],
        ),
    ] {
        let log = recorded(&case(name), steady, 0.0..0.0);
        assert_eq!(marks(&log), expected, "{name}");
        let job = Job::read(&log, &Wanted::default());
        assert_eq!((job.counts.fixes, job.counts.damaged, job.counts.jumps), (fixes, 0, 0), "{name}");
        let (off_m, error_m) = off_m(&job);
        assert!(off_m < 0.012 && error_m < 0.1 || name.contains("quality-9"), "{name}: {off_m} m off, error {error_m}");
        let placed = job.events().filter(|event| event.found.is_ok()).count();
        assert_eq!(placed, if fixes == 0 { 0 } else { job.events().count() }, "{name}");
    }
}

#[test]
fn zeros_are_no_fix_and_the_true_ones_after_them_are_all_used() {
    let log = recorded(&case("null-island-first.nmea"), steady, 0.0..0.0);
    assert_eq!(marks(&log), ["no fix", "fix by RTK"]);
    let job = Job::read(&log, &Wanted::default());
    let sent = case("null-island-first.nmea")
        .split(|&byte| byte == b'\n')
        .filter(|line| line.windows(4).any(|it| it == b"5130"))
        .count();
    assert_eq!((job.counts.fixes, job.counts.jumps), (sent as u64, 0));
}

#[test]
fn a_date_that_one_line_has_is_not_that_of_the_map() {
    let days = |name| days(&Job::read(&recorded(&case(name), steady, 0.0..0.0), &Wanted::default()));
    assert_eq!(days("last-date-1024-weeks-back.nmea"), [Some(DAY)]);
    assert_eq!(days("gap-of-an-hour.nmea"), [None]);
}

#[test]
fn a_record_that_is_continued_has_the_date_of_each_session() {
    let file = |began_ms: i64| {
        sent_from(began_ms, |_, texts| texts.iter().flat_map(|text| (framed(text) + "\r\n").into_bytes()).collect())
    };
    let is_right = |log: &[Entry], began_ms: [i64; 2]| {
        let job = Job::read(log, &Wanted::default());
        let mut placed = [0; 2];
        for (number, stretch) in job.stretches.iter().enumerate() {
            for event in &stretch.events {
                let Ok(found) = event.found else { continue };
                // Each file has 12 s.
                let since_s = event.distance_m / (SPEED / 1000.0) + 12.0 * number as f64;
                let session = usize::from(since_s >= 12.0);
                let utc_ms = began_ms[session] + (1000.0 * (since_s % 12.0)) as i64;
                assert!(job.utc_ms(&found).is_some_and(|it| (it - utc_ms).abs() < 200), "{began_ms:?}: {event:?}");
                placed[session] += 1;
            }
        }
        assert!(placed.into_iter().all(|placed| placed > 8), "{placed:?}");
    };
    let hours = |hours: [f64; 2]| hours.map(|hours| DAY * DAY_MS + (hours / 24.0 * DAY_MS as f64) as i64);
    // The next morning, two nights, the same day after more than half a day, the same time a day later, and the day after
    // a midnight at work.
    for began_ms in [[18.0, 32.0], [18.0, 56.0], [0.5, 14.0], [10.0, 34.0], [23.999, 32.0]].map(hours) {
        is_right(&began_ms.map(|began_ms| recorded(&file(began_ms), steady, 0.0..0.0)).concat(), began_ms);
    }
    // The PC sleeps, and the log's clock stands still.
    for began_ms in [[18.0, 32.0], [0.5, 14.0], [23.999, 32.0]].map(hours) {
        is_right(&recorded(&began_ms.map(file).concat(), steady, 0.0..0.0), began_ms);
    }
}

#[test]
fn a_file_without_positions_is_refused_with_what_would_be_right() {
    let refused = |file: &[u8]| playback::pieces(file).expect_err("it is of no use");
    assert!(refused(&case("only-gll.nmea")).contains("no line has RMC or GGA"));
    assert!(refused(b"$GPGGA,092750.000,,,,,0,,,,M,,M,,\r\n").contains("have no checksum"));
    for other in ["", "hello\n", "time_ms,kind,line\n"] {
        assert!(refused(other.as_bytes()).contains("no line is NMEA 0183"), "{other}");
    }
}

/// RMC and GGA of 60 fixes, as the cases have them. `change` gets their number and both texts, without frame.
fn sent(change: impl Fn(i64, [String; 2]) -> Vec<u8>) -> Vec<u8> {
    sent_from(BEGAN_MS, change)
}

/// The same from this moment on, in milliseconds from 1970.
fn sent_from(began_ms: i64, change: impl Fn(i64, [String; 2]) -> Vec<u8>) -> Vec<u8> {
    let plane = Plane::around(Place { latitude: 51.5, longitude: 0.1 });
    let fix = |number: i64| {
        let place = plane.place(Metres::toward(73.0) * (0.2 * SPEED / 1000.0 * number as f64));
        let fix = Some((place, Quality::Rtk));
        let utc_ms = began_ms + 200 * number;
        change(number, [gps::simulated::rmc(utc_ms, fix), gps::simulated::gga(utc_ms, fix)])
    };
    (0..60).flat_map(fix).collect()
}

/// A habit of a receiver or of a program that writes its lines to a file.
#[derive(Clone, Debug)]
struct Habits {
    before: Vec<u8>,
    end: &'static str,
    gga_first: bool,
    is_rmc_short: bool,
    has_other: bool,
    variation: &'static str,
    talker: &'static str,
}

fn habits() -> impl Strategy<Value = Habits> {
    let before = prop_oneof![
        Just(b"".to_vec()),
        Just(b"\\g:1-2-73874,s:r003669945*4A\\".to_vec()),
        Just(b"2026-06-14 10:15:00,".to_vec()),
        Just(b"\0\0\0".to_vec()),
        Just(b"[gps] ".to_vec()),
        // UBX and RTCM begin with these bytes.
        prop::collection::vec(any::<u8>(), 0..60).prop_map(|bytes| [&[0xB5, 0x62][..], &bytes, &[0xD3]].concat()),
    ];
    let end = prop::sample::select(vec!["\r\n", "\n", "\r", "", "\r\r\n", "  \r\n", "\0"]);
    let variation = prop::sample::select(vec![",,", ",,E", ",0.3,W"]);
    let talker = prop::sample::select(vec!["GN", "GP", "GL", "BD", "GA"]);
    (before, end, any::<[bool; 3]>(), variation, talker).prop_map(
        |(before, end, [gga_first, is_rmc_short, has_other], variation, talker)| Habits {
            before,
            end,
            gga_first,
            is_rmc_short,
            has_other,
            variation,
            talker,
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    #[test]
    fn habits_of_receivers_change_no_fix(habits in habits()) {
        let file = sent(|number, [mut rmc, gga]| {
            // The mode is the last field: the variation stands before it.
            let (fields, mode) = rmc.rsplit_once(',').unwrap();
            rmc = format!("{}{},{mode}", fields.trim_end_matches(','), habits.variation);
            if habits.is_rmc_short {
                // Three decimals, as some receivers have in RMC alone.
                let mut fields: Vec<String> = rmc.split(',').map(str::to_owned).collect();
                for at in [3, 5] {
                    let point = fields[at].find('.').unwrap();
                    fields[at].truncate(point + 4);
                }
                rmc = fields.join(",");
            }
            let mut texts = vec![rmc, gga];
            if habits.gga_first {
                texts.reverse();
            }
            if habits.has_other && number % 3 == 0 {
                texts.insert(1, "GNVTG,73.0,T,,M,1.35,N,2.5,K,R".to_owned());
            }
            let lines = texts.into_iter().map(|text| framed(&format!("{}{}", habits.talker, &text[2..])));
            lines.flat_map(|line| [&habits.before, line.as_bytes(), habits.end.as_bytes()].concat()).collect()
        });
        let log = recorded(&file, steady, 0.0..0.0);
        let job = Job::read(&log, &Wanted::default());
        prop_assert_eq!((job.counts.fixes, job.counts.damaged, job.counts.jumps, job.counts.losses), (60, 0, 0, 0));
        let (off_m, error_m) = off_m(&job);
        prop_assert!(off_m < 0.012 && error_m < 0.04, "{} m off, error {}", off_m, error_m);
        prop_assert!(job.events().all(|event| event.found.is_ok()));
        prop_assert_eq!(days(&job), [Some(DAY)]);
    }

    #[test]
    fn a_clock_that_steps_back_puts_no_plant_off(at in 15..40_i64, by_s in 1..18_i64, is_lost in any::<bool>()) {
        let utc_ms = |number: i64| BEGAN_MS + 200 * number - if number >= at { 1000 * by_s } else { 0 };
        let plane = Plane::around(Place { latitude: 51.5, longitude: 0.1 });
        let mut receiver = gps::receiver::Receiver::new(None);
        for number in 0..60 {
            // Lines come up to 90 ms late, and none around the step if it is lost.
            let time_ms = 200.0 * number as f64 + 30.0 * (number % 4) as f64;
            receiver.rolled(time_ms, SPEED / 1000.0 * time_ms / 1000.0, SPEED);
            let place = plane.place(Metres::toward(73.0) * (0.2 * SPEED / 1000.0 * number as f64));
            if !is_lost || !(at - 6..at + 2).contains(&number) {
                receiver.take(time_ms, &framed(&gps::simulated::gga(utc_ms(number), Some((place, Quality::Rtk)))));
            }
        }
        receiver.end();
        let steps = receiver.marks.iter().filter(|mark| matches!(mark, Mark::Stepped(_))).count();
        prop_assert_eq!((receiver.fixes.len(), steps), (if is_lost { 52 } else { 60 }, 1));
        for fix in receiver.fixes {
            let metres = plane.metres(fix.place).length();
            prop_assert!((fix.time_ms - 1000.0 * metres / (SPEED / 1000.0)).abs() < 100.0, "{:?}", fix);
        }
    }
}

#[test]
fn the_wheel_is_compared_with_the_receiver() {
    let file = sent(|_, texts| texts.iter().flat_map(|text| (framed(text) + "\r\n").into_bytes()).collect());
    for (wheel, ratio) in [(1.0, 1.0), (2.0, 0.5), (0.5, 2.0), (1.1, 1.0 / 1.1), (1.015, 1.0 / 1.015)] {
        let job = Job::read(&recorded(&file, |time_s| wheel * steady(time_s), 0.0..0.0), &Wanted::default());
        let found = gps::wheel::Ratio::mean(&job.ratios).expect("there is a straight stretch");
        assert!((found.value - ratio).abs() < 3.0 * found.error && found.error < 0.02, "{wheel}: {found:?}");
        assert_eq!(found.is_wrong(), (ratio - 1.0).abs() > 0.02, "{wheel}: {found:?}");
        assert_eq!(job.spun_m, 0.0, "{wheel}");
    }
}

#[test]
fn a_wheel_that_spins_is_marked_and_does_not_count_for_its_ratio() {
    let plane = Plane::around(Place { latitude: 51.5, longitude: 0.1 });
    // The machine stands from 20 to 30 s, and the wheel rolls on.
    let true_m = |time_s: f64| SPEED / 1000.0 * (time_s.min(20.0) + (time_s - 30.0).max(0.0));
    let mut file = Vec::new();
    for number in 0..250_i64 {
        let place = plane.place(Metres { east: true_m(0.2 * number as f64), north: 0.0 });
        let fix = Some((place, Quality::Rtk));
        file.extend((framed(&gps::simulated::gga(BEGAN_MS + 200 * number, fix)) + "\r\n").into_bytes());
    }
    let job = Job::read(&recorded(&file, steady, 0.0..0.0), &Wanted::default());
    assert!((job.spun_m - 6.9).abs() < 0.7, "{}", job.spun_m);
    assert_eq!(job.events().filter(|event| event.kind == gps::job::EventKind::WheelSpun).count(), 1);
    let ratio = gps::wheel::Ratio::mean(&job.ratios).expect("it is straight before and after");
    assert!((ratio.value - 1.0).abs() < 0.01 && !ratio.is_wrong(), "{ratio:?}");
}

#[test]
fn positions_in_a_gap_of_the_statuses_are_interpolated() {
    let file = sent(|_, texts| texts.iter().flat_map(|text| (framed(text) + "\r\n").into_bytes()).collect());
    let job = Job::read(&recorded(&file, steady, 4.05..8.05), &Wanted::default());
    let gaps: Vec<_> = job.events().filter(|event| event.kind == gps::job::EventKind::WheelGap).collect();
    assert_eq!(gaps.len(), 1, "{gaps:?}");
    assert!(gaps[0].text.contains("no status for 4.1 s"), "{gaps:?}");
    for event in job.events() {
        let is_in_gap = (4.2..7.8).contains(&(event.distance_m / (SPEED / 1000.0)));
        let basis = event.found.map(|found| found.basis);
        assert!(!is_in_gap || basis == Ok(Basis::Interpolated), "{event:?}");
    }
    assert_eq!(job.counts.jumps, 0);
}

#[test]
fn the_place_of_a_restart_at_work_is_on_the_map() {
    let file = sent(|_, texts| texts.iter().flat_map(|text| (framed(text) + "\r\n").into_bytes()).collect());
    let whole = recorded(&file, steady, 0.0..0.0);
    let greeting = "weeder 0.2.0, reset by brown_out, state hold, tool out";
    let hold = "state=hold tool=out pos=0 speed_mm_s=0 windows=0 unseen_mm=450";
    let work = "state=work tool=in pos=9000 speed_mm_s=690 windows=0 unseen_mm=0";
    let reconnected = [(Kind::Lost, greeting), (Kind::Connected, "0.2.0"), (Kind::Setting, "ticks_per_m=2000")];
    for (lines, expected) in [
        (
            [&reconnected[..], &[(Kind::Status, hold)]].concat(),
            Some("restarted (brown_out) while at work: not weeded from here"),
        ),
        (
            [&[(Kind::Lost, "the cable")], &reconnected[1..], &[(Kind::Status, hold)]].concat(),
            Some("restarted while at work: not weeded from here"),
        ),
        // The machine has worked on, or that is unknown.
        ([&[(Kind::Lost, "the cable")], &reconnected[1..], &[(Kind::Status, work)]].concat(), None),
        (vec![(Kind::Lost, "the cable")], None),
    ] {
        let mut log: Vec<Entry> = whole.iter().filter(|entry| entry.time_ms < 8000).cloned().collect();
        log.extend(lines.iter().map(|(kind, line)| Entry {
            number: 9,
            time_ms: 8000,
            kind: *kind,
            text: (*line).to_owned(),
        }));
        let job = Job::read(&log, &Wanted::default());
        let restarts: Vec<_> = job.events().filter(|event| event.kind == gps::job::EventKind::Restart).collect();
        assert_eq!(restarts.first().map(|event| event.text.as_str()), expected, "{lines:?}");
        assert!(
            restarts.iter().all(|event| event.found.is_ok() && (event.distance_m - 5.45).abs() < 0.1),
            "{restarts:?}"
        );
    }
}
