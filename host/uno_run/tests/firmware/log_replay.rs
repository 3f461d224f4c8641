//! A log of the real firmware weeding a row, and the same decisions again on the host.

use field::machine::Machine;
use field::motion::Motion;
use field::planting::Planting;
use field::row::{Canopy, Row};
use link::connection::Connection;
use link::moment::Moment;
use link::session::Happening;
use link::{EventLine, LinkError, Status, Wire};
use logbook::log::{self, Entry, Kind, LogWriter};
use logbook::replay::{Replayed, replay};
use model_test::cases;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::io::{self, Read, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use uno::CYCLES_PER_SECOND;
use uno::Uno;
use uno_run::{UnoPort, firmware};

/// Plants and a tall weed.
fn row() -> Row {
    let canopies = vec![
        Canopy::plant(600.0, 150.0),
        Canopy::weed(900.0, 15.0),
        Canopy::plant(1200.0, 140.0),
        Canopy::plant(1700.0, 160.0),
        Canopy::plant(2300.0, 150.0),
    ];
    Row::new(canopies).expect("plants and a weed are a row")
}

/// The log of a session in which the machine rolls along the row and is started by these commands. The link, the
/// settings and the start take time.
fn logged(row: &Row, motion: &Motion, commands: &[&str]) -> Vec<Entry> {
    logged_from(row, motion, commands, 16_000_000)
}

/// As [`logged`], for a machine that sets off a fixed number of cycles after power-up, independent of the session.
fn logged_from(row: &Row, motion: &Motion, commands: &[&str], sets_off: u64) -> Vec<Entry> {
    let (port, end) = port_along(row, motion, sets_off);
    logged_at(port, None, commands, end)
}

/// The port of a machine that rolls along the row, and a position in ticks just before its end.
fn port_along(row: &Row, motion: &Motion, sets_off: u64) -> (HostPort, i64) {
    let machine = Machine::default();
    let mut uno = uno_run::boot(&firmware::build().expect("the firmware builds"), &machine.beams_before(row, motion))
        .expect("the firmware wakes up");
    let changes = machine.pin_changes(row, motion, uno.cycle() + sets_off);
    uno.drive(changes);
    (HostPort::new(uno), machine.ticks(motion, motion.duration_s()) - 10)
}

/// The log of a session over a port, until the machine has stood for a second behind a position in ticks. `typed` adds
/// random commands.
fn logged_at(port: HostPort, mut typed: Option<ChaCha8Rng>, commands: &[&str], end: i64) -> Vec<Entry> {
    let ms = Arc::clone(&port.ms);
    let mut port = Some(port);
    let open = move || match port.take() {
        Some(port) => Ok(Wire::over(port, false)),
        None => Err(LinkError::Absent("it is gone".to_owned())),
    };
    let mut connection = Connection::waiting_for(open);
    for command in commands {
        assert!(connection.session.command(command, Moment::NEVER).is_some(), "{command}");
    }
    let folder = tempfile::tempdir().expect("there is room for a log");
    let path = folder.path().join("log.csv");
    let mut log = LogWriter::open(&path).expect("the log can be written");
    let mut standing = 0;
    while standing < 10 {
        if let Some(typed) = &mut typed
            && typed.random_ratio(1, 100)
        {
            match typed.random_range(0..5) {
                place @ 0..3 => {
                    let line = ["start", "start now", "clear"][place];
                    assert!(connection.session.command(line, Moment::NEVER).is_some());
                }
                _ => _ = connection.session.hold(),
            }
        }
        let clock = || Moment::default().after(Duration::from_millis(ms.load(Ordering::Relaxed)));
        for happening in connection.turn(clock) {
            assert!(!matches!(happening, Happening::Lost(_)), "{happening:?}");
            if let Happening::Status(status, _) = &happening {
                let is_there = i64::from(status.position) > end;
                standing = if is_there { standing + 1 } else { 0 };
            }
            log.write(ms.load(Ordering::Relaxed), &happening).expect("the log can be written");
        }
    }
    log::read(&path).expect("the log is one")
}

/// A virtual Uno as a port, with the PC's delays. The PC may be busy at random: the machine rolls on before its output
/// is read, or before typed text is sent.
struct HostPort {
    port: UnoPort,
    /// Time by the Uno's clock.
    ms: Arc<AtomicU64>,
    busy: Option<ChaCha8Rng>,
}

impl HostPort {
    fn new(uno: Uno) -> Self {
        Self { port: UnoPort::new(uno), ms: Arc::default(), busy: None }
    }

    /// Delays the PC in one of `one_in` cases.
    fn pause(&mut self, one_in: u32) -> io::Result<()> {
        if let Some(busy) = &mut self.busy
            && busy.random_ratio(1, one_in)
        {
            let ms = busy.random_range(1..=400);
            self.port.uno().run_for_ms(ms).map_err(io::Error::other)?;
        }
        Ok(())
    }

    fn sample_clock(&mut self) {
        self.ms.store(self.port.uno().cycle() * 1000 / CYCLES_PER_SECOND, Ordering::Relaxed);
    }
}

impl Read for HostPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.pause(20)?;
        let read = self.port.read(buffer);
        self.sample_clock();
        read
    }
}

