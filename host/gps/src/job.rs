//! Reads a log as a job: the machine's detections and actions, each with its distance, position and time.
//!
//! [`Job::read`] follows the log's lines ([`Follower`]) and divides them into stretches. A new stretch begins when the
//! Uno restarts, when the wheel's settings change or are unknown, and when the log is opened again. Distances are
//! comparable only within a stretch. Each fix gets the distance at which it was taken, from the statuses around it. Over
//! a gap of the statuses that distance is unknown, and the fix is not used. Each event gets its position from [`Track`].
//!
//! - A plant or weed is the middle of its detection, at the beam's position. So is guarded ground.
//! - A swing or an alarm has the tool's position at the time of its event. A swing is the command: the tool follows
//!   after the lead.
//! - Ground is weeded if the machine is at work and the tool is commanded into the row. It is not weeded if the tool is
//!   commanded out. Ground counts once: passing it again after rolling back adds nothing. But a machine that rolls back
//!   more than 2 m in hold is in another row. Over a gap of the statuses the work is unknown, and no ground counts.
//! - A restart at work is where the machine was at its last status. The ground behind it is not weeded.
//! - A label is the class that the operator gave the last detection, if the machine accepted it.

mod reading;

use self::reading::{Reading, Rolled};
use crate::antenna::Antenna;
use crate::plane::Place;
use crate::receiver::{Counts, Fix, Jump, Mark, Receiver};
use crate::track::{Basis, Found, Missing, Track};
use crate::wheel::{self, Ratio};
use link::Class;
use link::settings::Setting;
use logbook::follower::{Followed, Follower};
use logbook::log::{Entry, Kind};
use std::ops::Range;
use strum::IntoStaticStr;

/// The parameters of reading a log.
#[derive(Clone, Copy)]
pub struct Wanted<'a> {
    /// Replaces a session's offsets of beam and tool.
    pub antenna: &'a dyn Fn(Antenna) -> Antenna,
    /// The longest distance between two fixes for interpolation, in metres.
    pub longest_outage_m: f64,
}

impl Default for Wanted<'_> {
    fn default() -> Self {
        Self { antenna: &|antenna| antenna, longest_outage_m: 20.0 }
    }
}

/// The kinds of event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, IntoStaticStr)]
#[strum(serialize_all = "snake_case")]
pub enum EventKind {
    /// A detection that the beam has seen.
    Detection {
        /// Its class.
        class: Class,
        /// Votes for that.
        votes: u8,
    },
    /// Guarded ground, because a plant was expected.
    Guarded,
    /// The label of the last detection.
    Label(Class),
    /// The tool was commanded out of the row.
    SwingOut,
    /// The tool was commanded into the row.
    SwingIn,
    /// A fault was latched.
    Alarm,
    /// The machine restarted at work.
    Restart,
    /// The wheel rolled on while the antenna stayed.
    WheelSpun,
    /// The wheel rolled while the log has no status.
    WheelGap,
}

impl EventKind {
    /// Its word on the map.
    pub fn name(self) -> &'static str {
        match self {
            Self::Detection { class: Class::Plant, .. } => "plant",
            Self::Detection { class: Class::Weed, .. } => "weed",
            Self::Detection { class: Class::Unknown, .. } => "unknown",
            Self::Label(Class::Plant) => "label_plant",
            Self::Label(_) => "label_weed",
            other => other.into(),
        }
    }
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq)]
pub struct Event {
    /// Its kind.
    pub kind: EventKind,
    /// The log's line.
    pub line: u64,
    /// As it stands there, or what is wrong.
    pub text: String,
    /// Its time, by the log's clock.
    pub time_ms: u64,
    /// Distance by the wheel since the stretch began, in metres.
    pub distance_m: f64,
    /// Its width along the row in mm; 0 if it has none.
    pub width_mm: f64,
    /// Where it is.
    pub found: Result<Found, Missing>,
}

impl Event {
    fn mark(kind: EventKind, text: String, line: u64, time_ms: f64, distance_m: f64) -> Self {
        let (time_ms, found) = (time_ms as u64, Err(Missing::NoFixBefore));
        Self { kind, line, text, time_ms, distance_m, width_mm: 0.0, found }
    }
}

/// The machine's work on some ground.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Did {
    /// At work, with the tool commanded into the row.
    Weeded,
    /// At work, with the tool commanded out.
    Spared,
    /// Not at work.
    Rolled,
}

/// Ground that was passed.
#[derive(Clone, Debug, PartialEq)]
pub struct PassedGround {
    /// The work.
    pub did: Did,
    /// Distances by the wheel since the stretch began, in metres.
    pub distance_m: Range<f64>,
    /// When, by the record's clock.
    pub time_ms: Range<u64>,
    /// The tool's path, a line for each part that has positions. Empty if the machine was not at work.
    pub lines: Vec<Vec<Place>>,
}

