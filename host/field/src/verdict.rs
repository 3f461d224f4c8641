//! The verdict on each plant: from the servo's pulses to the tool's effect on the row.
//!
//! Pulses become commands and the tool's angle over time ([`crate::servo`]). With the machine's motion this becomes an
//! angle over the ground. A plant is *damaged* if the tool entered the protected zone round its stem
//! ([`crate::tool_path`]). Its keep-out zone, which is larger, is *reached* if the tool entered that. A margin is *cut*
//! if the tool came nearer to the keep-out zone than the margin, by more than [`MARGIN_TOLERANCE_MM`].
//!
//! A keep-out zone is the plant's canopy, as wide across the row as along it. The tool has to be fully out over it. With
//! a stem zone, the keep-out zone is the part of the canopy that the firmware keeps, and each of its ends is half of the
//! stem zone's circle. Only the part of the tool that reaches the circle counts. A canopy has the width that the beam saw
//! only at the beam's height. The margin reaches to the tool's middle along the row, so half of the tool's length is in it.
//!
//! A swing is also compared with its ideal position. The ideal follows from the true ends of the canopy, the margin,
//! the leads of the [`ZoneSettings`] and the true speed at that moment. Plants that share one swing share its two commands:
//! the first plant has the command out, the last one has the command back.

mod swing;
mod timing;

pub use self::timing::ZoneSettings;

use self::swing::Swing;
use self::timing::Level;
use crate::driving::Steering;
use crate::ground::{between, share_of, union};
use crate::machine::Machine;
use crate::motion::Motion;
use crate::row::{Canopy, Row};
use crate::servo::{OUT_DEGREES, Stroke};
use crate::tool_path::Swinging;
use serde::Serialize;
use std::ops::Range;
use strum::Display;
use uno::Pulse;

/// A margin that is short by less than this still counts as kept.
pub const MARGIN_TOLERANCE_MM: f64 = 10.0;

/// The result for a plant, from good to bad.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Display, Serialize)]
#[serde(rename_all = "camelCase")]
pub enum Verdict {
    /// The tool kept away from it by the margin.
    #[strum(to_string = "kept")]
    Kept,
    /// The tool came nearer than the margin allows, but did not enter the keep-out zone.
    #[strum(to_string = "margin cut")]
    MarginCut,
    /// The tool entered its keep-out zone, but not the protected zone round its stem.
    #[strum(to_string = "zone reached")]
    Reached,
    /// The tool entered the protected zone round its stem.
    #[strum(to_string = "DAMAGED")]
    Damaged,
}

/// The result for a plant.
#[derive(Clone, Debug, PartialEq)]
pub struct PlantOutcome {
    /// The plant.
    pub plant: Canopy,
    /// The protected stretch: its canopy, or the zone round its stem.
    pub kept_mm: Range<f64>,
    /// How much farther ahead the keep-out zone could have begun without being reached; negative if it was. `None` if
    /// the tool was out from the beginning.
    pub clearance_before_mm: Option<f64>,
    /// How much farther behind it could have ended; negative if it was reached. `None` if the tool stayed out to the
    /// end.
    pub clearance_behind_mm: Option<f64>,
    /// The position along the row at which the tool was fully out before the plant.
    pub clear_mm: Option<f64>,
    /// The position along the row at which the tool began to come back behind the plant.
    pub back_mm: Option<f64>,
    /// How often the tool was swung out over it.
    pub swings: usize,
    /// How late the command to swing out for this plant was, in ticks; negative if early. `None` if the plant had no
    /// such command of its own.
    pub out_error_ticks: Option<f64>,
    /// How late the command to come back behind this plant was, in ticks; negative if early. `None` as above.
    pub in_error_ticks: Option<f64>,
    /// The verdict.
    pub verdict: Verdict,
}

/// The result for a tall weed.
#[derive(Clone, Debug, PartialEq)]
pub struct WeedOutcome {
    /// The weed.
    pub weed: Canopy,
    /// Whether the tool worked the row's line over the weed's middle.
    pub cut: bool,
}

