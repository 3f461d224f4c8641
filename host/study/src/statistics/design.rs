//! The design of a trial: the factors of each plot, the columns of a model, and the reasons why there may be no model.

use super::basis::Basis;
use serde::Serialize;
use thiserror::Error;

/// The factors of each plot.
#[derive(Clone, Debug, PartialEq)]
pub struct Design {
    pub(super) speeds_km_h: Vec<f64>,
    pub(super) spacings_cm: Vec<f64>,
    /// The speed of each plot as a level of a factor: its nominal speed, where speeds were measured.
    pub(super) levels_km_h: Vec<f64>,
    /// The block of each plot; empty without blocks.
    pub(super) blocks: Vec<u32>,
}

impl Design {
    /// The speed in km/h and the spacing in cm of each plot; all are finite.
    pub fn new(plots: impl IntoIterator<Item = (f64, f64)>) -> Self {
        let (speeds_km_h, spacings_cm): (Vec<f64>, _) = plots.into_iter().unzip();
        Self { levels_km_h: speeds_km_h.clone(), speeds_km_h, spacings_cm, blocks: Vec::new() }
    }

    /// The speed in km/h, the spacing in cm, the nominal speed in km/h and the block of each plot. Models keep the
    /// measured speeds, if there is more than one nominal speed. The analysis of variance compares the nominal ones, and
    /// what differs from block to block is no chance to it.
    pub fn in_blocks(plots: impl IntoIterator<Item = (f64, f64, f64, u32)>) -> Self {
        let (mut speeds_km_h, spacings_cm, levels_km_h, blocks): (Vec<f64>, _, Vec<f64>, _) =
            plots.into_iter().collect();
        if !varies(&levels_km_h) {
            speeds_km_h.clone_from(&levels_km_h);
        }
        Self { speeds_km_h, spacings_cm, levels_km_h, blocks }
    }

    /// The measured speed and the spacing of each plot.
    pub(super) fn places(&self) -> impl Iterator<Item = (f64, f64)> {
        self.speeds_km_h.iter().copied().zip(self.spacings_cm.iter().copied())
    }

    /// The nominal speed and the spacing of each plot.
    pub(super) fn treatments(&self) -> impl Iterator<Item = (f64, f64)> {
        self.levels_km_h.iter().copied().zip(self.spacings_cm.iter().copied())
    }

    /// How many plots there are.
    pub fn plots(&self) -> usize {
        self.speeds_km_h.len()
    }

    /// The columns of a model with all factors that vary, and a remark on each that does not.
    ///
    /// # Errors
    /// If the plots carry none.
    pub(super) fn columns(&self) -> Result<(Vec<Column>, Vec<Remark>), NoModel> {
        let mut columns = vec![("constant", vec![1.0; self.plots()])];
        let mut remarks = Vec::new();
        let factors =
            [("speed", &self.speeds_km_h, Remark::OneSpeed), ("spacing", &self.spacings_cm, Remark::OneSpacing)];
        for (name, levels, constant) in factors {
            if varies(levels) {
                columns.push((name, levels.clone()));
            } else {
                remarks.push(constant);
            }
        }
        match columns.as_slice() {
            [_] => Err(NoModel::OneTreatment),
            [_, (_, speeds), (_, spacings)] if is_collinear(speeds, spacings) => Err(NoModel::Inseparable),
            _ if self.plots() <= columns.len() => {
                Err(NoModel::TooFewPlots { plots: self.plots(), parameters: columns.len(), needed: columns.len() + 1 })
            }
            _ => Ok((columns, remarks)),
        }
    }
}