impl Write for HostPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.sample_clock();
        self.pause(10)?;
        self.port.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[track_caller]
fn assert_same(log: &[Entry], swings: usize) -> Replayed {
    let replayed = replay(log).expect("the log can be replayed");
    assert_eq!(replayed.difference, None, "{replayed:#?}");
    assert_eq!((replayed.objects, replayed.notes.len()), (5, 0), "{replayed:#?}");
    assert!(replayed.swings >= swings, "{replayed:#?}");
    replayed
}

#[test]
fn a_row_at_a_steady_speed_is_decided_the_same_on_the_host() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    let log = logged(&row(), &motion, &["start"]);
    let replayed = assert_same(&log, 9);
    assert!(replayed.farthest_swing <= 12, "{replayed:?}");

    // A changed line is found, at its number.
    let mut tampered = log.clone();
    let place = tampered.iter().rposition(|entry| entry.text.starts_with("swing tool=out")).expect("a swing");
    tampered[place].text = "swing tool=out pos=1".to_owned();
    let difference = replay(&tampered).expect("it can be replayed").difference.expect("they differ");
    assert_eq!(difference.line, Some(log[place].number), "{difference}");
    assert!(
        difference.to_string().contains("the log has `swing tool=out pos=1`, the replay `swing tool="),
        "{difference}"
    );

    // The log lacks a zone, and the machine kept it at every pace.
    let mut tampered = log.clone();
    for swing in ["swing tool=in", "swing tool=out"] {
        let last = tampered.iter().rposition(|entry| entry.text.starts_with(swing)).expect("a swing");
        tampered.remove(last);
    }
    assert!(replay(&tampered).expect("it can be replayed").difference.is_some());

    // With another lead the tool would have swung out elsewhere.
    let mut tampered = log.clone();
    let lead = tampered.iter_mut().find(|entry| entry.text.starts_with("lead_out_ms=")).expect("a lead");
    lead.text = "lead_out_ms=80".to_owned();
    assert!(replay(&tampered).expect("it can be replayed").difference.is_some());

    // A weed that the log calls a plant.
    let mut tampered = log;
    let weed = tampered.iter_mut().find(|entry| entry.text.starts_with("weed pos=")).expect("a weed");
    weed.text = weed.text.replace("weed", "plant");
    let difference = replay(&tampered).expect("it can be replayed").difference.expect("they differ");
    assert!(difference.to_string().contains("the replay `weed pos="), "{difference}");
}

/// The session begins at each position of a metre with a weed and a plant.
#[test]
fn a_log_that_begins_anywhere_in_the_row_is_decided_the_same_on_the_host() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    let log = logged(&row(), &motion, &["start"]);
    let (settings, lines) = log.split_at(log.iter().position(|entry| entry.kind == Kind::Status).expect("a status"));
    for first in 1650..3550 {
        let is_behind = |entry: &&Entry| match (entry.kind, EventLine::parse(&entry.text)) {
            (Kind::Status, _) => Status::parse(&entry.text).expect("a status").position > first,
            // It is reported when the canopy has passed the beam.
            (_, Some(EventLine::Detection { position, hold, .. })) => position + hold > first,
            (_, Some(EventLine::Swing { position, .. })) => position > first,
            _ => false,
        };
        let behind: Vec<Entry> = lines.iter().filter(is_behind).cloned().collect();
        let text = format!("state=work tool=out pos={first} speed_mm_s=500 windows=1 unseen_mm=0");
        let status = Entry { kind: Kind::Status, text, ..behind[0].clone() };
        let replayed = replay(&[settings, &[status], &behind].concat()).expect("the log can be replayed");
        assert_eq!(replayed.difference, None, "from {first}: {replayed:#?}");
        assert!(replayed.objects >= 1 && replayed.swings >= 1, "from {first}: {replayed:#?}");
    }
}

