//! The binomial model of counts on speed and spacing: the logarithm of the odds as `constant + a speed + b spacing`.
//!
//! A count of damaged plants or removed weeds is a number out of a total. Its scatter depends on its share and on the
//! total, and a share ends at 0 and 1. The linear model ignores both. This is R's `glm(cbind(count, of - count) ~
//! speed + spacing, family = binomial)`, fitted by iteratively reweighted least squares.
//!
//! Plots of one field differ by more than the scatter of counting. [`BinomialModel::dispersion`] measures this. Above 1
//! the model is R's `quasibinomial`: standard errors are multiplied by the root of the dispersion, and each estimate
//! divided by its error is a t with the residual degrees of freedom. Up to 1 it is R's `binomial` with its z.

use super::basis::{Basis, Solution};
use super::design::{Column, Design, NoModel, Remark};
use super::interval::CONFIDENCE;
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// The most steps of a fit.
const STEPS: usize = 100;

/// The relative change of the deviance at which the fit has converged, as in R. Rounding is smaller.
const SETTLED: f64 = 1e-8;

/// The change of a plot's logarithm of odds at which the fit has converged. Slopes that diverge change by 1 a step.
const STILL: f64 = 1e-6;

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
    /// Estimate divided by standard error: a t if the model is quasi-binomial, else a z.
    pub statistic: f64,
    /// The two-sided p-value of the statistic, 0 to 1.
    pub p: f64,
    /// The factor of the odds for each unit, at most [`f64::MAX`].
    pub odds_ratio: f64,
    /// The ends of its two-sided 95 % interval.
    pub odds_interval: (f64, f64),
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
    /// Whether the dispersion is above 1, and in the standard errors.
    pub is_quasi: bool,
    /// The model's share for each plot, 0 to 1.
    pub fitted: Vec<f64>,
    /// Remarks for the reader.
    pub remarks: Vec<Remark>,
}

impl BinomialModel {
    /// Fits the model to a plot's count, and to how many it is of.
    ///
    /// # Errors
    /// If the plots carry none: nothing was counted or everything, no factor varies, or the counts lie on one side. Also
    /// if the iteration does not converge.
    ///
    /// # Panics
    /// If there are more or fewer counts than plots.
    pub fn fit(design: &Design, counts: &[(u32, u32)]) -> Result<Self, NoModel> {
        assert_eq!(counts.len(), design.plots(), "a response has a count for each plot");
        let (columns, mut remarks) = design.columns()?;
        let counts: Vec<Count> = counts.iter().map(|&(count, of)| (count.into(), of.into())).collect();
        let (all, of) = counts.iter().fold((0.0, 0.0), |(all, of), (count, n)| (all + count, of + n));
        if all == 0.0 || all == of {
            return Err(if all == 0.0 { NoModel::NothingCounted } else { NoModel::Constant { value: 100.0 } });
        }
        let (solution, fitted) = fit(&columns, &counts)?;
        let share = all / of;
        let degrees_of_freedom = counts.len() - columns.len();
        let dispersion = pearson(&counts, &fitted) / degrees_of_freedom as f64;
        let is_quasi = dispersion > 1.0;
        let factor = dispersion.max(1.0).sqrt();
        if factor.powi(2) > OVERDISPERSED {
            remarks.push(Remark::Overdispersed { factor });
        }
        let student = StudentsT::new(0.0, 1.0, degrees_of_freedom as f64).ok().filter(|_| is_quasi);
        let normal = Normal::standard();
        let chance: &dyn ContinuousCDF<f64, f64> = student.as_ref().map_or(&normal, |student| student);
        let quantile = chance.inverse_cdf(1.0 - (1.0 - CONFIDENCE) / 2.0);
        let term = |(index, (name, _)): (usize, &Column)| {
            let (estimate, standard_error) = (solution.coefficients[index], factor * solution.variances[index].sqrt());
            let statistic = estimate / standard_error;
            let odds = |errors: f64| (estimate + errors * standard_error).exp().min(f64::MAX);
            OddsTerm {
                name,
                estimate,
                standard_error,
                statistic,
                p: 2.0 * chance.sf(statistic.abs()),
                odds_ratio: odds(0.0),
                odds_interval: (odds(-quantile), odds(quantile)),
            }
        };
        Ok(Self {
            terms: columns.iter().enumerate().map(term).collect(),
            deviance: deviance(&counts, &fitted),
            null_deviance: deviance(&counts, &vec![share; counts.len()]),
            degrees_of_freedom,
            dispersion,
            is_quasi,
            fitted,
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

/// The coefficients and each plot's share, by iteratively reweighted least squares.
fn fit(columns: &[Column], counts: &[Count]) -> Result<(Solution, Vec<f64>), NoModel> {
    // R starts half a count inside, so that no plot is at 0 or 1.
    let mut fitted: Vec<f64> = counts.iter().map(|(count, of)| (count + 0.5) / (of + 1.0)).collect();
    let mut before: Vec<f64> = fitted.iter().map(|share| (share / (1.0 - share)).ln()).collect();
    let (mut last, mut is_settled) = (f64::INFINITY, false);
    for _ in 0..STEPS {
        let plots = || counts.iter().zip(&fitted);
        let roots: Vec<f64> = plots().map(|((_, of), share)| (of * share * (1.0 - share)).sqrt()).collect();
        let working = plots().zip(&before).zip(&roots).map(|((((count, of), share), log_odds), root)| {
            (log_odds + (count / of.max(1.0) - share) / (share * (1.0 - share))) * root
        });
        let working: Vec<f64> = working.collect();
        let weigh = |(_, values): &Column| values.iter().zip(&roots).map(|(value, root)| value * root).collect();
        let weighted: Vec<Vec<f64>> = columns.iter().map(weigh).collect();
        let basis = Basis::of(&weighted).ok_or(NoModel::NotSolved)?;
        // Counts on one side leave weights so small that columns depend on each other.
        let solution = basis.solve(&working).ok_or(NoModel::OneSided)?;
        let coefficients = || solution.coefficients.iter().zip(columns);
        let log_odds = |plot: usize| coefficients().map(|(of, (_, values))| of * values[plot]).sum();
        let log_odds: Vec<f64> = (0..counts.len()).map(log_odds).collect();
        if log_odds.iter().any(|odds| odds.is_nan()) {
            return Err(NoModel::NotSolved);
        }
        if log_odds.iter().any(|odds| odds.abs() > NEVER_LOG_ODDS) {
            return Err(NoModel::OneSided);
        }
        fitted = log_odds.iter().map(|odds| 1.0 / (1.0 + (-odds).exp())).collect();
        let deviance = deviance(counts, &fitted);
        // The deviance is flat at its minimum: one more step lets the coefficients converge as well.
        if is_settled {
            return Ok((solution, fitted));
        }
        let is_still = log_odds.iter().zip(&before).all(|(now, before)| (now - before).abs() <= STILL);
        is_settled = is_still && (deviance - last).abs() <= SETTLED * (deviance.abs() + 0.1);
        (last, before) = (deviance, log_odds);
    }
    Err(NoModel::NotSolved)
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
