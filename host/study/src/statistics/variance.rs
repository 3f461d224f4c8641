//! The two-way analysis of variance: how a response's variation divides into speed, spacing, their interaction, and the
//! residual.
//!
//! The models are nested: one mean; a mean for each block; additive effects of block and speed; of block, speed and
//! spacing; and of block and treatment. A source's sum of squares is the difference between the residuals of its model
//! and of the one before. Without blocks the first model is left out.

use super::basis::Basis;
use super::design::{Design, NoModel, Remark, grouped, is_zero, mean, scatter};
use serde::Serialize;
use statrs::distribution::{ContinuousCDF, FisherSnedecor};

/// Residual degrees of freedom that an analysis needs. With fewer, its p-values depend on a plot or two.
const SPARE: usize = 3;

/// The most treatments. The time grows with the cube of their number: this many take about a second.
const MOST_TREATMENTS: usize = 200;

/// One line of an analysis of variance.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Source {
    /// `block`, `speed`, `spacing`, `speed x spacing` or `residual`.
    pub name: &'static str,
    /// Its degrees of freedom, at least 1.
    pub degrees_of_freedom: usize,
    /// Its part of the variation, in the response's unit squared.
    pub sum_of_squares: f64,
    /// The same for each degree of freedom.
    pub mean_square: f64,
    /// Its mean square divided by that of the residual. `None` for the residual, and if the plots do not scatter.
    pub f: Option<f64>,
    /// The p-value of F, 0 to 1. `None` if F is `None`.
    pub p: Option<f64>,
}

/// A response's variation, taken apart by speed and spacing as factors.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct AnalysisOfVariance {
    /// The sources that the trial can separate, the residual last.
    pub sources: Vec<Source>,
    /// Remarks for the reader.
    pub remarks: Vec<Remark>,
}

/// The residual of a model.
#[derive(Clone, Copy)]
pub(super) struct Fit {
    pub parameters: usize,
    pub sum_of_squares: f64,
}

