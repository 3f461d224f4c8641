//! The real firmware weeds a row with a simulated receiver, and the log gives the positions again. All times are the
//! virtual Uno's.

use field::machine::Machine;
use field::motion::Motion;
use field::row::{Canopy, Kind as Grown, Row};
use gps::job::{self, Did, EventKind, Job};
use gps::simulated::{ReceiverSetup, SimulatedReceiver, Trouble};
use gps::summary::{Stand, Summary};
use gps::track::{Basis, Missing, Offset};
use gps::{Antenna, Recorder, Wanted};
use link::connection::Connection;
use link::moment::Moment;
use link::session::Happening;
use link::{Class, LinkError, Wire};
use logbook::log::{self, Entry, Kind, LogWriter};
use logbook::replay::replay;
use std::cell::Cell;
use std::io::{self, Read, Write};
use std::rc::Rc;
use std::time::Duration;
use uno::CYCLES_PER_SECOND;
use uno_run::{UnoPort, firmware};

/// From plant to plant, and how many there are.
const SPACING_MM: f64 = 500.0;
const PLANTS: usize = 48;

const MISSING: usize = 24;

/// When the machine sets off after the session has begun, in cycles.
const SETS_OFF: u64 = CYCLES_PER_SECOND;

/// A row of 24 m with one plant missing, and a weed after every tenth plant.
fn row() -> Row {
    let plants = (0..PLANTS).filter(|&plant| plant != MISSING);
    let plants = plants.map(|plant| Canopy::plant(600.0 + SPACING_MM * plant as f64, 148.0 + (plant % 5) as f64));
    let weeds = (5..PLANTS).step_by(10).map(|plant| Canopy::weed(600.0 + SPACING_MM * (plant as f64 + 0.5), 15.0));
    let mut canopies: Vec<Canopy> = plants.chain(weeds).collect();
    canopies.sort_by(|one, other| one.position_mm.total_cmp(&other.position_mm));
    Row::new(canopies).expect("plants and weeds are a row")
}

/// A port that also returns the Uno's time.
struct Clocked {
    port: UnoPort,
    cycle: Rc<Cell<u64>>,
}

impl Read for Clocked {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = self.port.read(buffer);
        self.cycle.set(self.port.uno().cycle());
        read
    }
}