/// The session ends behind each line: one in which the operator types at random, as the cable is pulled at any moment.
#[test]
fn a_log_that_ends_anywhere_is_decided_the_same_on_the_host() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    for typed in [None, Some(ChaCha8Rng::seed_from_u64(1)), Some(ChaCha8Rng::seed_from_u64(2))] {
        let (port, end) = port_along(&row(), &motion, 16_000_000);
        let log = logged_at(port, typed, &["start"], end);
        let first = log.iter().position(|entry| entry.kind == Kind::Status).expect("a status");
        (first + 1..log.len()).into_par_iter().for_each(|end| {
            let replayed = replay(&log[..end]).expect("the log can be replayed");
            assert_eq!(replayed.difference, None, "to line {}: {replayed:#?}", log[end - 1].number);
        });
    }
}

#[test]
fn a_row_with_changes_of_speed_and_a_stop_is_decided_the_same_on_the_host() {
    let motion = Motion::steady(0.0, 500.0, 300.0, 900.0)
        .change_speed(650.0, 400.0)
        .roll_to(1800.0)
        .change_speed(0.0, 600.0)
        .change_speed(400.0, 500.0)
        .roll_to(3200.0)
        .change_speed(0.0, 500.0);
    assert_same(&logged(&row(), &motion, &["start"]), 9);
}

/// Random rows. Half of their speeds are at the limit between two speed classes. The session begins before the machine
/// sets off, while it accelerates, or while it rolls past plants. The operator types at random times, and every other
/// PC is busy now and then.
#[test]
fn random_rows_are_replayed_with_the_same_decisions_on_the_host() {
    let rows = cases(20);
    let replayed: Vec<Replayed> = (0..rows)
        .into_par_iter()
        .map(|seed| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let planting = Planting {
                plants: 6,
                spacing_mm: rng.random_range(300.0..600.0),
                canopy_mm: rng.random_range(80.0..160.0),
                weeds: rng.random_range(0..4),
                ragged: rng.random(),
                ..Planting::default()
            };
            let row = planting.grow_with_room(seed).expect("there is room");
            let edge = [347.5, 486.5, 625.5][rng.random_range(0..3)] + rng.random_range(-6.0..6.0);
            let speed_mm_s = if rng.random() { edge } else { rng.random_range(250.0..900.0) };
            let start_mm = rng.random_range(-250.0..100.0);
            let end_mm = row.span_mm().end + 900.0;
            let motion = Motion::steady(start_mm, 800.0, speed_mm_s, end_mm).change_speed(0.0, 1500.0);
            let commands: &[&str] = [&["start"][..], &["start now"], &["clear", "start now"]][rng.random_range(0..3)];

            let (mut port, end) = port_along(&row, &motion, rng.random_range(0..24_000_000));
            port.busy = (seed % 2 == 0).then(|| ChaCha8Rng::from_rng(&mut rng));
            let typed = (seed % 4 < 3).then(|| ChaCha8Rng::from_rng(&mut rng));
            let log = logged_at(port, typed, commands, end);
            let replayed = replay(&log).expect("the log can be replayed");
            assert_eq!(replayed.difference, None, "seed {seed}, {commands:?}: {replayed:#?}\n{log:#?}");
            // The same, as if the session had ended earlier.
            let first = log.iter().position(|entry| entry.kind == Kind::Status).expect("a status");
            for _ in 0..20 {
                let log = &log[..rng.random_range(first + 1..log.len())];
                let difference = replay(log).expect("the log can be replayed").difference;
                assert_eq!(difference, None, "seed {seed}, {commands:?}, cut: {log:#?}");
            }
            replayed
        })
        .collect();
    let objects: u64 = replayed.iter().map(|replayed| replayed.objects as u64).sum();
    let swings: u64 = replayed.iter().map(|replayed| replayed.swings as u64).sum();
    assert!(objects > 4 * rows && swings > 4 * rows, "{objects}, {swings}");
}

#[test]
fn a_status_between_a_change_of_state_and_its_swing_changes_nothing() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    let (port, end) = port_along(&row(), &motion, 0);
    let log = logged_at(port, Some(ChaCha8Rng::seed_from_u64(1)), &["start now"], end);
    let begins = |place: usize, text: &str| log.get(place).is_some_and(|entry| entry.text.starts_with(text));
    let changes = (0..log.len()).filter(|&place| begins(place, "state is=") && begins(place + 1, "swing "));
    let mut tried = 0;
    for swing in changes.map(|change| change + 1) {
        let mut late = log.clone();
        let is_status = |entry: &Entry| entry.kind == Kind::Status;
        let status = swing + late[swing..].iter().position(is_status).expect("the machine was asked on");
        late[swing..=status].rotate_right(1);
        let replayed = replay(&late).expect("the log can be replayed");
        assert_eq!(replayed.difference, None, "line {}: {replayed:#?}", log[swing].number);
        tried += 1;
    }
    assert!(tried > 0, "{log:#?}");
}

