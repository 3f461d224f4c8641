//! A log replayed: the firmware's own decisions on the host, given what the log says that the machine met.
//!
//! A log holds where the beam broke and cleared, place and speed ten times a second, the settings, the examples and what was
//! typed. From these [`replay`] rebuilds the machine's way and the beam's edges, tick by tick, has
//! [`control::controller::Controller`] decide anew, and compares what it tells with what the log tells: each object with its
//! class and votes, each swing with its place, each alarm.
//!
//! # How near it is
//!
//! - An object's edges are right to [`OBJECT_TICKS`]. A swing leads by the speed, and the log has that only now and then: it may
//!   differ by [`SWING_TICKS`], and by [`SWING_MS`] of the machine's way, which at 2.5 km/h is another 17 mm.
//! - Where the state changed is not in the log. The swing that follows says it, and is not judged by its place.
//! - An alarm that encoder, beam, end switch or stack gave rests on what the log does not hold. It is raised where the log has it.
//! - Where a log begins with ground already seen, what the tool did there is not judged.
//! - A replay ends where the bench was used (`servo`, `calibrate`, `test`) or examples were forgotten.

use super::log::{Entry, Kind};
use super::settings::{Setting, Settings, shown, steps};
use super::{Class, Mode, Status, Told};
use control::classifier::{Nearest, label};
use control::console::{self, Command};
use control::controller::{Controller, Readings, State, WakeUp};
use control::event::Event;
use control::features;
use control::memory::Volatile;
use control::reset::Cause;
use control::units::{Instant, Interval, Position, TicksPerSecond};
use knn::Example;
use std::fmt;
use thiserror::Error;

/// By how many ticks an object's place and width may differ.
pub const OBJECT_TICKS: i32 = 3;

/// By how many ticks a swing's place may differ, 6 mm at the default wheel, besides [`SWING_MS`].
pub const SWING_TICKS: i32 = 12;

/// By how much of the machine's way a swing's place may differ, in milliseconds.
pub const SWING_MS: i32 = 25;

/// Time between two steps of a machine at rest.
const REST_MS: u32 = 5;

/// Longest rest that is replayed: nothing that it changes takes longer.
const LONGEST_REST_MS: u64 = 2_000;

/// Longest way between two lines of a log. A machine at 10 km/h rolls it in some minutes.
const LONGEST_WAY: i32 = 1_000_000;

/// Why a log cannot be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// There is nothing to replay.
    #[error(
        "the log has no machine in it: `weeder record` and `weeder monitor --log` write one with its settings and status"
    )]
    Nothing,
    /// A line says what cannot be.
    #[error("line {line} of the log: {problem}")]
    Line {
        /// The line, counted from 1.
        line: u64,
        /// What is wrong with it.
        problem: String,
    },
}

/// Something that was told, with its line in the log, or the place in the replay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Heard {
    line: u64,
    told: Told,
    /// The machine's speed then, in ticks a second.
    speed: i32,
    /// Whether its place is given, not decided.
    is_given: bool,
}

/// What log and replay do not agree on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The log's line, where it has one.
    pub line: Option<u64>,
    /// What the log says.
    pub logged: String,
    /// What the replay says.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, logged, replayed } = self;
        match line {
            Some(line) => write!(formatter, "line {line}: the log has {logged}, the replay {replayed}"),
            None => write!(formatter, "the log has {logged}, the replay {replayed}"),
        }
    }
}

/// What came of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Objects on which both agree.
    pub objects: usize,
    /// Swings on which both agree.
    pub swings: usize,
    /// Greatest distance between a swing of the log and the replay's, in ticks.
    pub farthest_swing: i32,
    /// The first thing on which they do not.
    pub difference: Option<Difference>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}

