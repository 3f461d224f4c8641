//! A stretch while it is read: the wheel's statuses, the events and the ground so far.

use super::{Did, Event, EventKind, PassedGround};
use crate::receiver::Fix;
use control::say::command::Action;
use link::settings::Setting;
use link::{Class, EventLine, Mode, Status};
use logbook::follower::{FASTEST_M_S, Follower, is_gap};
use logbook::log::{Entry, Kind};
use logbook::worked::NEXT_ROW_M;
use std::ops::Range;

/// Time before and after a stretch in which the machine is assumed to have stood, in ms. A fix in this time belongs to
/// the stretch's beginning or end.
const STANDING_MS: f64 = 1000.0;

/// An event lies at most so far from the last status, in metres, and as far as the machine rolls meanwhile.
const EVENT_M: f64 = 3.0;

/// A detection has at most `max_width_mm`, and some more with slip.
const MORE: f64 = 1.25;

/// A status of the wheel.
#[derive(Clone, Copy)]
pub(super) struct Rolled {
    pub(super) time_ms: f64,
    /// Distance since the stretch began.
    pub(super) m: f64,
    pub(super) line: u64,
}

#[derive(Default)]
pub(super) struct Reading {
    pub(super) wheel: Vec<Rolled>,
    pub(super) last_status: Option<Status>,
    pub(super) beam_to_tool_mm: f64,
    pub(super) fixes: Vec<Fix>,
    pub(super) events: Vec<Event>,
    pub(super) ground: Vec<PassedGround>,
    /// The first event of the row.
    row_from: usize,
    pub(super) time_ms: Option<Range<u64>>,
}

impl Reading {
    pub(super) fn seen(&mut self, time_ms: u64) {
        let range = self.time_ms.get_or_insert(time_ms..time_ms);
        range.end = time_ms;
    }

    /// Whether the wheel has rolled between two statuses, and it is not known when.
    fn is_gap(from: &Rolled, to: &Rolled) -> bool {
        is_gap(to.time_ms - from.time_ms, to.m - from.m)
    }

    pub(super) fn gaps(&self) -> impl Iterator<Item = Event> {
        let gaps = self.wheel.windows(2).filter(|pair| Self::is_gap(&pair[0], &pair[1]));
        gaps.map(|pair| {
            let (from, to) = (&pair[0], &pair[1]);
            let text = format!(
                "no status for {:.1} s and {:.1} m: positions there are interpolated",
                (to.time_ms - from.time_ms) / 1000.0,
                (to.m - from.m).abs()
            );
            Event::mark(EventKind::WheelGap, text, to.line, to.time_ms, from.m)
        })
    }

    /// The wheel's distance at a time, in metres. `None` outside of the stretch, and in a gap.
    pub(super) fn m_at(&self, time_ms: f64) -> Option<f64> {
        let next = self.wheel.partition_point(|rolled| rolled.time_ms < time_ms);
        let before = next.checked_sub(1).map(|place| self.wheel[place]);
        match (before, self.wheel.get(next)) {
            (Some(from), Some(to)) => {
                let share = (time_ms - from.time_ms) / (to.time_ms - from.time_ms);
                (!Self::is_gap(&from, to)).then_some(from.m + (to.m - from.m) * share)
            }
            (None, Some(&at)) | (Some(at), None) => ((time_ms - at.time_ms).abs() <= STANDING_MS).then_some(at.m),
            (None, None) => None,
        }
    }