#[test]
fn start_now_over_unseen_ground_is_known_from_start() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    assert_same(&logged(&row(), &motion, &["start now"]), 9);
}

#[test]
fn the_replay_raises_a_beam_alarm_and_cuts_the_detection() {
    let canopies = vec![Canopy::plant(600.0, 150.0), Canopy::plant(1500.0, 700.0), Canopy::plant(2300.0, 150.0)];
    let row = Row::new(canopies).expect("plants are a row");
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    let log = logged(&row, &motion, &["start"]);
    assert!(log.iter().any(|entry| entry.text.starts_with("alarm code=1-1 name=beam_blocked")), "{log:#?}");
    let replayed = replay(&log).expect("the log can be replayed");
    assert_eq!(replayed.difference, None, "{replayed:#?}");
    assert_eq!((replayed.objects, replayed.alarms), (3, 1), "{replayed:#?}");
}

#[test]
fn an_alarm_that_the_log_cannot_explain_is_given() {
    let motion = Motion::steady(0.0, 500.0, 500.0, 3200.0).change_speed(0.0, 500.0);
    let mut log = logged(&row(), &motion, &["start"]);
    // The weed and the gap behind it have passed.
    let weed = log.iter().position(|entry| entry.text.starts_with("weed pos=")).expect("a weed");
    let later = log.iter().enumerate().skip(weed).filter(|(_, entry)| entry.kind == Kind::Status).nth(2);
    let (place, status) = later.map(|(place, entry)| (place, Status::parse(&entry.text))).expect("it rolls on");
    let position = status.expect("a status").position;
    let alarm = |text: String| Entry { text, kind: Kind::Event, ..log[place].clone() };
    let alarms =
        [alarm(format!("alarm name=encoder_jumps code=23 pos={position}")), alarm("state is=alarm".to_owned())];
    log.splice(place + 1..place + 1, alarms);
    // From there on the log has a swing in, and the replay keeps the tool out.
    let difference = replay(&log).expect("the log can be replayed").difference.expect("they differ");
    assert!(difference.to_string().contains("the replay none"), "{difference}");
}

#[test]
fn a_log_without_a_machine_or_with_a_line_that_cannot_be_is_refused() {
    let entry = |kind, text: &str| Entry { number: 7, time_ms: 0, kind, text: text.to_owned() };
    assert!(replay(&[]).unwrap_err().to_string().starts_with("the log has no machine in it"));
    for (kind, text, wrong) in [
        (Kind::Setting, "k=99", "line 7 of the log: `k=99` is out of the range of this version"),
        (Kind::Example, "field 3 plant 1 2 3", "is no example"),
        (Kind::Status, "state=asleep", "is no status"),
    ] {
        let error = replay(&[entry(Kind::Connected, "0.2.0"), entry(kind, text)]).unwrap_err().to_string();
        assert!(error.contains(wrong), "{error}");
    }
    let far = "state=work tool=in pos=2000000000 speed_mm_s=1 windows=0 unseen_mm=0";
    let near = "state=work tool=in pos=0 speed_mm_s=1 windows=0 unseen_mm=0";
    let log = [entry(Kind::Connected, "0.2.0"), entry(Kind::Status, near), entry(Kind::Status, far)];
    assert!(replay(&log).unwrap_err().to_string().contains("the machine cannot have rolled so far"));
}

#[test]
fn numbers_that_no_machine_gives_are_replayed_or_refused() {
    let entry = |kind, text: &str| Entry { number: 7, time_ms: u64::MAX, kind, text: text.to_owned() };
    for [one, other] in [[i32::MIN, i32::MAX], [i32::MAX, i32::MIN], [0, i32::MIN]] {
        let status =
            |number: i32| format!("state=work tool=in pos={number} speed_mm_s={number} windows=1 unseen_mm={number}");
        let plant = format!("plant pos={one} votes=3 spacing={one} delay={one} hold={other} actuation={one}");
        let (swing, alarm) =
            (format!("swing tool=out pos={other}"), format!("alarm name=beam_blocked code=11 pos={one}"));
        let log = [
            entry(Kind::Connected, "0.2.0"),
            entry(Kind::Status, &status(one)),
            entry(Kind::Event, &plant),
            entry(Kind::Event, &swing),
            entry(Kind::Event, &alarm),
            entry(Kind::Event, "state is=work"),
            entry(Kind::Status, &status(one)),
        ];
        assert!(replay(&log).expect("it stands still").difference.is_some(), "{one} {other}");
        let jump = [&log[..2], &[entry(Kind::Status, &status(other))]].concat();
        // From the greatest position to the least is one step.
        assert_eq!(replay(&jump).is_err(), one == 0, "{one} {other}");
    }
}
