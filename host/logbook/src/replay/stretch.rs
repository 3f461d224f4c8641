//! A stretch of a log, from one start of the link to its end: its lines in order, and the machine's positions that
//! follow from them.

use super::{DETECTION_TICKS, ReplayError};
use crate::log::{Entry, Kind};
use control::say::command::{Action, Command};
use files::in_a_line;
use link::examples::{Taught, taught};
use link::session::HOLD;
use link::settings::{Setting, Settings, shown};
use link::{ConsoleLine, EventLine, Mode, Status};
use std::collections::VecDeque;

/// The content of a log line.
pub(super) enum Happened {
    Status(Status),
    Event(EventLine),
    /// A typed line; `None` if the firmware has refused it, or would: then it had no effect.
    Command(Option<Command>),
}

/// A log from one start of the link to its end.
pub(super) struct Stretch<'a> {
    pub(super) settings: Settings,
    pub(super) built_in: Vec<Taught>,
    /// The examples that were taught.
    pub(super) field: Vec<Taught>,
    /// The first of its statuses.
    pub(super) first: Status,
    pub(super) happened: Vec<(&'a Entry, Happened)>,
    /// Notes on lines that only a newer version knows.
    pub(super) notes: Vec<String>,
}

impl<'a> Stretch<'a> {
    /// Reads a stretch. `None` if the machine sent nothing.
    pub(super) fn read(entries: &'a [Entry]) -> Result<Option<Self>, ReplayError> {
        let mut settings = Settings::new();
        let (mut built_in, mut field) = (Vec::new(), Vec::new());
        let mut happened = Vec::new();
        let mut notes: Vec<String> = Vec::new();
        let mut skip = |entry: &Entry, what: &str| {
            let name = entry.text.split([' ', '=']).next().unwrap_or_default();
            let note = format!("{what} `{}`, which this version does not know, is left out", in_a_line(name));
            if !notes.contains(&note) {
                notes.push(note);
            }
        };
        let is_name = |text: &str| text.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_');
        // Indices in `happened` of commands without an answer so far. Answers come in the order of commands.
        let mut unanswered = VecDeque::new();
        for entry in entries {
            let wrong = |problem: &str| {
                let problem = format!("`{}` is {problem}", entry.text);
                ReplayError::Line { line: entry.number, problem }
            };
            match entry.kind {
                Kind::Setting => match shown(&entry.text) {
                    // With another value than the machine's, the decisions are others.
                    Some((setting, value)) => {
                        settings.set(setting, value).map_err(|_| wrong("out of the range of this version"))?;
                    }
                    None if entry.text.split('=').next().is_some_and(is_name) => skip(entry, "the setting"),
                    None => return Err(wrong("no setting")),
                },
                // The list may end with the number of damaged examples.
                Kind::Example if entry.text.starts_with("spoiled=") => {}
                Kind::Example => match (taught(&entry.text), EventLine::parse(&entry.text)) {
                    (Some((true, _, example)), _) => field.push(example),
                    (Some((false, _, example)), _) => built_in.push(example),
                    (None, Some(EventLine::Newer { .. })) => skip(entry, "the event"),
                    _ => return Err(wrong("no example")),
                },
                Kind::Status => {
                    let status = Status::parse(&entry.text).ok_or_else(|| wrong("no status"))?;
                    happened.push((entry, Happened::Status(status)));
                }
                Kind::Event => match EventLine::parse(&entry.text).ok_or_else(|| wrong("no event"))? {
                    EventLine::Newer { .. } => skip(entry, "the event"),
                    event => happened.push((entry, Happened::Event(event))),
                },
                Kind::Command => {
                    if entry.text != HOLD {
                        // It is typed after the answers before it: this log lacks them.
                        unanswered.clear();
                    }
                    unanswered.push_back(happened.len());
                    happened.push((entry, Happened::Command(link::command(&entry.text).ok())));
                }
                Kind::Answer => {
                    let ConsoleLine::End { error } = ConsoleLine::parse(&entry.text) else { continue };
                    if let (Some(place), Some(_)) = (unanswered.pop_front(), error) {
                        happened[place].1 = Happened::Command(None);
                    }
                }
                Kind::Connected | Kind::Started | Kind::Lost => {}
                // Satellite positions have no effect on the machine's decisions.
                Kind::Antenna | Kind::GpsFound | Kind::GpsLost | Kind::Gps | Kind::GpsDamaged | Kind::GpsMark => {}
            }
        }
        let first = happened.iter().find_map(status).cloned();
        Ok(first.map(|first| Self { settings, built_in, field, first, happened, notes }))
    }