/// The result for the row.
#[derive(Clone, Debug, PartialEq)]
pub struct Judgement {
    /// Every plant, in the order of the row.
    pub plants: Vec<PlantOutcome>,
    /// Every tall weed, in the order of the row.
    pub weeds: Vec<WeedOutcome>,
    /// Keep-out zones: each canopy with its margins.
    pub windows_mm: Vec<Range<f64>>,
    /// Ground over which the tool was fully out.
    pub clear_mm: Vec<Range<f64>>,
    /// Ground over which the tool worked the row's line.
    pub weeded_mm: Vec<Range<f64>>,
    /// The tool's angle over the ground below it: positions and degrees, with straight lines between them.
    pub path: Vec<(f64, f64)>,
    /// Swings out that passed no plant, without the first swing into the row.
    pub idle_swings: usize,
    /// Share of the row's length that was weeded, from 0 to 1.
    pub weeded_share: f64,
    /// Share of the row's length that could be weeded at best: see [`weedable_share`].
    pub weedable_share: f64,
}

impl Judgement {
    /// Number of plants with a verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.plants.iter().filter(|plant| plant.verdict == verdict).count()
    }

    /// Number of plants whose keep-out zone was reached, damaged ones included.
    pub fn reached(&self) -> usize {
        self.plants.iter().filter(|plant| plant.verdict >= Verdict::Reached).count()
    }

    /// The error of each swing in ticks, positive if late.
    pub fn swing_errors_ticks(&self) -> Vec<f64> {
        self.plants.iter().flat_map(|plant| [plant.out_error_ticks, plant.in_error_ticks]).flatten().collect()
    }
}

/// The largest share of the row's length that this machine can weed at this motion without cutting a margin.
///
/// Around each plant a length `U = w + 2 m + k v (T_out + T_in)` is left: the kept ground, both margins, and the distance
/// travelled while the tool swings and does not work the row's line. `T` is the servo's travel. Its dead time costs
/// nothing with the right leads. At the ends of a stem zone's circle, the tool may still swing. The inter-row tools are
/// not part of this figure.
pub fn weedable_share(row: &Row, machine: &Machine, motion: &Motion, timing: ZoneSettings) -> f64 {
    let degrees_a_s = OUT_DEGREES / (machine.servo.travel_ms / 1000.0);
    let levels: Vec<(Level, f64)> = timing
        .outline()
        .into_iter()
        .map(|level| (level, (machine.degrees_beside(level.aside_mm) - machine.line_degrees()).max(0.0) / degrees_a_s))
        .collect();
    let lost = row.plants().map(|plant| {
        let speed_mm_s = |ground_mm: f64| {
            let first = motion.passings(ground_mm + machine.beam_to_tool_mm).next();
            first.map_or(0.0, |passing| motion.speed_mm_s(passing.time_s).abs())
        };
        let kept = timing.kept_mm(plant);
        let margin_mm = (f64::from(timing.margin_mm) - machine.half_length_mm()).max(0.0);
        let window = kept.start - margin_mm..kept.end + margin_mm;
        let farthest_mm = |speed_mm_s: f64| {
            let of_level = |&(level, swing_s): &(Level, f64)| speed_mm_s * swing_s - level.inside_mm;
            levels.iter().map(of_level).fold(f64::NEG_INFINITY, f64::max)
        };
        window.start - farthest_mm(speed_mm_s(window.start))..window.end + farthest_mm(speed_mm_s(window.end))
    });
    1.0 - share_of(&row.span_mm(), &union(lost.collect()))
}

