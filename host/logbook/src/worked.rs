//! What the machine did while it was at work: each stretch of work in a log, with its time, distance, plants and swings.
//!
//! A stretch begins when the state becomes WORK, and ends with it or with the link. Its distance is the net distance by
//! the wheel. Its plants are those that the tool passed: the beam saw them earlier, by the distance from beam to tool.
//! Detections that are no weeds count as plants, as for the firmware.

use crate::follower::{Followed, Follower};
use crate::log::Entry;
use control::ground::class::Class;
use link::settings::Setting;
use link::{EventLine, Mode};
use std::ops::Range;

/// A stretch of work.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Worked {
    /// Its lines in the log.
    pub lines: Range<u64>,
    /// Its time by the log's clock, in milliseconds.
    pub time_ms: Range<u64>,
    /// The part of it in which the machine rolled.
    pub rolled_ms: u64,
    /// Net distance by the wheel in mm. `None` if a part of it is unknown.
    pub distance_mm: Option<f64>,
    /// Plants that the tool passed. `None` if the distance is unknown.
    pub plants: Option<u32>,
    /// Swings out of the row.
    pub swings: u32,
}

impl Worked {
    /// The mean speed while the machine rolled, in km/h. `None` if the distance is unknown, or nothing was rolled.
    pub fn speed_km_h(&self) -> Option<f64> {
        let mm = self.distance_mm.filter(|_| self.rolled_ms > 0)?;
        Some(mm / self.rolled_ms as f64 * 3.6)
    }
}

/// A stretch that has not ended.
struct Open {
    worked: Worked,
    /// The beam's ground in mm, as far as it is known.
    beam_mm: Option<Range<f64>>,
    goes_on: bool,
}

/// Divides a log into its stretches of work.
pub fn worked(log: &[Entry]) -> Vec<Worked> {
    let mut stretches = Vec::new();
    let mut follower = Follower::default();
    let mut open: Option<Open> = None;
    // The leading edges of plants since the distance began.
    let mut plants_mm: Vec<f64> = Vec::new();
    for entry in log {
        let followed = follower.take(entry);
        let mut now_mm = None;
        let mode = match &followed {
            Followed::Linked => None,
            Followed::Status(status, goes_on) => {
                if !goes_on {
                    plants_mm.clear();
                }
                now_mm = follower.mm(status.position);
                if let Some(open) = &mut open {
                    let since_ms = entry.time_ms.saturating_sub(open.worked.time_ms.end);
                    if status.speed_mm_s != 0 {
                        open.worked.rolled_ms += since_ms;
                    }
                    open.take(now_mm, *goes_on);
                }
                Some(status.mode)
            }
            Followed::Event(EventLine::State { mode }) => Some(*mode),
            Followed::Event(EventLine::Alarm { .. }) => Some(Mode::Alarm),
            Followed::Event(EventLine::Detection { class, position, .. }) => {
                plants_mm.extend(follower.mm(*position).filter(|_| *class != Class::Weed));
                continue;
            }
            Followed::Event(EventLine::Swing { out: true, .. }) => {
                open.iter_mut().for_each(|open| open.worked.swings += 1);
                continue;
            }
            _ => continue,
        };
        if let Some(open) = &mut open
            && mode.is_some()
        {
            (open.worked.time_ms.end, open.worked.lines.end) = (entry.time_ms, entry.number + 1);
        }
        match (mode == Some(Mode::Work), open.is_some()) {
            (true, false) => open = Some(Open::at(entry, now_mm)),
            (false, true) => {
                stretches.extend(open.take().map(|open| open.end(&plants_mm, &follower)));
            }
            _ => {}
        }
        if mode.is_none() {
            plants_mm.clear();
        }
    }
    stretches.extend(open.map(|open| open.end(&plants_mm, &follower)));
    stretches
}

impl Open {
    fn at(entry: &Entry, now_mm: Option<f64>) -> Self {
        let worked = Worked {
            lines: entry.number..entry.number + 1,
            time_ms: entry.time_ms..entry.time_ms,
            ..Worked::default()
        };
        Self { worked, beam_mm: now_mm.map(|mm| mm..mm), goes_on: true }
    }

    /// Takes the beam's place at a status.
    fn take(&mut self, now_mm: Option<f64>, goes_on: bool) {
        match (&mut self.beam_mm, now_mm) {
            (None, Some(mm)) => self.beam_mm = Some(mm..mm),
            (Some(ground_mm), Some(mm)) if goes_on => ground_mm.end = ground_mm.end.max(mm),
            _ => self.goes_on = false,
        }
    }

    fn end(self, plants_mm: &[f64], follower: &Follower) -> Worked {
        let beam_to_tool_mm = f64::from(follower.in_use().settings().get(Setting::BeamToToolMm));
        let beam_mm = self.beam_mm.filter(|_| self.goes_on);
        let passed = |ground_mm: &Range<f64>| {
            let tool_mm = ground_mm.start - beam_to_tool_mm..ground_mm.end - beam_to_tool_mm;
            plants_mm.iter().filter(|mm| tool_mm.contains(mm)).count() as u32
        };
        Worked {
            plants: beam_mm.as_ref().map(passed),
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
        assert_eq!((worked.time_ms.clone(), worked.rolled_ms), (1000..6100, 4000));
        assert_eq!((worked.distance_mm, worked.plants, worked.swings), (Some(2000.0), Some(2), 1));
        // 2 m in 4 s.
        assert!((worked.speed_km_h().expect("it is known") - 1.8).abs() < 1e-9);
    }

    #[test]
    fn a_lost_link_ends_a_stretch_and_a_distance_that_is_unknown_stays_unknown() {
        let at_work = format!("1,status,{}\n2,status,{}\n", status("work", 0, 500), status("work", 700, 500));
        let lost = of(&format!("{HEAD}{at_work}9,lost,the cable\n"));
        assert_eq!((lost.len(), lost[0].distance_mm), (1, Some(700.0)));
        let unknown = of(&format!("{HEAD}0,setting,ticks_per_m=0\n0,command,revert\n0,answer,ok\n{at_work}"));
        assert_eq!(unknown.len(), 1);
        assert_eq!((unknown[0].distance_mm, unknown[0].plants, unknown[0].speed_km_h()), (None, None, None));
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