/// A model's column: its name, and its value in each plot.
pub(super) type Column = (&'static str, Vec<f64>);

pub(super) fn basis(columns: &[Column]) -> Result<Basis, NoModel> {
    let values: Vec<&[f64]> = columns.iter().map(|(_, values)| values.as_slice()).collect();
    Basis::of(&values).ok_or(NoModel::NotSolved)
}

/// The plots carry no model.
#[derive(Clone, Copy, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum NoModel {
    #[error("it is {} in every plot that has it: speed and spacing explain nothing", crate::table::short(*.value))]
    Constant { value: f64 },
    #[error("all plots with this measure have the same speed and spacing: a model needs two levels of one of them")]
    OneTreatment,
    #[error("plots: {plots}, parameters: {parameters}: this model takes at least {needed} plots")]
    TooFewPlots { plots: usize, parameters: usize, needed: usize },
    #[error(
        "speeds and spacings make {treatments} treatments, and the analysis takes at most {most}: give measured speeds their nominal ones (`weeder evaluate --speeds`)"
    )]
    TooManyTreatments { treatments: usize, most: usize },
    #[error("speed and spacing change together, so their effects cannot be separated")]
    Inseparable,
    #[error("no plant of any plot is damaged, or no weed gone: speed and spacing explain nothing")]
    NothingCounted,
    #[error("all that was counted lies on one side of the speeds or spacings, so the odds have no finite slope")]
    OneSided,
    #[error("the calculation did not converge; this is no statement about the plots")]
    NotSolved,
    #[error("no plot has it: something that it needs is 0, or was not counted or measured")]
    NotMeasured,
}

/// A remark on a table of figures.
#[derive(Clone, Copy, Debug, Error, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum Remark {
    #[error("all plots with this measure have the same speed, so that speed is left out")]
    OneSpeed,
    #[error("all plots with this measure have the same spacing, so that spacing is left out")]
    OneSpacing,
    #[error("too few treatments were repeated to separate the interaction from chance: it is part of the residual")]
    NoReplication,
    #[error(
        "the treatments differ in their number of plots, in the trial or in a block: sums of squares are sequential (type I), in the order of the table"
    )]
    Unbalanced,
    #[error("the replications are not used as blocks: too few plots would remain to separate effects from chance")]
    NoBlocks,
    #[error(
        "the replications are not used as blocks: their effects cannot be separated from those of speed and spacing"
    )]
    InseparableBlocks,
    #[error(
        "plots differ by more than counting explains: standard errors of the binomial model are multiplied by {factor:.2}, and t has the residual degrees of freedom (quasi-binomial)"
    )]
    Overdispersed { factor: f64 },
    #[error("the plots lie on the model exactly: without scatter there are no test statistics")]
    NoScatter,
}

/// Sums of squares below this share of the response's own are rounding errors of zero.
const ROUNDING: f64 = 1e-24;

/// Whether a sum of squares of deviations is zero but for rounding.
pub(super) fn is_zero(sum_of_squares: f64, values: &[f64]) -> bool {
    sum_of_squares <= ROUNDING * values.iter().map(|value| value * value).sum::<f64>()
}

/// The items of each key, in the order in which the keys first occur.
pub(crate) fn grouped<K: PartialEq, T>(items: impl IntoIterator<Item = (K, T)>) -> Vec<(K, Vec<T>)> {
    let mut groups: Vec<(K, Vec<T>)> = Vec::new();
    for (key, item) in items {
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(item),
            None => groups.push((key, vec![item])),
        }
    }
    groups
}

/// The mean; of no values, zero.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len().max(1) as f64
}

/// The sum of squared deviations from the mean.
pub(super) fn scatter(values: &[f64]) -> f64 {
    let mean = mean(values);
    values.iter().map(|value| (value - mean).powi(2)).sum()
}

fn varies(values: &[f64]) -> bool {
    values.windows(2).any(|pair| pair[0] != pair[1])
}

/// Whether one column is a linear function of the other.
fn is_collinear(a: &[f64], b: &[f64]) -> bool {
    /// If less than this share of a column is unexplained by the other, the coefficients are only rounding errors.
    const TOLERANCE: f64 = 1e-9;
    let (mean_a, mean_b) = (mean(a), mean(b));
    let together: f64 = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).sum();
    1.0 - together * together / (scatter(a) * scatter(b)) < TOLERANCE
}
