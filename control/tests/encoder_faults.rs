//! A row with small encoder faults: silences, spikes on both channels, missing edges.
//!
//! The machine rolls past plants at a constant speed. The encoder's edges are uneven by a third, like real ones. They go through
//! the fault into the firmware's decoder. The controller turns like the firmware's loop, with some long turns. The tool follows
//! like a servo. A plant is hit if the tool is not fully out over its canopy.
//!
//! The test checks that each canopy is kept, or that the alarm comes before a second one is hit. The manual's page of faults has
//! the table; `UPDATE_EXPECT=1 cargo test -p control --test encoder_faults` writes it.

use control::{
    alarm::Alarm,
    ground::{examples::EXAMPLES, nearest::Nearest},
    measure::quadrature::{Quadrature, Step},
    memory::Volatile,
    operate::{servo, state::State},
    settings::{Setting, TICKS_PER_M_LEAST},
    units::{Instant, Interval},
};
use expect_test::{ExpectFile, expect_file};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use rig::{Beams, Rig};
use std::fmt::{self, Write};
use std::ops::Range;

/// A tick of a wheel of 400 mm with 2400 counts.
const TICK_MM: f64 = std::f64::consts::PI * 400.0 / 2400.0;

/// The row: plants half a metre apart, canopies of 150 mm. The first is this far from the machine's start.
const PLANTS: usize = 8;
const FIRST_MM: f64 = 1000.0;
const SPACING_MM: f64 = 500.0;
const CANOPY_MM: f64 = 150.0;

const BEAM_TO_TOOL_MM: f64 = 400.0;
const MARGIN_MM: f64 = 50.0;

/// A margin that is short by less than this counts as kept, as everywhere in this project.
const TOLERANCE_MM: f64 = 10.0;

/// The machine accelerates with 1 m/s2.
const ACCELERATION_MM_S2: f64 = 1000.0;

/// The beam's sensor responds after a millisecond.
const RESPONSE_S: f64 = 0.001;

/// The servo: dead time, and time until the tool is out.
const DEAD_S: f64 = 0.060;
const SWING_S: f64 = 0.180;

/// Duration of a spike: longer than the interrupt's response.
const SPIKE_S: f64 = 0.000_1;

const SPEEDS_KM_H: [f64; 7] = [0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 4.0];

/// The encoder's fault.
#[derive(Clone, Copy, Debug)]
enum Fault {
    /// No edge for this time, once or repeatedly.
    Silence { length_ms: u32, every_ms: Option<u32> },
    /// Both channels change for a moment, this often a second.
    Spikes { a_second: u32 },
    /// This many of a thousand edges are missing: the channel keeps its level until its second next edge.
    LostEdges { in_1000: u32 },
    /// One channel stops for this many ticks, repeatedly.
    Dropouts { ticks: u32, every_mm: u32 },
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Silence { length_ms, every_ms: None } => write!(f, "silent once for {length_ms} ms"),
            Self::Silence { length_ms, every_ms: Some(every_ms) } => {
                write!(f, "silent for {length_ms} ms every {} s", f64::from(every_ms) / 1000.0)
            }
            Self::Spikes { a_second } => write!(f, "{a_second} spikes a second on both channels"),
            Self::LostEdges { in_1000 } => write!(f, "{} % of the edges lost", f64::from(in_1000) / 10.0),
            Self::Dropouts { ticks, every_mm } => write!(f, "one channel dead for {ticks} ticks every {every_mm} mm"),
        }
    }
}

/// The result of a run, best first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Outcome {
    /// All canopies and margins were kept.
    Kept,
    /// A margin was not kept.
    MarginCut,
    /// An alarm, and no plant hit.
    Alarm,
    /// One plant hit, and an alarm.
    OneHit,
    /// Plants hit without an alarm, or more than one before it.
    Failed,
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Kept => "kept",
            Self::MarginCut => "cut",
            Self::Alarm => "alarm",
            Self::OneHit => "1 hit, alarm",
            Self::Failed => "FAILED",
        })
    }
}

/// A run: the fault begins at a place.
#[derive(Clone, Copy, Debug)]
struct Run {
    fault: Fault,
    speed_km_h: f64,
    from_mm: f64,
    seed: u64,
    tick_mm: f64,
}

/// The data of a run.
#[derive(Debug)]
struct Shown {
    hit: usize,
    cut: usize,
    alarm: Option<Alarm>,
    /// Ticks rolled, and ticks by the controller.
    rolled: i64,
    counted: i64,
}

impl Shown {
    fn outcome(&self) -> Outcome {
        match (self.hit, self.alarm) {
            (0, Some(_)) => Outcome::Alarm,
            (1, Some(_)) => Outcome::OneHit,
            (0, None) if self.cut > 0 => Outcome::MarginCut,
            (0, None) => Outcome::Kept,
            _ => Outcome::Failed,
        }
    }
}

