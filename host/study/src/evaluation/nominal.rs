//! Nominal speeds: the few speeds that plots were set to, where the table has the speeds that were measured.
//!
//! An analysis of variance compares plots of the same speed. Measured speeds are all different, so it would have a level
//! for each plot and nothing left for chance.

use super::PlotRecord;
use crate::statistics::grouped;
use crate::table::{distinct, list};
use anyhow::{Result, ensure};

const STEPS_KM_H: [f64; 5] = [1.0, 0.5, 0.25, 0.2, 0.1];

/// The greatest error of a measured speed, as a share of the step.
const OFF_STEP: f64 = 0.3;

/// The same, as a share of the nominal speed.
const OFF_SPEED: f64 = 0.3;

/// Plots of a treatment, on average, from which the treatments count as repeated.
const REPEATED: f64 = 1.5;

/// The nominal speeds that the plots seem to have had. `None` if their own speeds repeat, or fit no step.
pub(super) fn guessed(records: &[PlotRecord]) -> Option<Vec<f64>> {
    let is_repeated = |speed: &dyn Fn(f64) -> f64| {
        let treatments =
            grouped(records.iter().map(|record| ((speed(record.speed_km_h), record.spacing_cm), ()))).len();
        records.len() as f64 >= REPEATED * treatments as f64
    };
    if is_repeated(&|speed| speed) {
        return None;
    }
    let of_step = |step: f64| {
        // Tenths and hundredths without the digits of a sum.
        let nominal = move |speed: f64| ((speed / step).round() * step * 100.0).round() / 100.0;
        let speeds = || records.iter().map(|record| record.speed_km_h);
        let is_near = speeds().all(|speed| (speed - nominal(speed)).abs() <= OFF_STEP * step && nominal(speed) > 0.0);
        let levels = distinct(speeds().map(nominal));
        (is_near && levels.len() > 1 && levels.len() < distinct(speeds()).len() && is_repeated(&nominal))
            .then_some(levels)
    };
    STEPS_KM_H.into_iter().find_map(of_step)
}

/// The nearest of the nominal speeds for each plot.
///
/// # Errors
/// If a plot is far from all of them.
pub(super) fn nearest(records: &[PlotRecord], nominal_km_h: &[f64]) -> Result<Vec<f64>> {
    let of_plot = |record: &PlotRecord| {
        let (plot, speed) = (record.plot, record.speed_km_h);
        let off = |nominal: &f64| (nominal - speed).abs();
        let nearest = nominal_km_h.iter().copied().min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(speed);
        ensure!(
            off(&nearest) <= OFF_SPEED * nearest,
            "plot {plot}: its speed, {speed} km/h, is far from {} km/h: add its nominal speed",
            list(nominal_km_h)
        );
        Ok(nearest)
    };
    records.iter().map(of_plot).collect()
}
