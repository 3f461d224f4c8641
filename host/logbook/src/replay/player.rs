//! Drives the decisions along a log: the machine's motion, the beam's edges, and the typed commands.

use super::DETECTION_TICKS;
use super::classifier::{ReplayClassifier, Seen};
use super::compare::Heard;
use super::stretch::{Happened, Stretch};
use control::alarm::Alarm;
use control::ground::class::Vote;
use control::measure::reset::Cause;
use control::memory::Volatile;
use control::operate::event::Event;
use control::say::command::{Action, Command};
use control::say::execute;
use control::units::{Instant, Interval, Position, Ticks};
use control::{measure::readings::Readings, operate::state::State};
use link::settings::{Setting, Settings, steps};
use link::{EventLine, Mode, Status};
use rig::{Beams, Rig};

/// Time between two steps of a machine at rest.
const REST_MS: u32 = 5;

/// Longest rest that is replayed: nothing that it changes takes longer.
const LONGEST_REST_MS: u64 = 2_000;

/// A machine may stop from this speed without an encoder alarm.
const SLOWLY_MM_S: i32 = 20;

/// From this speed on, the time between two lines of a log follows from the speeds, not from the PC's clock.
const SURE_MM_S: f64 = 50.0;

/// Highest assumed speed where neither the speeds nor the PC's clock give one.
const MOST_MM_S: f64 = 200.0;

/// How far the slow and the fast pace go from the even speed to the slower or faster of two logged speeds. A machine may
/// accelerate directly after the first line, so it is near 1. It is below 1, as no machine stops before the log says so.
const EXTREME: f64 = 7.0 / 8.0;

/// Relative error of the machine's own measurement of a steady speed.
const UNSURE: f64 = 0.02;

/// Longest distance between two lines of a log. A machine at 10 km/h rolls it in some minutes.
const LONGEST_DISTANCE: i32 = 1_000_000;

/// Faster than any machine, and as far as [`control::units::Wheel::ticks`] goes with every encoder.
const FASTEST_MM_S: u16 = 3_800;

/// The assumed speed between two lines of a log. The log has only the speeds at the lines, in whole mm/s.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pace {
    /// Constant acceleration.
    Even,
    /// As slow as possible: nearly the slower of the two speeds, and a little less.
    Slow,
    /// As fast as possible: nearly the faster of the two, and a little more.
    Fast,
}

impl Pace {
    /// All paces, the most likely first.
    pub(super) const ALL: [Self; 3] = [Self::Even, Self::Slow, Self::Fast];

    /// How much later a detection ends than in the log, in ticks, within the tolerance. The tool goes out for an
    /// expected plant, or later for the plant's own zone if the plant is classified first. An early end and a slow pace
    /// favour the second, a late end and a fast pace the first.
    const fn end_later(self) -> i32 {
        match self {
            Self::Even => 0,
            Self::Slow => -DETECTION_TICKS,
            Self::Fast => DETECTION_TICKS,
        }
    }

    /// The speed after a share of the distance between two lines, in mm/s; never negative.
    fn speed(self, from: f64, to: f64, share: f64) -> f64 {
        // At constant acceleration the square of the speed is linear in the distance.
        let even = (from * from + share * (to * to - from * from)).max(0.0).sqrt();
        let (one, other) = (from.abs(), to.abs());
        match self {
            Self::Even => even,
            Self::Slow => (even + EXTREME * (one.min(other) - even)) * (1.0 - UNSURE),
            Self::Fast => (even + EXTREME * (one.max(other) - even)) * (1.0 + UNSURE),
        }
    }
}

/// The decisions, driven along the log.
pub(super) struct Player<'a> {
    pace: Pace,
    rig: Rig<ReplayClassifier<'a>>,
    /// The ground over which the beam was broken.
    canopies: Canopies,
    /// Steps so far, the same at every pace.
    steps: u64,
    /// The machine's speed over the ground.
    pub(super) speed_mm_s: i32,
    pub(super) heard: Vec<Heard>,
    /// Whether the next alarm was raised by the replay itself.
    swallows_alarm: bool,
}