/// The machine's motion.
#[derive(Clone, Copy)]
struct Way {
    speed_mm_s: f64,
}

impl Way {
    /// The time at a place.
    fn time_s(self, place_mm: f64) -> f64 {
        let gaining_mm = self.speed_mm_s.powi(2) / (2.0 * ACCELERATION_MM_S2);
        if place_mm < gaining_mm {
            (2.0 * place_mm / ACCELERATION_MM_S2).sqrt()
        } else {
            self.speed_mm_s / ACCELERATION_MM_S2 + (place_mm - gaining_mm) / self.speed_mm_s
        }
    }

    /// The place at a time.
    fn place_mm(self, time_s: f64) -> f64 {
        let gaining_s = self.speed_mm_s / ACCELERATION_MM_S2;
        if time_s < gaining_s {
            ACCELERATION_MM_S2 * time_s * time_s / 2.0
        } else {
            self.speed_mm_s * (time_s - gaining_s / 2.0)
        }
    }
}

/// The encoder's wires, with the fault.
struct Wires {
    way: Way,
    fault: Fault,
    from_s: f64,
    from_mm: f64,
    tick_mm: f64,
    rng: ChaCha8Rng,
    /// The number of the next edge, and its time.
    edge: i64,
    edge_s: f64,
    /// The levels without spikes.
    levels: u8,
    spike_s: f64,
    spiked: bool,
    decoder: Quadrature,
    count: i64,
    jumps: u16,
}

/// AB in the order of forward motion.
const FORWARD: [u8; 4] = [0b00, 0b10, 0b11, 0b01];

impl Wires {
    fn new(way: Way, run: Run) -> Self {
        let mut wires = Self {
            way,
            fault: run.fault,
            from_s: way.time_s(run.from_mm),
            from_mm: run.from_mm,
            tick_mm: run.tick_mm,
            rng: ChaCha8Rng::seed_from_u64(run.seed),
            edge: 0,
            edge_s: 0.0,
            levels: FORWARD[0],
            spike_s: f64::INFINITY,
            spiked: false,
            decoder: Quadrature::new(FORWARD[0]),
            count: 0,
            jumps: 0,
        };
        wires.next_edge();
        if let Fault::Spikes { a_second } = run.fault {
            wires.spike_s = wires.from_s + wires.rng.random_range(0.0..1.0) / f64::from(a_second);
        }
        wires
    }

    fn next_edge(&mut self) {
        self.edge += 1;
        // One channel's edges are late by a third of the distance between two edges.
        let late = if self.edge % 2 == 0 { 1.0 / 3.0 } else { 0.0 };
        self.edge_s = self.way.time_s((self.edge as f64 + late) * self.tick_mm);
    }

    /// Rolls on until a time.
    fn roll_to(&mut self, time_s: f64) {
        while self.edge_s.min(self.spike_s) <= time_s {
            if self.spike_s < self.edge_s {
                self.spiked = !self.spiked;
                self.spike_s += match self.fault {
                    Fault::Spikes { a_second } if !self.spiked => {
                        // Not synchronous with anything else.
                        (1.0 / f64::from(a_second) - SPIKE_S) * self.rng.random_range(0.5..1.5)
                    }
                    _ => SPIKE_S,
                };
            } else {
                let from = FORWARD[(self.edge - 1).rem_euclid(4) as usize];
                let to = FORWARD[self.edge.rem_euclid(4) as usize];
                let channel = from ^ to;
                if !self.is_lost(self.edge_s, channel) {
                    self.levels = self.levels & !channel | to & channel;
                }
                self.next_edge();
            }
            match self.decoder.step(self.levels ^ if self.spiked { 0b11 } else { 0 }) {
                Step::Ticks(ticks) => {
                    self.count += i64::from(ticks);
                    self.jumps = self.jumps.wrapping_add(u16::from(ticks.abs() == 2));
                }
                Step::Lost => self.jumps = self.jumps.wrapping_add(1),
            }
        }
    }

    fn is_lost(&mut self, time_s: f64, channel: u8) -> bool {
        let since_s = time_s - self.from_s;
        match self.fault {
            _ if since_s < 0.0 => false,
            Fault::Silence { length_ms, every_ms } => {
                let phase_s = every_ms.map_or(since_s, |every_ms| since_s % (f64::from(every_ms) / 1000.0));
                phase_s < f64::from(length_ms) / 1000.0
            }
            Fault::Spikes { .. } => false,
            Fault::Dropouts { ticks, every_mm } => {
                let phase_mm = (self.edge as f64 * self.tick_mm - self.from_mm).rem_euclid(every_mm.into());
                channel == 0b01 && phase_mm < f64::from(ticks) * self.tick_mm
            }
            Fault::LostEdges { in_1000 } => self.rng.random_bool(f64::from(in_1000) / 1000.0),
        }
    }
}

