//! The evaluation of a field trial: from the counts of each plot to the paper's measures (Eq. 22 to 27), and from these
//! to models and analyses of variance, beside the paper's own figures.
//!
//! A trial has plots at some speeds and plant spacings, with replications. [`PlotRecord`] is one plot. [`read_csv`] reads
//! plots from CSV. [`PlotRecord::performance`] calculates the measures of one plot, and [`Analysis`] analyses
//! all plots. [`published`] holds the paper's printed figures. The code does not distinguish real plots from simulated
//! plots.

pub mod field_log;
mod findings;
mod nominal;
mod plot;
pub mod published;
pub(crate) mod report;
mod table;

pub(crate) use self::plot::COLUMNS;
pub use self::plot::{Performance, PlotRecord, Response};
pub use self::table::read_csv;

use self::published::Published;
use crate::statistics::{
    AnalysisOfVariance, BinomialModel, Checks, Design, LinearModel, Mean, NoModel, Share, grouped,
};
use anyhow::{Result, anyhow, bail, ensure};
use serde::Serialize;

/// The analysis of all plots of a trial.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The plots.
    pub records: Vec<PlotRecord>,
    /// The nominal speed of each plot, km/h. It is the plot's own if no nominal speeds were given.
    pub levels_km_h: Vec<f64>,
    /// The analysis of each measure, in the order of [`Response::ALL`].
    pub responses: Vec<ResponseAnalysis>,
    /// Whether a plot had no number of its own, so that all are numbered in the order of the records.
    pub is_renumbered: bool,
}

/// The analysis of one measure over all plots.
#[derive(Clone, Debug)]
pub struct ResponseAnalysis {
    /// The measure.
    pub response: Response,
    /// The plots that have it, numbered from 0. All vectors below are in this order.
    pub plots: Vec<usize>,
    /// The number of each of them in the field.
    pub numbers: Vec<u32>,
    /// Its lowest and its highest value in a plot, in its unit. `None` if no plot has it.
    pub range: Option<(f64, f64)>,
    /// The measure as a linear function of speed in km/h and spacing in cm.
    pub model: Result<LinearModel, NoModel>,
    /// The checks of that model's residuals; `None` without a model.
    pub checks: Option<Checks>,
    /// The binomial model of its counts; `None` for a measure that is not counted.
    pub binomial: Option<Result<BinomialModel, NoModel>>,
    /// Its two-way analysis of variance by speed and spacing, with their interaction, and the replications as blocks.
    pub variance: Result<AnalysisOfVariance, NoModel>,
    /// The paper's figures for it.
    pub published: Published,
}

/// The plots of one speed and spacing together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Treatment {
    /// Forward speed, nominal, km/h.
    pub speed_km_h: f64,
    /// Plant spacing, cm.
    pub spacing_cm: f64,
    /// How many plots there are.
    pub plots: usize,
    /// The mean of each measure over the plots that have it, and the damage of all their plants together.
    pub mean: Performance,
    /// Damaged plants of all these plots together.
    pub damaged: Share,
    /// Their mean weeding efficiency in %, with its interval. `None` if no plot has it.
    pub weeding_efficiency: Option<Mean>,
}

impl Analysis {
    /// Analyses the plots of a trial.
    ///
    /// # Errors
    /// If there is no plot, none that is filled in, an invalid one, or a replication of a treatment twice. A measure without
    /// a model has a [`NoModel`] instead.
    pub fn of(records: Vec<PlotRecord>) -> Result<Self> {
        Self::at_speeds(records, &[])
    }

    /// Analyses the plots of a trial whose speeds were measured, each at the nearest of these nominal speeds. The
    /// linear and binomial models keep the measured speeds. Without nominal speeds, each plot has its own.
    ///
    /// # Errors
    /// As [`of`](Self::of), and if a plot is far from each nominal speed.
    pub fn at_speeds(mut records: Vec<PlotRecord>, nominal_km_h: &[f64]) -> Result<Self> {
        let is_renumbered = records.iter().any(|record| record.plot == 0);
        if is_renumbered {
            (1..).zip(&mut records).for_each(|(number, record)| record.plot = number);
        }
        let levels_km_h = match nominal_km_h {
            [] => records.iter().map(|record| record.speed_km_h).collect(),
            nominal_km_h => nominal::nearest(&records, nominal_km_h)?,
        };
        Ok(Self { is_renumbered, ..Self::at_levels(records, levels_km_h)? })
    }