impl<'a> Player<'a> {
    /// A machine in the state at the stretch's beginning. It has rolled there from the position where watching began, if
    /// the log shows it.
    pub(super) fn new(stretch: &'a Stretch<'a>, pace: Pace) -> Self {
        let canopies = Canopies::of(stretch, pace);
        let position = stretch.began();
        let broken = canopies.over(position).is_some();
        // The log's sensors. Add another only if the log has its level; else refuse such a log in `replay_stretch`.
        let readings = Readings {
            now: Instant::ZERO,
            position: Position::new(position),
            switch_on: false,
            lost: 0,
            jumps: 0,
            end_switch_on: false,
            stack_free: u16::MAX,
        };
        let beams = Beams { broken, second_broken: false };
        let classifier = ReplayClassifier::new(&stretch.built_in, &stretch.field);
        let mut rig = Rig::wake_at(classifier, Volatile::new(), readings, beams, Cause::Unknown);
        rig.clear();
        for (setting, value) in steps(rig.settings(), &stretch.settings) {
            // In an order that the firmware accepts, and every value is in its range.
            let _ = rig.set(setting, value);
        }
        let mut player = Self {
            pace,
            steps: 0,
            rig,
            canopies,
            speed_mm_s: stretch.first.speed_mm_s,
            heard: Vec::new(),
            swallows_alarm: false,
        };
        let (is_work, is_unseen) = (stretch.first.mode == Mode::Work, stretch.first.unseen_mm > 0);
        // On unseen ground work began where watching did.
        if is_work && is_unseen {
            let _ = player.rig.start(false);
            player.rig.enable_events(true);
        }
        player.roll_in(&stretch.first);
        if is_work && !is_unseen {
            let _ = player.rig.start(true);
        }
        player.rig.enable_events(true);
        player
    }

    /// Rolls from the position where watching began to the log's first position, at the log's first speed. If the machine
    /// stands there, it rolls so slowly that its stop raises no encoder alarm.
    fn roll_in(&mut self, first: &Status) {
        let distance = first.position.wrapping_sub(self.position());
        let speed_mm_s = if first.speed_mm_s > 0 { first.speed_mm_s } else { SLOWLY_MM_S };
        let distance_mm = i64::from(self.rig.settings().wheel().millimetres(Ticks(distance)));
        let time_ms = (distance_mm * 1000 / i64::from(speed_mm_s)).unsigned_abs();
        self.speed_mm_s = speed_mm_s;
        self.roll_by(distance, speed_mm_s, time_ms);
        self.speed_mm_s = first.speed_mm_s;
    }

    pub(super) fn position(&self) -> i32 {
        self.rig.readings.position.count()
    }

    /// The machine's speed in ticks a second.
    pub(super) fn speed(&self) -> i32 {
        let wheel = self.rig.settings().wheel();
        let ticks = wheel.ticks(self.speed_mm_s.unsigned_abs().min(FASTEST_MM_S.into()) as u16).0;
        if self.speed_mm_s < 0 { -ticks } else { ticks }
    }

    /// Rolls to the next status, `host_ms` later by the PC's clock. False if that is too far.
    pub(super) fn roll(&mut self, to: &Status, host_ms: u64) -> bool {
        let distance = to.position.wrapping_sub(self.position());
        if distance == 0 {
            self.speed_mm_s = to.speed_mm_s;
            // A line between the two may have moved it here already.
            if f64::from(to.speed_mm_s.saturating_abs()) < SURE_MM_S {
                for _ in 0..host_ms.min(LONGEST_REST_MS).div_ceil(u64::from(REST_MS)) {
                    self.wait(Interval::from_ms(REST_MS));
                    self.step();
                }
            }
        } else if distance.saturating_abs() <= LONGEST_DISTANCE {
            self.roll_by(distance, to.speed_mm_s, host_ms);
        } else {
            return false;
        }
        true
    }

    /// Rolls to a position, if it lies before the next status. Behind the last status the machine rolls on at its speed.
    pub(super) fn roll_to(&mut self, place: i32, next: Option<&Status>) {
        let distance = place.wrapping_sub(self.position());
        let Some(next) = next else {
            let is_ahead = distance != 0 && distance.signum() == self.speed_mm_s.signum();
            if is_ahead && distance.saturating_abs() <= LONGEST_DISTANCE {
                self.roll_by(distance, self.speed_mm_s, 0);
            }
            return;
        };
        let whole = next.position.wrapping_sub(self.position());
        let farthest = whole.unsigned_abs().min(LONGEST_DISTANCE as u32);
        if distance == 0 || distance.signum() != whole.signum() || distance.unsigned_abs() > farthest {
            return;
        }
        let share = f64::from(distance) / f64::from(whole);
        let speed = self.pace.speed(self.speed_mm_s.into(), next.speed_mm_s.into(), share);
        self.roll_by(distance, distance.signum() * speed.round() as i32, 0);
    }