/// Judges what these pulses did to the row. The motion began at `start_cycle`.
pub fn judge(
    row: &Row,
    machine: &Machine,
    motion: &Motion,
    timing: ZoneSettings,
    pulses: &[Pulse],
    start_cycle: u64,
) -> Judgement {
    let commands = machine.servo.commands(pulses);
    let stroke = machine.servo.stroke(&commands, start_cycle);
    let whole_s = 0.0..motion.duration_s();
    let half_mm = machine.half_length_mm();
    let ground_below = |degrees: f64| {
        let forward_mm = machine.forward_mm(degrees);
        let worked_mm = |times_s: &Range<f64>| {
            let ground = machine.worked_mm(motion, times_s);
            // A tool that comes back into the row is carried back along it.
            let back_mm =
                if forward_mm > 0.0 { carried_back_mm(machine, motion, &stroke, times_s) } else { ground.start };
            back_mm - half_mm..ground.end + forward_mm + half_mm
        };
        union(stroke.times_below_s(degrees, &whole_s).iter().map(worked_mm).collect())
    };
    let closed = ground_below(machine.clear_degrees());
    let over_zone: Vec<(Level, Vec<Range<f64>>)> = timing
        .outline()
        .into_iter()
        .map(|level| (level, ground_below(machine.degrees_beside(level.aside_mm))))
        .collect();
    let weeded = ground_below(machine.line_degrees());
    let run = machine.worked_mm(motion, &whole_s);
    // How late a command was against its ideal position, in ticks. `None` unless the machine rolls forward.
    let late_ticks = |time_s: f64, window_mm: f64, lead_ms: u32| {
        let speed_mm_s = motion.speed_mm_s(time_s);
        let ideal_mm = window_mm + machine.beam_to_tool_mm - speed_mm_s * f64::from(lead_ms) / 1000.0;
        (speed_mm_s > 0.0).then(|| (motion.position_mm(time_s) - ideal_mm) / machine.tick_mm())
    };
    let works = |place_mm: f64| {
        let mut passings = motion.passings(place_mm + machine.beam_to_tool_mm);
        passings.any(|passing| stroke.degrees(passing.time_s) < machine.line_degrees())
            || half_mm > 0.0 && weeded.iter().any(|ground| ground.contains(&place_mm))
    };

    let mut plants: Vec<PlantOutcome> =
        row.plants().map(|plant| plant_outcome(plant, &closed, &over_zone, machine, timing)).collect();
    let steering = Steering::default();
    let swinging = Swinging { machine, motion, steering: &steering, stroke: &stroke };
    // A stem may stand beyond its canopy's end. A plant that the beam cannot see is not in the row.
    for stem in row.stems().iter().filter(|stem| stem.is_seen && swinging.damages(stem)) {
        let away_mm = |of: &PlantOutcome| {
            let span = of.plant.span_mm();
            (span.start - stem.along_mm).max(stem.along_mm - span.end)
        };
        if let Some(plant) = plants.iter_mut().min_by(|a, b| away_mm(a).total_cmp(&away_mm(b))) {
            plant.verdict = Verdict::Damaged;
        }
    }
    let mut idle_swings = 0;
    for swing in Swing::all(&commands, start_cycle) {
        let during_s = swing.out_s.unwrap_or(0.0)..swing.in_s.unwrap_or(whole_s.end);
        let worked = machine.worked_mm(motion, &during_s);
        // Plants stand in ascending order, and apart.
        let first = plants.partition_point(|plant| plant.plant.span_mm().end <= worked.start);
        let behind = plants.partition_point(|plant| plant.plant.span_mm().start < worked.end);
        let passed = &mut plants[first..behind];
        passed.iter_mut().for_each(|plant| plant.swings += 1);
        idle_swings += usize::from(passed.is_empty() && swing.out_s.is_some());
        if let Some(first) = passed.first_mut() {
            let out_mm = timing.window_mm(&first.plant).start;
            first.out_error_ticks = swing.out_s.and_then(|time_s| late_ticks(time_s, out_mm, timing.lead_out_ms));
        }
        if let Some(last) = passed.last_mut() {
            let in_mm = timing.window_mm(&last.plant).end;
            last.in_error_ticks = swing.in_s.and_then(|time_s| late_ticks(time_s, in_mm, timing.lead_in_ms));
        }
    }

    Judgement {
        plants,
        windows_mm: union(row.plants().map(|plant| timing.window_mm(plant)).collect()),
        weeds: row.weeds().map(|weed| WeedOutcome { weed: weed.clone(), cut: works(weed.position_mm) }).collect(),
        clear_mm: between(&closed, &run),
        path: path(machine, motion, &stroke),
        idle_swings,
        weeded_share: share_of(&row.span_mm(), &weeded),
        weeded_mm: weeded,
        weedable_share: weedable_share(row, machine, motion, timing),
    }
}

