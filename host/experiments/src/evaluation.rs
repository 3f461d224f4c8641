//! The evaluation of a field trial: from the counts of each plot to the paper's measures (Eq. 22 to 27), and from these
//! to models and analyses of variance, beside the paper's own figures.
//!
//! A trial has plots at some speeds and plant spacings, with replications. [`PlotRecord`] is one plot. [`read_csv`] reads
//! plots from CSV. [`PlotRecord::performance`] calculates the measures of one plot, and [`Analysis`] analyses
//! all plots. [`published`] holds the paper's printed figures. The code does not distinguish real plots from simulated
//! plots.

mod findings;
mod plot;
pub mod published;
pub(crate) mod report;
mod table;

pub use self::plot::{COLUMNS, Performance, PlotRecord, Response};
pub use self::table::read_csv;

use self::published::Published;
use crate::statistics::{
    AnalysisOfVariance, BinomialModel, Checks, Design, LinearModel, Mean, NoModel, Share, grouped, mean,
};
use anyhow::{Result, anyhow, ensure};
use serde::Serialize;

/// The analysis of all plots of a trial.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The plots.
    pub records: Vec<PlotRecord>,
    /// The measures of each plot, in the same order.
    pub performances: Vec<Performance>,
    /// The analysis of each measure, in the order of [`Response::ALL`].
    pub responses: Vec<ResponseAnalysis>,
}

/// The analysis of one measure over all plots.
#[derive(Clone, Debug)]
pub struct ResponseAnalysis {
    /// The measure.
    pub response: Response,
    /// Its lowest and its highest value in a plot, in its unit.
    pub range: (f64, f64),
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
    /// Forward speed, km/h.
    pub speed_km_h: f64,
    /// Plant spacing, cm.
    pub spacing_cm: f64,
    /// How many plots there are.
    pub plots: usize,
    /// The mean of each measure over them.
    pub mean: Performance,
    /// Damaged plants of all these plots together.
    pub damaged: Share,
    /// Their mean weeding efficiency in %, with its interval.
    pub weeding_efficiency: Mean,
}

impl Analysis {
    /// Analyses the plots of a trial.
    ///
    /// # Errors
    /// If there is no plot, or an invalid one. A measure without a model has a [`NoModel`] instead.
    pub fn of(records: Vec<PlotRecord>) -> Result<Self> {
        ensure!(!records.is_empty(), "a trial has at least one plot");
        for (index, record) in records.iter().enumerate() {
            record.check().map_err(|problem| anyhow!("plot {}: {problem}", index + 1))?;
        }
        let performances: Vec<Performance> = records.iter().map(PlotRecord::performance).collect();
        let design = Design::new(records.iter().map(|record| (record.speed_km_h, record.spacing_cm)))
            .in_blocks(records.iter().map(|record| record.replication).collect());
        let analyse = |response: Response| {
            let values: Vec<f64> = performances.iter().map(|performance| response.value(performance)).collect();
            let extreme = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap_or_default();
            let model = LinearModel::fit(&design, &values);
            let counts: Option<Vec<(u32, u32)>> = records.iter().map(|record| response.count(record)).collect();
            ResponseAnalysis {
                response,
                range: (extreme(f64::min), extreme(f64::max)),
                checks: model.as_ref().ok().map(|model| Checks::of(&design, &values, model)),
                model,
                binomial: counts.map(|counts| BinomialModel::fit(&design, &counts)),
                variance: AnalysisOfVariance::of(&design, &values),
                published: Published::of(response),
            }
        };
        let responses = Response::ALL.map(analyse).to_vec();
        Ok(Self { records, performances, responses })
    }

    /// The plots by treatment, slow and narrow first.
    pub fn treatments(&self) -> Vec<Treatment> {
        let plots = self.records.iter().zip(&self.performances);
        let mut of_treatments = grouped(plots.map(|plot| ((plot.0.speed_km_h, plot.0.spacing_cm), plot)));
        of_treatments.sort_by(|(a, _), (b, _)| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        of_treatments.into_iter().map(|(_, plots)| Treatment::of(plots)).collect()
    }
}

impl Treatment {
    /// The treatment of these plots, at least one.
    fn of(plots: Vec<(&PlotRecord, &Performance)>) -> Self {
        let (records, performances): (Vec<&PlotRecord>, Vec<&Performance>) = plots.into_iter().unzip();
        let values = |quantity: fn(&Performance) -> f64| performances.iter().copied().map(quantity).collect::<Vec<_>>();
        let mean_of = |quantity| mean(&values(quantity));
        Self {
            speed_km_h: records[0].speed_km_h,
            spacing_cm: records[0].spacing_cm,
            plots: records.len(),
            mean: Performance {
                plant_damage_percent: mean_of(|plot| plot.plant_damage_percent),
                weeding_efficiency_percent: mean_of(|plot| plot.weeding_efficiency_percent),
                theoretical_capacity_ha_h: mean_of(|plot| plot.theoretical_capacity_ha_h),
                effective_capacity_ha_h: mean_of(|plot| plot.effective_capacity_ha_h),
                field_efficiency_percent: mean_of(|plot| plot.field_efficiency_percent),
                performance_index: mean_of(|plot| plot.performance_index),
            },
            damaged: damaged(records),
            weeding_efficiency: Mean::of(&values(|plot| plot.weeding_efficiency_percent)),
        }
    }
}

/// The plants of some plots that were damaged.
fn damaged<'a>(records: impl IntoIterator<Item = &'a PlotRecord>) -> Share {
    let (damaged, plants) = records
        .into_iter()
        .fold((0, 0), |(damaged, plants), plot| (damaged + u64::from(plot.damaged), plants + u64::from(plot.plants)));
    Share::of(damaged, plants)
}

#[cfg(test)]
mod tests;