fn canopies_mm() -> impl Iterator<Item = Range<f64>> {
    (0..PLANTS).map(|plant| {
        let leading_mm = FIRST_MM + SPACING_MM * plant as f64;
        leading_mm..leading_mm + CANOPY_MM
    })
}

/// Rolls past the row, until its end or until the swing after an alarm.
fn roll(run: Run) -> Shown {
    let way = Way { speed_mm_s: run.speed_km_h / 0.0036 };
    let mut wires = Wires::new(way, run);
    let mut weeder = Rig::new(Nearest::new(&EXAMPLES[..], Volatile::new()));
    if run.tick_mm != TICK_MM {
        weeder.set(Setting::TicksPerM, (1000.0 / run.tick_mm).round() as u16).expect("fine enough");
    }
    // This servo is so fast that the machine may work at 5 km/h.
    for (setting, value) in [(Setting::LeadOutMs, (SWING_S * 1000.0) as u16), (Setting::TopSpeedMmS, 1400)] {
        weeder.set(setting, value).expect("within its range");
    }
    weeder.start(false).expect("nothing is wrong yet");
    let tool_in = servo::from_us(weeder.settings().get(Setting::ServoInUs));

    let mut beam = canopies_mm()
        .flat_map(|canopy| [(canopy.start, true), (canopy.end, false)])
        .map(|(place_mm, broken)| (way.time_s(place_mm) + RESPONSE_S, broken))
        .peekable();
    let canopies: Vec<Range<f64>> = canopies_mm().collect();
    let (mut hit, mut cut) = ([false; PLANTS], [false; PLANTS]);
    // Since when the tool has its command, and whether it was clear of the row then.
    let (mut out, mut told_s, mut was_clear) = (true, f64::NEG_INFINITY, true);
    let end_s = way.time_s(canopies[PLANTS - 1].end + BEAM_TO_TOOL_MM + MARGIN_MM);
    let (mut time_s, mut turn, mut alarm) = (0.0, 0_u32, None);
    while time_s < alarm.map_or(end_s, |(_, at_s): (Alarm, f64)| f64::min(at_s + 2.0 * SWING_S, end_s)) {
        turn += 1;
        // The loop's turns while it weeds and the operator requests the status.
        time_s += match turn {
            turn if turn % 503 == 0 => 0.003_8,
            turn if turn % 11 == 0 => 0.000_7,
            _ => 0.000_25,
        };
        while let Some((edge_s, broken)) = beam.next_if(|&(edge_s, _)| edge_s <= time_s) {
            wires.roll_to(edge_s);
            weeder.at(wires.count as i32).see(Beams::one(broken));
        }
        wires.roll_to(time_s);
        weeder.readings.now = Instant::new((time_s * f64::from(Interval::STEPS_PER_SECOND)) as u32);
        weeder.readings.jumps = wires.jumps;
        let orders = weeder.at(wires.count as i32).turn();
        if let (State::Alarm(raised), None) = (weeder.state(), alarm) {
            alarm = Some((raised, time_s));
        }
        let since_told_s = time_s - told_s;
        let is_clear = if out { since_told_s >= SWING_S || was_clear } else { was_clear && since_told_s < DEAD_S };
        if (orders.pulse != tool_in) != out {
            (out, told_s, was_clear) = (!out, time_s, is_clear);
        }
        if is_clear {
            continue;
        }
        let tool_mm = way.place_mm(time_s) - BEAM_TO_TOOL_MM;
        let within = |canopy: &Range<f64>, by_mm: f64| (canopy.start - by_mm..canopy.end + by_mm).contains(&tool_mm);
        for (plant, canopy) in canopies.iter().enumerate() {
            hit[plant] |= within(canopy, 0.0);
            cut[plant] |= within(canopy, MARGIN_MM - TOLERANCE_MM);
        }
    }
    let count = |plants: [bool; PLANTS]| plants.iter().filter(|is| **is).count();
    Shown {
        hit: count(hit),
        cut: count(cut),
        alarm: alarm.map(|(alarm, _)| alarm),
        rolled: wires.edge - 1,
        counted: i64::from(weeder.position().count()),
    }
}

/// The worst result of a fault at a speed, for all begins between two plants.
fn worst(fault: Fault, speed_km_h: f64) -> (Outcome, Run) {
    let places: u32 = if matches!(fault, Fault::Silence { every_ms: None, .. }) { 25 } else { 4 };
    (0..places)
        .map(|place| {
            // The tool works between the first plants.
            let from_mm = 1800.0 + SPACING_MM * f64::from(place) / f64::from(places);
            let run = Run { fault, speed_km_h, from_mm, seed: place.into(), tick_mm: TICK_MM };
            (roll(run).outcome(), run)
        })
        .max_by_key(|(outcome, _)| *outcome)
        .expect("there are places")
}