/// Replays a log.
///
/// # Errors
/// Where it holds no machine, or a line says what cannot be.
pub fn replay(log: &[Entry]) -> Result<Replayed, ReplayError> {
    let mut replayed = Replayed::default();
    let mut stretches = 0;
    let mut rest = log;
    while let Some(start) = rest.iter().position(|entry| entry.kind == Kind::Connected) {
        rest = &rest[start + 1..];
        let end =
            rest.iter().position(|entry| matches!(entry.kind, Kind::Connected | Kind::Lost)).unwrap_or(rest.len());
        let stretch = Stretch::read(&rest[..end])?;
        if let Some(stretch) = stretch {
            stretches += 1;
            stretch.replay(&mut replayed)?;
        }
        rest = &rest[end..];
    }
    if stretches == 0 { Err(ReplayError::Nothing) } else { Ok(replayed) }
}

/// What happened at one place of the log.
enum Happened<'a> {
    Status(Status),
    Told(Told),
    Command(&'a str),
}

/// A log from one start of the link to its end.
struct Stretch<'a> {
    settings: Settings,
    examples: Vec<Example<{ features::COUNT }>>,
    first: Status,
    happened: Vec<(&'a Entry, Happened<'a>)>,
}

impl<'a> Stretch<'a> {
    /// Reads one; none where the machine said nothing.
    fn read(entries: &'a [Entry]) -> Result<Option<Self>, ReplayError> {
        let mut settings = Settings::new();
        let mut examples = Vec::new();
        let mut happened = Vec::new();
        for entry in entries {
            let wrong = |problem: &str| {
                let problem = format!("`{}` is {problem}", entry.text);
                ReplayError::Line { line: entry.number, problem }
            };
            match entry.kind {
                Kind::Setting => {
                    let (setting, value) = shown(&entry.text).ok_or_else(|| wrong("no setting of this version"))?;
                    settings.set(setting, value).map_err(|_| wrong("out of range"))?;
                }
                Kind::Example => examples.extend(example(&entry.text).map_err(|()| wrong("no example"))?),
                Kind::Status => {
                    let status = Status::parse(&entry.text).ok_or_else(|| wrong("no status"))?;
                    happened.push((entry, Happened::Status(status)));
                }
                Kind::Event => {
                    let told = Told::parse(&entry.text).ok_or_else(|| wrong("no event"))?;
                    happened.push((entry, Happened::Told(told)));
                }
                Kind::Command => happened.push((entry, Happened::Command(&entry.text))),
                Kind::Answer | Kind::Connected | Kind::Lost => {}
            }
        }
        let first = happened.iter().find_map(|(_, happened)| match happened {
            Happened::Status(status) => Some(status.clone()),
            _ => None,
        });
        Ok(first.map(|first| Self { settings, examples, first, happened }))
    }

    fn replay(self, replayed: &mut Replayed) -> Result<(), ReplayError> {
        let wheel = self.settings.wheel();
        let beam_to_tool = self.settings.ticks(Setting::BeamToToolMm);
        // A machine that has just started has seen nothing yet.
        let starts_unseen = i32::from(wheel.millimetres(beam_to_tool)) <= self.first.unseen_mm + 1;
        let judged_from = if starts_unseen { i32::MIN } else { self.first.position.saturating_add(beam_to_tool.0) };
        if !starts_unseen {
            replayed.notes.push(format!(
                "the log begins with ground already seen: swings before pos={judged_from} are not judged"
            ));
        }

        let mut player = Player::new(&self);
        let mut logged: Vec<Heard> = Vec::new();
        let mut last = (self.first.clone(), self.happened.first().map_or(0, |(entry, _)| entry.time_ms));
        for (place, (entry, happened)) in self.happened.iter().enumerate() {
            match happened {
                Happened::Status(status) => {
                    player.roll(&last.0, status, entry.time_ms.saturating_sub(last.1)).map_err(|()| {
                        let problem = "the machine cannot have come so far since the status before".to_owned();
                        ReplayError::Line { line: entry.number, problem }
                    })?;
                    last = (status.clone(), entry.time_ms);
                }
                Happened::Told(told) => {
                    let mut is_given = false;
                    // Both places of a change of state are known once its swing is.
                    if let Told::State(_) | Told::Alarm { .. } = told
                        && let Some(at) = self.place_of_change(place)
                    {
                        player.roll_to(at, &last.0, self.next_status(place));
                        last.0.position = at;
                        last.0.speed_mm_s = player.speed_mm_s;
                    }
                    match told {
                        Told::State(mode) => player.enter(*mode),
                        Told::Alarm { .. } => is_given = player.raise(),
                        Told::Swing { .. } => is_given = self.follows_change(place),
                        _ => {}
                    }
                    logged.push(Heard { line: entry.number, told: *told, speed: player.speed().0, is_given });
                }
                Happened::Command(line) => {
                    if !player.command(line) {
                        replayed.notes.push(format!("line {}: not replayed from `{line}` on", entry.number));
                        break;
                    }
                }
            }
        }
        let bounds = Bounds { first: self.first.position, judged_from, end: last.0.position };
        compare(&logged, &player.heard, &bounds, replayed);
        Ok(())
    }

