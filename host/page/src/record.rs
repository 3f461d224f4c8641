//! A log for the page: the row that the machine has reported, drawn on the ground, and its replay.
//!
//! A day's log is 100 MB, so it is read in pieces: [`begin`], then [`take`] for each piece, and then a question about
//! it. [`picture`] needs each line once, so no line is kept for it.
//!
//! Distances are millimetres of the tool's travel since the start of the log, by the wheel. After a reset, or for
//! another machine, the ground continues one metre farther. An event without a position has that of the line before. Over
//! a gap of the statuses the work is unknown, and the tool is not drawn in the row.
//!
//! After `revert` the settings can be missing ([`logbook::follower`]): a log of an earlier version has them only if `save`
//! was typed before. Then the picture stops, and says when. It goes on where `get` has shown the values, or at the next
//! connection.

use gps::job::{Job, Wanted};
use gps::picture::{Words, draw};
use link::settings::Setting;
use link::{Class, EventLine, Mode, Values};
use logbook::follower::{Followed, Follower, is_gap};
use logbook::log::{Entry, Kind};
use logbook::pieces::Pieces;
use logbook::replay;
use serde_json::{Value, json};
use std::cell::RefCell;
use std::path::Path;

/// Distance between two stored speeds, and the time after a status in which others are skipped.
const SPEED_MM: f64 = 250.0;
const SPEED_MS: u64 = 300;

/// Ground between two stretches of a log.
const APART_MM: f64 = 1000.0;

/// The picture of a log, in the form of `page/src/record/picture.ts`.
#[derive(Default)]
struct Picture {
    follower: Follower,
    /// Where the ground of the stretch begins, time and position of its last status, and the farthest position so far.
    start_mm: f64,
    here: Option<(u64, f64)>,
    end_mm: f64,
    /// Position and state of the last stored speed of the stretch.
    shown: Option<(f64, Mode)>,
    /// Whether nothing is drawn, because settings are unknown; and the times at which that began.
    is_stopped: bool,
    unknown_ms: Vec<u64>,
    /// The time of all sessions of the log so far, and of those before the present one.
    time_ms: u64,
    before_ms: u64,
    swings: usize,
    /// The tool's positions, each with whether it is out from there on.
    changes: Vec<(f64, bool)>,
    /// Those before the last status.
    known: usize,
    has_places: bool,
    alarms: Vec<Value>,
    tables: [Vec<f64>; 3],
}

/// The tables of a picture. For each detection: its class (0 plant, 1 weed, 2 unknown), its canopy's ends and its
/// zone's ends in mm. For each speed: its position in mm, time in ms, and mm/s. The ends of each stretch with the tool
/// in the row, in mm.
const OBJECTS: usize = 0;
const SPEEDS: usize = 1;
const WORKED: usize = 2;

impl Picture {
    fn take(&mut self, entry: &Entry) {
        // In a continued log the time restarts at 0.
        if self.before_ms.saturating_add(entry.time_ms) < self.time_ms {
            self.before_ms = self.time_ms;
        }
        self.time_ms = self.before_ms.saturating_add(entry.time_ms);
        self.has_places |= entry.kind == Kind::Gps;
        let followed = self.follower.take(entry);
        let is_known = self.follower.knows_wheel() && self.follower.in_use().knows(&[Setting::BeamToToolMm]);
        match followed {
            Followed::Linked => self.end_stretch(),
            Followed::Status(..) | Followed::Event(_) if !is_known => {
                if !std::mem::replace(&mut self.is_stopped, true) {
                    self.unknown_ms.push(self.time_ms);
                    self.end_stretch();
                }
            }
            Followed::Status(status, goes_on) => {
                self.is_stopped = false;
                if !goes_on {
                    self.end_stretch();
                }
                let here_mm = self.tool_mm(status.position);
                self.leave_gap(here_mm);
                (self.here, self.known) = (Some((self.time_ms, here_mm)), self.changes.len());
                let is_near = |(mm, mode): (f64, Mode)| (here_mm - mm).abs() < SPEED_MM && mode == status.mode;
                if self.shown.is_some_and(is_near) {
                    return;
                }
                if self.shown.replace((here_mm, status.mode)).is_none() {
                    self.changes.push((here_mm, status.tool_out));
                }
                self.tables[SPEEDS].extend([here_mm, self.time_ms as f64, f64::from(status.speed_mm_s)]);
            }
            Followed::Event(event) => self.take_event(&event, &entry.text, self.time_ms),
            _ => {}
        }
    }