    /// The position from which the machine is replayed. If the log shows where watching began, it is that, or a little
    /// earlier if the machine has rolled since: a detection there is seen in full. Else it is the front of the first
    /// detection in the log that the machine had reached by then, and the gap that the firmware wants to see ahead of it.
    pub(super) fn began(&self) -> i32 {
        let first = self.first.position;
        // There the tool had all of this to go.
        let all_mm = unseen_at_begin_mm(&self.settings);
        let rolled = if self.first.unseen_mm > 0 {
            let unseen_mm = self.first.unseen_mm.min(all_mm.into()) as u16;
            if unseen_mm == all_mm {
                return first;
            }
            self.settings.wheel().ticks(all_mm - unseen_mm).0
        } else {
            let front = self.reached_at_first().map_or(first, |(front, _)| front);
            first.wrapping_sub(front).wrapping_add(self.settings.ticks(Setting::MergeGapMm).0)
        };
        first.wrapping_sub(rolled).wrapping_sub(DETECTION_TICKS + 1)
    }

    /// Front and end of the first detection in the log whose front the machine had reached when the log began.
    fn reached_at_first(&self) -> Option<(i32, i32)> {
        let widest = self.settings.ticks(Setting::MaxWidthMm).0;
        let margins = 2 * self.settings.ticks(Setting::MarginMm).0;
        self.happened.iter().find_map(|(_, happened)| match happened {
            Happened::Event(EventLine::Detection { position, hold, .. }) => {
                let before = self.first.position.wrapping_sub(*position);
                let end = position.wrapping_add(hold.wrapping_sub(margins));
                (0..=widest).contains(&before).then_some((*position, end))
            }
            _ => None,
        })
    }

    /// The first position from which the log has all inputs of the tool's swings; `i32::MAX` if it never has. A machine
    /// that has just started has no zones, and the ground that it has seen was bare. If its tool is already in the row,
    /// the line of that swing may still follow.
    pub(super) fn compared_from(&self) -> i32 {
        if self.first.unseen_mm > 0 && self.first.zones == 0 && self.first.tool_out {
            return i32::MIN;
        }
        let first = self.first.position;
        let reached = self.reached_at_first().map_or(0, |(_, end)| end.wrapping_sub(first).max(0));
        // The zone of the last canopy before.
        let zone = self.settings.wheel().ticks(unseen_at_begin_mm(&self.settings)).0;
        let from = first.saturating_add(reached).saturating_add(zone);
        if self.settings.get(Setting::GuardSpacingMm) == 0 {
            return from;
        }
        // The plant from which the machine counts is unknown until `start` forgets the ground.
        let begun = self.happened.iter().filter_map(status).find(|begun| begun.unseen_mm > 0 && begun.zones == 0);
        begun.map_or(i32::MAX, |begun| begun.position.max(from))
    }

    /// The machine's position at a typed command that changes no state: between its last position, with that time, and
    /// the next status, by the PC's clock. `start now` at work lets the tool into the row at its next swing in. `start` has the
    /// position at which work begins, with these `settings`.
    pub(super) fn position_of_command(&self, last: (i32, u64), place: usize, settings: &Settings) -> Option<i32> {
        if let (_, Happened::Command(Some(Command { action: Action::Start, .. }))) = self.happened[place]
            && let Some(begin) = self.begin_of_work(place, Some(last.0), settings)
        {
            return Some(begin);
        }
        if let (_, Happened::Command(Some(Command { action: Action::StartNow, .. }))) = self.happened[place]
            && let Some((position, true)) = self.happened[place..].iter().find_map(swing_or_status)
        {
            return Some(position);
        }
        let (entry, next) = self.happened[place..].iter().find_map(|told| Some((told.0, status(told)?)))?;
        let whole_ms = entry.time_ms.checked_sub(last.1).filter(|&time_ms| time_ms > 0)?;
        let share = self.happened[place].0.time_ms.saturating_sub(last.1).min(whole_ms) as f64 / whole_ms as f64;
        let distance = f64::from(next.position.wrapping_sub(last.0)) * share;
        Some(last.0.wrapping_add(distance as i32))
    }

    /// The position of a state change that an event reports. An alarm has its own position. Else the next swing has it.
    /// Without a swing the tool was already out: work then began as late, and ended as early, as the log allows. Or the
    /// log ends before the swing, which then came at its end. `settings` are those of the moment.
    pub(super) fn position_of_change(&self, place: usize, settings: &Settings) -> Option<i32> {
        let mode = match self.happened[place].1 {
            Happened::Event(EventLine::Alarm { position, .. }) => return Some(position),
            Happened::Event(EventLine::State { mode }) => mode,
            _ => return None,
        };
        let before = || self.happened[..place].iter().rev().find_map(swing_or_status).map(|(position, _)| position);
        let next_status = || {
            let mut until_next = self.happened[place + 1..].iter().take_while(|happened| !is_change(happened));
            Some(until_next.find_map(status)?.position)
        };
        // At most one status comes between the change and its swing.
        let is_cut = || self.happened[place..].iter().filter_map(status).nth(1).is_none() && !self.was_out(place);
        match self.swing_of_change(place) {
            Some((_, position)) => Some(position),
            None if mode == Mode::Work => {
                self.begin_of_work(place, before(), settings).or_else(next_status).or_else(before)
            }
            None if is_cut() => next_status().or_else(before),
            None => before(),
        }
    }

