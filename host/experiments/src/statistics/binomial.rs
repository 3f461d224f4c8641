//! The binomial model of counts on speed and spacing: the logarithm of the odds as `constant + a speed + b spacing`.
//!
//! A count of damaged plants or removed weeds is a number out of a total. Its scatter depends on its share and on the
//! total, and a share ends at 0 and 1. The linear model ignores both. This is R's `glm(cbind(count, of - count) ~
//! speed + spacing, family = binomial)`, fitted by iteratively reweighted least squares with nalgebra.
//!
//! Plots of one field differ by more than the scatter of counting. [`BinomialModel::dispersion`] measures this. If it
//! is above 1, the true standard errors are larger by its root. The reported ones are those of R's binomial family,
//! without this correction.

use super::design::{Column, Design, NoModel, Remark, matrix};
use nalgebra::{DMatrix, DVector};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal};

/// The most steps of a fit, and the change of the deviance at which it has converged.
const STEPS: usize = 100;
const SETTLED: f64 = 1e-14;

/// Greatest logarithm of odds that counts can support. Beyond it the counts lie on one side of the speeds or spacings.
const NEVER_LOG_ODDS: f64 = 30.0;

/// One coefficient of a binomial model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OddsTerm {
    /// `constant`, `speed` (for each km/h) or `spacing` (for each cm).
    pub name: &'static str,
    /// The coefficient: the change of the logarithm of the odds.
    pub estimate: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Estimate by standard error.
    pub z: f64,
    /// The two-sided p-value of z, 0 to 1.
    pub p: f64,
}

impl OddsTerm {
    /// The factor of the odds for each unit, with the ends of its 95 % interval.
    pub fn odds_ratio(&self) -> (f64, f64, f64) {
        const QUANTILE: f64 = 1.959_963_984_540_054;
        let at = |errors: f64| (self.estimate + errors * self.standard_error).exp();
        (at(0.0), at(-QUANTILE), at(QUANTILE))
    }
}

/// Counts on speed and spacing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BinomialModel {
    /// The constant, and a slope for each of speed and spacing that varies.
    pub terms: Vec<OddsTerm>,
    /// Twice the logarithm of the likelihood that the model falls short of a share for each plot.
    pub deviance: f64,
    /// The deviance of a model with one share for all plots.
    pub null_deviance: f64,
    /// Plots less terms, at least 1.
    pub degrees_of_freedom: usize,
    /// Pearson's chi-square divided by the degrees of freedom: 1 if plots differ only by the scatter of counting.
    pub dispersion: f64,
    /// The model's share for each plot, 0 to 1.
    pub fitted: Vec<f64>,
    /// Remarks for the reader.
    pub remarks: Vec<Remark>,
}

/// An unfinished fit.
struct Fit {
    coefficients: DVector<f64>,
    covariance: DMatrix<f64>,
    fitted: Vec<f64>,
    deviance: f64,
}

impl BinomialModel {
    /// Fits the model to a plot's count, and to how many it is of.
    ///
    /// # Errors
    /// If the plots carry none: nothing was counted or everything, no factor varies, or the counts lie on one side.
    ///
    /// # Panics
    /// If there are more or fewer counts than plots.
    pub fn fit(design: &Design, counts: &[(u32, u32)]) -> Result<Self, NoModel> {
        assert_eq!(counts.len(), design.plots(), "a response has a count for each plot");
        let counts: Vec<Count> = counts.iter().map(|&(count, of)| (count.into(), of.into())).collect();
        let (all, of) = counts.iter().fold((0.0, 0.0), |(all, of), (count, n)| (all + count, of + n));
        if all == 0.0 || all == of {
            return Err(NoModel::Constant { value: if all == 0.0 { 0.0 } else { 100.0 } });
        }
        let (columns, mut remarks) = design.columns()?;
        let fit = fit(&matrix(&columns), &counts).ok_or(NoModel::OneSided)?;
        let share = all / of;
        let degrees_of_freedom = counts.len() - columns.len();
        let dispersion = pearson(&counts, &fit.fitted) / degrees_of_freedom as f64;
        if dispersion > OVERDISPERSED {
            remarks.push(Remark::Overdispersed { factor: dispersion.sqrt() });
        }
        let term = |(index, (name, _)): (usize, &Column)| {
            let (estimate, standard_error) = (fit.coefficients[index], fit.covariance[(index, index)].sqrt());
            let z = estimate / standard_error;
            OddsTerm { name, estimate, standard_error, z, p: 2.0 * Normal::standard().sf(z.abs()) }
        };
        Ok(Self {
            terms: columns.iter().enumerate().map(term).collect(),
            deviance: fit.deviance,
            null_deviance: deviance(&counts, &vec![share; counts.len()]),
            degrees_of_freedom,
            dispersion,
            fitted: fit.fitted,
            remarks,
        })
    }

