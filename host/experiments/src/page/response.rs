//! A chapter of the page: the analysis of one measure, beside the paper's figures.

use super::figure::{Figure, residuals};
use crate::evaluation::published::Coefficients;
use crate::evaluation::report::{odds, sources};
use crate::evaluation::{Analysis, ResponseAnalysis};
use crate::statistics::LinearModel;
use crate::table::{Table, short, significant};
use anyhow::Result;

/// The chapter of one measure.
pub struct Chapter {
    /// The measure.
    pub title: &'static str,
    /// The model as an equation, or why there is none.
    pub model: Result<String, String>,
    /// The paper's equation and its number. Empty if it is illegible.
    pub published: String,
    /// The paper's equation number.
    pub equation_number: u32,
    /// The coefficients.
    pub terms: Table,
    /// How well the model fits.
    pub fit: Table,
    /// The binomial model, or why there is none. `None` for a measure that is not counted.
    pub binomial: Option<Result<Table, String>>,
    /// The analysis of variance, or why there is none.
    pub variance: Result<Table, String>,
    /// Remarks on the models and on the paper's figures.
    pub remarks: Vec<String>,
    /// The paper's contradictions.
    pub contradictions: &'static [&'static str],
    /// The residuals; `None` without a model.
    pub residuals: Option<Figure>,
}

impl Chapter {
    /// The chapter on a measure.
    ///
    /// # Errors
    /// If plotters cannot draw the residuals.
    pub fn of(analysis: &Analysis, of: &ResponseAnalysis) -> Result<Self> {
        let (model, variance) = (of.model.as_ref(), of.variance.as_ref());
        let name = of.response.title().to_lowercase();

        Ok(Self {
            title: of.response.title(),
            model: model
                .map(|model| equation(&name, &coefficients(model), significant))
                .map_err(|why| format!("{why}.")),
            published: equation(&name, &of.published.equation, short),
            equation_number: of.published.equation_number,
            terms: of.terms(),
            fit: of.fit(),
            binomial: of.binomial.as_ref().map(|model| model.as_ref().map(odds).map_err(|why| format!("{why}."))),
            variance: variance.map(sources).map_err(|why| format!("{why}.")),
            remarks: of.remarks(),
            contradictions: of.published.contradictions,
            residuals: model.ok().map(|model| residuals(analysis, of, model)).transpose()?,
        })
    }
}

/// The model's coefficients, in the shape of the paper's.
fn coefficients(model: &LinearModel) -> Coefficients {
    let estimate = |name| model.term(name).map(|term| term.estimate);
    Coefficients { constant: estimate("constant"), per_km_h: estimate("speed"), per_cm: estimate("spacing") }
}

/// A measure as an equation. Empty if no coefficient is known.
fn equation(name: &str, coefficients: &Coefficients, said: fn(f64) -> String) -> String {
    let factors =
        [(coefficients.constant, ""), (coefficients.per_km_h, " × speed"), (coefficients.per_cm, " × spacing")];
    let mut right = String::new();
    for (value, factor) in factors {
        let Some(value) = value else { continue };
        let sign = match (value < 0.0, right.is_empty()) {
            (true, true) => "\u{2212}",
            (true, false) => " \u{2212} ",
            (false, true) => "",
            (false, false) => " + ",
        };
        right += &format!("{sign}{}{factor}", said(value.abs()));
    }
    if right.is_empty() { right } else { format!("{name} = {right}") }
}
