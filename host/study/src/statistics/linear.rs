//! The linear model of a response on speed and spacing, by least squares.

use super::basis::Solution;
use super::design::{Column, Design, NoModel, Remark, basis, is_zero, mean, scatter};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, StudentsT};

/// One coefficient of a linear model.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Term {
    /// `constant`, `speed` (for each km/h) or `spacing` (for each cm).
    pub name: &'static str,
    /// The coefficient, in the response's unit.
    pub estimate: f64,
    /// Its standard error, in the same unit.
    pub standard_error: f64,
    /// Estimate divided by standard error. `None` if the plots do not scatter.
    pub t: Option<f64>,
    /// The two-sided p-value of t, 0 to 1. `None` if t is `None`.
    pub p: Option<f64>,
}

/// A response as `constant + a speed + b spacing`.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct LinearModel {
    /// The constant, and a slope for each of speed and spacing that varies.
    pub terms: Vec<Term>,
    /// Share of the response's variation that the model explains, 0 to 1.
    pub r_squared: f64,
    /// The same, adjusted for the number of terms. It is below 0 if the model explains less than chance.
    pub adjusted_r_squared: f64,
    /// Standard deviation of the plots around the model, in the response's unit.
    pub residual_standard_error: f64,
    /// Plots less terms, at least 1.
    pub degrees_of_freedom: usize,
    /// The model's value for each plot, in the response's unit.
    pub fitted: Vec<f64>,
    /// The response less the model's value, for each plot.
    pub residuals: Vec<f64>,
    /// Remarks for the reader.
    pub remarks: Vec<Remark>,
}

impl LinearModel {
    /// Fits the model to a response with a finite value for each plot.
    ///
    /// # Errors
    /// If the plots carry none.
    ///
    /// # Panics
    /// If there are more or fewer values than plots.
    pub fn fit(design: &Design, values: &[f64]) -> Result<Self, NoModel> {
        assert_eq!(values.len(), design.plots(), "a response has a value for each plot");
        let (columns, mut remarks) = design.columns()?;
        let total = scatter(values);
        if is_zero(total, values) {
            return Err(NoModel::Constant { value: mean(values) });
        }
        let basis = basis(&columns)?;
        let Solution { coefficients, variances } = basis.solve(values).ok_or(NoModel::Inseparable)?;
        let residuals = basis.residual(values);
        let residual: f64 = residuals.iter().map(|residual| residual * residual).sum();
        let degrees_of_freedom = values.len() - columns.len();
        let variance = residual / degrees_of_freedom as f64;
        let scatters = !is_zero(residual, values);
        if !scatters {
            remarks.push(Remark::NoScatter);
        }
        let distribution = StudentsT::new(0.0, 1.0, degrees_of_freedom as f64).ok();
        let term = |(index, (name, _)): (usize, &Column)| {
            let (estimate, standard_error) = (coefficients[index], (variance * variances[index]).sqrt());
            let t = scatters.then(|| estimate / standard_error);
            let p = t.zip(distribution).map(|(t, distribution)| 2.0 * distribution.sf(t.abs()));
            Term { name, estimate, standard_error, t, p }
        };
        Ok(Self {
            terms: columns.iter().enumerate().map(term).collect(),
            r_squared: 1.0 - residual / total,
            adjusted_r_squared: 1.0 - variance / (total / (values.len() - 1) as f64),
            residual_standard_error: variance.sqrt(),
            degrees_of_freedom,
            fitted: values.iter().zip(&residuals).map(|(value, residual)| value - residual).collect(),
            residuals,
            remarks,
        })
    }

    /// The term with this name, if the model has it.
    pub fn term(&self, name: &str) -> Option<&Term> {
        self.terms.iter().find(|term| term.name == name)
    }
}