    /// The tool's position at a count.
    fn tool_mm(&mut self, position: i32) -> f64 {
        let tool_mm = self.start_mm + self.follower.mm(position).unwrap_or_default();
        self.end_mm = self.end_mm.max(tool_mm);
        tool_mm
    }

    /// Takes the tool out over a gap between the last status and one at this position.
    fn leave_gap(&mut self, to_mm: f64) {
        let Some((from_ms, from_mm)) = self.here else { return };
        if is_gap((self.time_ms - from_ms) as f64, (to_mm - from_mm) / 1000.0) {
            self.changes.truncate(self.known);
            self.changes.push((from_mm.min(to_mm), true));
            self.shown = None;
        }
    }

    /// Ends the ground of a wheel's counts. What follows begins farther on.
    fn end_stretch(&mut self) {
        if self.here.take().is_some() {
            self.changes.push((self.end_mm, true));
            self.end_mm += APART_MM;
        }
        (self.start_mm, self.shown) = (self.end_mm, None);
    }

    fn take_event(&mut self, event: &EventLine, line: &str, time_ms: u64) {
        let name = Values(line).text("name").unwrap_or_default();
        let trouble =
            |mm: f64, is_warning: bool| json!({ "name": name, "mm": mm, "timeMs": time_ms, "isWarning": is_warning });
        match *event {
            EventLine::Detection { class, position, delay, hold, .. } => {
                let from_mm =
                    self.tool_mm(position) + f64::from(self.follower.in_use().settings().get(Setting::BeamToToolMm));
                // The tool reaches the zone after this number of counts.
                let zone_mm = self.tool_mm(position.wrapping_add(delay));
                let zone_end_mm = zone_mm + f64::from(hold) * self.follower.tick_mm();
                let class = match class {
                    Class::Plant => 0.0,
                    Class::Weed => 1.0,
                    Class::Unknown => 2.0,
                };
                // A zone lies about its canopy's middle.
                let to_mm = zone_mm + zone_end_mm - from_mm;
                self.tables[OBJECTS].extend([class, from_mm, to_mm, zone_mm, zone_end_mm]);
            }
            EventLine::Swing { out, position } => {
                self.swings += 1;
                let mm = self.tool_mm(position);
                self.changes.push((mm, out));
            }
            EventLine::Alarm { position, .. } => {
                let mm = self.tool_mm(position);
                self.alarms.push(trouble(mm, false));
                self.changes.push((mm, true));
            }
            EventLine::Warning { .. } => {
                let mm = self.here.map_or(self.end_mm, |(_, mm)| mm);
                self.alarms.push(trouble(mm, true));
            }
            // An alarm puts the tool out, and a start may let it in: the swing reports it.
            _ => {}
        }
    }

    /// Adds the ground on which the tool was in the row: from a swing in to the next swing out, or to an alarm.
    fn worked(&mut self) {
        self.changes.sort_by(|(one, _), (other, _)| one.total_cmp(other));
        let mut start_mm = None;
        for (mm, out) in self.changes.drain(..) {
            if let (true, Some(start_mm)) = (out, start_mm.take_if(|_| out)) {
                self.tables[WORKED].extend([start_mm, mm]);
            } else if !out {
                start_mm.get_or_insert(mm);
            }
        }
        if let Some(start_mm) = start_mm {
            self.tables[WORKED].extend([start_mm, self.end_mm]);
        }
    }
}

/// The log that is read.
struct Log {
    pieces: Pieces,
    /// Why it is none.
    problem: Option<String>,
    /// Whether all lines are kept, for a replay. Otherwise most statuses are dropped.
    is_whole: bool,
    /// Time of the last kept status.
    kept_ms: Option<u64>,
    entries: Vec<Entry>,
    picture: Picture,
}

thread_local! {
    static LOG: RefCell<Log> = RefCell::new(Log::new(false));
    static JOBS: RefCell<Vec<Job>> = const { RefCell::new(Vec::new()) };
}

impl Log {
    fn new(is_whole: bool) -> Self {
        let pieces = Pieces::new(Path::new("log"));
        Self { pieces, problem: None, is_whole, kept_ms: None, entries: Vec::new(), picture: Picture::default() }
    }