    /// Where the state changed that a line tells of: at an alarm's own place, or that of the swing that follows.
    fn place_of_change(&self, place: usize) -> Option<i32> {
        if let Happened::Told(Told::Alarm { position, .. }) = &self.happened[place].1 {
            return Some(*position);
        }
        self.happened[place + 1..].iter().find_map(|(_, happened)| match happened {
            Happened::Told(Told::Swing { position, .. }) => Some(Some(*position)),
            Happened::Status(_) => Some(None),
            _ => None,
        })?
    }

    /// Whether a swing belongs to a change of state that was told just before it.
    fn follows_change(&self, place: usize) -> bool {
        let before = self.happened[..place].iter().rev().map(|(_, happened)| happened);
        before
            .take_while(|happened| !matches!(happened, Happened::Status(_) | Happened::Told(Told::Swing { .. })))
            .any(|happened| matches!(happened, Happened::Told(Told::State(_))))
    }

    fn next_status(&self, place: usize) -> Option<&Status> {
        self.happened[place..].iter().find_map(|(_, happened)| match happened {
            Happened::Status(status) => Some(status),
            _ => None,
        })
    }
}

/// Reads a line of the examples; none where it only counts those that are spoiled.
fn example(line: &str) -> Result<Option<Example<{ features::COUNT }>>, ()> {
    let words: Vec<&str> = line.split(' ').collect();
    match words.as_slice() {
        ["built_in" | "field", _, class, rest @ ..] => {
            let label = match *class {
                "plant" => label::PLANT,
                "weed" => label::WEED,
                _ => return Err(()),
            };
            let bytes: Result<Vec<u8>, _> = rest.iter().map(|word| word.parse()).collect();
            let features = bytes.map_err(|_| ())?.try_into().map_err(|_| ())?;
            Ok(Some(Example::new(features, label)))
        }
        [line] if line.starts_with("spoiled=") => Ok(None),
        _ => Err(()),
    }
}

/// The decisions, driven along the log.
struct Player<'a> {
    controller: Controller<Nearest<&'a [Example<{ features::COUNT }>], Volatile>, Volatile>,
    /// The ground over which the beam was broken.
    canopies: Vec<(i32, i32)>,
    broken: bool,
    now: Instant,
    position: i32,
    speed_mm_s: i32,
    heard: Vec<Heard>,
    /// Whether the next alarm told is one that was given.
    swallows_alarm: bool,
}

impl<'a> Player<'a> {
    fn new(stretch: &'a Stretch<'a>) -> Self {
        let margins = stretch.settings.wheel().ticks(2 * stretch.settings.get(Setting::MarginMm)).0;
        let canopies: Vec<(i32, i32)> = stretch
            .happened
            .iter()
            .filter_map(|(_, happened)| match happened {
                Happened::Told(Told::Object { position, hold, .. }) => {
                    Some((*position, position.wrapping_add(hold.wrapping_sub(margins))))
                }
                _ => None,
            })
            .collect();
        let position = stretch.first.position;
        let broken = is_in(&canopies, position);
        let readings = Readings::new(Instant::new(0), Position::new(position));
        let wake_up = WakeUp { readings, beam_broken: broken, cause: Cause::Unknown };
        let classifier = Nearest::new(stretch.examples.as_slice(), Volatile::new());
        let mut controller = Controller::new(classifier, Volatile::new(), wake_up);
        controller.clear();
        for (setting, value) in steps(controller.settings(), &stretch.settings) {
            // In an order that the firmware takes, and every value is in its range.
            let _ = controller.set(setting, value);
        }
        if stretch.first.mode == Mode::Work {
            let unseen = stretch.first.unseen_mm;
            let _ = controller.start(unseen < i32::from(stretch.settings.get(Setting::BeamToToolMm)) - 1);
        }
        controller.tell_events(true);
        Self {
            controller,
            canopies,
            broken,
            now: Instant::new(0),
            position,
            speed_mm_s: stretch.first.speed_mm_s,
            heard: Vec::new(),
            swallows_alarm: false,
        }
    }

