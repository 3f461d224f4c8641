//! Replays a log: the firmware's decisions, repeated on the PC from the inputs in the log.
//!
//! A log holds the positions where the beam broke and cleared, position and speed ten times a second, the settings, the
//! examples, and the typed commands. From these [`replay`] rebuilds the machine's motion and the beam's edges, tick by
//! tick. [`control::weeder::Controller`] decides on them again. The replay compares its events with the log's: each
//! detection with its class and votes, each swing with its position, and each alarm.
//!
//! # Accuracy
//!
//! - A detection's edges are right to [`DETECTION_TICKS`]. The lead of a swing depends on the speed, which the log
//!   holds ten times a second. So a swing may differ by [`SWING_TICKS`], and by the distance that the machine travels
//!   in [`SWING_MS`]: 17 mm at 2.5 km/h. The speed also decides whether the gap between two zones is long enough to
//!   swing in. So the log is replayed at three paces: even, and as slow and as fast as the log allows. At the slow pace
//!   detections end [`DETECTION_TICKS`] earlier, and at the fast pace later. A swing differs only if no pace reproduces
//!   it. Swings into a gap and out again that the log lacks differ only if no pace lacks them.
//! - The votes of a detection depend on the speed class, which the line does not tell. Votes agree if any possible
//!   speed class gives them. Detections from before the start of the log are taken as logged.
//! - The log does not hold the position of a change of state. The next swing shows the change, and its position is not
//!   compared. Without a swing the tool was already out, and the statuses before and after the change suffice. The time
//!   of a typed command is not exact: a busy PC records it late.
//! - An alarm from the encoder, the beam, the end switch or the stack depends on inputs that the log lacks. The replay
//!   raises it at its logged position.
//! - If a log begins on ground that was already seen, the tool's swings there are not compared. With
//!   `guard_spacing_mm` none is compared until a `start` forgets the ground.
//! - A refused command is left out, because it had no effect.
//! - A replay ends at a bench command (`servo`, `calibrate`, `test`), where examples were forgotten, or where a second
//!   beam was set. A log of a machine with a second beam is not replayed.

mod classifier;
mod compare;
mod player;
mod stretch;

use self::compare::{Bounds, Heard, compare};
use self::player::{Pace, Player};
use self::stretch::{Happened, Stretch};
use super::log::{Entry, Kind};
use control::say::command::Action;
use link::EventLine;
use link::settings::{self, Setting};
use std::fmt;
use thiserror::Error;

/// Tolerance of a detection's position and width, in ticks.
pub const DETECTION_TICKS: i32 = 3;

/// Tolerance of a swing's position, in ticks: 6 mm at the default wheel. [`SWING_MS`] adds to it.
pub const SWING_TICKS: i32 = 12;

/// Tolerance of a swing's position, as the machine's travel in this time, in milliseconds.
pub const SWING_MS: i32 = 25;

/// Why a log cannot be replayed.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum ReplayError {
    #[error(
        "the log has no machine in it: `weeder record` and `weeder monitor --log` write one with its settings and status"
    )]
    Nothing,
    #[error("line {line} of the log: {problem}")]
    Line { line: u64, problem: String },
}

/// A difference between log and replay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The log's line, if it has one.
    pub line: Option<u64>,
    /// The log's value.
    pub logged: String,
    /// The replay's value.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let line = self.line.map_or_else(String::new, |line| format!("line {line}: "));
        write!(formatter, "{line}the log has {}, the replay {}", self.logged, self.replayed)
    }
}

/// The result of a replay.
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
    /// The first difference.
    pub difference: Option<Difference>,
    /// Notes on skipped parts, with the reasons.
    pub notes: Vec<String>,
}

/// Replays a log.
///
/// # Errors
/// If it holds no machine, or a line says what cannot be.
pub fn replay(log: &[Entry]) -> Result<Replayed, ReplayError> {
    replay_with(log, |_| {})
}

/// As [`replay`]. Calls `tell` with the progress, from 0 to 1, a hundred times at most.
///
/// # Errors
/// As [`replay`].
pub fn replay_with(log: &[Entry], mut tell: impl FnMut(f64)) -> Result<Replayed, ReplayError> {
    // Replayed lines, of the total at all paces.
    let (mut done, all) = (0, Pace::ALL.len() * log.len());
    let mut advance = || {
        let before = 100 * done / all;
        done += 1;
        if before < 100 * done / all {
            tell(done as f64 / all as f64);
        }
    };
    let mut replayed = Replayed::default();
    let mut stretches = 0;
    let mut rest = log;
    while let Some(start) = rest.iter().position(|entry| entry.kind == Kind::Connected) {
        let version = &rest[start].text;
        let note = format!("the log's firmware {version} is not this version, and may decide otherwise");
        if settings::other_version(version, &[]).is_some() && !replayed.notes.contains(&note) {
            replayed.notes.push(note);
        }
        rest = &rest[start + 1..];
        let end =
            rest.iter().position(|entry| matches!(entry.kind, Kind::Connected | Kind::Lost)).unwrap_or(rest.len());
        if let Some(stretch) = Stretch::read(&rest[..end])? {
            stretches += 1;
            replay_stretch(&stretch, &mut replayed, &mut advance)?;
        }
        rest = &rest[end..];
    }
    if stretches == 0 { Err(ReplayError::Nothing) } else { Ok(replayed) }
}