impl Write for Clocked {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.port.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The log of a machine with a receiver that weeds the row. The receiver is unplugged during `unplugged_s`.
fn recorded(
    row: &Row,
    motion: &Motion,
    setup: &ReceiverSetup,
    antenna: &Antenna,
    unplugged_s: std::ops::Range<f64>,
) -> Vec<Entry> {
    let machine = Machine::default();
    let elf = firmware::build().expect("the firmware builds");
    let mut uno = uno_run::boot(&elf, &machine.beams_before(row, motion)).expect("the firmware wakes up");
    let sets_off = uno.cycle() + SETS_OFF;
    uno.drive(machine.pin_changes(row, motion, sets_off));
    let distance_m = |time_s: f64| {
        let since_s = (time_s - sets_off as f64 / CYCLES_PER_SECOND as f64).clamp(0.0, motion.duration_s());
        (motion.position_mm(since_s) - motion.start_mm()) / 1000.0
    };
    let cycle = Rc::new(Cell::new(uno.cycle()));
    let mut port = Some(Clocked { port: UnoPort::new(uno), cycle: Rc::clone(&cycle) });
    let open = move || match port.take() {
        Some(port) => Ok(Wire::over(port, false)),
        None => Err(LinkError::Absent("it is gone".to_owned())),
    };
    let mut connection = Connection::waiting_for(open);
    // The simulated servo has no load, and the tool swings in between any two plants.
    for line in ["set lead_out_ms 180", "start"] {
        assert!(connection.session.command(line, Moment::NEVER).is_some());
    }
    let folder = tempfile::tempdir().expect("there is room for a log");
    let path = folder.path().join("log.csv");
    let mut log = LogWriter::open(&path).expect("the log can be written");
    let mut simulated = SimulatedReceiver::new(setup.clone());
    let (mut recorder, lines) = Recorder::new(antenna);
    let time_s = || cycle.get() as f64 / CYCLES_PER_SECOND as f64;
    let began_s = time_s();
    let end_s = (sets_off as f64 / CYCLES_PER_SECOND as f64) + motion.duration_s() + 1.0;
    let mut is_plugged = true;
    log.lines_at(0, &lines).expect("the log can be written");
    log.lines_at(0, &recorder.found(0, "simulated")).expect("the log can be written");
    while time_s() < end_s {
        let happened = connection.turn(|| Moment::default().after(Duration::from_secs_f64(time_s() - began_s)));
        let since_s = time_s() - began_s;
        let time_ms = (since_s * 1000.0) as u64;
        for happening in happened {
            assert!(!matches!(happening, Happening::Lost(_)), "{happening:?}");
            log.write(time_ms, &happening).expect("the log can be written");
            recorder.happened(time_ms, &happening);
            // A label for the last object, once.
            if let Happening::Event(_, line) = &happening
                && line.starts_with("weed ")
                && since_s > 30.0
            {
                assert!(connection.session.command("label weed force", Moment::NEVER).is_some());
            }
        }
        let bytes = simulated.bytes_until(time_s(), distance_m);
        let lines = match (is_plugged, !unplugged_s.contains(&since_s)) {
            (true, false) => recorder.lost("unplugged"),
            (false, true) => recorder.found(time_ms, "simulated"),
            (true, true) => recorder.take(time_ms, &bytes),
            (false, false) => Vec::new(),
        };
        is_plugged = !unplugged_s.contains(&since_s);
        log.lines_at(time_ms, &lines).expect("the log can be written");
    }
    log::read(&path).expect("the log is one")
}

/// The machine's motion: at 0.7 m/s, from half a metre before the row.
fn motion() -> Motion {
    let end_mm = 600.0 + SPACING_MM * PLANTS as f64 + 900.0;
    Motion::steady(0.0, 500.0, 700.0, end_mm).change_speed(0.0, 500.0)
}

/// The position errors of the row's plants and weeds, in metres, and how each was found. Each canopy is in the log.
fn errors_m(job: &Job, row: &Row, setup: &ReceiverSetup) -> Vec<(f64, Basis)> {
    let truth = SimulatedReceiver::new(setup.clone());
    let objects: Vec<_> = job.events().filter(|event| matches!(event.kind, EventKind::Detection { .. })).collect();
    assert_eq!(objects.len(), row.canopies().len());
    let error = |(canopy, object): (&Canopy, &&job::Event)| {
        let place = truth.place(canopy.position_mm / 1000.0, Offset::default());
        // A plant behind a gap is unlike all examples, and is kept.
        let is_weed = matches!(object.kind, EventKind::Detection { class: Class::Weed, .. });
        assert_eq!(is_weed, canopy.kind == Grown::Weed, "{object:?}");
        let found = object.found.ok()?;
        Some((found.place.distance_m(place), found.basis))
    };
    row.canopies().iter().zip(&objects).filter_map(error).collect()
}

/// The most that the machine and its log add to the receiver's error, in metres. A status is logged some 10 ms late,
/// which is 7 mm of travel. The edges of a canopy are exact to a tick.
const MACHINE_M: f64 = 0.015;

#[test]
fn despite_faults_positions_lie_within_the_receivers_error() {
    let (row, motion) = (row(), motion());
    let beam = Offset { ahead_m: 0.6, right_m: -0.25 };
    let trouble = Trouble { every_s: 12.0, outage_s: 5.0..8.0, jump_s: 9.0..10.0, jump_m: 2.0, damaged: 0.02 };
    let setup = ReceiverSetup { beam, delay_ms: 120.0, trouble: Some(trouble), ..ReceiverSetup::default() };
    let antenna = Antenna { beam_ahead_mm: 600.0, beam_right_mm: -250.0, delay_ms: 120.0, ..Antenna::default() };
    let log = recorded(&row, &motion, &setup, &antenna, 0.0..0.0);
    let job = Job::read(&log, &Wanted::default());
    assert_eq!(job.antenna, antenna);

    let errors = errors_m(&job, &row, &setup);
    assert_eq!(errors.len(), row.canopies().len(), "all have places");
    let interpolated = errors.iter().filter(|(_, basis)| *basis == Basis::Interpolated).count();
    assert!((10..40).contains(&interpolated), "{interpolated}");
    // An error with normal distributions to the east and to the north exceeds four standard deviations once in 3000
    // times. The fix's error is one part, and the heading's error at 0.65 m from the antenna is the other. Between two
    // fixes the error is smaller.
    let sigma_m = (setup.error_mm / 1000.0).hypot(0.02 * 0.65);
    let farthest = errors.iter().map(|(error, _)| *error).fold(0.0, f64::max);
    assert!(farthest < 4.0 * sigma_m + MACHINE_M, "{farthest} {errors:?}");
    // Its mean is 1.25 standard deviations.
    let mean = errors.iter().map(|(error, _)| error).sum::<f64>() / errors.len() as f64;
    assert!(mean < 1.25 * sigma_m + MACHINE_M, "{mean}");

    // The faults are in the log, in their own lines, and no line of the machine is lost.
    let marks = |begin: &str| log.iter().filter(|it| it.kind == Kind::GpsMark && it.text.starts_with(begin)).count();
    assert!((3..=4).contains(&marks("no fix")), "{}", marks("no fix"));
    assert_eq!(marks("jumped") as u64, job.counts.jumps);
    assert!((10..=20).contains(&marks("jumped")), "{}", marks("jumped"));
    assert_eq!(marks("stays"), 0);
    let damaged = log.iter().filter(|entry| entry.kind == Kind::GpsDamaged).count() as u64;
    assert!(damaged > 2 && damaged == job.counts.damaged, "{damaged}");
    let replayed = replay(&log).expect("the log can be replayed");
    assert_eq!((replayed.difference, replayed.objects), (None, row.canopies().len()));

    // The time is the receiver's, and the label has the detection's position.
    let label = job.events().find(|event| event.kind == EventKind::Label(Class::Weed)).expect("it was labelled");
    let weed =
        job.events().find(|event| (event.distance_m - label.distance_m).abs() < 1e-9).expect("it is an object's");
    assert_eq!((weed.found, label.time_ms > weed.time_ms), (label.found, true));
    let utc_ms = job.utc_ms(&label.found.expect("it has a place")).expect("RMC has a date");
    assert!((30_000..60_000).contains(&(utc_ms - setup.began_ms)), "{utc_ms}");

    let summary = Summary::of(&job, &Stand { row_spacing_mm: 600.0, spacing_mm: None });
    assert_eq!((summary.plants, summary.unknown, summary.weeds, summary.missing), (47, 1, 5, 1), "{summary:?}");
    let spacing_mm = summary.spacing_mean_mm.expect("there are plants");
    assert!((spacing_mm - SPACING_MM).abs() < 2.0, "{spacing_mm}");
    assert!(summary.spacing_scatter_mm.is_some_and(|scatter| scatter < 5.0), "{summary:?}");
    assert!((24.0..26.0).contains(&summary.worked_m), "{summary:?}");
    assert!((summary.area_ha - summary.worked_m * 0.6 / 10_000.0).abs() < 1e-12, "{summary:?}");
}

#[test]
fn without_faults_the_weeded_ground_is_where_the_tool_was() {
    let (row, motion) = (row(), motion());
    let setup =
        ReceiverSetup { error_mm: 0.0, beam: Offset { ahead_m: 0.5, right_m: 0.1 }, ..ReceiverSetup::default() };
    let antenna = Antenna { beam_ahead_mm: 500.0, beam_right_mm: 100.0, ..Antenna::default() };
    let job = Job::read(&recorded(&row, &motion, &setup, &antenna, 0.0..0.0), &Wanted::default());
    let farthest = errors_m(&job, &row, &setup).iter().map(|(error, _)| *error).fold(0.0, f64::max);
    assert!(farthest < MACHINE_M, "{farthest}");
    let truth = SimulatedReceiver::new(setup);
    let weeded = job.stretches.iter().flat_map(|stretch| &stretch.ground).filter(|ground| ground.did == Did::Weeded);
    let mut lines = 0;
    for ground in weeded.filter(|ground| ground.distance_m.end > ground.distance_m.start) {
        let line = ground.lines.first().expect("it has places");
        for (at, place) in [(ground.distance_m.start, line.first()), (ground.distance_m.end, line.last())] {
            let tool = truth.place(at, Offset { ahead_m: -0.4, right_m: 0.0 });
            let off_m = place.expect("a line has places").distance_m(tool);
            assert!(off_m < MACHINE_M, "{off_m}");
        }
        lines += 1;
    }
    assert!(lines > 30, "{lines}");
}

#[test]
fn an_unplugged_receiver_costs_positions_and_no_machine_line() {
    let (row, motion) = (row(), motion());
    let setup = ReceiverSetup { rate_hz: 2.0, ..ReceiverSetup::default() };
    let antenna = Antenna { beam_ahead_mm: 500.0, ..Antenna::default() };
    let log = recorded(&row, &motion, &setup, &antenna, 10.0..20.0);
    let read = |longest_outage_m| Job::read(&log, &Wanted { longest_outage_m, ..Wanted::default() });
    let far = read(8.0);
    assert!(errors_m(&far, &row, &setup).iter().any(|(_, basis)| *basis == Basis::Interpolated));
    assert_eq!((far.unplugged, far.counts.losses), (1, 1));
    let near = read(5.0);
    let missing: Vec<_> = near.events().filter_map(|event| event.found.err()).collect();
    assert!(missing.len() > 15 && missing.iter().all(|why| *why == Missing::OutageTooLong), "{missing:?}");
    assert_eq!(near.events().count(), far.events().count());
    let replayed = replay(&log).expect("the log can be replayed");
    assert_eq!((replayed.difference, replayed.objects), (None, row.canopies().len()));
}