/// Clearances and verdict of a plant. `closed` is the ground over which the tool was not fully out. `over_zone` is the
/// ground over which its edge was nearer to the row's line than each point of the zone's outline.
fn plant_outcome(
    plant: &Canopy,
    closed: &[Range<f64>],
    over_zone: &[(Level, Vec<Range<f64>>)],
    machine: &Machine,
    timing: ZoneSettings,
) -> PlantOutcome {
    let kept = timing.kept_mm(plant);
    let (clear_mm, back_mm) = swings_beside(closed, &kept, plant.position_mm);
    let (mut clearance_before_mm, mut clearance_behind_mm) = (None, None);
    for (level, ground) in over_zone {
        let zone = kept.start + level.inside_mm..kept.end - level.inside_mm;
        let (out_mm, in_mm) = swings_beside(ground, &zone, plant.position_mm);
        let lesser = |clearance_mm, now_mm| [clearance_mm, now_mm].into_iter().flatten().reduce(f64::min);
        clearance_before_mm = lesser(clearance_before_mm, out_mm.map(|out_mm| zone.start - out_mm));
        clearance_behind_mm = lesser(clearance_behind_mm, in_mm.map(|in_mm| in_mm - zone.end));
    }
    let narrowest_mm = [clearance_before_mm, clearance_behind_mm].into_iter().flatten().fold(f64::INFINITY, f64::min);
    // A stroke that ends within the zone does not clear it.
    let verdict = if narrowest_mm < 0.0 || machine.room_mm() < timing.kept_across_mm(plant) / 2.0 {
        Verdict::Reached
    } else if narrowest_mm < f64::from(timing.margin_mm) - machine.half_length_mm() - MARGIN_TOLERANCE_MM {
        Verdict::MarginCut
    } else {
        Verdict::Kept
    };
    PlantOutcome {
        plant: plant.clone(),
        kept_mm: kept,
        clearance_before_mm,
        clearance_behind_mm,
        clear_mm,
        back_mm,
        swings: 0,
        out_error_ticks: None,
        in_error_ticks: None,
        verdict,
    }
}

/// Where the tool had left the row before a zone, and where it came back behind it, but not beyond the zone's other end.
/// `near` is the ground that it had not left.
fn swings_beside(near: &[Range<f64>], zone: &Range<f64>, middle_mm: f64) -> (Option<f64>, Option<f64>) {
    // The zone's middle divides the swing before the plant from the one behind it. If a swing began or ended beyond
    // the middle, its end divides them.
    let across = near.iter().find(|ground| ground.contains(&middle_mm));
    let parting_mm = match across {
        Some(ground) if ground.end < zone.end => ground.end,
        Some(ground) if ground.start > zone.start => ground.start,
        _ => middle_mm,
    };
    let before = near.iter().rev().find(|ground| ground.start < parting_mm);
    let behind = near.iter().find(|ground| ground.end > parting_mm);
    (before.map(|ground| ground.end.min(zone.end)), behind.map(|ground| ground.start.max(zone.start)))
}

/// The least position of the tool in the first moments of a time in which its arm swings in.
fn carried_back_mm(machine: &Machine, motion: &Motion, stroke: &Stroke, times_s: &Range<f64>) -> f64 {
    let places_mm = (0..=SWING_STEPS).map(|step| {
        let time_s = (times_s.start + f64::from(step) * SWING_STEP_S).min(times_s.end);
        machine.tool_mm(motion.position_mm(time_s)) + machine.forward_mm(stroke.degrees(time_s))
    });
    places_mm.fold(f64::INFINITY, f64::min)
}

/// Steps that are together longer than a swing.
const SWING_STEPS: u32 = 500;
const SWING_STEP_S: f64 = 0.001;

