//! What the machine did while it was at work: each stretch of work in a log, with its time, distance, plants and swings.
//!
//! A stretch begins when the state becomes WORK, and ends with it or with the link. Its distance is the net distance by
//! the wheel. A change of state has no position: the speed of the last status leads there. Its plants are those that the
//! tool passed: the beam saw them earlier, by the distance from beam to tool. After rolling back, `start` sees plants
//! again, and they count once. Detections that are no weeds count as plants, as for the firmware.
//!
//! The work in a gap of the statuses is unknown ([`is_gap`]). Nothing but the lines of such a stretch is known, and no
//! time over the gap: the clocks of some computers stand still during their sleep.

use crate::follower::{FASTEST_M_S, Followed, Follower, WHEEL_GAP_MS, is_gap};
use crate::log::Entry;
use control::ground::class::Class;
use link::settings::Setting;
use link::{EventLine, Mode};
use std::ops::Range;

/// Rolling back farther than this in hold leads to another row, in metres.
pub const NEXT_ROW_M: f64 = 2.0;

/// A stretch of work.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Worked {
    /// Its lines in the log.
    pub lines: Range<u64>,
    /// How often the log was opened again before it. The log's clock then begins again.
    pub session: u32,
    /// Gaps of the statuses in the log before it, and until its end.
    pub gaps: Range<u32>,
    /// Its time by the log's clock, in milliseconds.
    pub time_ms: Range<u64>,
    /// The part of it in which the machine rolled.
    pub rolled_ms: u64,
    /// The distance rolled in that part, forwards and backwards, in mm. Only as far as the wheel is known.
    pub path_mm: f64,
    /// Net distance by the wheel in mm. `None` if a part of it is unknown.
    pub distance_mm: Option<f64>,
    /// Plants that the tool passed. `None` if the distance is unknown, or the beam missed a part of the ground.
    pub plants: Option<u32>,
    /// Swings out of the row that the log has.
    pub swings: u32,
}

impl Worked {
    /// The mean speed while the machine rolled, in km/h. `None` if the distance is unknown, or nothing was rolled.
    pub fn speed_km_h(&self) -> Option<f64> {
        (self.distance_mm.is_some() && self.rolled_ms > 0).then(|| self.path_mm / self.rolled_ms as f64 * 3.6)
    }
}

/// A stretch that has not ended.
struct Open {
    worked: Worked,
    /// The beam's ground in mm, as far as it is known.
    beam_mm: Option<Range<f64>>,
    /// The beam's last place in mm.
    last_mm: Option<f64>,
    goes_on: bool,
}