impl PassedGround {
    /// Ground that begins here.
    fn begin(did: Did, at_m: f64, time_ms: u64) -> Self {
        Self { did, distance_m: at_m..at_m, time_ms: time_ms..time_ms, lines: Vec::new() }
    }
}

/// A part of a log with continuous wheel distance.
#[derive(Clone, Debug, Default)]
pub struct Stretch {
    /// The events, in the log's order.
    pub events: Vec<Event>,
    /// The ground that was passed.
    pub ground: Vec<PassedGround>,
    /// Its beginning and end, by the log's clock.
    pub time_ms: Range<u64>,
}

/// A record read.
#[derive(Clone, Debug, Default)]
pub struct Job {
    /// Its parts.
    pub stretches: Vec<Stretch>,
    /// The counts of the receiver.
    pub counts: Counts,
    /// Fixes that have jumped, each with the log's line.
    pub jumps: Vec<(u64, Jump)>,
    /// How often the receiver was lost, by the record.
    pub unplugged: u64,
    /// For each session, the midnight from which [`Found::utc_ms`] counts.
    midnights_ms: Vec<Option<i64>>,
    /// The offsets of beam and tool that were used in the last session.
    pub antenna: Antenna,
    /// The wheel's distance against the receiver's, for each straight stretch.
    pub ratios: Vec<Ratio>,
    /// Metres that the wheel spun.
    pub spun_m: f64,
    /// Statuses that count for nothing, because no wheel is known: the log lacks the settings, or this version does not allow one.
    pub without_wheel: u64,
    /// Lines of the machine that were left out: damaged, of another firmware, or with a position far from those around it.
    pub left_out: u64,
}

impl Job {
    /// Reads a record.
    pub fn read(log: &[Entry], wanted: &Wanted<'_>) -> Self {
        let antenna = (wanted.antenna)(Antenna::default());
        let mut job = Self { antenna, ..Self::default() };
        let mut receiver = Receiver::new(antenna.error_m());
        let (mut follower, mut reading) = (Follower::default(), Reading::default());
        for (at, entry) in log.iter().enumerate() {
            let tick_mm = follower.tick_mm();
            let followed = follower.take(entry);
            let is_cut = matches!(followed, Followed::Linked | Followed::Status(_, false));
            let antenna = if entry.kind == Kind::Antenna { Antenna::parse(&entry.text) } else { None };
            // An earlier time, or an antenna's line: the log was closed, and opened again.
            let is_opened =
                antenna.is_some() || reading.time_ms.as_ref().is_some_and(|range| entry.time_ms < range.end);
            if is_cut || is_opened {
                if matches!(followed, Followed::Linked) {
                    reading.restart(entry, &log[at..]);
                }
                job.end(&mut receiver, &mut reading, entry, wanted);
            }
            if is_opened {
                receiver.log_opened();
            }
            if let Some(antenna) = antenna {
                job.antenna = (wanted.antenna)(antenna);
                receiver.error_m = job.antenna.error_m();
            }
            match followed {
                Followed::Status(status, _) => {
                    if let Some(mm) = follower.mm(status.position) {
                        let m = mm / 1000.0;
                        receiver.rolled(entry.time_ms as f64, m, f64::from(status.speed_mm_s));
                        reading.beam_to_tool_mm = follower.in_use().settings().get(Setting::BeamToToolMm).into();
                        reading.status(status, m, entry);
                    } else {
                        job.without_wheel += 1;
                    }
                }
                unread if unread.is_unread() => job.left_out += 1,
                Followed::Event(event) => job.left_out += u64::from(!reading.event(entry, &event, &follower)),
                Followed::Answered(command, true) => reading.label(&command),
                _ => job.left_out += u64::from(entry.kind == Kind::Antenna && antenna.is_none()),
            }
            match entry.kind {
                Kind::Gps | Kind::GpsDamaged => receiver.take(entry.time_ms as f64, &entry.text),
                Kind::GpsLost => {
                    job.unplugged += 1;
                    receiver.silent();
                }
                _ => {}
            }
            job.hear(&mut receiver, &mut reading, entry);
            if follower.tick_mm() != tick_mm && !reading.wheel.is_empty() {
                // The machine's position stays.
                let last_status = reading.last_status.take();
                job.end(&mut receiver, &mut reading, entry, wanted);
                if let Some((status, mm)) =
                    last_status.and_then(|status| follower.mm(status.position).map(|mm| (status, mm)))
                {
                    reading.status(status, mm / 1000.0, entry);
                }
            }
            reading.seen(entry.time_ms);
        }
        if let Some(last) = log.last() {
            job.end(&mut receiver, &mut reading, last, wanted);
        }
        job.counts = receiver.counts;
        job.midnights_ms = receiver.midnights_ms();
        job
    }

