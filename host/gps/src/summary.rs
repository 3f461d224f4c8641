//! A job in numbers: the stand, the ground, the time, and how many positions there are.
//!
//! A spacing is the distance between two neighbouring plants if the machine was at work all the time between. So a
//! headland is no gap in the stand: the work switch marks the row end. If a spacing is longer than one and a half of
//! the usual one, plants are missing in it. Unknown detections count as plants.

use crate::job::{Did, Event, EventKind, Job, PassedGround};
use crate::track::{Basis, Found};
use crate::wheel::Ratio;
use link::Class;
use serde::Serialize;

/// A spacing with missing plants is longer than this number of usual ones.
const GAP: f64 = 1.5;

/// The parameters of the summary.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stand {
    /// From row to row, in mm.
    pub row_spacing_mm: f64,
    /// Spacing in mm. `None` uses the median of those found.
    pub spacing_mm: Option<f64>,
}

/// A job in numbers.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Summary {
    /// Plants, including unknown detections.
    pub plants: u64,
    /// Unknown detections among them.
    pub unknown: u64,
    /// Mean distance between neighbouring plants without a missing one between, in mm.
    pub spacing_mean_mm: Option<f64>,
    /// Its standard deviation.
    pub spacing_scatter_mm: Option<f64>,
    /// Plants that are missing.
    pub missing: u64,
    /// Tall weeds.
    pub weeds: u64,
    /// Swings out of the row.
    pub swings: u64,
    /// Alarms.
    pub alarms: u64,
    /// Restarts at work.
    pub restarts: u64,
    /// Number of labels.
    pub labels: u64,
    /// Ground of the row over which the machine was at work, in metres.
    pub worked_m: f64,
    /// The weeded part of it.
    pub weeded_m: f64,
    /// The same as a share.
    pub weeded_percent: Option<f64>,
    /// Area: the ground worked, as wide as the rows are apart.
    pub area_ha: f64,
    /// Hours at work.
    pub work_h: f64,
    /// Hours of the record.
    pub record_h: f64,
    /// Events with a position between two successive fixes.
    pub measured: u64,
    /// Events with a position over an outage.
    pub interpolated: u64,
    /// Events without a position.
    pub without_place: u64,
    /// Fixes that are used.
    pub fixes: u64,
    /// How often the fix was lost.
    pub fix_losses: u64,
    /// Fixes that have jumped.
    pub jumps: u64,
    /// Lines of the receiver that came damaged.
    pub damaged_lines: u64,
    /// How often the receiver was lost or silent.
    pub receiver_losses: u64,
    /// Metres by the receiver for a metre of the wheel, over straight stretches. `None` without one.
    pub wheel_ratio: Option<f64>,
    /// Its standard deviation.
    pub wheel_ratio_error: Option<f64>,
    /// Metres that the wheel spun.
    pub wheel_spun_m: f64,
    /// Gaps of the statuses in which the wheel rolled.
    pub wheel_gaps: u64,
}