    /// The term with this name, if the model has it.
    pub fn term(&self, name: &str) -> Option<&OddsTerm> {
        self.terms.iter().find(|term| term.name == name)
    }
}

/// A dispersion above this is reported: half as much again as the scatter of counting.
const OVERDISPERSED: f64 = 1.5;

/// A plot's count, and how many it is of.
type Count = (f64, f64);

/// Iteratively reweighted least squares. `None` if the coefficients diverge.
fn fit(matrix: &DMatrix<f64>, counts: &[Count]) -> Option<Fit> {
    // R starts half a count inside, so that no plot is at 0 or 1.
    let mut fitted: Vec<f64> = counts.iter().map(|(count, of)| (count + 0.5) / (of + 1.0)).collect();
    let (mut last, mut is_settled) = (f64::INFINITY, false);
    for _ in 0..STEPS {
        let root = |plot: usize| (counts[plot].1 * fitted[plot] * (1.0 - fitted[plot])).sqrt();
        let working = DVector::from_fn(counts.len(), |plot, _| {
            let ((count, of), share) = (counts[plot], fitted[plot]);
            let observed = count / of.max(1.0);
            ((share / (1.0 - share)).ln() + (observed - share) / (share * (1.0 - share))) * root(plot)
        });
        let weighted =
            DMatrix::from_fn(matrix.nrows(), matrix.ncols(), |plot, column| matrix[(plot, column)] * root(plot));
        // By QR, which keeps digits that the normal equations lose.
        let parts = weighted.qr();
        let inverse = parts.r().try_inverse()?;
        let coefficients = &inverse * (parts.q().transpose() * working);
        let covariance = &inverse * inverse.transpose();
        let log_odds = matrix * &coefficients;
        if log_odds.iter().any(|odds| odds.abs() > NEVER_LOG_ODDS || odds.is_nan()) {
            return None;
        }
        fitted = log_odds.iter().map(|odds| 1.0 / (1.0 + (-odds).exp())).collect();
        let deviance = deviance(counts, &fitted);
        // The deviance is flat at its minimum: one more step lets the coefficients converge as well.
        if is_settled {
            return Some(Fit { coefficients, covariance, fitted, deviance });
        }
        is_settled = (deviance - last).abs() <= SETTLED * (deviance.abs() + 0.1);
        last = deviance;
    }
    None
}

/// Twice the logarithm of the likelihood that these shares fall short of the plots' own.
fn deviance(counts: &[Count], shares: &[f64]) -> f64 {
    let part = |count: f64, expected: f64| if count > 0.0 { count * (count / expected).ln() } else { 0.0 };
    let of_plot =
        |(&(count, of), share): (&Count, &f64)| 2.0 * (part(count, of * share) + part(of - count, of * (1.0 - share)));
    counts.iter().zip(shares).map(of_plot).sum()
}

fn pearson(counts: &[Count], shares: &[f64]) -> f64 {
    let of_plot = |(&(count, of), share): (&Count, &f64)| {
        if of == 0.0 { 0.0 } else { (count - of * share).powi(2) / (of * share * (1.0 - share)) }
    };
    counts.iter().zip(shares).map(of_plot).sum()
}