    pub(super) fn status(&mut self, status: Status, at_m: f64, entry: &Entry) {
        let here = Rolled { time_ms: entry.time_ms as f64, m: at_m, line: entry.number };
        self.leave_gap(&here);
        let did = shown(&status);
        let shows_the_same = self.last_status.as_ref().is_some_and(|last| shown(last) == did);
        let last = self.wheel.last().copied().filter(|_| shows_the_same);
        self.wheel.push(here);
        match self.ground.last().map(|passed| (passed.did, passed.distance_m.start)) {
            None => self.ground.push(PassedGround::begin(did, at_m, entry.time_ms)),
            Some((passed, _)) if (passed == Did::Rolled) != (did == Did::Rolled) => {
                self.turn_to(did, at_m, entry.time_ms);
                // `start` forgets the ground: the beam sees again what ends ahead of it.
                if did != Did::Rolled && status.unseen_mm > 0 {
                    let row = self.events.split_off(self.row_from);
                    let is_seen = |kind: EventKind| matches!(kind, EventKind::Detection { .. } | EventKind::Guarded);
                    let is_behind = |it: &Event| it.distance_m + it.width_mm / 2000.0 < at_m;
                    self.events.extend(row.into_iter().filter(|it| is_behind(it) || !is_seen(it.kind)));
                }
            }
            Some((_, start_m)) => {
                // A swing has its own position. If its line is missing, two statuses show it.
                if let Some(last) = last.filter(|last| last.m > start_m) {
                    self.turn_to(did, last.m, last.time_ms as u64);
                }
            }
        }
        if let Some(passed) = self.ground.last_mut() {
            passed.distance_m.end = passed.distance_m.end.max(at_m);
            passed.time_ms.end = entry.time_ms;
        }
        self.last_status = Some(status);
    }

    /// Ends the ground before a gap that ends here. Returns whether one does.
    fn leave_gap(&mut self, to: &Rolled) -> bool {
        let from = self.wheel.last().copied().filter(|from| Self::is_gap(from, to));
        if let Some(from) = from {
            self.turn_to(Did::Rolled, from.m, from.time_ms as u64);
        }
        from.is_some()
    }

    /// From this distance on the ground gets another kind of work.
    fn turn_to(&mut self, did: Did, mut at_m: f64, time_ms: u64) {
        let Some(passed) = self.ground.last_mut() else { return };
        if passed.did == did {
            return;
        }
        let is_next_row = passed.did == Did::Rolled && at_m < passed.distance_m.end - NEXT_ROW_M;
        if is_next_row {
            self.row_from = self.events.len();
        } else {
            // A swing is reported somewhat later than it is commanded, perhaps after a status with a farther position.
            at_m = at_m.max(passed.distance_m.start);
            passed.distance_m.end = at_m;
        }
        passed.time_ms.end = time_ms.max(passed.time_ms.start);
        self.ground.push(PassedGround::begin(did, at_m, time_ms));
    }

    /// The link ends or begins with the first of these lines. Marks a restart of the machine at work.
    pub(super) fn restart(&mut self, entry: &Entry, lines: &[Entry]) {
        let (Some(status), Some(&Rolled { m, .. })) = (&self.last_status, self.wheel.last()) else { return };
        if let Some(text) = restarted(lines).filter(|_| status.mode == Mode::Work) {
            self.events.push(Event::mark(EventKind::Restart, text, entry.number, entry.time_ms as f64, m));
        }
    }

    /// Whether an event at this distance can be where the machine is. One status may have a damaged position.
    fn is_near(&self, time_ms: f64, m: f64) -> bool {
        let reach_m = |from: &Rolled| EVENT_M + FASTEST_M_S * (time_ms - from.time_ms) / 1000.0;
        let last = &self.wheel[self.wheel.len().saturating_sub(2)..];
        last.is_empty() || last.iter().any(|from| (m - from.m).abs() <= reach_m(from))
    }

