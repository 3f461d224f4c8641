//! The statistics of a trial with two factors, forward speed and plant spacing: a linear model of a response on both as
//! numbers, a binomial one of counts, the two-way analysis of variance with both as factors and the replications as blocks,
//! what the residuals say, and how far shares and means may be off.
//!
//! The model is R's `lm(response ~ speed + spacing)`, the binomial one R's `glm(..., family = binomial)`, the analysis R's
//! `anova(lm(response ~ factor(block) + factor(speed) * factor(spacing)))`. Least squares come from linregress and nalgebra, distributions
//! from statrs. The rest is by hand: no kept crate has this analysis of variance, and the one for the binomial model (ndarray-glm)
//! wants a LAPACK of the system's. What the plots cannot tell is said in words, as [`NoModel`] or as a [`Remark`]: no figure here is
//! infinite or not a number.

mod binomial;
mod checks;
mod design;
mod interval;
mod linear;
mod variance;

pub use binomial::{BinomialModel, OddsTerm};
pub use checks::Checks;
pub use design::{Design, NoModel, Remark};
pub use interval::{CONFIDENCE, Mean, Share};
pub use linear::{LinearModel, Term};
pub use variance::{AnalysisOfVariance, Source};
