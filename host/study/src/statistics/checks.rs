//! Checks of a linear model by its residuals, as tests with a p-value each.
//!
//! - **Lack of fit**: do the treatments' means differ from the straight lines by more than their plots scatter? R:
//!   `anova(m, lm(y ~ factor(speed):factor(spacing)))`.
//! - **Unequal scatter**: do plots scatter more at one speed or spacing than at another? Breusch and Pagan's test in
//!   Koenker's form, R: `n * summary(lm(residuals(m)^2 ~ speed + spacing))$r.squared` as a chi-square. It is left
//!   out if few degrees of freedom remain.
//! - **Outlier**: is one plot farther off than the farthest of this many plots may be? R: the greatest
//!   `abs(rstudent(m))`, its probability times the number of plots.
//!
//! Normality of the residuals is not tested. A few dozen plots are too few for such a test, and means tolerate
//! deviations.

use super::design::{Design, basis, is_zero};
use super::linear::LinearModel;
use super::variance::{Fit, levels, levels_fit};
use crate::table::list;
use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF, FisherSnedecor, StudentsT};

/// A coefficient counts as an effect, and a check has a finding, if the p-value is below this.
pub(crate) const SIGNIFICANCE: f64 = 0.05;

/// Residual degrees of freedom that the test for unequal scatter needs. From here on, 3 to 7 of 100 simulated trials with
/// even, normal scatter have a finding. With fewer, between none and all of them have one: 100 of 100 with 4 plots.
const LEAST_FREEDOM: usize = 7;

/// The checks of a model. A check that the plots do not allow is `None`.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Checks {
    /// The p-value of the lack of fit. It needs repeated treatments, and more treatments than terms.
    pub lack_of_fit_p: Option<f64>,
    /// How probable scatter as unequal is by chance.
    pub unequal_scatter_p: Option<f64>,
    /// The numbers of the plots that are farthest off, and their p-value among this many plots. Several are equally far.
    pub farthest: Option<(Vec<u32>, f64)>,
}

impl Checks {
    /// The checks of a model of these values in this design. `plots` has the number of each plot.
    pub fn of(design: &Design, values: &[f64], model: &LinearModel, plots: &[u32]) -> Self {
        // A model that fits exactly has no residuals.
        if model.terms.iter().any(|term| term.p.is_none()) {
            return Self::default();
        }
        Self {
            lack_of_fit_p: lack_of_fit(design, values, model),
            unequal_scatter_p: unequal_scatter(design, model),
            farthest: farthest(design, model, plots),
        }
    }

    /// The findings, a sentence each. `name` is the measure's.
    pub fn sentences(&self, name: &str) -> Vec<String> {
        let mut said = Vec::new();
        let found = |p: Option<f64>| p.filter(|p| *p < SIGNIFICANCE).map(probability);
        if let Some(p) = found(self.lack_of_fit_p) {
            said.push(format!(
                "{name} does not follow straight lines ({p}): go by the treatments' means, not by the slopes."
            ));
        }
        if let Some(p) = found(self.unequal_scatter_p) {
            said.push(format!(
                "{name} scatters more at some speeds or spacings than at others ({p}): its p-values are not exact."
            ));
        }
        if let Some((farthest, p)) = &self.farthest
            && let Some(p) = found(Some(*p))
        {
            let numbers: Vec<f64> = farthest.iter().copied().map(f64::from).collect();
            said.push(match numbers.as_slice() {
                [one] => format!(
                    "{name}: plot {one} is farther from the model than chance explains ({p}): check what happened there."
                ),
                several => format!(
                    "{name}: plots {} are equally far from the model, and farther than chance explains ({p}): check what happened there.",
                    list(several)
                ),
            });
        }
        let made = [self.lack_of_fit_p, self.unequal_scatter_p, self.farthest.as_ref().map(|(_, p)| *p)];
        if said.is_empty() && made.iter().any(Option::is_some) {
            let is_all = made.iter().all(Option::is_some);
            let which = if is_all { "straight lines, even scatter and no outlier" } else { "what can be checked" };
            said.push(format!("The residuals of {} are as they should be: {which}.", name.to_lowercase()));
        }
        said
    }
}

/// A p-value with its sign: four digits, or the limit that it is below.
pub(crate) fn probability(p: f64) -> String {
    if p < 0.0001 { "p < 0.0001".to_owned() } else { format!("p = {p:.4}") }
}

fn lack_of_fit(design: &Design, values: &[f64], model: &LinearModel) -> Option<f64> {
    let Fit { parameters: treatments, sum_of_squares: pure } = levels_fit(&levels(design.places()), values);
    let pure_freedom = values.len().checked_sub(treatments).filter(|freedom| *freedom > 0)?;
    let lack_freedom = treatments.checked_sub(model.terms.len()).filter(|freedom| *freedom > 0)?;
    if is_zero(pure, values) {
        return None;
    }
    let residual: f64 = model.residuals.iter().map(|residual| residual * residual).sum();
    let f = ((residual - pure).max(0.0) / lack_freedom as f64) / (pure / pure_freedom as f64);
    Some(FisherSnedecor::new(lack_freedom as f64, pure_freedom as f64).ok()?.sf(f))
}

fn unequal_scatter(design: &Design, model: &LinearModel) -> Option<f64> {
    if model.degrees_of_freedom < LEAST_FREEDOM {
        return None;
    }
    let squares: Vec<f64> = model.residuals.iter().map(|residual| residual * residual).collect();
    let of_squares = LinearModel::fit(design, &squares).ok()?;
    let statistic = squares.len() as f64 * of_squares.r_squared;
    Some(ChiSquared::new((of_squares.terms.len() - 1) as f64).ok()?.sf(statistic))
}

fn farthest(design: &Design, model: &LinearModel, plots: &[u32]) -> Option<(Vec<u32>, f64)> {
    /// Parts and differences below this share are rounding.
    const ROUNDING: f64 = 1e-9;
    let (columns, _) = design.columns().ok()?;
    let basis = basis(&columns).ok()?;
    let freedom = model.degrees_of_freedom.checked_sub(1).filter(|freedom| *freedom > 0)? as f64;
    let residual: f64 = model.residuals.iter().map(|residual| residual * residual).sum();
    let of_plots = model.residuals.iter().enumerate().filter_map(|(plot, deviation)| {
        let own = 1.0 - basis.leverage(plot);
        let without = residual - deviation * deviation / own;
        // The others fit exactly: this plot alone scatters.
        let is_alone = without <= ROUNDING * residual;
        let t = if is_alone { f64::INFINITY } else { deviation.abs() / (without / freedom * own).sqrt() };
        // A plot that its model follows in any case has no deviation.
        (own > ROUNDING).then_some((plot, t))
    });
    let of_plots: Vec<(usize, f64)> = of_plots.collect();
    let t = of_plots.iter().map(|(_, t)| *t).max_by(f64::total_cmp)?;
    let farthest = of_plots.iter().filter(|(_, other)| *other >= t * (1.0 - ROUNDING));
    let alone = 2.0 * StudentsT::new(0.0, 1.0, freedom).ok()?.sf(t);
    Some((farthest.map(|(plot, _)| plots[*plot]).collect(), (alone * design.plots() as f64).min(1.0)))
}