impl AnalysisOfVariance {
    /// Analyses a response with a finite value for each plot.
    ///
    /// # Errors
    /// If the plots do not allow this analysis.
    ///
    /// # Panics
    /// If there are more or fewer values than plots.
    pub fn of(design: &Design, values: &[f64]) -> Result<Self, NoModel> {
        assert_eq!(values.len(), design.plots(), "a response has a value for each plot");
        let (speeds, spacings) = (levels(&design.levels_km_h), levels(&design.spacings_cm));
        let (treatments, blocks) = (levels(design.treatments()), levels(&design.blocks));
        let (has_speed, has_spacing) = (speeds.len() > 1, spacings.len() > 1);
        let factors = [(has_speed, Remark::OneSpeed), (has_spacing, Remark::OneSpacing)];
        let mut remarks: Vec<Remark> =
            factors.into_iter().filter(|(varies, _)| !varies).map(|(_, remark)| remark).collect();
        if !has_speed && !has_spacing {
            return Err(NoModel::OneTreatment);
        }
        if is_zero(scatter(values), values) {
            return Err(NoModel::Constant { value: mean(values) });
        }
        if treatments.len() > MOST_TREATMENTS {
            return Err(NoModel::TooManyTreatments { treatments: treatments.len(), most: MOST_TREATMENTS });
        }

        let nested = |in_blocks: &[&Levels]| {
            let fit = |levels: &[&Levels]| additive_fit(&[in_blocks, levels].concat(), values);
            let mut fits = vec![("", Fit { parameters: 1, sum_of_squares: scatter(values) })];
            if !in_blocks.is_empty() {
                fits.push(("block", fit(&[])?));
            }
            if has_speed {
                fits.push(("speed", fit(&[&speeds])?));
            }
            if has_spacing {
                fits.push(("spacing", fit(&[&speeds, &spacings])?));
            }
            // With fewer parameters, a part of one factor's effect is also a part of another's.
            let factors = in_blocks.iter().copied().chain([&speeds, &spacings]);
            if fits[fits.len() - 1].1.parameters < 1 + factors.map(|levels| levels.len() - 1).sum::<usize>() {
                return Err(NoModel::Inseparable);
            }
            let each = fit(&[&treatments])?;
            if each.parameters > fits[fits.len() - 1].1.parameters {
                fits.push(("speed x spacing", each));
            }
            Ok(fits)
        };
        let has_spare = |fits: &[(&str, Fit)]| fits[fits.len() - 1].1.parameters + SPARE <= values.len();
        let has_blocks = blocks.len() > 1;
        let in_blocks: &[&Levels] = if has_blocks { &[&blocks] } else { &[] };
        let mut fits = match nested(in_blocks) {
            Ok(fits) if has_blocks && !has_spare(&fits) => {
                remarks.push(Remark::NoBlocks);
                nested(&[])?
            }
            Err(NoModel::Inseparable) if has_blocks => {
                remarks.push(Remark::InseparableBlocks);
                nested(&[])?
            }
            fits => fits?,
        };
        if !has_spare(&fits) && fits.pop_if(|(name, _)| *name == "speed x spacing").is_some() {
            remarks.push(Remark::NoReplication);
        }
        if has_speed && has_spacing {
            let is_in_blocks = fits[1].0 == "block";
            let cells = (0..values.len()).map(|plot| if is_in_blocks { design.blocks[plot] } else { 0 });
            let cells = levels(design.treatments().zip(cells));
            let all = speeds.len() * spacings.len() * if is_in_blocks { blocks.len() } else { 1 };
            if cells.len() != all || cells.iter().any(|plots| plots.len() != cells[0].len()) {
                remarks.push(Remark::Unbalanced);
            }
        }
        let (_, last) = fits[fits.len() - 1];
        if !has_spare(&fits) {
            let needed = last.parameters + SPARE;
            return Err(NoModel::TooFewPlots { plots: values.len(), parameters: last.parameters, needed });
        }

        let residual_freedom = values.len() - last.parameters;
        let residual_mean_square = last.sum_of_squares / residual_freedom as f64;
        let scatters = !is_zero(last.sum_of_squares, values);
        if !scatters {
            remarks.push(Remark::NoScatter);
        }
        let source = |pair: &[(&'static str, Fit)]| {
            let (before, (name, after)) = (pair[0].1, pair[1]);
            let degrees_of_freedom = after.parameters - before.parameters;
            // A smaller share of all is a rounding error.
            let gained = before.sum_of_squares - after.sum_of_squares;
            let sum_of_squares = if gained > 1e-12 * scatter(values) { gained } else { 0.0 };
            let mean_square = sum_of_squares / degrees_of_freedom as f64;
            let f = scatters.then(|| mean_square / residual_mean_square);
            let distribution = FisherSnedecor::new(degrees_of_freedom as f64, residual_freedom as f64).ok();
            let p = f.zip(distribution).map(|(f, distribution)| distribution.sf(f));
            Source { name, degrees_of_freedom, sum_of_squares, mean_square, f, p }
        };
        let mut sources: Vec<Source> = fits.windows(2).map(source).collect();
        sources.push(Source {
            name: "residual",
            degrees_of_freedom: residual_freedom,
            sum_of_squares: last.sum_of_squares,
            mean_square: residual_mean_square,
            f: None,
            p: None,
        });
        Ok(Self { sources, remarks })
    }
}

/// The plots of each level of a factor.
pub(super) type Levels = Vec<Vec<usize>>;

pub(super) fn levels<K: PartialEq>(plots: impl IntoIterator<Item = K>) -> Levels {
    grouped(plots.into_iter().zip(0..)).into_iter().map(|(_, plots)| plots).collect()
}

/// Effects of some factors that add up.
fn additive_fit(factors: &[&Levels], values: &[f64]) -> Result<Fit, NoModel> {
    // For a single factor the means suffice, and are exact.
    if let [only] = factors {
        return Ok(levels_fit(only, values));
    }
    // A column for each level of each factor: more than needed, so some depend on others.
    let column = |level: &Vec<usize>| (0..values.len()).map(|plot| f64::from(level.contains(&plot))).collect();
    let columns: Vec<Vec<f64>> = factors.iter().copied().flatten().map(column).collect();
    let basis = Basis::of(&columns).ok_or(NoModel::NotSolved)?;
    let mean = mean(values);
    let deviations: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let sum_of_squares = basis.residual(&deviations).iter().map(|residual| residual * residual).sum();
    Ok(Fit { parameters: basis.rank(), sum_of_squares })
}

pub(super) fn levels_fit(levels: &Levels, values: &[f64]) -> Fit {
    let of_level = |plots: &Vec<usize>| plots.iter().map(|&plot| values[plot]).collect::<Vec<f64>>();
    Fit { parameters: levels.len(), sum_of_squares: levels.iter().map(|plots| scatter(&of_level(plots))).sum() }
}