/// Divides a log into its stretches of work.
pub fn worked(log: &[Entry]) -> Vec<Worked> {
    let mut stretches: Vec<Worked> = Vec::new();
    let mut follower = Follower::default();
    let mut open: Option<Open> = None;
    // The plants since the distance began, from leading to trailing edge, and the row's farthest status.
    let (mut plants_mm, mut row_mm): (Vec<Range<f64>>, f64) = (Vec::new(), f64::NEG_INFINITY);
    // The last status: its line, its time, its distance in mm, and its speed in mm/s.
    let mut last: Option<(u64, u64, f64, f64)> = None;
    // The gaps of the statuses so far, and the end of the last one: the beam may have missed plants before it.
    let (mut gaps, mut missed_mm) = (0, f64::NEG_INFINITY);
    let (mut session, mut before_ms, mut was_work) = (0, 0, false);
    for entry in log {
        session += u32::from(entry.time_ms < before_ms);
        before_ms = entry.time_ms;
        let gaps_before = gaps;
        let followed = follower.take(entry);
        let mut now_mm = None;
        let mode = match &followed {
            Followed::Linked => None,
            Followed::Status(status, goes_on) => {
                if !goes_on {
                    (plants_mm, row_mm, missed_mm) = (Vec::new(), f64::NEG_INFINITY, f64::NEG_INFINITY);
                }
                now_mm = follower.mm(status.position);
                if let (Some((line, time_ms, mm, _)), Some(now_mm)) = (last, now_mm)
                    // `revert` in hold begins the distance anew: that is no gap.
                    && (if *goes_on {
                        is_gap(entry.time_ms.saturating_sub(time_ms) as f64, (now_mm - mm) / 1000.0)
                    } else {
                        open.is_some()
                    })
                {
                    (gaps, missed_mm) = (gaps + 1, missed_mm.max(now_mm));
                    // An event may have come in the gap, and ended a stretch.
                    for ended in stretches.iter_mut().filter(|ended| ended.lines.end > line + 1) {
                        (ended.gaps.end, ended.distance_mm, ended.plants) = (gaps, None, None);
                    }
                }
                let is_work = status.mode == Mode::Work;
                if let Some(mm) = now_mm.filter(|_| is_work && !was_work && status.unseen_mm > 0) {
                    // `start` has forgotten the ground: the beam sees again the plants that end ahead of it.
                    let is_next_row = row_mm - mm > 1000.0 * NEXT_ROW_M;
                    plants_mm.retain(|plant_mm| plant_mm.end < mm && !is_next_row);
                    (row_mm, missed_mm) = (if is_next_row { mm } else { row_mm }, f64::NEG_INFINITY);
                }
                row_mm = now_mm.map_or(row_mm, |mm| row_mm.max(mm));
                was_work = is_work;
                let speed_mm_s = f64::from(status.speed_mm_s);
                last = now_mm.map(|mm| (entry.number, entry.time_ms, mm, speed_mm_s));
                open.iter_mut().for_each(|open| open.take(entry.time_ms, now_mm, speed_mm_s, *goes_on));
                Some(status.mode)
            }
            Followed::Event(EventLine::State { mode }) => Some(*mode),
            Followed::Event(EventLine::Alarm { .. }) => Some(Mode::Alarm),
            Followed::Event(EventLine::Detection { class, position, hold, .. }) => {
                let leading_mm = follower.mm(*position).filter(|_| *class != Class::Weed);
                plants_mm.extend(leading_mm.map(|mm| mm..mm + follower.width_mm(*hold)));
                continue;
            }
            Followed::Event(EventLine::Swing { out: true, .. }) => {
                open.iter_mut().for_each(|open| open.worked.swings += 1);
                continue;
            }
            _ => continue,
        };
        if let (Followed::Event(_), Some((_, time_ms, mm, speed_mm_s))) = (&followed, last) {
            let since_ms = entry.time_ms.saturating_sub(time_ms) as f64;
            if since_ms <= WHEEL_GAP_MS {
                // A damaged status may have any speed.
                let fastest_mm_s = 1000.0 * FASTEST_M_S;
                now_mm = Some(mm + speed_mm_s.clamp(-fastest_mm_s, fastest_mm_s) * since_ms / 1000.0);
                open.iter_mut().for_each(|open| open.take(entry.time_ms, now_mm, speed_mm_s, true));
            } else {
                gaps += u32::from(open.is_some());
            }
        }
        if let Some(open) = &mut open
            && mode.is_some()
        {
            (open.worked.time_ms.end, open.worked.lines.end) = (entry.time_ms, entry.number + 1);
        }
        match (mode == Some(Mode::Work), open.is_some()) {
            (true, false) => open = Some(Open::at(entry, session, gaps_before, now_mm)),
            (false, true) => {
                stretches.extend(open.take().map(|open| open.end(&plants_mm, missed_mm, gaps, &follower)));
            }
            _ => {}
        }
        if mode.is_none() {
            (plants_mm, row_mm, missed_mm) = (Vec::new(), f64::NEG_INFINITY, f64::NEG_INFINITY);
            last = None;
        }
    }
    stretches.extend(open.map(|open| open.end(&plants_mm, missed_mm, gaps, &follower)));
    stretches
}

impl Open {
    fn at(entry: &Entry, session: u32, gaps: u32, now_mm: Option<f64>) -> Self {
        let worked = Worked {
            lines: entry.number..entry.number + 1,
            session,
            gaps: gaps..gaps,
            time_ms: entry.time_ms..entry.time_ms,
            ..Worked::default()
        };
        Self { worked, beam_mm: now_mm.map(|mm| mm..mm), last_mm: now_mm, goes_on: true }
    }

    /// Takes the beam's place at a status or a change of state, and the speed up to there.
    fn take(&mut self, time_ms: u64, now_mm: Option<f64>, speed_mm_s: f64, goes_on: bool) {
        if speed_mm_s != 0.0 {
            self.worked.rolled_ms += time_ms.saturating_sub(self.worked.time_ms.end);
            self.worked.path_mm += now_mm.zip(self.last_mm).map_or(0.0, |(mm, last_mm)| (mm - last_mm).abs());
        }
        self.last_mm = now_mm;
        match (&mut self.beam_mm, now_mm) {
            (None, Some(mm)) => self.beam_mm = Some(mm..mm),
            (Some(ground_mm), Some(mm)) if goes_on => ground_mm.end = ground_mm.end.max(mm),
            _ => self.goes_on = false,
        }
    }