/// The result of a stretch at one pace.
struct Played {
    logged: Vec<Heard>,
    replayed: Vec<Heard>,
    /// Notes on skipped parts, with the reasons.
    notes: Vec<String>,
    /// The last position.
    end: i32,
}

fn replay_stretch(stretch: &Stretch, replayed: &mut Replayed, advance: &mut impl FnMut()) -> Result<(), ReplayError> {
    replayed.notes.extend_from_slice(&stretch.notes);
    if stretch.settings.get(Setting::SecondBeamMm) > 0 {
        replayed.notes.push("a machine with a second beam is not replayed: the log lacks its edges".to_owned());
        return Ok(());
    }
    let compared_from = stretch.compared_from();
    if compared_from > i32::MIN {
        let before = if compared_from < i32::MAX { format!(" before pos={compared_from}") } else { String::new() };
        replayed.notes.push(format!("the log begins with ground already seen: swings{before} are not compared"));
    }

    let played = Pace::ALL.into_iter().map(|pace| play(stretch, pace, advance)).collect::<Result<Vec<_>, _>>()?;
    let heard: Vec<&[Heard]> = played.iter().map(|played| played.replayed.as_slice()).collect();
    // The logged values are the same at every pace.
    let Played { logged, notes, end, .. } = &played[0];
    let [widest, gap] = [Setting::MaxWidthMm, Setting::MergeGapMm].map(|setting| stretch.settings.ticks(setting).0);
    let bounds = Bounds { first: stretch.first.position, compared_from, end: *end, untold: widest + gap };
    compare(logged, &heard, &bounds, replayed);
    replayed.notes.extend_from_slice(notes);
    Ok(())
}

