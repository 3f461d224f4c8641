//! Reads a log as a job: the machine's detections and actions, each with its distance, position and time.
//!
//! [`Job::read`] reads the log's lines in order and divides them into stretches. A new stretch begins when the Uno
//! restarts, when the wheel's settings change, and when the log is opened again. Distances are comparable only within a
//! stretch. Each fix gets the distance at which it was taken, from the statuses around it. Each event gets its position
//! from [`Track`].
//!
//! - A plant or weed is the middle of its detection, at the beam's position. So is guarded ground.
//! - A swing or an alarm has the tool's position at the time of its event. A swing is the command: the tool follows
//!   after the lead.
//! - Ground is weeded if the machine is at work and the tool is commanded into the row. It is not weeded if the tool is
//!   commanded out. Ground counts once: passing it again after rolling back adds nothing.
//! - A label is the class that the operator gave the last detection, if the machine accepted it.

use crate::antenna::Antenna;
use crate::plane::Place;
use crate::receiver::{Counts, Fix, Heard, Jump, Mark, Receiver};
use crate::track::{Found, Missing, Offset, Track};
use link::log::{Entry, Kind};
use link::settings::{Setting, Settings, shown};
use link::{Class, ConsoleLine, EventLine, Mode, Status};
use std::collections::VecDeque;
use std::f64::consts::PI;
use std::ops::Range;

/// Time before and after a stretch in which the machine is assumed to have stood, in ms. A fix in this time belongs to
/// the stretch's beginning or end.
const STANDING_MS: f64 = 1000.0;

/// The longest distance between two statuses in ticks, some hundred metres.
pub(crate) const LONGEST_DISTANCE: u32 = 1_000_000;

/// The parameters of reading a log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wanted {
    /// The offsets of beam and tool, instead of the log's.
    pub antenna: Option<Antenna>,
    /// The longest distance between two fixes for interpolation, in metres.
    pub longest_outage_m: f64,
}

impl Default for Wanted {
    fn default() -> Self {
        Self { antenna: None, longest_outage_m: 20.0 }
    }
}

/// The kinds of event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
}