    fn speed(&self) -> TicksPerSecond {
        let wheel = self.controller.settings().wheel();
        let ticks = wheel.ticks(u16::try_from(self.speed_mm_s.unsigned_abs()).unwrap_or(u16::MAX)).0;
        TicksPerSecond(if self.speed_mm_s < 0 { -ticks } else { ticks })
    }

    /// Rolls from one status to the next, `host_ms` later by the host's clock, gaining or losing speed evenly.
    fn roll(&mut self, from: &Status, to: &Status, host_ms: u64) -> Result<(), ()> {
        let way = to.position.wrapping_sub(self.position);
        if way.abs() > LONGEST_WAY {
            return Err(());
        }
        if way == 0 {
            self.speed_mm_s = to.speed_mm_s;
            self.rest(host_ms.min(LONGEST_REST_MS));
            return Ok(());
        }
        self.roll_by(way, from.speed_mm_s, to.speed_mm_s, host_ms);
        Ok(())
    }

    /// Rolls to a place on the way to the next status, if it lies there.
    fn roll_to(&mut self, place: i32, from: &Status, next: Option<&Status>) {
        let way = place.wrapping_sub(self.position);
        let Some(next) = next else { return };
        let whole = next.position.wrapping_sub(self.position);
        if way == 0 || way.signum() != whole.signum() || way.abs() > whole.abs() {
            return;
        }
        let share = f64::from(way) / f64::from(whole);
        let speed = f64::from(from.speed_mm_s) + share * f64::from(next.speed_mm_s - from.speed_mm_s);
        self.roll_by(way, from.speed_mm_s, speed.round() as i32, 0);
    }

    /// Rolls a way, tick by tick. The speeds say how long it takes; where they cannot, the host's clock does.
    fn roll_by(&mut self, way: i32, from_mm_s: i32, to_mm_s: i32, host_ms: u64) {
        let tick_mm = 100.0 / f64::from(self.controller.settings().wheel().ticks(100).0.max(1));
        let (from, to) = (f64::from(from_mm_s) / tick_mm, f64::from(to_mm_s) / tick_mm);
        let ways = f64::from(way);
        let mean = (from + to) / 2.0;
        let by_speed = ways / mean;
        let host_s = host_ms.max(1) as f64 / 1000.0;
        let duration_s = if by_speed > 0.0 && by_speed < 3.0 * host_s.max(0.1) { by_speed } else { host_s };
        let steps = way.unsigned_abs();
        let start = self.position;
        let mut elapsed_s = 0.0;
        for step in 1..=steps {
            let share = f64::from(step) / f64::from(steps);
            // Even acceleration: the square of the speed goes evenly with the way.
            let speed = (from * from + share * (to * to - from * from)).max(0.0).sqrt();
            let even = duration_s * share;
            let due_s = if by_speed == duration_s && from.abs() + speed > 0.0 {
                2.0 * ways.abs() * share / (from.abs() + speed)
            } else {
                even
            };
            let interval_s = (due_s - elapsed_s).max(0.0);
            elapsed_s = due_s;
            self.speed_mm_s = (from_mm_s.signum() | to_mm_s.signum()) * (speed * tick_mm).round() as i32;
            self.now = self.now + Interval::from_steps((interval_s * f64::from(Interval::STEPS_PER_SECOND)) as u32);
            self.position = start.wrapping_add(way.signum() * step as i32);
            self.step();
        }
        self.speed_mm_s = to_mm_s;
    }