    /// Rolls a distance, tick by tick. The time follows from the speeds, because a busy PC reads lines late and together.
    /// Near standstill it follows from the PC's clock.
    fn roll_by(&mut self, distance: i32, to_mm_s: i32, host_ms: u64) {
        let from_mm_s = self.speed_mm_s;
        let tick_mm = 100.0 / f64::from(self.rig.settings().wheel().ticks(100).0.max(1));
        let distance_mm = f64::from(distance) * tick_mm;
        let (from, to) = (f64::from(from_mm_s), f64::from(to_mm_s));
        let mean = (from + to) / 2.0;
        let by_speed_s = distance_mm / mean;
        self.rig.classifier().speeds_mm_s.set((from_mm_s.min(to_mm_s), from_mm_s.max(to_mm_s)));
        let host_s = (host_ms as f64 / 1000.0).max(distance_mm.abs() / MOST_MM_S);
        let is_known = by_speed_s > 0.0 && (by_speed_s < 3.0 * host_s.max(0.1) || mean.abs() > SURE_MM_S);
        let steps = distance.unsigned_abs();
        let start = self.position();
        let mut speed = from.abs();
        for step in 1..=steps {
            let before = speed;
            speed = self.pace.speed(from, to, f64::from(step) / f64::from(steps));
            let interval_s = if is_known { 2.0 * tick_mm / (before + speed) } else { host_s / f64::from(steps) };
            self.speed_mm_s = (from_mm_s.signum() | to_mm_s.signum()) * speed.round() as i32;
            self.wait(Interval::from_steps((interval_s * f64::from(Interval::STEPS_PER_SECOND)) as u32));
            self.rig.at(start.wrapping_add(distance.signum() * step as i32));
            self.step();
        }
        self.speed_mm_s = to_mm_s;
    }

    fn wait(&mut self, interval: Interval) {
        self.rig.readings.now = self.rig.readings.now + interval;
    }

    /// Runs a turn of the decisions at the present position.
    fn step(&mut self) {
        self.steps += 1;
        let response = Ticks(self.speed() * i32::from(self.rig.settings().get(Setting::BeamResponseMs)) / 1000);
        let ground = (self.rig.readings.position - response).count();
        let canopy = self.canopies.over(ground);
        let before = self.rig.beams();
        self.rig.see(Beams { broken: canopy.is_some(), second_broken: false });
        // The edge may have ended the previous detection, which is classified by now.
        if let Some(canopy) = canopy
            && !before.broken
        {
            self.rig.classifier().seen.set(canopy.seen);
        }
        // An end switch without a fault.
        self.rig.readings.end_switch_on = self.rig.tool_out();
        self.rig.turn();
        let speed = self.speed();
        while let Some(event) = self.rig.next_event() {
            match event {
                Event::Alarm { .. } if std::mem::take(&mut self.swallows_alarm) => {}
                Event::Detection { .. } | Event::Swing { .. } | Event::Alarm { .. } => {
                    let event = EventLine::from(&event);
                    self.heard.push(Heard { line: 0, steps: self.steps, event, speed, is_given: false });
                }
                // They depend on time, which the log has only roughly, or follow from other events.
                _ => {}
            }
        }
    }

    pub(super) fn settings(&self) -> &Settings {
        self.rig.settings()
    }

    /// Enters a state, unless it is there already. With `now` it works over unseen ground too, as `start now`.
    pub(super) fn enter(&mut self, mode: Mode, now: bool) {
        match (mode, self.rig.state()) {
            (Mode::Work, State::Hold) => _ = self.rig.start(now),
            (Mode::Hold, State::Work | State::Alarm(_)) => {
                self.rig.hold();
                self.rig.clear();
            }
            _ => return,
        }
        self.step();
    }

    /// Raises a logged alarm. Returns whether the replay had not raised it itself.
    pub(super) fn raise(&mut self) -> bool {
        let is_given = !matches!(self.rig.state(), State::Alarm(_));
        if is_given {
            // All alarms have the same effect, and the caller can raise this one.
            self.swallows_alarm = true;
            // A detection in the beam begins here, within the tolerance of its position.
            let broken =
                (0..=DETECTION_TICKS).any(|ahead| self.canopies.over(self.position().wrapping_add(ahead)).is_some());
            self.rig.lose_edges(Beams { broken, second_broken: false });
            self.step();
        }
        is_given
    }