    /// Where work began after a position. It begins on unseen ground, and the next status says how much of that is left. `None` if the log does not tell.
    fn begin_of_work(&self, place: usize, before: Option<i32>, settings: &Settings) -> Option<i32> {
        let ends = |happened: &Happened| {
            matches!(happened, Happened::Event(EventLine::Alarm { .. } | EventLine::State { mode: Mode::Work }))
        };
        let mut until_next = self.happened[place + 1..].iter().take_while(|(_, happened)| !ends(happened));
        let next = until_next.find_map(status).filter(|next| next.unseen_mm > 0)?;
        let left_mm = u16::try_from(i32::from(unseen_at_begin_mm(settings)) - next.unseen_mm).unwrap_or(0);
        let most = next.position.wrapping_sub(before?).max(0);
        Some(next.position.wrapping_sub(settings.wheel().ticks(left_mm).0.min(most)))
    }

    /// The index and the position of the swing that a change of state brings. A status that was asked for before may come
    /// between them, and shows the tool where the swing puts it. `None` if the tool was there already.
    fn swing_of_change(&self, place: usize) -> Option<(usize, i32)> {
        let mut between = None;
        for (index, (_, happened)) in self.happened.iter().enumerate().skip(place + 1) {
            match happened {
                Happened::Event(EventLine::Swing { out, position }) => {
                    return between.is_none_or(|tool_out| tool_out == *out).then_some((index, *position));
                }
                // A swing after the next change of state belongs to that change.
                Happened::Event(EventLine::State { .. }) => return None,
                Happened::Status(status) if between.is_none() => between = Some(status.tool_out),
                Happened::Status(_) => return None,
                _ => {}
            }
        }
        None
    }

    /// Whether the tool was out of the row before an index, as far as the log tells.
    fn was_out(&self, place: usize) -> bool {
        let told = self.happened[..place].iter().rev().find_map(|(_, happened)| match happened {
            Happened::Event(EventLine::Swing { out, .. }) => Some(*out),
            Happened::Status(status) => Some(status.tool_out),
            _ => None,
        });
        told.unwrap_or(true)
    }

    /// Whether an event reports the change of state by a command. It comes after the answer, with at most one earlier
    /// requested status between them. At the end of a log it may be missing.
    pub(super) fn is_reported_by_event(&self, place: usize) -> bool {
        let Happened::Command(Some(command)) = self.happened[place].1 else { return false };
        let brings = match command.action {
            Action::Start | Action::StartNow => Mode::Work,
            Action::Hold | Action::Clear => Mode::Hold,
            _ => return false,
        };
        let mut statuses = 0;
        for (_, happened) in &self.happened[place + 1..] {
            match happened {
                Happened::Event(EventLine::State { mode }) => return *mode == brings,
                Happened::Status(_) if statuses == 1 => return false,
                Happened::Status(_) => statuses += 1,
                _ => {}
            }
        }
        true
    }

    /// Whether a swing belongs to a change of state before it.
    pub(super) fn follows_change(&self, place: usize) -> bool {
        // A swing between them is the one of the change.
        let ends =
            |told: &(&Entry, Happened)| is_change(told) || swing_or_status(told).is_some_and(|(_, is_swing)| is_swing);
        let change = self.happened[..place].iter().rposition(ends).filter(|&at| is_change(&self.happened[at]));
        change.and_then(|change| self.swing_of_change(change)).is_some_and(|(index, _)| index == place)
    }

    pub(super) fn next_status(&self, place: usize) -> Option<&Status> {
        self.happened[place..].iter().find_map(status)
    }
}

/// Ground that is unseen where work begins, mm: from the tool to the beam, and ahead of it the margin and half of a stem
/// zone.
fn unseen_at_begin_mm(settings: &Settings) -> u16 {
    let [to_beam_mm, margin_mm, zone_mm] =
        [Setting::BeamToToolMm, Setting::MarginMm, Setting::StemZoneMm].map(|setting| settings.get(setting));
    to_beam_mm + margin_mm + zone_mm / 2
}

fn is_change((_, happened): &(&Entry, Happened)) -> bool {
    matches!(happened, Happened::Event(EventLine::State { .. }))
}

/// The position in a swing or a status, and whether it is a swing.
fn swing_or_status((_, happened): &(&Entry, Happened)) -> Option<(i32, bool)> {
    match happened {
        Happened::Event(EventLine::Swing { position, .. }) => Some((*position, true)),
        Happened::Status(status) => Some((status.position, false)),
        _ => None,
    }
}

fn status<'a>((_, happened): &'a (&Entry, Happened)) -> Option<&'a Status> {
    if let Happened::Status(status) = happened { Some(status) } else { None }
}