    /// Takes the next bytes. `None` ends the log.
    fn take(&mut self, bytes: Option<&[u8]>) {
        if self.problem.is_some() {
            return;
        }
        let (is_whole, kept_ms) = (self.is_whole, &mut self.kept_ms);
        let is_wanted = |line: &str| is_whole || !is_near_another(line, kept_ms);
        let entries = match bytes {
            Some(bytes) => self.pieces.take(bytes, is_wanted),
            None => std::mem::replace(&mut self.pieces, Pieces::new(Path::new("log"))).end(is_wanted),
        };
        match entries {
            Ok(entries) if is_whole => self.entries.extend(entries),
            Ok(entries) => entries.iter().for_each(|entry| self.picture.take(entry)),
            Err(error) => self.problem = Some(error.to_string()),
        }
    }
}

/// Whether a line is a status soon after a kept one. A day has a million of them.
fn is_near_another(line: &str, kept_ms: &mut Option<u64>) -> bool {
    let Some((time_ms, rest)) = line.split_once(',') else { return false };
    if rest.starts_with("connected,") {
        *kept_ms = None;
    }
    let Some(time_ms) = time_ms.parse::<u64>().ok().filter(|_| rest.starts_with("status,")) else { return false };
    // In a continued log the time restarts at 0.
    if kept_ms.is_some_and(|kept_ms| (kept_ms..kept_ms + SPEED_MS).contains(&time_ms)) {
        return true;
    }
    *kept_ms = Some(time_ms);
    false
}

/// Begins another log. With `is_whole` it can be replayed, otherwise only shown.
pub fn begin(is_whole: bool) -> Value {
    LOG.set(Log::new(is_whole));
    Value::Null
}

/// Takes the next bytes of the log.
pub fn take(bytes: &[u8]) {
    LOG.with_borrow_mut(|log| log.take(Some(bytes)));
}

/// Ends the log. Returns the answer from it, or its error: `{"problem": "..."}`.
fn ended(answer: impl FnOnce(&mut Log) -> Result<Value, String>) -> Value {
    LOG.with_borrow_mut(|log| {
        log.take(None);
        let answer = log.problem.clone().map_or_else(|| answer(log), Err);
        answer.unwrap_or_else(|problem| json!({ "problem": problem }))
    })
}

/// The picture, or the error.
pub fn picture() -> Value {
    ended(|log| {
        log.picture.worked();
        let Picture { end_mm, unknown_ms, time_ms, swings, has_places, alarms, tables, .. } =
            std::mem::take(&mut log.picture);
        Ok(json!({
            "lengthMm": end_mm, "timeMs": time_ms, "swings": swings, "alarms": alarms, "hasPlaces": has_places,
            "unknownMs": unknown_ms, "tables": tables,
        }))
    })
}

/// The replay of the log by the decisions of these sources: how much agrees, and the first difference.
pub fn replayed(progress: impl FnMut(f64)) -> Value {
    ended(|log| {
        let replayed = replay::replay_with(&log.entries, progress).map_err(|error| error.to_string())?;
        Ok(json!({
            "objects": replayed.objects,
            "swings": replayed.swings,
            "alarms": replayed.alarms,
            "difference": replayed.difference.as_ref().map(ToString::to_string),
            "notes": replayed.notes,
        }))
    })
}

/// Adds the log to the map, or returns the error.
pub fn job() -> Value {
    ended(|log| {
        let job = Job::read(&std::mem::take(&mut log.entries), &Wanted::default());
        JOBS.with_borrow_mut(|jobs| jobs.push(job));
        Ok(json!({}))
    })
}

