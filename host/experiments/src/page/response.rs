//! A chapter of the page: what the plots together say of one measure, with what the paper printed of it beside.

use super::figure::{Figure, residuals};
use super::table::{NOTHING, Table, fixed, optional, probability, short, significant};
use crate::evaluation::published::{Coefficients, Published};
use crate::evaluation::{Analysis, ResponseAnalysis};
use crate::statistics::{AnalysisOfVariance, BinomialModel, LinearModel};
use anyhow::Result;

/// What the page says of one measure.
pub struct Chapter {
    /// The measure.
    pub title: &'static str,
    /// The model as an equation, or why there is none.
    pub model: Result<String, String>,
    /// The paper's equation, and its number; empty where it cannot be read.
    pub published: String,
    /// The paper's equation number.
    pub equation_number: u32,
    /// The coefficients.
    pub terms: Table,
    /// How well the model fits.
    pub fit: Table,
    /// The binomial model, or why there is none; empty for a measure that is not counted.
    pub binomial: Option<Result<Table, String>>,
    /// The analysis of variance, or why there is none.
    pub variance: Result<Table, String>,
    /// What has to be known of either, and of the paper's figures.
    pub remarks: Vec<String>,
    /// What contradicts what in the paper.
    pub contradictions: &'static [&'static str],
    /// The residuals; there are none without a model.
    pub residuals: Option<Figure>,
}

impl Chapter {
    /// The chapter on a measure.
    ///
    /// # Errors
    /// Where plotters cannot draw the residuals.
    pub fn of(analysis: &Analysis, of: &ResponseAnalysis) -> Result<Self> {
        let (model, variance) = (of.model.as_ref(), of.variance.as_ref());
        let name = of.response.title().to_lowercase();

        let mut remarks = Vec::new();
        let of_model = model.iter().flat_map(|model| &model.remarks);
        let of_counts = of.binomial.iter().flatten().flat_map(|model| &model.remarks);
        for remark in of_model.chain(of_counts).chain(variance.iter().flat_map(|variance| &variance.remarks)) {
            let remark = sentence(&remark.to_string());
            if !remarks.contains(&remark) {
                remarks.push(remark);
            }
        }
        remarks.extend(of.checked());
        Ok(Self {
            title: of.response.title(),
            model: model
                .map(|model| equation(&name, &coefficients(model), significant))
                .map_err(|why| format!("{why}.")),
            published: equation(&name, &of.published.equation, short),
            equation_number: of.published.equation_number,
            terms: terms(of, model.ok()),
            fit: fit(analysis, of, model.ok()),
            binomial: of.binomial.as_ref().map(|model| model.as_ref().map(odds).map_err(|why| format!("{why}."))),
            variance: variance.map(sources).map_err(|why| format!("{why}.")),
            remarks,
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

/// A measure as an equation; empty where no coefficient is known.
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

/// The coefficients with what chance may have done to them, beside the paper's.
fn terms(of: &ResponseAnalysis, model: Option<&LinearModel>) -> Table {
    let Published { equation, text, equation_number, .. } = of.published;
    let mut table = Table::new(
        "Linear model",
        [
            "term",
            "estimate",
            "standard error",
            "t",
            "p",
            &format!("paper, Eq. {equation_number}"),
            "paper, in its text",
        ],
    );
    let rows = [
        ("constant", "constant", equation.constant, text.constant),
        ("speed", "for each km/h", equation.per_km_h, text.per_km_h),
        ("spacing", "for each cm of spacing", equation.per_cm, text.per_cm),
    ];
    for (name, meaning, equation, text) in rows {
        let term = model.and_then(|model| model.term(name));
        table.rows.push(vec![
            meaning.to_owned(),
            optional(term.map(|term| term.estimate), significant),
            optional(term.map(|term| term.standard_error), significant),
            optional(term.and_then(|term| term.t), |t| fixed(t, 2)),
            optional(term.and_then(|term| term.p), probability),
            optional(equation, short),
            optional(text, short),
        ]);
    }
    table
}

/// How well the model fits, and over which range, beside the paper's.
fn fit(analysis: &Analysis, of: &ResponseAnalysis, model: Option<&LinearModel>) -> Table {
    let values = || analysis.performances.iter().map(|performance| of.response.value(performance));
    let (low, high) =
        values().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)));
    let range = |low: f64, high: f64| format!("{} to {}", fixed(low, 2), fixed(high, 2));
    let published: Vec<String> = of.published.ranges.iter().map(|(low, high)| range(*low, *high)).collect();
    let share = |value| fixed(value, 4);
    let row = |what: &str, ours: String, paper: String| vec![what.to_owned(), ours, paper];
    let mut table = Table::new("Fit and range", ["", "this trial", "paper"]);
    table.rows = vec![
        row("R²", optional(model.map(|model| model.r_squared), share), share(of.published.r_squared)),
        row(
            "adjusted R²",
            optional(model.map(|model| model.adjusted_r_squared), share),
            optional(of.published.adjusted_r_squared, share),
        ),
        row(
            "residual standard error",
            optional(model.map(|model| model.residual_standard_error), significant),
            NOTHING.to_owned(),
        ),
        row(&format!("range, {}", of.response.unit()), range(low, high), published.join(",\n")),
    ];
    table
}

/// What speed and spacing do to the odds of what was counted.
fn odds(model: &BinomialModel) -> Table {
    let columns = ["term", "log odds", "standard error", "z", "p", "odds times (95 %)"];
    let mut table = Table::new("Binomial model of the counts", columns);
    for term in &model.terms {
        let (times, least, greatest) = term.odds_ratio();
        let (name, times) = match term.name {
            "speed" => {
                ("for each km/h", format!("{} ({} to {})", fixed(times, 2), fixed(least, 2), fixed(greatest, 2)))
            }
            "spacing" => (
                "for each cm of spacing",
                format!("{} ({} to {})", fixed(times, 3), fixed(least, 3), fixed(greatest, 3)),
            ),
            name => (name, NOTHING.to_owned()),
        };
        let cells =
            [significant(term.estimate), significant(term.standard_error), fixed(term.z, 2), probability(term.p)];
        table.rows.push([name.to_owned()].into_iter().chain(cells).chain([times]).collect());
    }
    table
}

fn sources(variance: &AnalysisOfVariance) -> Table {
    let mut table =
        Table::new("Analysis of variance", ["source", "degrees of freedom", "sum of squares", "mean square", "F", "p"]);
    for source in &variance.sources {
        table.rows.push(vec![
            source.name.replace(" x ", " × "),
            source.degrees_of_freedom.to_string(),
            significant(source.sum_of_squares),
            significant(source.mean_square),
            optional(source.f, |f| fixed(f, 2)),
            optional(source.p, probability),
        ]);
    }
    table
}

/// Words with a capital letter in front and a full stop behind.
fn sentence(words: &str) -> String {
    let mut letters = words.chars();
    let first = letters.next().map(|letter| letter.to_uppercase().to_string()).unwrap_or_default();
    format!("{first}{}.", letters.as_str())
}