impl Summary {
    /// That of a job.
    pub fn of(job: &Job, stand: &Stand) -> Self {
        let ratio = Ratio::mean(&job.ratios);
        let mut summary = Self {
            wheel_ratio: ratio.map(|ratio| ratio.value),
            wheel_ratio_error: ratio.map(|ratio| ratio.error),
            wheel_spun_m: job.spun_m,
            fixes: job.counts.fixes,
            fix_losses: job.counts.losses,
            jumps: job.counts.jumps,
            damaged_lines: job.counts.damaged,
            receiver_losses: job.unplugged,
            ..Self::default()
        };
        for event in job.events() {
            match event.kind {
                EventKind::Detection { class: Class::Weed, .. } => summary.weeds += 1,
                EventKind::Detection { class, .. } => {
                    summary.plants += 1;
                    summary.unknown += u64::from(class == Class::Unknown);
                }
                EventKind::SwingOut => summary.swings += 1,
                EventKind::Alarm => summary.alarms += 1,
                EventKind::Label(_) => summary.labels += 1,
                EventKind::SwingIn | EventKind::Guarded | EventKind::WheelSpun => {}
                EventKind::Restart => summary.restarts += 1,
                EventKind::WheelGap => summary.wheel_gaps += 1,
            }
            match event.found {
                Err(_) => summary.without_place += 1,
                Ok(Found { basis: Basis::Interpolated, .. }) => summary.interpolated += 1,
                Ok(_) => summary.measured += 1,
            }
        }
        let (mut work_ms, mut record_ms) = (0, 0);
        for stretch in &job.stretches {
            record_ms += stretch.time_ms.end.saturating_sub(stretch.time_ms.start);
            for ground in stretch.ground.iter().filter(|ground| ground.did != Did::Rolled) {
                let length_m = ground.distance_m.end - ground.distance_m.start;
                summary.worked_m += length_m;
                summary.weeded_m += if ground.did == Did::Weeded { length_m } else { 0.0 };
                work_ms += ground.time_ms.end - ground.time_ms.start;
            }
        }
        summary.weeded_percent = (summary.worked_m > 0.0).then(|| 100.0 * summary.weeded_m / summary.worked_m);
        summary.area_ha = summary.worked_m * stand.row_spacing_mm / 1000.0 / 10_000.0;
        let hours = |time_ms: u64| time_ms as f64 / 3_600_000.0;
        summary.work_h = hours(work_ms);
        summary.record_h = hours(record_ms);
        summary.count_spacings(&spacings_mm(job), stand);
        summary
    }

    fn count_spacings(&mut self, spacings_mm: &[f64], stand: &Stand) {
        let mut sorted = spacings_mm.to_vec();
        sorted.sort_by(f64::total_cmp);
        let usual_mm = stand.spacing_mm.or_else(|| sorted.get(sorted.len() / 2).copied());
        let Some(usual_mm) = usual_mm.filter(|&usual_mm| usual_mm > 0.0) else { return };
        let (single, gaps): (Vec<f64>, Vec<f64>) = spacings_mm.iter().partition(|&&spacing| spacing <= GAP * usual_mm);
        self.missing = gaps.iter().map(|gap| (gap / usual_mm).round() as u64 - 1).sum();
        let count = single.len() as f64;
        let mean = single.iter().sum::<f64>() / count;
        let squares: f64 = single.iter().map(|spacing| (spacing - mean).powi(2)).sum();
        self.spacing_mean_mm = (count > 0.0).then_some(mean);
        self.spacing_scatter_mm = (count > 1.0).then(|| (squares / (count - 1.0)).sqrt());
    }
}

/// The distances between neighbouring plants, in mm, if the machine was at work from one to the other.
fn spacings_mm(job: &Job) -> Vec<f64> {
    let mut spacings = Vec::new();
    for stretch in &job.stretches {
        let is_plant =
            |event: &&Event| matches!(event.kind, EventKind::Detection { class: Class::Plant | Class::Unknown, .. });
        let plants: Vec<&Event> = stretch.events.iter().filter(is_plant).collect();
        // A day has few rests, and many swings.
        let rests: Vec<&PassedGround> = stretch.ground.iter().filter(|ground| ground.did == Did::Rolled).collect();
        let distance_m = |pair: &[&Event]| pair[1].distance_m - pair[0].distance_m;
        // Another row may have a rest at the same distance, by the wheel.
        let is_between = |rest: &PassedGround, pair: &[&Event]| {
            rest.distance_m.start < pair[1].distance_m
                && pair[0].distance_m <= rest.distance_m.end
                && rest.time_ms.start <= pair[1].time_ms
                && pair[0].time_ms <= rest.time_ms.end
        };
        let is_spacing = |pair: &&[&Event]| distance_m(pair) > 0.0 && !rests.iter().any(|rest| is_between(rest, pair));
        spacings.extend(plants.windows(2).filter(is_spacing).map(|pair| 1000.0 * distance_m(pair)));
    }
    spacings
}