    fn rest(&mut self, time_ms: u64) {
        for _ in 0..time_ms.div_ceil(u64::from(REST_MS)) {
            self.now = self.now + Interval::from_ms(REST_MS);
            self.step();
        }
    }

    /// Has the decisions take the place where the machine now is.
    fn step(&mut self) {
        let response = self.speed().distance_in_ms(self.controller.settings().get(Setting::BeamResponseMs));
        let ground = (Position::new(self.position) - response).count();
        let broken = is_in(&self.canopies, ground);
        if broken != self.broken {
            self.broken = broken;
            self.controller.beam_edge(Position::new(self.position), broken);
        }
        let mut readings = Readings::new(self.now, Position::new(self.position));
        // An end switch that does as it is told.
        readings.end_switch_on = self.controller.tool_out();
        self.controller.step(readings);
        self.listen();
    }

    fn listen(&mut self) {
        let speed = self.speed().0;
        while let Some(event) = self.controller.next_event() {
            let told = match event {
                Event::Object { vote, leading, spacing, plan } => Told::Object {
                    class: vote.class,
                    position: leading.count(),
                    votes: vote.votes,
                    spacing: spacing.0,
                    delay: plan.delay.0,
                    hold: plan.hold.0,
                    actuation: plan.actuation().0,
                },
                Event::Swing { out, position } => Told::Swing { out, position: position.count() },
                Event::Alarm { .. } if std::mem::take(&mut self.swallows_alarm) => continue,
                Event::Alarm { alarm, position } => Told::Alarm { alarm, position: position.count() },
                // They rest on time, which the log has only roughly; or follow from the others.
                Event::State(_) | Event::Warning(_) | Event::Calibrated { .. } => continue,
            };
            self.heard.push(Heard { line: 0, told, speed, is_given: false });
        }
    }

    /// Goes to a state, unless it is there already.
    fn enter(&mut self, mode: Mode) {
        match (mode, self.controller.state()) {
            (Mode::Work, State::Hold) => {
                let _ = self.controller.start(false);
            }
            (Mode::Hold, State::Work | State::Alarm(_)) => {
                self.controller.hold();
                self.controller.clear();
            }
            _ => return,
        }
        self.step();
    }

    /// Raises an alarm that the log has; whether the replay did not have it by itself.
    fn raise(&mut self) -> bool {
        let is_given = !matches!(self.controller.state(), State::Alarm(_));
        if is_given {
            // All alarms do the same; this one can be given from outside.
            self.swallows_alarm = true;
            self.controller.beam_edges_lost(self.broken);
            self.step();
        }
        is_given
    }

    /// Carries out what was typed; false where that cannot be replayed.
    fn command(&mut self, line: &str) -> bool {
        match console::parse(line.as_bytes()) {
            Ok(Command::Start { now }) => {
                let _ = self.controller.start(now);
            }
            Ok(Command::Hold) => self.controller.hold(),
            Ok(Command::Clear) => self.controller.clear(),
            Ok(Command::Set(setting, value)) => {
                // Refused here as there.
                let _ = self.controller.set(setting, value);
            }
            Ok(Command::Label(label)) => {
                let _ = self.controller.label(label);
            }
            Ok(Command::Forget(_) | Command::ForgetAll) => return false,
            _ => {
                let word = line.split_whitespace().next().unwrap_or_default();
                return !["servo", "calibrate", "test", "defaults", "revert"].contains(&word);
            }
        }
        self.step();
        true
    }
}

/// Whether the beam is broken over this ground.
fn is_in(canopies: &[(i32, i32)], ground: i32) -> bool {
    canopies.iter().any(|&(from, to)| ground.wrapping_sub(from) >= 0 && ground.wrapping_sub(to) < 0)
}

/// Where a stretch of a log was replayed.
struct Bounds {
    /// The first place.
    first: i32,
    /// Swings before this place are not judged.
    judged_from: i32,
    /// The last place.
    end: i32,
}

