//! A log replayed: the firmware's own decisions on the host, given what the log says that the machine met.
//!
//! A log holds where the beam broke and cleared, place and speed ten times a second, the settings, the examples and what was
//! typed. From these [`replay`] rebuilds the machine's way and the beam's edges, tick by tick, has
//! [`control::weeder::Controller`] decide anew, and compares what it tells with what the log tells: each object with its
//! class and votes, each swing with its place, each alarm.
//!
//! # How near it is
//!
//! - An object's edges are right to [`OBJECT_TICKS`]. A swing leads by the speed, and the log has that only now and then: it may
//!   differ by [`SWING_TICKS`], and by [`SWING_MS`] of the machine's way, which at 2.5 km/h is another 17 mm. Whether the ground between
//!   two windows is long enough to come into the row rests on the speed too. So all is replayed at three paces, as even, as slow and
//!   as fast as the log allows, and a swing differs where none of them has it like the log.
//! - An object's vote rests on the speed class, which the line does not tell: it is the same where one of the classes that the machine
//!   may have been in gives it. What was seen before the log began is believed.
//! - Where the state changed is not in the log. The swing that follows says it, and is not judged by its place. Without one the tool was
//!   out already, and the statuses around it say enough. The time at which a command was typed does not: a busy host is late.
//! - An alarm that encoder, beam, end switch or stack gave rests on what the log does not hold. It is raised where the log has it.
//! - Where a log begins with ground already seen, what the tool did there is not judged.
//! - A command that the firmware refused is left out, as it did nothing there.
//! - A replay ends where the bench was used (`servo`, `calibrate`, `test`), examples were forgotten, or a second beam was set. A log of
//!   a machine that has one already is not replayed.

mod compare;
mod judge;
mod player;

use self::compare::{Bounds, Heard, compare};
use self::player::{Pace, Player};
use super::log::{Entry, Kind};
use super::settings::{Setting, Settings, shown};
use super::{EventLine, Mode, Said, Status};
use control::ground::class::label;
use control::ground::features;
use control::say::command::{self, Command};
use knn::Example;
use std::collections::VecDeque;
use std::fmt;
use thiserror::Error;

/// By how many ticks an object's place and width may differ.
pub const OBJECT_TICKS: i32 = 3;

/// By how many ticks a swing's place may differ, 6 mm at the default wheel, besides [`SWING_MS`].
pub const SWING_TICKS: i32 = 12;

/// By how much of the machine's way a swing's place may differ, in milliseconds.
pub const SWING_MS: i32 = 25;

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
    /// Alarms that both raised by themselves.
    pub alarms: usize,
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
    Event(EventLine),
    Command {
        line: &'a str,
        /// Whether the firmware answered by an error, and so did nothing.
        is_refused: bool,
    },
}

/// What came of a stretch at one pace.
struct Played {
    logged: Vec<Heard>,
    replayed: Vec<Heard>,
    /// What was left out, and why.
    notes: Vec<String>,
    /// The last place.
    end: i32,
}

/// A log from one start of the link to its end.
struct Stretch<'a> {
    settings: Settings,
    /// All examples, the built-in ones first, and how many those are.
    examples: Vec<Example<{ features::COUNT }>>,
    built_in: usize,
    first: Status,
    happened: Vec<(&'a Entry, Happened<'a>)>,
}