impl EventKind {
    /// Its word on the map.
    pub fn name(self) -> &'static str {
        match self {
            Self::Detection { class: Class::Plant, .. } => "plant",
            Self::Detection { class: Class::Weed, .. } => "weed",
            Self::Detection { class: Class::Unknown, .. } => "unknown",
            Self::Guarded => "guarded",
            Self::Label(Class::Plant) => "label_plant",
            Self::Label(_) => "label_weed",
            Self::SwingOut => "swing_out",
            Self::SwingIn => "swing_in",
            Self::Alarm => "alarm",
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
    /// As it stands there.
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
pub struct Ground {
    /// The work.
    pub did: Did,
    /// Distances by the wheel since the stretch began, in metres.
    pub distance_m: Range<f64>,
    /// When, by the record's clock.
    pub time_ms: Range<u64>,
    /// The tool's path, a line for each part that has positions. Empty if the machine was not at work.
    pub lines: Vec<Vec<Place>>,
}

impl Ground {
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
    pub ground: Vec<Ground>,
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
    /// The midnight from which [`Found::utc_ms`] counts, in milliseconds since 1970. `None` if the receiver sent no
    /// date.
    pub midnight_ms: Option<i64>,
    /// The offsets of beam and tool that were used.
    pub antenna: Antenna,
}

/// A stretch while it is read.
#[derive(Default)]
struct Reading {
    settings: Option<Settings>,
    /// The wheel's positions: milliseconds of the log, and ticks since the stretch began.
    wheel: Vec<(f64, i64)>,
    last_position: Option<i32>,
    last_status: Option<Status>,
    fixes: Vec<Fix>,
    events: Vec<Event>,
    ground: Vec<Ground>,
    /// Commands without an answer so far: the line, its time, and the text.
    unanswered: VecDeque<(u64, u64, String)>,
    time_ms: Option<Range<u64>>,
}

impl Job {
    /// Reads a record.
    pub fn read(log: &[Entry], wanted: &Wanted) -> Self {
        let antenna = wanted.antenna.or_else(|| antenna_of(log)).unwrap_or_default();
        let mut job = Self { antenna, ..Self::default() };
        let mut receiver = Receiver::new(antenna.error_m());
        let mut reading = Reading::default();
        let mut last_ms = 0;
        for entry in log {
            if entry.time_ms < last_ms {
                // The log was closed, and opened again.
                job.heard(receiver.end(), &mut reading, entry);
                receiver.wheel_lost();
                job.close(&mut reading, wanted, None);
            }
            last_ms = entry.time_ms;
            match entry.kind {
                Kind::Connected | Kind::Lost => {
                    job.heard(receiver.end(), &mut reading, entry);
                    receiver.wheel_lost();
                    job.close(&mut reading, wanted, None);
                    if entry.kind == Kind::Connected {
                        reading.settings = Some(Settings::new());
                    }
                }
                Kind::Gps | Kind::GpsDamaged => {
                    let heard = receiver.take(entry.time_ms as f64, &entry.text);
                    job.heard(heard, &mut reading, entry);
                }
                Kind::GpsLost => {
                    job.unplugged += 1;
                    job.heard(receiver.silent(), &mut reading, entry);
                }
                Kind::Setting => reading.set(&entry.text, false),
                Kind::Status => {
                    if let Some(status) = Status::parse(&entry.text) {
                        if reading.is_far(&status) {
                            receiver.wheel_lost();
                            let settings = reading.settings.clone();
                            job.close(&mut reading, wanted, settings);
                        }
                        reading.status(status, entry.time_ms);
                        if let (Some(&(_, ticks)), Some(status)) = (reading.wheel.last(), &reading.last_status) {
                            let rolled_m = reading.metres(ticks);
                            receiver.rolled(entry.time_ms as f64, rolled_m, f64::from(status.speed_mm_s));
                        }
                    }
                }
                Kind::Event => reading.event(entry),
                Kind::Command => {
                    reading.unanswered.push_back((entry.number, entry.time_ms, entry.text.clone()));
                }
                Kind::Answer => {
                    if let Some(settings) = reading.answer(&entry.text) {
                        job.heard(receiver.end(), &mut reading, entry);
                        receiver.wheel_lost();
                        // Unanswered commands stay, and so does the machine's position.
                        let unanswered = std::mem::take(&mut reading.unanswered);
                        let last_status = reading.last_status.take();
                        job.close(&mut reading, wanted, Some(settings));
                        reading.unanswered = unanswered;
                        if let Some(status) = last_status {
                            reading.status(status, entry.time_ms);
                        }
                    }
                }
                Kind::Started | Kind::Example | Kind::Antenna | Kind::GpsFound | Kind::GpsMark => {}
            }
            reading.seen(entry.time_ms);
        }
        if let Some(last) = log.last() {
            job.heard(receiver.end(), &mut reading, last);
        }
        job.close(&mut reading, wanted, None);
        job.counts = receiver.counts();
        job.midnight_ms = receiver.midnight_ms();
        job
    }

    fn heard(&mut self, heard: Heard, reading: &mut Reading, entry: &Entry) {
        for fix in heard.fixes {
            reading.fixes.push(Fix { time_ms: fix.time_ms - self.antenna.delay_ms, ..fix });
        }
        for mark in heard.marks {
            if let Mark::Jumped(jump) = mark {
                self.jumps.push((entry.number, jump));
            }
        }
    }

    /// Ends a stretch and begins another one with these settings.
    fn close(&mut self, reading: &mut Reading, wanted: &Wanted, settings: Option<Settings>) {
        let read = std::mem::replace(reading, Reading { settings, ..Reading::default() });
        if read.wheel.is_empty() {
            return;
        }
        let tick_m = read.tick_mm() / 1000.0;
        let mut fixes: Vec<(f64, Fix)> =
            read.fixes.iter().filter_map(|fix| Some((read.ticks_at(fix.time_ms)? * tick_m, *fix))).collect();
        // When a shorter delay is found, a later fix may get an earlier time.
        fixes.sort_by(|(_, one), (_, other)| one.time_ms.total_cmp(&other.time_ms));
        let track = Track::through(&fixes, self.antenna.error_m(), wanted.longest_outage_m);
        let find = |distance_m: f64, recorded_ms: u64, offset: Offset| match &track {
            Some(track) => track.find(distance_m, recorded_ms as f64, offset),
            None => Err(Missing::NoFixBefore),
        };
        let (beam, tool) = (self.antenna.beam(), self.antenna.tool(read.mm(Setting::BeamToToolMm)));
        let (mut events, mut ground) = (read.events, read.ground);
        for event in &mut events {
            let offset = match event.kind {
                EventKind::Detection { .. } | EventKind::Guarded | EventKind::Label(_) => beam,
                EventKind::SwingOut | EventKind::SwingIn | EventKind::Alarm => tool,
            };
            event.found = find(event.distance_m, event.time_ms, offset);
        }
        for ground in ground.iter_mut().filter(|ground| ground.did != Did::Rolled) {
            let until_ms = ground.time_ms.end;
            ground.lines = lines(&ground.distance_m, |distance_m| find(distance_m, until_ms, tool));
        }
        self.stretches.push(Stretch { events, ground, time_ms: read.time_ms.unwrap_or_default() });
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
    let mut lines: Vec<Vec<Place>> = vec![Vec::new()];
    let steps = ((distance_m.end - distance_m.start) / LINE_STEP_M).ceil().max(1.0);
    for step in 0..=steps as u64 {
        let share = step as f64 / steps;
        match (find(distance_m.start + share * (distance_m.end - distance_m.start)), lines.last_mut()) {
            (Ok(found), Some(line)) => line.push(found.place),
            (Err(_), Some(line)) if !line.is_empty() => lines.push(Vec::new()),
            _ => {}
        }
    }
    // A single position is no line.
    lines.retain(|line| line.len() > 1);
    lines
}

impl Reading {
    fn tick_mm(&self) -> f64 {
        self.settings.as_ref().map_or(0.0, tick_mm)
    }

    fn metres(&self, ticks: i64) -> f64 {
        ticks as f64 * self.tick_mm() / 1000.0
    }

    fn mm(&self, setting: Setting) -> f64 {
        self.settings.as_ref().map_or(0.0, |settings| f64::from(settings.get(setting)))
    }

    /// Takes a line `name=value`: shown by the machine, or what it `changed`.
    fn set(&mut self, line: &str, changed: bool) {
        if let (Some((setting, value)), Some(settings)) = (shown(line), &mut self.settings) {
            // A log of another version may have another range. Then the default is used.
            let _ = if changed { settings.change(setting, value) } else { settings.set(setting, value) };
        }
    }

    fn seen(&mut self, time_ms: u64) {
        let range = self.time_ms.get_or_insert(time_ms..time_ms);
        range.end = time_ms;
    }

    /// Ticks since the stretch began, for a position near the last one.
    fn ticks(&self, position: i32) -> Option<i64> {
        let (&(_, ticks), last) = (self.wheel.last()?, self.last_position?);
        Some(ticks + i64::from(position.wrapping_sub(last)))
    }

    /// Whether the distance since the last status is impossible: the log has a gap.
    fn is_far(&self, status: &Status) -> bool {
        self.last_position.is_some_and(|last| status.position.wrapping_sub(last).unsigned_abs() > LONGEST_DISTANCE)
    }

    /// The wheel's ticks at a time. `None` outside of the stretch.
    fn ticks_at(&self, time_ms: f64) -> Option<f64> {
        let next = self.wheel.partition_point(|&(at_ms, _)| at_ms < time_ms);
        let before = next.checked_sub(1).map(|place| self.wheel[place]);
        match (before, self.wheel.get(next)) {
            (Some((from_ms, from)), Some(&(to_ms, to))) => {
                Some(from as f64 + (to - from) as f64 * (time_ms - from_ms) / (to_ms - from_ms))
            }
            (None, Some(&(at_ms, ticks))) | (Some((at_ms, ticks)), None) => {
                ((time_ms - at_ms).abs() <= STANDING_MS).then_some(ticks as f64)
            }
            (None, None) => None,
        }
    }

    fn status(&mut self, status: Status, time_ms: u64) {
        let ticks = self.ticks(status.position).unwrap_or(0);
        self.wheel.push((time_ms as f64, ticks));
        self.last_position = Some(status.position);
        let (did, at_m) = (did(&status), self.metres(ticks));
        match self.ground.last_mut() {
            None => self.ground.push(Ground::begin(did, at_m, time_ms)),
            Some(passed) => {
                passed.distance_m.end = passed.distance_m.end.max(at_m);
                passed.time_ms.end = time_ms;
                // A swing has its own position.
                let is_at_work = |did: Did| did != Did::Rolled;
                if is_at_work(passed.did) != is_at_work(did) {
                    self.turn_to(did, ticks, time_ms);
                }
            }
        }
        self.last_status = Some(status);
    }

    /// From these ticks on the ground gets another kind of work.
    fn turn_to(&mut self, did: Did, ticks: i64, time_ms: u64) {
        let at_m = self.metres(ticks);
        let Some(passed) = self.ground.last_mut() else { return };
        if passed.did == did {
            return;
        }
        // A swing is reported somewhat later than it is commanded, and perhaps after a status with a farther position.
        let at_m = at_m.max(passed.distance_m.start);
        passed.distance_m.end = at_m;
        passed.time_ms.end = time_ms;
        self.ground.push(Ground::begin(did, at_m, time_ms));
    }

    fn event(&mut self, entry: &Entry) {
        let Some(event) = EventLine::parse(&entry.text) else { return };
        let (kind, position, behind_mm, width_mm) = match event {
            EventLine::Detection { class, position, votes, hold, .. } => {
                let hold_mm = f64::from(hold) * self.tick_mm();
                let width_mm = (hold_mm - 2.0 * self.mm(Setting::MarginMm)).max(0.0);
                (EventKind::Detection { class, votes }, position, width_mm / 2.0, width_mm)
            }
            EventLine::Guarded { position } => (EventKind::Guarded, position, 0.0, 0.0),
            EventLine::Swing { out, position } => {
                let is_at_work = self.last_status.as_ref().is_some_and(|status| status.mode == Mode::Work)
                    || self.ground.last().is_some_and(|passed| passed.did != Did::Rolled);
                if let Some(ticks) = self.ticks(position).filter(|_| is_at_work) {
                    self.turn_to(if out { Did::Spared } else { Did::Weeded }, ticks, entry.time_ms);
                }
                (if out { EventKind::SwingOut } else { EventKind::SwingIn }, position, 0.0, 0.0)
            }
            EventLine::Alarm { position, .. } => (EventKind::Alarm, position, 0.0, 0.0),
            EventLine::State { mode } => {
                if let Some(status) = &mut self.last_status {
                    status.mode = mode;
                }
                if mode != Mode::Work
                    && let Some(&(_, ticks)) = self.wheel.last()
                {
                    self.turn_to(Did::Rolled, ticks, entry.time_ms);
                }
                return;
            }
            _ => return,
        };
        let Some(ticks) = self.ticks(position) else { return };
        self.events.push(Event {
            kind,
            line: entry.number,
            text: entry.text.clone(),
            time_ms: entry.time_ms,
            distance_m: (ticks as f64 * self.tick_mm() + behind_mm) / 1000.0,
            width_mm,
            found: Err(Missing::NoFixBefore),
        });
    }

    /// Takes a line of an answer. If it changes the wheel, returns the settings of the new stretch.
    fn answer(&mut self, line: &str) -> Option<Settings> {
        let before = self.tick_mm();
        match ConsoleLine::parse(line) {
            ConsoleLine::End { error: None } => {
                let (number, time_ms, command) = self.unanswered.pop_front()?;
                let words: Vec<&str> = command.split_whitespace().collect();
                match words.as_slice() {
                    ["set", name, value] => self.set(&format!("{name}={value}"), true),
                    ["label", class, ..] => self.label(class, number, time_ms, &command),
                    _ => {}
                }
            }
            ConsoleLine::End { error: Some(_) } => {
                self.unanswered.pop_front();
            }
            // The output of `get` and `calibrate`.
            ConsoleLine::Setting { .. } => self.set(line, false),
            _ => {}
        }
        (before != self.tick_mm()).then(|| self.settings.clone()).flatten()
    }

    fn label(&mut self, class: &str, line: u64, time_ms: u64, command: &str) {
        let class = if class == "plant" { Class::Plant } else { Class::Weed };
        let is_detection = |event: &&Event| matches!(event.kind, EventKind::Detection { .. });
        let Some(detection) = self.events.iter().rev().find(is_detection).cloned() else { return };
        self.events.push(Event { kind: EventKind::Label(class), line, text: command.to_owned(), time_ms, ..detection });
    }
}

/// Millimetres in a tick of the encoder.
pub fn tick_mm(settings: &Settings) -> f64 {
    let value = |setting| f64::from(settings.get(setting));
    match value(Setting::TicksPerM) {
        0.0 => PI * value(Setting::WheelMm) / value(Setting::TicksPerRev).max(1.0),
        ticks_per_m => 1000.0 / ticks_per_m,
    }
}

/// The last offsets of beam and tool in a log.
pub fn antenna_of(log: &[Entry]) -> Option<Antenna> {
    log.iter().rev().find(|entry| entry.kind == Kind::Antenna).and_then(|entry| Antenna::parse(&entry.text))
}

/// The work of a machine with this status.
fn did(status: &Status) -> Did {
    match (status.mode, status.tool_out) {
        (Mode::Work, false) => Did::Weeded,
        (Mode::Work, true) => Did::Spared,
        (Mode::Hold | Mode::Alarm, _) => Did::Rolled,
    }
}