fn path(machine: &Machine, motion: &Motion, stroke: &Stroke) -> Vec<(f64, f64)> {
    let during_s = 0.0..motion.duration_s();
    let turns_s = stroke.turns_s().filter(|time_s| during_s.contains(time_s));
    std::iter::once(during_s.start)
        .chain(turns_s)
        .chain([during_s.end])
        .map(|time_s| {
            let degrees = stroke.degrees(time_s);
            (machine.tool_mm(motion.position_mm(time_s)) + machine.forward_mm(degrees), degrees)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::cycle_at;
    use crate::motion::mm_s;
    use crate::row::Stem;
    use uno::CYCLES_PER_SECOND;

    const START_CYCLE: u64 = 16_000_000;

    /// Two plants and a weed between them, passed at 2.5 km/h.
    fn row() -> Row {
        Row::new(vec![Canopy::plant(1000.0, 150.0), Canopy::weed(1300.0, 15.0), Canopy::plant(1600.0, 150.0)]).unwrap()
    }

    fn motion() -> Motion {
        Motion::steady(-500.0, 1000.0, mm_s(2.5), 3000.0)
    }

    /// The first pulse of each width: out at power-up, in at the first position of the machine, out at the second, and so on.
    fn pulses(motion: &Motion, changes_mm: &[f64]) -> Vec<Pulse> {
        let rises = changes_mm.iter().map(|&mm| cycle_at(START_CYCLE, motion.passings(mm).next().unwrap().time_s));
        let widths = [2000, 1500].map(|us| us * CYCLES_PER_SECOND / 1_000_000).into_iter().cycle();
        [0].into_iter().chain(rises).zip(widths).map(|(rise, width)| Pulse { rise, fall: rise + width }).collect()
    }

    /// Positions of the machine at which the swings of [`row`] should be commanded, with these leads.
    fn ideal_mm(timing: ZoneSettings) -> Vec<f64> {
        let lead_mm = |lead_ms: u32| mm_s(2.5) * f64::from(lead_ms) / 1000.0;
        let mut places = vec![200.0];
        for plant in row().plants() {
            let span = plant.span_mm();
            let margin_mm = f64::from(timing.margin_mm);
            places.push(span.start + 400.0 - margin_mm - lead_mm(timing.lead_out_ms));
            places.push(span.end + 400.0 + margin_mm - lead_mm(timing.lead_in_ms));
        }
        places
    }

    fn judged(changes_mm: &[f64], timing: ZoneSettings) -> Judgement {
        let motion = motion();
        let pulses = pulses(&motion, changes_mm);
        judge(&row(), &Machine::default(), &motion, timing, &pulses, START_CYCLE)
    }

    #[test]
    fn swings_with_their_leads_keep_every_plant_and_its_margin() {
        let judgement = judged(&ideal_mm(ZoneSettings::default()), ZoneSettings::default());
        for plant in &judgement.plants {
            assert_eq!((plant.verdict, plant.swings), (Verdict::Kept, 1));
            // The servo knows the command only at the end of the pulse, 2 ms and 1.4 mm after its beginning.
            let before_mm = plant.clearance_before_mm.unwrap();
            assert!((before_mm - 48.6).abs() < 0.2, "{before_mm} mm before");
            // The lead is 40 ms, of 60 ms of dead time.
            let behind_mm = plant.clearance_behind_mm.unwrap();
            assert!((behind_mm - 64.9).abs() < 0.2, "{behind_mm} mm behind");
        }
        let worst = judgement.swing_errors_ticks().into_iter().fold(0.0, |worst: f64, error| worst.max(error.abs()));
        assert_eq!(judgement.swing_errors_ticks().len(), 4);
        assert!(worst < 0.01, "{worst} ticks");
        assert!(judgement.weeds[0].cut);
        assert_eq!(judgement.idle_swings, 0);
        assert!(judgement.weeded_share <= judgement.weedable_share);
    }

    #[test]
    fn swings_commanded_where_they_should_be_done_damage_the_plants_at_speed() {
        let timing = ZoneSettings::as_in_the_paper();
        let judgement = judged(&ideal_mm(timing), timing);
        assert_eq!(judgement.reached(), 2);
        // 180 ms of dead time and travel, less the margin.
        let before_mm = judgement.plants[0].clearance_before_mm.unwrap();
        assert!((before_mm - (50.0 - 0.182 * mm_s(2.5))).abs() < 0.2, "{before_mm} mm");
    }

    #[test]
    fn a_swing_that_is_late_by_less_than_the_margin_cuts_only_the_margin() {
        let mut places = ideal_mm(ZoneSettings::default());
        places[1] += 30.0;
        let judgement = judged(&places, ZoneSettings::default());
        assert_eq!(judgement.plants[0].verdict, Verdict::MarginCut);
        assert_eq!(judgement.plants[1].verdict, Verdict::Kept);
        let error = judgement.plants[0].out_error_ticks.unwrap();
        assert!((error - 30.0 / Machine::default().tick_mm()).abs() < 0.01, "{error} ticks");
    }

    #[test]
    fn a_plant_without_a_swing_is_damaged() {
        let judgement = judged(&[200.0], ZoneSettings::default());
        assert_eq!(judgement.reached(), 2);
        assert!(judgement.plants.iter().all(|plant| plant.swings == 0));
        assert!(judgement.swing_errors_ticks().is_empty());
        assert_eq!(judgement.weeded_share, 1.0);
    }

    #[test]
    fn a_damaged_stem_belongs_to_the_nearest_plant_if_the_beam_sees_it() {
        let (motion, timing) = (motion(), ZoneSettings::default());
        let pulses = pulses(&motion, &ideal_mm(timing));
        for (is_seen, verdicts) in [(true, [Verdict::Damaged, Verdict::Kept]), (false, [Verdict::Kept; 2])] {
            let mut row = row();
            row.stems = Some(vec![Stem { is_seen, ..Stem::at(1250.0) }]);
            let judgement = judge(&row, &Machine::default(), &motion, timing, &pulses, START_CYCLE);
            assert!(judgement.plants.iter().map(|plant| plant.verdict).eq(verdicts), "{is_seen}");
        }
    }

    #[test]
    fn plants_that_share_a_swing_share_its_commands() {
        let places = ideal_mm(ZoneSettings::default());
        let judgement = judged(&[places[0], places[1], places[4]], ZoneSettings::default());
        let [first, last] = judgement.plants.as_slice() else {
            panic!("two plants");
        };
        assert_eq!((first.swings, last.swings), (1, 1));
        assert!(first.out_error_ticks.is_some() && first.in_error_ticks.is_none());
        assert!(last.out_error_ticks.is_none() && last.in_error_ticks.is_some());
        assert!(!judgement.weeds[0].cut, "the tool was out over the weed");
    }

    #[test]
    fn a_swing_for_a_weed_is_idle() {
        let mut places = ideal_mm(ZoneSettings::default());
        places.splice(3..3, [1600.0, 1700.0]);
        let judgement = judged(&places, ZoneSettings::default());
        assert_eq!(judgement.idle_swings, 1);
        assert!(!judgement.weeds[0].cut);
    }

    #[test]
    fn a_tool_that_stays_out_weeds_nothing_and_harms_nothing() {
        let judgement = judged(&[], ZoneSettings::default());
        assert_eq!(judgement.count(Verdict::Kept), 2);
        assert_eq!(judgement.weeded_share, 0.0);
        assert_eq!(judgement.plants[0].clear_mm, None);
    }

    #[test]
    fn rolling_back_with_the_tool_in_damages_a_plant_that_was_kept_before() {
        let places = ideal_mm(ZoneSettings::default());
        let there = motion();
        let pulses = pulses(&there, &places);
        let back = motion().change_speed(-mm_s(1.0), 1000.0).roll_to(1000.0);
        let judgement = judge(&row(), &Machine::default(), &back, ZoneSettings::default(), &pulses, START_CYCLE);
        assert_eq!(judgement.reached(), 2);
    }

    #[test]
    fn the_weedable_share_follows_from_canopy_margins_and_swings() {
        let share = weedable_share(&row(), &Machine::default(), &motion(), ZoneSettings::default());
        let lost_mm = 150.0 + 2.0 * 50.0 + 2.0 * 0.9 * mm_s(2.5) * 0.12;
        assert!((share - (1.0 - lost_mm / 600.0)).abs() < 0.001, "{share}");
    }
}