impl<'a> Stretch<'a> {
    /// Reads one; none where the machine said nothing.
    fn read(entries: &'a [Entry]) -> Result<Option<Self>, ReplayError> {
        let mut settings = Settings::new();
        let (mut examples, mut built_in) = (Vec::new(), 0);
        let mut happened = Vec::new();
        // Places in `happened` of the commands that are not answered yet. Answers come in their order.
        let mut unanswered = VecDeque::new();
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
                Kind::Example => {
                    examples.extend(example(&entry.text).map_err(|()| wrong("no example"))?);
                    built_in += usize::from(entry.text.starts_with("built_in "));
                }
                Kind::Status => {
                    let status = Status::parse(&entry.text).ok_or_else(|| wrong("no status"))?;
                    happened.push((entry, Happened::Status(status)));
                }
                Kind::Event => {
                    let event = EventLine::parse(&entry.text).ok_or_else(|| wrong("no event"))?;
                    happened.push((entry, Happened::Event(event)));
                }
                Kind::Command => {
                    unanswered.push_back(happened.len());
                    happened.push((entry, Happened::Command { line: &entry.text, is_refused: false }));
                }
                Kind::Answer => {
                    let Some(is_error) = end_of_answer(&entry.text) else { continue };
                    let place = unanswered.pop_front();
                    if let Some((_, Happened::Command { is_refused, .. })) = place.map(|place| &mut happened[place]) {
                        *is_refused = is_error;
                    }
                }
                Kind::Connected | Kind::Lost => {}
                // Where the machine was on the earth changes nothing that it decides.
                Kind::Antenna | Kind::GpsFound | Kind::GpsLost | Kind::Gps | Kind::GpsDamaged | Kind::GpsMark => {}
            }
        }
        let first = happened.iter().find_map(|(_, happened)| match happened {
            Happened::Status(status) => Some(status.clone()),
            _ => None,
        });
        Ok(first.map(|first| Self { settings, examples, built_in, first, happened }))
    }

    fn replay(self, replayed: &mut Replayed) -> Result<(), ReplayError> {
        if self.settings.get(Setting::SecondBeamMm) > 0 {
            replayed
                .notes
                .push("a machine with a second beam is not replayed: the log does not hold what that saw".to_owned());
            return Ok(());
        }
        let judged_from = self.judged_from();
        if judged_from > i32::MIN {
            replayed.notes.push(format!(
                "the log begins with ground already seen: swings before pos={judged_from} are not judged"
            ));
        }

        let mut played = Vec::new();
        for pace in Pace::ALL {
            played.push(self.play(pace)?);
        }
        let heard: Vec<&[Heard]> = played.iter().map(|played| played.replayed.as_slice()).collect();
        // What the log says is the same at every pace.
        let Played { logged, notes, end, .. } = &played[0];
        let bounds = Bounds { first: self.first.position, judged_from, end: *end };
        compare(logged, &heard, &bounds, replayed);
        replayed.notes.extend_from_slice(notes);
        Ok(())
    }

    /// Has the decisions made anew at a pace.
    fn play(&self, pace: Pace) -> Result<Played, ReplayError> {
        let mut player = Player::new(self, pace);
        let mut logged: Vec<Heard> = Vec::new();
        let mut last = (self.first.clone(), self.happened.first().map_or(0, |(entry, _)| entry.time_ms));
        let mut notes = Vec::new();
        // Whether the start that is carried out next takes unseen ground for bare.
        let mut starts_now = false;
        for (place, (entry, happened)) in self.happened.iter().enumerate() {
            match happened {
                Happened::Status(status) => {
                    player.roll(&last.0, status, entry.time_ms.saturating_sub(last.1)).map_err(|()| {
                        let problem = "the machine cannot have come so far since the status before".to_owned();
                        ReplayError::Line { line: entry.number, problem }
                    })?;
                    last = (status.clone(), entry.time_ms);
                }
                Happened::Event(event) => {
                    let mut is_given = false;
                    if let Some(at) = self.place_of_change(place) {
                        player.roll_to(at, &last.0, self.next_status(place));
                        last.0.position = player.position();
                        last.0.speed_mm_s = player.speed_mm_s;
                    }
                    match event {
                        EventLine::State(mode) => player.enter(*mode, std::mem::take(&mut starts_now)),
                        EventLine::Alarm { .. } => is_given = player.raise(),
                        EventLine::Swing { .. } => is_given = self.follows_change(place),
                        _ => {}
                    }
                    logged.push(Heard {
                        line: entry.number,
                        steps: 0,
                        event: *event,
                        speed: player.speed().0,
                        is_given,
                    });
                }
                Happened::Command { is_refused: true, .. } => {}
                Happened::Command { line, .. } => {
                    // The line that tells of the new state comes nearer to where it was taken.
                    if self.is_told_by_state(place) {
                        starts_now = matches!(command::parse(line.as_bytes()), Ok(Command::Start { now: true }));
                        continue;
                    }
                    if let Some(at) = self.place_of_command(entry.time_ms, &last, place) {
                        player.roll_to(at, &last.0, self.next_status(place));
                        last.0.position = player.position();
                        last.0.speed_mm_s = player.speed_mm_s;
                        last.1 = entry.time_ms;
                    }
                    if !player.command(line) {
                        notes.push(format!("line {}: not replayed from `{line}` on", entry.number));
                        break;
                    }
                }
            }
        }
        Ok(Played { logged, replayed: player.heard, notes, end: last.0.position })
    }

    /// Where watching began, as far as the log tells. Where all ground up to the tool had been seen, the log does not: then it is
    /// where the log begins, or the beginning of what stood in the beam there.
    fn began(&self) -> i32 {
        let first = self.first.position;
        let beam_to_tool_mm = self.settings.get(Setting::BeamToToolMm);
        let unseen_mm = self.first.unseen_mm.clamp(0, beam_to_tool_mm.into()) as u16;
        if unseen_mm > 0 {
            return first.wrapping_sub(self.settings.wheel().ticks(beam_to_tool_mm - unseen_mm).0);
        }
        self.in_the_beam_at_first().map_or(first, |(from, _)| from)
    }

    /// The ground of the object that was in the beam when the log began.
    fn in_the_beam_at_first(&self) -> Option<(i32, i32)> {
        let widest = self.settings.ticks(Setting::MaxWidthMm).0;
        self.happened.iter().find_map(|(_, happened)| match happened {
            Happened::Event(EventLine::Object { position, hold, .. }) => {
                let before = self.first.position.wrapping_sub(*position);
                (0..=widest).contains(&before).then_some((*position, position.wrapping_add(*hold)))
            }
            _ => None,
        })
    }

    /// From where on the log tells all that the tool's swings rest on. A machine that has just started knows no window yet, and
    /// the ground that it has seen was bare.
    fn judged_from(&self) -> i32 {
        if self.first.unseen_mm > 0 && self.first.windows == 0 {
            return i32::MIN;
        }
        let first = self.first.position;
        // The hold has both margins.
        let behind = self.in_the_beam_at_first().map_or(0, |(_, to)| to.wrapping_sub(first).max(0));
        first.saturating_add(self.settings.ticks(Setting::BeamToToolMm).0).saturating_add(behind)
    }

    /// Where the machine was when a command was typed that changes no state: on its way to the next status, by the host's clock. `start
    /// now` at work lets the tool into the row where it swings in next.
    fn place_of_command(&self, time_ms: u64, last: &(Status, u64), place: usize) -> Option<i32> {
        if let Happened::Command { line, .. } = self.happened[place].1
            && matches!(command::parse(line.as_bytes()), Ok(Command::Start { now: true }))
            && let Some((position, true)) = self.happened[place..].iter().find_map(swing_or_status)
        {
            return Some(position);
        }
        let (entry, next) = self.happened[place..].iter().find_map(|(entry, happened)| match happened {
            Happened::Status(status) => Some((entry, status)),
            _ => None,
        })?;
        let whole_ms = entry.time_ms.checked_sub(last.1).filter(|&time_ms| time_ms > 0)?;
        let share = time_ms.saturating_sub(last.1).min(whole_ms) as f64 / whole_ms as f64;
        let way = f64::from(next.position.wrapping_sub(last.0.position)) * share;
        Some(last.0.position.wrapping_add(way as i32))
    }

    /// Where the state changed that an event tells of: an alarm has its own place, and the swing that follows has it. Where no swing
    /// follows, the tool was out already: work began as late, and was left as early as the log allows.
    fn place_of_change(&self, place: usize) -> Option<i32> {
        let mode = match &self.happened[place].1 {
            Happened::Event(EventLine::Alarm { position, .. }) => return Some(*position),
            Happened::Event(EventLine::State(mode)) => mode,
            _ => return None,
        };
        let is_state = |(_, happened): &&(_, _)| matches!(happened, Happened::Event(EventLine::State(_)));
        // Behind the next change of state, a swing is that one's.
        let mut until_next = self.happened[place + 1..].iter().take_while(|happened| !is_state(happened));
        match (until_next.find_map(swing_or_status), mode) {
            (Some((position, true)), _) | (Some((position, false)), Mode::Work) => Some(position),
            _ => self.happened[..place].iter().rev().find_map(swing_or_status).map(|(position, _)| position),
        }
    }

    /// Whether an event tells of the change of state that a command brought: it comes behind the answer, and no more than the status
    /// that was asked for before comes between.
    fn is_told_by_state(&self, place: usize) -> bool {
        let Happened::Command { line, .. } = self.happened[place].1 else { return false };
        let brings = match command::parse(line.as_bytes()) {
            Ok(Command::Start { .. }) => Mode::Work,
            Ok(Command::Hold | Command::Clear) => Mode::Hold,
            _ => return false,
        };
        let mut statuses = 0;
        let soon = self.happened[place + 1..].iter().take_while(|(_, happened)| {
            statuses += u8::from(matches!(happened, Happened::Status(_)));
            statuses < 2
        });
        let told = soon.into_iter().find_map(|(_, happened)| match happened {
            Happened::Event(EventLine::State(mode)) => Some(*mode),
            _ => None,
        });
        told == Some(brings)
    }

    /// Whether a swing belongs to a change of state that was told just before it.
    fn follows_change(&self, place: usize) -> bool {
        let before = self.happened[..place].iter().rev().map(|(_, happened)| happened);
        before
            .take_while(|happened| !matches!(happened, Happened::Status(_) | Happened::Event(EventLine::Swing { .. })))
            .any(|happened| matches!(happened, Happened::Event(EventLine::State(_))))
    }

    fn next_status(&self, place: usize) -> Option<&Status> {
        self.happened[place..].iter().find_map(|(_, happened)| match happened {
            Happened::Status(status) => Some(status),
            _ => None,
        })
    }
}