    fn hear(&mut self, receiver: &mut Receiver, reading: &mut Reading, entry: &Entry) {
        for fix in receiver.fixes.drain(..) {
            reading.fixes.push(Fix { time_ms: fix.time_ms - self.antenna.delay_ms, ..fix });
        }
        for mark in receiver.marks.drain(..) {
            if let Mark::Jumped(jump) = mark {
                self.jumps.push((entry.number, jump));
            }
        }
    }

    /// Ends a stretch: gives its events their positions, and begins another one.
    fn end(&mut self, receiver: &mut Receiver, reading: &mut Reading, entry: &Entry, wanted: &Wanted<'_>) {
        receiver.end();
        self.hear(receiver, reading, entry);
        receiver.wheel_lost();
        let read = std::mem::take(reading);
        if read.wheel.is_empty() {
            return;
        }
        let mut fixes: Vec<(f64, Fix)> =
            read.fixes.iter().filter_map(|fix| Some((read.m_at(fix.time_ms)?, *fix))).collect();
        // When a shorter delay is found, a later fix may get an earlier time.
        fixes.sort_by(|(_, one), (_, other)| one.time_ms.total_cmp(&other.time_ms));
        let track = Track::through(&fixes, wanted.longest_outage_m);
        let marks: Vec<Event> = read.gaps().chain(self.compare(&track, &read.wheel)).collect();
        let (beam, tool) = (self.antenna.beam(), self.antenna.tool(read.beam_to_tool_mm));
        let (mut events, mut ground) = (read.events, read.ground);
        events.extend(marks);
        for event in &mut events {
            let offset = match event.kind {
                EventKind::Detection { .. } | EventKind::Guarded | EventKind::Label(_) => beam,
                _ => tool,
            };
            event.found = track.find(event.distance_m, event.time_ms as f64, offset);
            if let (EventKind::Restart, Err(Missing::NoFixBehind)) = (event.kind, event.found) {
                // The track ends at the last fix, a little before the machine's last position.
                let last_m = track.stations.last().map_or(0.0, |station| station.distance_m);
                let error_m = event.distance_m - last_m;
                let at_end = track.find(last_m, event.time_ms as f64, offset);
                let beyond = |end: Found| Found { error_m: end.error_m + error_m, basis: Basis::Interpolated, ..end };
                event.found = at_end.map(beyond);
            }
        }
        for ground in ground.iter_mut().filter(|ground| ground.did != Did::Rolled) {
            let until_ms = ground.time_ms.end as f64;
            ground.lines = lines(&ground.distance_m, |distance_m| track.find(distance_m, until_ms, tool));
        }
        self.stretches.push(Stretch { events, ground, time_ms: read.time_ms.unwrap_or_default() });
    }

    /// Compares the wheel with the receiver. Returns where the wheel spun.
    fn compare(&mut self, track: &Track, wheel: &[Rolled]) -> Vec<Event> {
        let stations = &track.stations;
        let spins = wheel::spins(stations);
        self.ratios.extend(wheel::ratios(stations, &spins));
        let event = |spin: &Range<usize>| {
            let (from, to) = (&stations[spin.start], &stations[spin.end]);
            let rolled_m = (to.distance_m - from.distance_m).abs();
            self.spun_m += rolled_m;
            let at = wheel.partition_point(|rolled| rolled.time_ms < to.fix.time_ms).min(wheel.len() - 1);
            let text = format!("the wheel rolled {rolled_m:.1} m on the spot");
            let at_m = from.distance_m.midpoint(to.distance_m);
            Event::mark(EventKind::WheelSpun, text, wheel[at].line, to.fix.time_ms, at_m)
        };
        spins.iter().map(event).collect()
    }

    /// The time of a position, in milliseconds since 1970. `None` if the receiver sent no date in that session.
    pub fn utc_ms(&self, found: &Found) -> Option<i64> {
        Some((*self.midnights_ms.get(found.session)?)? + found.utc_ms)
    }

    /// Everything that happened.
    pub fn events(&self) -> impl Iterator<Item = &Event> {
        self.stretches.iter().flat_map(|stretch| &stretch.events)
    }
}

/// Distance between two positions of a line, in metres.
const LINE_STEP_M: f64 = 0.5;

/// The lines along this distance, where positions are known.
fn lines(distance_m: &Range<f64>, find: impl Fn(f64) -> Result<Found, Missing>) -> Vec<Vec<Place>> {
    let length_m = distance_m.end - distance_m.start;
    let steps = (length_m / LINE_STEP_M).ceil().max(1.0);
    let distances_m = (0..=steps as u64).map(|step| distance_m.start + step as f64 / steps * length_m);
    let places: Vec<Option<Place>> = distances_m.map(|at_m| find(at_m).ok().map(|found| found.place)).collect();
    // A single position is no line.
    let lines = places.split(Option::is_none).filter(|line| line.len() > 1);
    lines.map(|line| line.iter().flatten().copied().collect()).collect()
}