    /// Executes a command. False if it cannot be replayed.
    pub(super) fn command(&mut self, command: &Command) -> bool {
        match command.action {
            // The log lacks the second beam's edges.
            Action::Set if command.setting == Setting::SecondBeamMm && command.number > 0 => return false,
            Action::Forget | Action::ForgetAll | Action::Defaults | Action::Revert => return false,
            Action::CalibrateStart | Action::CalibrateServo | Action::Calibrate => return false,
            Action::ServoIn | Action::ServoOut | Action::Servo | Action::TestRow | Action::TestWatchdog => {
                return false;
            }
            Action::Start | Action::StartNow | Action::Hold | Action::Clear | Action::Set => {}
            Action::LabelPlant | Action::LabelWeed | Action::Feature | Action::TeachPlant | Action::TeachWeed => {}
            // It changes nothing that the replay compares.
            _ => return true,
        }
        // If the log lacks the answer: the firmware refused what the replay refuses.
        let _ = execute(command, &mut *self.rig);
        self.step();
        true
    }
}

/// Ground over which the beam was broken.
struct Canopy {
    /// Its place in the log's order.
    number: usize,
    from: i32,
    to: i32,
    /// The log's values, if it was classified.
    seen: Option<Seen>,
}

/// The ground over which the beam was broken, as far as the log shows it: by where it begins, because a day has 200 000
/// plants.
struct Canopies {
    canopies: Vec<Canopy>,
    /// The stretch's beginning. Ground is compared as ticks from here, because a position wraps.
    first: i32,
    /// The widest of them in ticks.
    widest: i32,
}

impl Canopies {
    fn of(stretch: &Stretch, pace: Pace) -> Self {
        let (mut settings, first) = (stretch.settings.clone(), stretch.first.position);
        let mut canopies = Vec::new();
        for (number, (_, happened)) in stretch.happened.iter().enumerate() {
            let wheel = settings.wheel();
            match happened {
                Happened::Event(EventLine::Detection { class, position, votes, spacing, hold, .. }) => {
                    let width = hold.wrapping_sub(2 * wheel.ticks(settings.get(Setting::MarginMm)).0);
                    let seen = Seen {
                        vote: Vote { class: *class, votes: *votes },
                        spacing_mm: wheel.millimetres(Ticks(*spacing)),
                        width_mm: wheel.millimetres(Ticks(width)),
                        is_given: position.wrapping_sub(first) < 0,
                    };
                    canopies.push(Canopy {
                        number,
                        from: *position,
                        to: position.wrapping_add(width).wrapping_add(pace.end_later()),
                        seen: Some(seen),
                    });
                }
                // It is latched when the detection exceeds the greatest width.
                Happened::Event(EventLine::Alarm { alarm: Alarm::BeamBlocked, position }) => {
                    let from = position.wrapping_sub(settings.ticks(Setting::MaxWidthMm).0 + 1);
                    canopies.push(Canopy { number, from, to: position.wrapping_add(1), seen: None });
                }
                // Later holds have the new margin.
                Happened::Command(Some(Command { action: Action::Set, setting, number, .. })) => {
                    let _ = settings.change(*setting, *number);
                }
                _ => {}
            }
        }
        canopies.sort_by_key(|canopy| canopy.from.wrapping_sub(first));
        let widest = canopies.iter().map(|canopy| canopy.to.wrapping_sub(canopy.from)).max().unwrap_or(0);
        Self { canopies, first, widest }
    }

    /// The first of them in the log over this ground.
    fn over(&self, ground: i32) -> Option<&Canopy> {
        let ticks = ground.wrapping_sub(self.first);
        let from = |canopy: &Canopy| canopy.from.wrapping_sub(self.first);
        let begun = self.canopies.partition_point(|canopy| from(canopy) <= ticks);
        let near =
            self.canopies[..begun].iter().rev().take_while(|canopy| ticks.wrapping_sub(from(canopy)) < self.widest);
        let is_over = |canopy: &&Canopy| ground.wrapping_sub(canopy.from) >= 0 && ground.wrapping_sub(canopy.to) < 0;
        near.filter(is_over).min_by_key(|canopy| canopy.number)
    }
}