/// Replays a stretch at one pace. Calls `advance` for each line.
fn play(stretch: &Stretch, pace: Pace, advance: &mut impl FnMut()) -> Result<Played, ReplayError> {
    let mut player = Player::new(stretch, pace);
    let mut logged: Vec<Heard> = Vec::new();
    // The PC's time when the machine was at its present position.
    let mut last_ms = stretch.happened.first().map_or(0, |(entry, _)| entry.time_ms);
    let mut notes = Vec::new();
    // Whether the next start treats unseen ground as bare.
    let mut starts_now = false;
    for (place, (entry, happened)) in stretch.happened.iter().enumerate() {
        advance();
        match happened {
            Happened::Status(status) => {
                if !player.roll(status, entry.time_ms.saturating_sub(last_ms)) {
                    let problem = "the machine cannot have rolled so far since the status before".to_owned();
                    return Err(ReplayError::Line { line: entry.number, problem });
                }
                last_ms = entry.time_ms;
            }
            Happened::Event(event) => {
                let mut is_given = false;
                let next = stretch.next_status(place);
                let at = match event {
                    // A log may end behind any line.
                    EventLine::Swing { position, .. } if next.is_none() => Some(*position),
                    _ => stretch.position_of_change(place, player.settings()),
                };
                if let Some(at) = at {
                    player.roll_to(at, next);
                }
                match event {
                    EventLine::State { mode } => player.enter(*mode, std::mem::take(&mut starts_now)),
                    EventLine::Alarm { .. } => is_given = player.raise(),
                    EventLine::Swing { .. } => is_given = stretch.follows_change(place),
                    _ => {}
                }
                logged.push(Heard { line: entry.number, steps: 0, event: *event, speed: player.speed(), is_given });
            }
            Happened::Command(None) => {}
            Happened::Command(Some(command)) => {
                // The status that shows the new state must come nearer to the command.
                if stretch.is_reported_by_event(place) {
                    starts_now |= command.action == Action::StartNow;
                    continue;
                }
                if let Some(at) = stretch.position_of_command((player.position(), last_ms), place, player.settings()) {
                    player.roll_to(at, stretch.next_status(place));
                    last_ms = entry.time_ms;
                }
                if !player.command(command) {
                    notes.push(format!("line {}: not replayed from `{}` on", entry.number, entry.text));
                    break;
                }
            }
        }
    }
    let end = player.position();
    Ok(Played { logged, replayed: player.heard, notes, end })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The log of a machine that rolls at half a metre a second over bare ground, with a status ten times a second. These
    /// typed lines, answers and events come after the status of their number.
    fn log(happens: &[(u64, Kind, &str)]) -> Vec<Entry> {
        let mut lines = vec![(0, Kind::Connected, "0.2.0".to_owned())];
        for status in 0..30 {
            let (time_ms, position) = (100 * status, status as i64 * 95);
            let unseen_mm = 450_u64.saturating_sub(50 * status);
            let line = format!("state=hold tool=out pos={position} speed_mm_s=500 windows=0 unseen_mm={unseen_mm}");
            lines.push((time_ms, Kind::Status, line));
            let here = happens.iter().filter(|(number, ..)| *number == status);
            lines.extend(here.map(|&(_, kind, line)| (time_ms + 1, kind, line.to_owned())));
        }
        let entry = |(place, (time_ms, kind, text))| Entry { number: place as u64 + 2, time_ms, kind, text };
        lines.into_iter().enumerate().map(entry).collect()
    }

    #[test]
    fn a_command_that_the_firmware_refused_is_not_carried_out() {
        let refused = "error: an alarm is latched, look after it and clear it first";
        let start = |end| replay(&log(&[(2, Kind::Command, "start"), (2, Kind::Answer, end)])).unwrap();
        let replayed = start(refused);
        assert_eq!((replayed.difference, replayed.swings), (None, 0));

        // If the same start was accepted, the tool swings into the row.
        let difference = start("ok").difference.expect("the log has no swing");
        assert!(difference.replayed.contains("swing tool=in"), "{difference}");
    }

    #[test]
    fn unseen_ground_gives_the_start_of_work_between_statuses() {
        // Half of a stem zone is unseen too.
        for (zone, half_mm, swing) in [("set stem_zone_mm 0", 0, 1300), ("set stem_zone_mm 110", 55, 1405)] {
            let swing = format!("swing tool=in pos={swing}");
            let happens = [
                (1, Kind::Command, "set margin_mm 22"),
                (1, Kind::Answer, "ok"),
                (1, Kind::Command, "set top_speed_mm_s 1000"),
                (1, Kind::Answer, "ok"),
                (1, Kind::Command, zone),
                (1, Kind::Answer, "ok"),
                (5, Kind::Event, "state is=work"),
                (if half_mm == 0 { 14 } else { 15 }, Kind::Event, &swing),
            ];
            let mut log = log(&happens);
            // It began 30 mm behind the fifth status: X and the margin ahead are unseen there.
            let statuses = log.iter_mut().filter(|entry| entry.kind == Kind::Status).enumerate().skip(6);
            for (number, entry) in statuses {
                let (before, _) = entry.text.split_once("unseen_mm").unwrap();
                let unseen_mm = (422 + half_mm + 30 + 250_usize).saturating_sub(50 * number);
                entry.text = format!("{before}unseen_mm={unseen_mm}");
            }
            let replayed = replay(&log).unwrap();
            assert_eq!((replayed.difference, replayed.swings), (None, 1), "{zone}");
            assert!(replayed.farthest_swing <= 4, "{} ticks", replayed.farthest_swing);
        }
    }

    /// The log of a machine that is at work from before the first status on.
    fn log_at_work(happens: &[(u64, Kind, &str)], status: impl Fn(usize) -> String) -> Vec<Entry> {
        let mut log = log(happens);
        for (number, entry) in log.iter_mut().filter(|entry| entry.kind == Kind::Status).enumerate() {
            entry.text = format!("state=work pos={} speed_mm_s=500 {}", 95 * number, status(number));
        }
        log
    }

    #[test]
    fn work_that_began_before_the_log_began_where_the_unseen_ground_says() {
        // Work began at 28 ticks. The log begins with the tool out, or between the swing and its line.
        let log = log_at_work(&[(9, Kind::Event, "swing tool=in pos=846")], |number| {
            let tool = if number < 9 { "out" } else { "in" };
            format!("tool={tool} windows=0 unseen_mm={}", 468_usize.saturating_sub(50 * number))
        });
        for (first, swings) in [(4, 1), (8, 1), (9, 0)] {
            let replayed = replay(&[&log[..1], &log[1 + first..]].concat()).unwrap();
            assert_eq!((replayed.difference, replayed.swings), (None, swings), "from status {first}");
        }
    }

    #[test]
    fn swings_for_earlier_plants_are_not_compared_until_a_start() {
        for (guard_spacing_mm, starts_at, zones, is_compared) in
            [(0, 30, 0, true), (500, 30, 0, false), (500, 9, 0, true), (500, 9, 1, false)]
        {
            let mut log = log_at_work(&[(11, Kind::Event, "swing tool=out pos=1050")], |number| {
                format!("tool=in windows={zones} unseen_mm={}", if number == starts_at { 450 } else { 0 })
            });
            let text = format!("guard_spacing_mm={guard_spacing_mm}");
            log.insert(1, Entry { number: 2, time_ms: 0, kind: Kind::Setting, text });
            let replayed = replay(&log).unwrap();
            assert_eq!(replayed.difference.is_some(), is_compared, "{guard_spacing_mm} {starts_at} {zones}");
        }
    }

    #[test]
    fn an_expected_plant_classified_a_little_off_is_no_difference() {
        // The tool goes out for the expected plant, or later for the plant itself.
        for (plant, out, back) in [(1177, 1498, 2275), (1187, 1635, 2285)] {
            let rest = "delay=669 hold=467 actuation=1136";
            let second = format!("unknown pos={plant} votes=0 spacing={} {rest}", plant - 100);
            let mut log = log(&[
                (0, Kind::Event, "state is=work"),
                (4, Kind::Event, &format!("unknown pos=100 votes=0 spacing=100 {rest}")),
                (12, Kind::Event, "swing tool=in pos=1199"),
                (15, Kind::Event, &second),
                (out / 95, Kind::Event, &format!("swing tool=out pos={out}")),
                (24, Kind::Event, &format!("swing tool=in pos={back}")),
            ]);
            for setting in ["guard_spacing_mm=500", "top_speed_mm_s=1000", "stem_zone_mm=90"] {
                log.insert(1, Entry { number: 2, time_ms: 0, kind: Kind::Setting, text: setting.to_owned() });
            }
            let replayed = replay(&log).unwrap();
            assert_eq!((replayed.difference, replayed.objects, replayed.swings), (None, 2, 3), "{plant}");
        }
    }

    #[test]
    fn where_a_second_beam_sees_more_than_the_log_holds_nothing_is_replayed() {
        let set = log(&[(2, Kind::Command, "set second_beam_mm 200"), (2, Kind::Answer, "ok")]);
        assert_eq!(replay(&set).unwrap().notes, ["line 6: not replayed from `set second_beam_mm 200` on"]);
        let setting = "second_beam_mm=200 mm from 0 to 900, default 0, saved 0";
        let mut has_one = log(&[]);
        has_one.insert(1, Entry { number: 2, time_ms: 0, kind: Kind::Setting, text: setting.to_owned() });
        assert_eq!(replay(&has_one).unwrap().notes.len(), 1);
    }

    #[test]
    fn unknown_events_and_settings_are_left_out_and_named() {
        let mut entries = log(&[
            (2, Kind::Event, "tilt deg=4 pos=9"),
            (2, Kind::Event, "alarm code=9-1 name=boredom pos=9"),
            (3, Kind::Event, "tilt deg=5 pos=9"),
            (3, Kind::Example, "tilt deg=5"),
        ]);
        entries.insert(1, Entry { number: 2, time_ms: 0, kind: Kind::Setting, text: "tilt_deg=7".to_owned() });
        let replayed = replay(&entries).unwrap();
        assert_eq!(replayed.difference, None);
        let left_out = |what: &str| format!("the {what}, which this version does not know, is left out");
        assert_eq!(replayed.notes, ["setting `tilt_deg`", "event `tilt`", "event `alarm`"].map(left_out));
        // A known setting with another value is another machine.
        entries[1].text = "wheel_mm=900".to_owned();
        let error = replay(&entries).unwrap_err().to_string();
        assert!(error.contains("`wheel_mm=900` is out of the range of this version"), "{error}");
    }

    #[test]
    fn a_replay_ends_at_a_command_that_it_cannot_execute() {
        for (line, notes) in
            [("TEST row 500", vec!["line 6: not replayed from `TEST row 500` on"]), ("test \u{1b}[2J", vec![])]
        {
            assert_eq!(replay(&log(&[(2, Kind::Command, line)])).unwrap().notes, notes);
        }
    }

    #[test]
    fn answers_belong_to_commands_in_their_order() {
        // `hold` does not wait for the previous answer.
        let hold = (2, Kind::Command, "hold");
        let answers = [(3, Kind::Answer, "error: settings contradict"), (3, Kind::Answer, "ok")];
        let start = (2, Kind::Command, "start");
        assert_eq!(replay(&log(&[start, hold, answers[0], answers[1]])).unwrap().difference, None, "refused");
        // The other lines wait for it: of the first one, the answer is missing.
        let difference =
            replay(&log(&[(2, Kind::Command, "status"), start, answers[1], answers[1]])).unwrap().difference;
        let difference = difference.expect("the start was taken");
        assert!(difference.replayed.contains("swing tool=in"), "{difference}");
    }
}