/// Compares what both tell, each kind in its order, and notes the first difference.
fn compare(logged: &[Heard], replayed: &[Heard], bounds: &Bounds, result: &mut Replayed) {
    let kinds: [fn(&Told) -> bool; 3] = [
        |told| matches!(told, Told::Object { .. }),
        |told| matches!(told, Told::Swing { .. }),
        |told| matches!(told, Told::Alarm { .. }),
    ];
    let is_judged = |heard: &&Heard| match heard.told {
        // What was in the beam when the log began is cut for the replay.
        Told::Object { position, .. } => position.wrapping_sub(bounds.first) >= 0,
        Told::Swing { position, .. } => position >= bounds.judged_from,
        _ => !heard.is_given,
    };
    // A swing at the very end may come in the one and not yet in the other.
    let is_at_end = |heard: &Heard| {
        matches!(heard.told, Told::Swing { position, .. }
            if bounds.end.wrapping_sub(position).abs() <= swing_ticks(heard, heard))
    };
    let mut differences = Vec::new();
    for is_kind in kinds {
        let mut ours = replayed.iter().filter(|heard| is_kind(&heard.told)).filter(is_judged);
        let mut theirs = logged.iter().filter(|heard| is_kind(&heard.told)).filter(is_judged);
        loop {
            match (theirs.next(), ours.next()) {
                (None, None) => break,
                (Some(logged), Some(replayed)) if agree(logged, replayed) => result.count(logged, replayed),
                (Some(only), None) | (None, Some(only)) if is_at_end(only) => break,
                (logged, replayed) => {
                    let line = logged.map(|heard| heard.line);
                    differences.push(Difference { line, logged: describe(logged), replayed: describe(replayed) });
                    break;
                }
            }
        }
    }
    if result.difference.is_none() {
        result.difference = differences.into_iter().min_by_key(|difference| difference.line.unwrap_or(u64::MAX));
    }
}

impl Replayed {
    /// Counts what both agree on.
    fn count(&mut self, logged: &Heard, replayed: &Heard) {
        match (logged.told, replayed.told) {
            (Told::Object { .. }, _) => self.objects += 1,
            (Told::Swing { position, .. }, Told::Swing { position: ours, .. }) => {
                self.swings += 1;
                if !logged.is_given {
                    self.farthest_swing = self.farthest_swing.max(position.wrapping_sub(ours).abs());
                }
            }
            _ => {}
        }
    }
}

/// By how many ticks the places of these swings may differ.
fn swing_ticks(logged: &Heard, replayed: &Heard) -> i32 {
    SWING_TICKS + logged.speed.abs().max(replayed.speed.abs()) * SWING_MS / 1000
}

/// Whether log and replay tell the same.
fn agree(logged: &Heard, replayed: &Heard) -> bool {
    let near = |one: i32, other: i32, ticks: i32| one.wrapping_sub(other).abs() <= ticks;
    match (logged.told, replayed.told) {
        (
            Told::Object { class, position, votes, hold, .. },
            Told::Object { class: our_class, position: our_position, votes: our_votes, hold: our_hold, .. },
        ) => {
            (class, votes) == (our_class, our_votes)
                && near(position, our_position, OBJECT_TICKS)
                && near(hold, our_hold, OBJECT_TICKS)
        }
        (Told::Swing { out, position }, Told::Swing { out: ours, position: our_position }) => {
            out == ours && (logged.is_given || near(position, our_position, swing_ticks(logged, replayed)))
        }
        (Told::Alarm { alarm, .. }, Told::Alarm { alarm: ours, .. }) => alarm == ours,
        _ => false,
    }
}

fn describe(heard: Option<&Heard>) -> String {
    let Some(heard) = heard else { return "none".to_owned() };
    match heard.told {
        Told::Object { class, position, votes, hold, .. } => {
            let class = match class {
                Class::Plant => "plant",
                Class::Weed => "weed",
                Class::Unknown => "unknown",
            };
            format!("`{class} pos={position} votes={votes} hold={hold}`")
        }
        Told::Swing { out, position } => format!("`swing tool={} pos={position}`", if out { "out" } else { "in" }),
        Told::Alarm { alarm, position } => {
            let name: String = alarm.text().bytes().map(char::from).collect();
            format!("`alarm name={name} pos={position}`")
        }
        Told::State(_) | Told::Warning(_) | Told::Calibrated | Told::Plot => "something else".to_owned(),
    }
}