fn silences() -> Vec<Fault> {
    const LENGTHS_MS: [u32; 7] = [5, 10, 25, 50, 100, 200, 500];
    let once = LENGTHS_MS.map(|length_ms| Fault::Silence { length_ms, every_ms: None });
    let repeated = [50, 100, 200, 500, 1000, 2000].into_iter().flat_map(|every_ms| {
        let lengths_ms = LENGTHS_MS.into_iter().filter(move |length_ms| 2 * length_ms <= every_ms);
        lengths_ms.map(move |length_ms| Fault::Silence { length_ms, every_ms: Some(every_ms) })
    });
    once.into_iter().chain(repeated).collect()
}

fn table(faults: &[Fault], failed: &mut Vec<String>) -> String {
    let outcomes: Vec<_> =
        faults.par_iter().map(|&fault| (fault, SPEEDS_KM_H.map(|speed_km_h| worst(fault, speed_km_h)))).collect();
    let mut table = "| the encoder |".to_owned();
    for speed_km_h in SPEEDS_KM_H {
        write!(table, " {speed_km_h} km/h |").expect("a string has room");
    }
    table += "\n|";
    table += &" --- |".repeat(1 + SPEEDS_KM_H.len());
    for (fault, worst) in outcomes {
        write!(table, "\n| {fault} |").expect("a string has room");
        for (outcome, run) in worst {
            write!(table, " {outcome} |").expect("a string has room");
            if outcome == Outcome::Failed {
                failed.push(format!("{run:?}: {:?}", roll(run)));
            }
        }
    }
    table + "\n"
}

/// The page with a new part between `<!-- name -->` and `<!-- name end -->`.
fn with_part(page: &ExpectFile, name: &str, part: &str) -> String {
    let (begin, end) = (format!("<!-- {name} -->\n"), format!("<!-- {name} end -->"));
    let text = page.data();
    let (before, rest) = text.split_once(&begin).unwrap_or_else(|| panic!("no {begin:?}"));
    let (_, after) = rest.split_once(&end).unwrap_or_else(|| panic!("no {end:?}"));
    [before, &begin, "\n", part, "\n", &end, after].concat()
}

#[test]
fn no_encoder_fault_hits_a_second_canopy_before_the_alarm() {
    let spikes = [1, 2, 5, 10, 17, 20, 50, 100].map(|a_second| Fault::Spikes { a_second });
    let lost = [1, 2, 5, 10, 20, 50, 100, 200].map(|in_1000| Fault::LostEdges { in_1000 });
    let faults: Vec<Fault> = silences().into_iter().chain(spikes).chain(lost).collect();
    let mut failed = Vec::new();
    let table = table(&faults, &mut failed);
    println!("{table}");
    println!("{failed:#?}");
    assert!(failed.is_empty(), "{failed:#?}");
    let page = expect_file!["../../docs/faults.md"];
    page.assert_eq(&with_part(&page, "encoder", &table));
}

#[test]
fn spikes_on_both_channels_are_not_counted() {
    for speed_km_h in [1.0, 2.5, 4.0] {
        let run = Run { fault: Fault::Spikes { a_second: 10 }, speed_km_h, from_mm: 300.0, seed: 1, tick_mm: TICK_MM };
        let shown = roll(run);
        assert!((shown.rolled - shown.counted).abs() <= 4, "{run:?}: {shown:?}");
    }
}

#[test]
fn dropouts_of_a_channel_cost_at_most_one_plant() {
    let tick_mm = 1000.0 / f64::from(TICKS_PER_M_LEAST);
    let runs: Vec<Run> = [tick_mm, 1.0, TICK_MM]
        .into_iter()
        .flat_map(|tick_mm| [0.5, 0.6, 0.75, 0.88, 1.0, 2.5].map(|speed_km_h| (tick_mm, speed_km_h)))
        .flat_map(|of| [4, 8, 20, 60, 200].map(|ticks| (of, ticks)))
        .flat_map(|of| [70, 130, 300, 500, 900].map(|every_mm| (of, every_mm)))
        .map(|(((tick_mm, speed_km_h), ticks), every_mm)| {
            let fault = Fault::Dropouts { ticks, every_mm };
            Run { fault, speed_km_h, from_mm: 1850.0, seed: 1, tick_mm }
        })
        .collect();
    let failed: Vec<String> = runs
        .par_iter()
        .map(|&run| (run, roll(run)))
        .filter(|(_, shown)| shown.outcome() == Outcome::Failed)
        .map(|(run, shown)| format!("{run:?}: {shown:?}"))
        .collect();
    assert!(failed.is_empty(), "{} of {}: {failed:#?}", failed.len(), runs.len());
}