/// The place that a swing or a status tells, and whether it is a swing.
fn swing_or_status((_, happened): &(&Entry, Happened<'_>)) -> Option<(i32, bool)> {
    match happened {
        Happened::Event(EventLine::Swing { position, .. }) => Some((*position, true)),
        Happened::Status(status) => Some((status.position, false)),
        _ => None,
    }
}

/// Whether a line that ends an answer is an error; none where it ends none.
fn end_of_answer(line: &str) -> Option<bool> {
    match Said::parse(line) {
        Said::Done => Some(false),
        Said::Refused(_) => Some(true),
        _ => None,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// The log of a machine that rolls at half a metre a second over bare ground. At each of the statuses, ten a second, something
    /// is typed and answered, or told.
    fn log(statuses: u64, happens: impl Fn(u64) -> Vec<(Kind, &'static str)>) -> Vec<Entry> {
        let mut lines = vec![(0, Kind::Connected, "0.1.0".to_owned())];
        for status in 0..statuses {
            let (time_ms, position) = (100 * status, status as i64 * 95);
            let unseen_mm = 400_u64.saturating_sub(50 * status);
            let line = format!("state=hold tool=out pos={position} speed_mm_s=500 windows=0 unseen_mm={unseen_mm}");
            lines.push((time_ms, Kind::Status, line));
            lines.extend(happens(status).into_iter().map(|(kind, line)| (time_ms + 1, kind, line.to_owned())));
        }
        let entry = |(place, (time_ms, kind, text))| Entry { number: place as u64 + 2, time_ms, kind, text };
        lines.into_iter().enumerate().map(entry).collect()
    }

    #[test]
    fn a_command_that_the_firmware_refused_is_not_carried_out() {
        let refused = "error: an alarm is latched, look after it and clear it first";
        let start = |end: &'static str| vec![(Kind::Command, "start"), (Kind::Answer, end)];
        let never = log(20, |status| if status == 2 { start(refused) } else { Vec::new() });
        let replayed = replay(&never).unwrap();
        assert_eq!((replayed.difference, replayed.swings), (None, 0));

        // The same start where it was taken has the tool come into the row.
        let taken = log(20, |status| if status == 2 { start("ok") } else { Vec::new() });
        let difference = replay(&taken).unwrap().difference.expect("the log has no swing");
        assert!(difference.replayed.contains("swing tool=in"), "{difference}");
    }

    #[test]
    fn where_a_second_beam_sees_more_than_the_log_holds_nothing_is_replayed() {
        let set = |status| {
            if status == 2 { vec![(Kind::Command, "set second_beam_mm 200"), (Kind::Answer, "ok")] } else { Vec::new() }
        };
        assert_eq!(replay(&log(20, set)).unwrap().notes, ["line 6: not replayed from `set second_beam_mm 200` on"]);
        let setting = "second_beam_mm=200 mm from 0 to 900, default 0, saved 0";
        let mut has_one = log(20, |_| Vec::new());
        has_one.insert(1, Entry { number: 2, time_ms: 0, kind: Kind::Setting, text: setting.to_owned() });
        assert_eq!(replay(&has_one).unwrap().notes.len(), 1);
    }

    #[test]
    fn answers_belong_to_commands_in_their_order() {
        // `hold` does not wait for the answer before it.
        let log = log(20, |status| match status {
            2 => vec![(Kind::Command, "set margin_mm 9999"), (Kind::Command, "start")],
            3 => vec![(Kind::Answer, "error: margin_mm takes a whole number from 0 to 200"), (Kind::Answer, "ok")],
            _ => Vec::new(),
        });
        let difference = replay(&log).unwrap().difference.expect("the start was taken");
        assert!(difference.replayed.contains("swing tool=in"), "{difference}");
    }
}
