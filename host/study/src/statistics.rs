//! The statistics of a trial with two factors, forward speed and plant spacing: a linear model of a response on both as
//! numbers, and the two-way analysis of variance with both as factors.
//!
//! The model is R's `lm(response ~ speed + spacing)`, the analysis R's `anova(lm(response ~ factor(speed) *
//! factor(spacing)))`. Least squares come from linregress and nalgebra, the F distribution from statrs. What the plots
//! cannot tell is said in words, as [`NoModel`] or as a [`Remark`]: no figure here is infinite or not a number.

mod linear;
mod variance;

pub use linear::{LinearModel, Term};
use serde::Serialize;
use thiserror::Error;
pub use variance::{AnalysisOfVariance, Source};

/// Where each plot stands in the trial.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    speeds_km_h: Vec<f64>,
    spacings_cm: Vec<f64>,
}

impl Design {
    /// The speed in km/h and the spacing in cm of each plot; all are finite.
    pub fn new(plots: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (speeds_km_h, spacings_cm) = plots.into_iter().unzip();
        Self { speeds_km_h, spacings_cm }
    }

    /// How many plots there are.
    pub fn plots(&self) -> usize {
        self.speeds_km_h.len()
    }
}

/// The plots carry no model.
#[derive(Clone, Copy, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NoModel {
    /// The response does not vary.
    #[error("it is {value} in every plot: there is nothing that speed or spacing could explain")]
    Constant {
        /// Its value everywhere.
        value: f64,
    },
    /// No factor varies.
    #[error("all plots have the same speed and spacing: a model needs two levels of one of them")]
    OneTreatment,
    /// Nothing is left to tell an effect from chance.
    #[error("plots: {plots}, parameters: {parameters}: it takes at least one plot more than parameters")]
    TooFewPlots {
        /// The plots that there are.
        plots: usize,
        /// The parameters that have to be found.
        parameters: usize,
    },
    /// Speed and spacing go together.
    #[error("speed and spacing change together, so that their effects cannot be told apart")]
    Inseparable,
}

/// What a reader has to know of a table of figures.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Remark {
    /// Speed is no term.
    #[error("all plots have the same speed, so that it is left out")]
    OneSpeed,
    /// Spacing is no term.
    #[error("all plots have the same spacing, so that it is left out")]
    OneSpacing,
    /// The interaction would use up all plots.
    #[error(
        "no treatment was repeated, so that the interaction cannot be told from chance: it is part of the residual"
    )]
    NoReplication,
    /// The treatments differ in their number of plots.
    #[error(
        "the treatments differ in their number of plots: sums of squares are sequential (type I), speed first, then spacing, then both"
    )]
    Unbalanced,
    /// The residual is zero.
    #[error("the plots lie on the model exactly: without scatter there are no test statistics")]
    NoScatter,
}

/// Sums of squares below this share of the response's own are what rounding leaves of zero.
const ROUNDING: f64 = 1e-24;

/// Whether a sum of squares of deviations is zero but for rounding.
fn is_zero(sum_of_squares: f64, values: &[f64]) -> bool {
    sum_of_squares <= ROUNDING * values.iter().map(|value| value * value).sum::<f64>()
}

/// The mean; of no values, zero.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The sum of squared deviations from the mean.
fn scatter(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(2)).sum()
}

/// Whether values differ at all.
fn varies(values: &[f64]) -> bool {
    values.windows(2).any(|pair| pair[0] != pair[1])
}