    /// Analyses the plots of a trial whose speeds were measured, each at its own nominal speed.
    ///
    /// # Errors
    /// As [`of`](Self::of).
    pub fn at_levels(records: Vec<PlotRecord>, levels_km_h: Vec<f64>) -> Result<Self> {
        ensure!(!records.is_empty(), "a trial has at least one plot");
        for record in &records {
            record.check().map_err(|problem| anyhow!("plot {}: {problem}", record.plot))?;
        }
        let all = records.len();
        ensure!(
            !records.iter().all(PlotRecord::is_blank),
            "{all} of {all} plots are not filled in: enter what was counted"
        );
        let replications = records.iter().zip(&levels_km_h).map(|(of, level)| (of.replication, *level, of.spacing_cm));
        for ((replication, speed, spacing), plots) in grouped(replications.zip(records.iter().map(|of| of.plot))) {
            if let [first, second, ..] = plots.as_slice() {
                bail!(
                    "plots {first} and {second} are both replication {replication} of {speed} km/h and {spacing} cm: each plot needs its own replication"
                );
            }
        }
        let responses = Response::ALL.map(|response| ResponseAnalysis::of(response, &records, &levels_km_h)).to_vec();
        Ok(Self { records, levels_km_h, responses, is_renumbered: false })
    }

    /// Damaged plants of all plots together.
    pub fn damage(&self) -> Share {
        damaged(&self.records)
    }

    /// The plots by treatment, slow and narrow first.
    pub fn treatments(&self) -> Vec<Treatment> {
        let plots = self.records.iter().zip(&self.levels_km_h);
        let mut of_treatments = grouped(plots.map(|(plot, level)| ((*level, plot.spacing_cm), plot)));
        of_treatments.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        of_treatments.into_iter().map(|(treatment, plots)| Treatment::of(treatment, &plots)).collect()
    }
}

impl ResponseAnalysis {
    /// The analysis of one measure over the plots that have it.
    fn of(response: Response, records: &[PlotRecord], levels_km_h: &[f64]) -> Self {
        let with_value =
            (0..).zip(records).filter_map(|(plot, record)| Some((plot, response.value(&record.performance())?)));
        let (plots, values): (Vec<usize>, Vec<f64>) = with_value.unzip();
        let records = || plots.iter().map(|&plot| &records[plot]);
        let levels = plots.iter().map(|&plot| levels_km_h[plot]);
        let factors = records().zip(levels).map(|(of, level)| (of.speed_km_h, of.spacing_cm, level, of.replication));
        let design = Design::in_blocks(factors);
        let is_measured = if plots.is_empty() { Err(NoModel::NotMeasured) } else { Ok(()) };
        let model = is_measured.and_then(|()| LinearModel::fit(&design, &values));
        let counts: Vec<(u32, u32)> = records().filter_map(|record| response.count(record)).collect();
        let binomial = || is_measured.and_then(|()| BinomialModel::fit(&design, &counts));
        let numbers: Vec<u32> = records().map(|record| record.plot).collect();
        let extreme = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick);
        Self {
            response,
            range: extreme(f64::min).zip(extreme(f64::max)),
            checks: model.as_ref().ok().map(|model| Checks::of(&design, &values, model, &numbers)),
            numbers,
            model,
            binomial: response.is_counted().then(binomial),
            variance: is_measured.and_then(|()| AnalysisOfVariance::of(&design, &values)),
            published: Published::of(response),
            plots,
        }
    }
}

impl Treatment {
    /// The treatment of these plots, at least one.
    fn of((speed_km_h, spacing_cm): (f64, f64), records: &[&PlotRecord]) -> Self {
        let mean = |quantity: fn(Performance) -> Option<f64>| {
            let values: Vec<f64> = records.iter().filter_map(|record| quantity(record.performance())).collect();
            (!values.is_empty()).then(|| Mean::of(&values))
        };
        let mean_of = |quantity| mean(quantity).map(|of| of.mean);
        let damaged = damaged(records.iter().copied());
        Self {
            speed_km_h,
            spacing_cm,
            plots: records.len(),
            mean: Performance {
                plant_damage_percent: damaged.percent(),
                weeding_efficiency_percent: mean_of(|plot| plot.weeding_efficiency_percent),
                theoretical_capacity_ha_h: mean_of(|plot| plot.theoretical_capacity_ha_h),
                effective_capacity_ha_h: mean_of(|plot| plot.effective_capacity_ha_h),
                field_efficiency_percent: mean_of(|plot| plot.field_efficiency_percent),
                performance_index: mean_of(|plot| plot.performance_index),
            },
            damaged,
            weeding_efficiency: mean(|plot| plot.weeding_efficiency_percent),
        }
    }
}

fn damaged<'a>(records: impl IntoIterator<Item = &'a PlotRecord>) -> Share {
    let counts = records.into_iter().filter_map(|record| Response::PlantDamage.count(record));
    let (damaged, plants) =
        counts.fold((0, 0), |(all, of), (damaged, plants)| (all + u64::from(damaged), of + u64::from(plants)));
    Share::of(damaged, plants)
}

#[cfg(test)]
mod tests;