/// The map of all added logs as SVG, how many of their objects are on it, and how many lines are left out. No SVG if none
/// has a position.
pub fn map(words: &Words) -> Value {
    let jobs = JOBS.take();
    let drawn = draw(&jobs.iter().collect::<Vec<_>>(), words);
    let placed = jobs.iter().flat_map(Job::events).filter(|event| event.found.is_ok()).count();
    let left_out: u64 = jobs.iter().map(|job| job.left_out + job.without_wheel).sum();
    json!({ "svg": drawn.map(|drawn| drawn.to_string()), "placed": placed, "leftOut": left_out })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "time_ms,kind,line
0,connected,0.2.0
0,setting,beam_to_tool_mm=400
0,setting,margin_mm=50
0,setting,ticks_per_m=2000
10,status,state=work tool=in pos=1000 speed_mm_s=500 windows=0 unseen_mm=0
20,command,set margin_mm 60
30,answer,ok
40,event,plant pos=2000 votes=3 spacing=1000 delay=680 hold=540 actuation=1220
50,event,swing tool=out pos=2600
460,status,state=work tool=out pos=2700 speed_mm_s=500 windows=1 unseen_mm=0
470,event,alarm code=3-1 name=too_fast pos=3000
480,event,warning name=no_plants
490,lost,pulled
495,connected,0.2.0
495,setting,ticks_per_m=2000
496,status,state=hold tool=out pos=5 speed_mm_s=0 windows=0 unseen_mm=400
";

    const BEGIN: &str = "time_ms,kind,line\n0,connected,0.2.0\n0,setting,ticks_per_rev=2400\n0,setting,wheel_mm=400\n";

    /// What `get` answers about the wheel and the tool.
    const SETTINGS: &str = "1300,answer,ticks_per_rev=2400
1300,answer,wheel_mm=400
1300,answer,ticks_per_m=1000
1300,answer,beam_to_tool_mm=500
";

    fn status(time_ms: u64, tool: &str, position: u64) -> String {
        format!("{time_ms},status,state=work tool={tool} pos={position} speed_mm_s=500 windows=0 unseen_mm=0\n")
    }

    /// The picture of a log that is read in pieces of this length.
    fn shown(text: &str, length: usize) -> Value {
        begin(false);
        text.as_bytes().chunks(length).for_each(take);
        picture()
    }

    fn rows<const COLUMNS: usize>(picture: &Value, table: usize) -> Vec<[f64; COLUMNS]> {
        let values: Vec<f64> = serde_json::from_value(picture["tables"][table].clone()).unwrap();
        values.chunks(COLUMNS).map(|row| row.try_into().unwrap()).collect()
    }

    #[test]
    fn a_log_is_a_row_on_the_ground_and_a_reset_goes_on_behind_it() {
        for length in [1, 100, 10_000] {
            let picture = shown(LOG, length);
            // Half a millimetre a count; the log begins at 1000.
            assert_eq!(rows(&picture, OBJECTS), [[0.0, 900.0, 1050.0, 840.0, 1110.0]]);
            assert_eq!(picture["swings"], 1);
            assert_eq!(rows(&picture, WORKED), [[0.0, 800.0]]);
            assert_eq!(
                picture["alarms"],
                json!([
                    { "name": "too_fast", "mm": 1000.0, "timeMs": 470, "isWarning": false },
                    { "name": "no_plants", "mm": 850.0, "timeMs": 480, "isWarning": true },
                ])
            );
            let speeds = rows::<3>(&picture, SPEEDS);
            assert_eq!(speeds[..2], [[0.0, 10.0, 500.0], [850.0, 460.0, 500.0]]);
            // The zone lay ahead of the tool, and a metre lies between.
            assert!(speeds[2][0] >= 2000.0, "{speeds:?}");
            assert_eq!(picture["timeMs"], 496);
        }
    }

    /// A log of a wheel with 2000 ticks a metre: a status at 0 and at 1000 ticks, these lines, and one at 2000.
    fn changed(lines: &str) -> String {
        let [first, second] = [status(0, "in", 0), status(1000, "in", 1000)];
        let settings = "0,setting,beam_to_tool_mm=400\n0,setting,ticks_per_m=2000\n";
        let last = status(3000, "out", 2000);
        format!("{BEGIN}{settings}{first}{second}{lines}{last}")
    }

    #[test]
    fn ground_is_drawn_by_the_wheel_of_its_time() {
        let command = |line: &str, answer: &str| format!("1100,command,{line}\n1100,answer,{answer}\n");
        let set = command("set ticks_per_m 1000", "ok");
        let shown_ticks = "\"ticks_per_m=1000 from 0 to 20000, default 0, not saved\"\n1100,answer,ok";
        let nominal_mm = |wheel_mm: f64| 500.0 + 1000.0 * std::f64::consts::PI * wheel_mm / 2400.0;
        for (lines, last_mm) in [
            (String::new(), 1000.0),
            (set.clone(), 1500.0),
            (command("set ticks_per_m 1000", "error: the machine is at work"), 1000.0),
            (command("calibrate 1000 force", shown_ticks), 1500.0),
            (command("get ticks_per_m", shown_ticks), 1500.0),
            (command("set wheel_mm 500", "ok"), nominal_mm(500.0)),
            (command("defaults", "ok"), nominal_mm(400.0)),
            ([command("save", "ok"), set, command("revert", "ok")].concat(), 1000.0),
            (command("revert", "ok") + SETTINGS, 1500.0),
            (command("revert", "\"error: no settings are saved, save does it\""), 1000.0),
        ] {
            let picture = shown(&changed(&lines), 64);
            let positions: Vec<f64> = rows::<3>(&picture, SPEEDS).iter().map(|[mm, ..]| mm.round()).collect();
            assert_eq!(positions, [0.0, 500.0, f64::round(last_mm)], "{lines}");
            assert_eq!(picture["unknownMs"], json!([]), "{lines}");
        }
    }

    #[test]
    fn where_the_log_lacks_the_saved_settings_nothing_is_drawn() {
        let plant = "event,plant pos=1200 votes=3 spacing=1000 delay=680 hold=540 actuation=1220\n";
        let reverted = format!("1100,command,revert\n1200,answer,ok\n1300,{plant}");
        let picture = shown(&changed(&reverted), 64);
        assert_eq!(picture["unknownMs"], json!([1300]));
        assert_eq!((rows::<3>(&picture, SPEEDS).len(), rows::<5>(&picture, OBJECTS).len()), (2, 0));
        assert_eq!(rows(&picture, WORKED), [[0.0, 500.0]]);

        let picture =
            shown(&changed(&format!("{reverted}1400,command,get\n{SETTINGS}1400,answer,ok\n1500,{plant}")), 64);
        // It goes on behind a metre.
        assert_eq!(rows::<5>(&picture, OBJECTS)[0][1], 2000.0);
        assert_eq!(rows::<3>(&picture, SPEEDS)[2], [2300.0, 4400.0, 500.0]);
    }

    #[test]
    fn the_tool_is_in_the_row_from_a_swing_in_to_the_next_out_or_an_alarm() {
        let swing = |tool: &str, pos: u32| format!("9,event,swing tool={tool} pos={pos}\n");
        let status = status(1, "out", 0);
        let alarm = "9,event,alarm code=3-1 name=too_fast pos=9000\n";
        let setting = "0,setting,ticks_per_m=1000\n";
        let swings =
            [("in", 1000), ("out", 2000), ("in", 3000), ("in", 3500), ("out", 4000), ("in", 8000), ("in", 9500)];
        let swings: String = swings.map(|(tool, pos)| swing(tool, pos)).concat();
        let picture = shown(&format!("{BEGIN}{setting}{status}{swings}{alarm}"), 64);
        assert_eq!(rows(&picture, WORKED), [[1000.0, 2000.0], [3000.0, 4000.0], [8000.0, 9000.0], [9500.0, 9500.0]]);
        // A reset takes the tool out.
        let picture = shown(&changed("2000,lost,pulled\n2000,connected,0.2.0\n"), 64);
        assert_eq!(rows(&picture, WORKED), [[0.0, 500.0]]);
    }

    #[test]
    fn over_a_gap_of_the_statuses_the_tool_is_not_drawn_in_the_row() {
        let before = [status(0, "in", 0), status(1000, "in", 1000)].concat();
        let swings = "1000,event,swing tool=out pos=1500\n1000,event,swing tool=in pos=2000\n";
        // The clock of a computer that sleeps stands still.
        for (swings, time_ms) in [("", 1300), ("", 8000), (swings, 1300), (swings, 8000)] {
            let behind = [status(time_ms, "in", 5000), status(time_ms + 1000, "in", 6000)].concat();
            let picture = shown(&format!("{BEGIN}0,setting,ticks_per_m=1000\n{before}{swings}{behind}"), 64);
            assert_eq!(rows(&picture, WORKED), [[0.0, 1000.0], [5000.0, 6000.0]], "{swings} {time_ms}");
        }
    }

    #[test]
    fn statuses_close_together_are_left_out_and_lines_keep_their_numbers() {
        let statuses: String = (0..10).map(|number| status(100 * number, "in", 1000 * number)).collect();
        let wheel = "0,setting,ticks_per_m=2000\n";
        let log = format!("{BEGIN}{statuses}0,connected,0.2.0\n{wheel}{}", status(50, "in", 0));
        let picture = shown(&log, 100);
        let times: Vec<f64> = rows::<3>(&picture, SPEEDS).iter().map(|speed| speed[1]).collect();
        // The second session goes on behind the first.
        assert_eq!(times, [0.0, 300.0, 600.0, 900.0, 950.0]);
        assert_eq!(picture["timeMs"], 950);
        let wrong = shown(&format!("{log}1,gossip,hello\n"), 100);
        assert!(wrong["problem"].as_str().is_some_and(|problem| problem.contains("line 18")), "{wrong}");
    }
}