    /// Takes an event. Returns false if its position is far from those around it: then it is left out.
    pub(super) fn event(&mut self, entry: &Entry, event: &EventLine, follower: &Follower) -> bool {
        let metres = |position| follower.mm(position).map(|mm| mm / 1000.0);
        let (kind, position, width_mm) = match *event {
            EventLine::Detection { class, position, votes, hold, .. } => {
                (EventKind::Detection { class, votes }, position, follower.width_mm(hold))
            }
            EventLine::Guarded { position } => (EventKind::Guarded, position, 0.0),
            EventLine::Swing { out, position } => {
                if metres(position).is_some_and(|m| !self.is_near(entry.time_ms as f64, m)) {
                    return false;
                }
                let is_at_work = self.last_status.as_ref().is_some_and(|status| status.mode == Mode::Work)
                    || self.ground.last().is_some_and(|passed| passed.did != Did::Rolled);
                if let Some(at_m) = metres(position).filter(|_| is_at_work) {
                    let here = Rolled { time_ms: entry.time_ms as f64, m: at_m, line: entry.number };
                    if self.leave_gap(&here) {
                        // So the next status ends no gap again, and leaves the ground that begins here.
                        self.wheel.push(here);
                    }
                    self.turn_to(if out { Did::Spared } else { Did::Weeded }, at_m, entry.time_ms);
                }
                (if out { EventKind::SwingOut } else { EventKind::SwingIn }, position, 0.0)
            }
            EventLine::Alarm { position, .. } => (EventKind::Alarm, position, 0.0),
            EventLine::State { mode } => {
                if let Some(status) = &mut self.last_status {
                    status.mode = mode;
                }
                if mode != Mode::Work
                    && let Some(&Rolled { m, .. }) = self.wheel.last()
                {
                    self.turn_to(Did::Rolled, m, entry.time_ms);
                }
                return true;
            }
            _ => return true,
        };
        let Some(at_m) = metres(position) else { return true };
        // Wider ones raise an alarm.
        let most_mm = MORE * f64::from(follower.in_use().settings().get(Setting::MaxWidthMm));
        if width_mm > most_mm || !self.is_near(entry.time_ms as f64, at_m + width_mm / 1000.0) {
            return false;
        }
        // A detection is its middle.
        let mark = Event::mark(kind, entry.text.clone(), entry.number, entry.time_ms as f64, at_m + width_mm / 2000.0);
        self.events.push(Event { width_mm, ..mark });
        true
    }

    /// Takes a command that the machine has carried out.
    pub(super) fn label(&mut self, command: &Entry) {
        let class = match link::command(&command.text).map(|command| command.action) {
            Ok(Action::LabelPlant) => Class::Plant,
            Ok(Action::LabelWeed) => Class::Weed,
            _ => return,
        };
        let is_detection = |event: &&Event| matches!(event.kind, EventKind::Detection { .. });
        let Some(detection) = self.events.iter().rev().find(is_detection).cloned() else { return };
        let (line, time_ms, text) = (command.number, command.time_ms, command.text.clone());
        self.events.push(Event { kind: EventKind::Label(class), line, text, time_ms, ..detection });
    }
}

fn shown(status: &Status) -> Did {
    match (status.mode, status.tool_out) {
        (Mode::Work, false) => Did::Weeded,
        (Mode::Work, true) => Did::Spared,
        (Mode::Hold | Mode::Alarm, _) => Did::Rolled,
    }
}

/// The text of the mark of a machine whose link ended or began with the first of these lines. `None` if it has worked on
/// without its link, or if that is unknown.
fn restarted(lines: &[Entry]) -> Option<String> {
    let status = |entry: &Entry| Status::parse(&entry.text).filter(|_| entry.kind == Kind::Status);
    let has_restarted = match lines.iter().find_map(status) {
        Some(next) => next.mode != Mode::Work,
        None => lines.iter().any(|entry| entry.kind == Kind::Connected),
    };
    let before_status = lines.iter().take_while(|&entry| status(entry).is_none());
    let cause = before_status.filter_map(|entry| reset_cause(&entry.text)).last();
    let cause = cause.map_or(String::new(), |cause| format!(" ({cause})"));
    has_restarted.then(|| format!("restarted{cause} while at work: not weeded from here"))
}

fn reset_cause(line: &str) -> Option<&str> {
    let (_, rest) = line.split_once("reset by ")?;
    rest.split(|letter: char| !(letter.is_alphanumeric() || letter == '_')).next().filter(|cause| !cause.is_empty())
}