    /// `gaps` are those in the log so far, and the beam may have missed plants before `missed_mm`.
    fn end(self, plants_mm: &[Range<f64>], missed_mm: f64, gaps: u32, follower: &Follower) -> Worked {
        let beam_to_tool_mm = f64::from(follower.in_use().settings().get(Setting::BeamToToolMm));
        let gaps = self.worked.gaps.start..gaps;
        let beam_mm = self.beam_mm.filter(|_| self.goes_on && gaps.is_empty());
        let passed = |ground_mm: &Range<f64>| {
            let tool_mm = ground_mm.start - beam_to_tool_mm..ground_mm.end - beam_to_tool_mm;
            let passed = plants_mm.iter().filter(|plant_mm| tool_mm.contains(&plant_mm.start));
            (tool_mm.start >= missed_mm).then(|| passed.count() as u32)
        };
        Worked {
            gaps,
            plants: beam_mm.as_ref().and_then(passed),
            distance_mm: beam_mm.map(|ground_mm| ground_mm.end - ground_mm.start),
            ..self.worked
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log;
    use proptest::prelude::*;
    use std::fmt::Write;
    use std::path::Path;

    /// Ticks a metre of the log's machine: a tick is a millimetre.
    const HEAD: &str =
        "time_ms,kind,line\n0,connected,0.2.0\n0,setting,ticks_per_m=1000\n0,setting,beam_to_tool_mm=400\n";

    fn status(mode: &str, position: i64, speed_mm_s: u32) -> String {
        format!("state={mode} tool=out pos={position} speed_mm_s={speed_mm_s} windows=0 unseen_mm=0")
    }

    fn of(text: &str) -> Vec<Worked> {
        worked(&log::parse(Path::new("log.csv"), text.as_bytes().to_vec()).expect("it is a log"))
    }

    #[test]
    fn a_stretch_has_its_time_distance_plants_and_swings_as_counted_by_hand() {
        let mut text = HEAD.to_owned();
        let mut line = |time_ms: u64, kind: &str, said: &str| {
            writeln!(text, "{time_ms},{kind},{said}").expect("a string takes all");
        };
        let plant = |position| format!("plant pos={position} votes=3 spacing=500 delay=100 hold=300 actuation=400");
        // Seen in hold, and passed by the tool at work: 700 is 300 behind the tool's start.
        line(0, "status", &status("hold", 0, 0));
        line(900, "event", &plant(500));
        line(1000, "event", &plant(700));
        line(1000, "status", &status("hold", 1000, 500));
        line(1000, "event", "state is=work");
        line(1000, "status", &status("work", 1000, 500));
        line(2000, "event", "swing tool=out pos=1100");
        line(2000, "event", "swing tool=in pos=1400");
        line(2000, "event", "weed pos=1500 votes=3 spacing=500 delay=100 hold=300 actuation=400");
        line(2000, "event", "unknown pos=1600 votes=0 spacing=500 delay=100 hold=300 actuation=400");
        // It stands for a second.
        line(3000, "status", &status("work", 2000, 500));
        line(4000, "status", &status("work", 2000, 0));
        // Beyond the tool at the end.
        line(5000, "event", &plant(2700));
        line(6000, "status", &status("work", 3000, 500));
        line(6100, "event", "state is=hold");
        line(7000, "status", &status("hold", 3100, 0));
        let [worked] = &of(&text)[..] else { panic!("{:?}", of(&text)) };
        // The hold comes 0.1 s after the last status, at 0.5 m/s.
        assert_eq!((worked.time_ms.clone(), worked.rolled_ms), (1000..6100, 4100));
        assert_eq!((worked.distance_mm, worked.plants, worked.swings), (Some(2050.0), Some(2), 1));
        // 2.05 m in 4.1 s.
        assert!((worked.speed_km_h().expect("it is known") - 1.8).abs() < 1e-9);
    }

    #[test]
    fn a_stretch_between_statuses_gets_its_distance_from_the_speed() {
        let rolling = format!("0,status,{}\n", status("hold", 0, 500))
            + "40,event,state is=work\n"
            + &format!("100,status,{}\n", status("work", 50, 500))
            + &format!("2100,status,{}\n", status("work", 1050, 500))
            + "2160,event,state is=hold\n";
        let (_, again) = HEAD.split_once('\n').expect("it has a header");
        let found = of(&format!("{HEAD}{rolling}{again}{rolling}"));
        let found: Vec<_> = found.iter().map(|of| (of.session, of.distance_mm, of.rolled_ms)).collect();
        assert_eq!(found, [(0, Some(1060.0), 2120), (1, Some(1060.0), 2120)]);
    }

    #[test]
    fn rolling_back_at_work_counts_for_the_speed_and_not_for_the_distance() {
        let mut text = format!("{HEAD}0,event,state is=work\n");
        // Half a metre a second: 2 m on, 0.5 m back, and 1 m on.
        let place_mm = |step: i64| if step <= 40 { 50 * step } else { (50 * step - 1000).max(4000 - 50 * step) };
        for step in 0..=70 {
            let speed_mm_s = if (41..=50).contains(&step) { -500 } else { 500 };
            let status = status("work", place_mm(step), 0).replace("_s=0", &format!("_s={speed_mm_s}"));
            writeln!(text, "{},status,{status}", 100 * step).unwrap();
        }
        let [worked] = &of(&text)[..] else { panic!("{:?}", of(&text)) };
        assert_eq!((worked.distance_mm, worked.path_mm, worked.rolled_ms), (Some(2500.0), 3500.0, 7000));
        assert!((worked.speed_km_h().expect("it is known") - 1.8).abs() < 1e-9);
    }

    #[test]
    fn a_lost_link_ends_a_stretch_with_its_known_distance() {
        let at_work = format!("1,status,{}\n2,status,{}\n", status("work", 0, 500), status("work", 700, 500));
        let lost = of(&format!("{HEAD}{at_work}9,lost,the cable\n"));
        assert_eq!((lost.len(), lost[0].distance_mm), (1, Some(700.0)));
        for unknown in [
            "0,command,revert\n0,answer,ok\n",
            // An earlier version took it.
            "0,setting,\"ticks_per_rev=500 from 100 to 10000, default 2400\"\n",
            "0,command,set wheel_mm 900\n0,answer,error: hold first\n0,command,set wheel_mm 900\n0,answer,ok\n",
        ] {
            let unknown = of(&format!("{HEAD}0,setting,ticks_per_m=0\n{unknown}{at_work}"));
            assert_eq!(unknown.len(), 1);
            assert_eq!((unknown[0].distance_mm, unknown[0].plants, unknown[0].speed_km_h()), (None, None, None));
        }
    }

    #[test]
    fn the_work_in_a_gap_of_the_statuses_is_unknown() {
        // The machine rolls a metre a second past a plant each half metre. It is at work from 2 s to 12 s, and from 16 s
        // to 26 s.
        for (gap_ms, are_known) in [
            (0..0, [(true, true), (true, true)]),
            (5000..9000, [(false, false), (true, true)]),
            (11_000..13_500, [(false, false), (true, true)]),
            (13_000..17_000, [(true, true), (false, false)]),
            // At the second start the tool is 400 mm behind the beam.
            (12_500..15_000, [(true, true), (true, true)]),
            (12_500..15_900, [(true, true), (true, false)]),
        ] {
            for (is_asleep, has_events) in [(false, false), (false, true), (true, false), (true, true)] {
                let mut text = HEAD.to_owned();
                for at_ms in (0..28_000_u64).step_by(100) {
                    let is_in_gap = gap_ms.contains(&at_ms);
                    let slept_ms = if is_asleep { at_ms.clamp(gap_ms.start, gap_ms.end) - gap_ms.start } else { 0 };
                    let mut line = |kind: &str, said: &str| {
                        writeln!(text, "{},{kind},{said}", at_ms - slept_ms).expect("a string takes all");
                    };
                    let is_work = (2000..12_000).contains(&at_ms) || (16_000..26_000).contains(&at_ms);
                    let mode = if is_work { "work" } else { "hold" };
                    if [2000, 12_000, 16_000, 26_000].contains(&at_ms) && (has_events || !is_in_gap) {
                        line("event", &format!("state is={mode}"));
                    }
                    if at_ms % 500 == 0 && (has_events || !is_in_gap) {
                        line("event", &format!("plant pos={at_ms} votes=3 spacing=0 delay=0 hold=0 actuation=0"));
                    }
                    if !is_in_gap {
                        line("status", &status(mode, at_ms as i64, 1000));
                    }
                }
                let found = of(&text);
                let found: Vec<_> = found.iter().map(|of| (of.gaps.is_empty(), of.distance_mm, of.plants)).collect();
                let expected = are_known
                    .map(|(is_known, has_plants)| (is_known, is_known.then_some(10_000.0), has_plants.then_some(20)));
                assert_eq!(found, expected, "{gap_ms:?} {is_asleep} {has_events}");
            }
        }
    }

    #[test]
    fn plants_seen_again_after_a_start_count_once() {
        // Plants of 150 mm every half metre. The machine is held after 3 m, drawn back from there, and starts again, at
        // 1800 mm with the beam in a plant.
        for (held_mm, back_to_mm, expected) in [(3000, 1500, 21), (3000, 1800, 20), (3000, 500, 22), (4000, 1500, 20)] {
            let (mut text, mut time_ms) = (HEAD.to_owned(), 0);
            let mut line = |kind: &str, said: &str| {
                time_ms += 100;
                writeln!(text, "{time_ms},{kind},{said}").expect("a string takes all");
            };
            for (from_mm, until_mm, held_mm) in [(0, 3000, held_mm), (back_to_mm, 12_000, 12_000)] {
                line("status", &status("hold", from_mm, 0));
                line("event", "state is=work");
                line("status", &status("work", from_mm, 0).replace("unseen_mm=0", "unseen_mm=450"));
                for plant_mm in (175..until_mm).step_by(500).filter(|plant_mm| plant_mm + 150 > from_mm) {
                    // The margin of 50 mm lies at either edge.
                    let (seen_mm, hold) = (from_mm.max(plant_mm), plant_mm + 250 - from_mm.max(plant_mm));
                    line("event", &format!("plant pos={seen_mm} votes=3 spacing=0 delay=0 hold={hold} actuation=0"));
                    line("status", &status("work", plant_mm + 325, 0));
                }
                line("event", "state is=hold");
                line("status", &status("hold", held_mm, 0));
            }
            // The tool is 400 mm behind the beam.
            assert_eq!(of(&text)[1].plants, Some(expected), "{held_mm} {back_to_mm}");
        }
    }

    proptest! {
        #[test]
        fn plots_with_gaps_between_them_come_back(
            plots in prop::collection::vec((2_000_i64..30_000, 1_500_i64..9_000, 200_u32..1200), 1..8),
            spacing_mm in 150_i64..700,
            start in any::<i32>(),
        ) {
            let mut text = HEAD.to_owned();
            let wrapped = |mm: i64| i64::from(start.wrapping_add(mm as i32));
            let (mut mm, mut time_ms, mut next_mm) = (0_i64, 0_u64, 100_i64);
            let mut expected = Vec::new();
            for &(length_mm, gap_mm, speed_mm_s) in &plots {
                let begins_mm = mm + gap_mm;
                let ends_mm = begins_mm + length_mm;
                for (mode, until_mm) in [("hold", begins_mm), ("work", ends_mm)] {
                    if mode == "work" {
                        writeln!(text, "{time_ms},event,state is=work").unwrap();
                        writeln!(text, "{time_ms},status,{}", status("work", wrapped(mm), speed_mm_s)).unwrap();
                    }
                    while mm < until_mm {
                        let rolled_mm = (until_mm - mm).min(300);
                        mm += rolled_mm;
                        time_ms += 1000 * rolled_mm as u64 / u64::from(speed_mm_s);
                        while next_mm < mm {
                            let position = wrapped(next_mm);
                            writeln!(text, "{time_ms},event,plant pos={position} votes=3 spacing=0 delay=0 hold=0 actuation=0").unwrap();
                            next_mm += spacing_mm;
                        }
                        writeln!(text, "{time_ms},status,{}", status(mode, wrapped(mm), speed_mm_s)).unwrap();
                    }
                }
                writeln!(text, "{time_ms},event,state is=hold").unwrap();
                let plants = (100..mm).step_by(spacing_mm as usize);
                let passed = plants.filter(|plant| (begins_mm - 400..ends_mm - 400).contains(plant)).count();
                expected.push((length_mm as f64, passed as u32));
            }
            let found: Vec<(f64, u32)> =
                of(&text).iter().map(|worked| (worked.distance_mm.unwrap(), worked.plants.unwrap())).collect();
            prop_assert_eq!(found, expected);
        }
    }
}
