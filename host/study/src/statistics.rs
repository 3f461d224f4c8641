//! The statistics of a trial with two factors, forward speed and plant spacing. They are: a linear model of a response,
//! a binomial model of counts, the two-way analysis of variance with the replications as blocks, checks of the
//! residuals, and intervals of shares and means.
//!
//! The model is R's `lm(response ~ speed + spacing)`, the binomial one R's `glm(..., family = binomial)`, or `quasibinomial` where plots scatter more, the analysis
//! R's `anova(lm(response ~ factor(block) + factor(speed) * factor(spacing)))`. Distributions come from statrs. The rest
//! is written here: no maintained crate has this analysis of variance, and the one for the binomial model (ndarray-glm)
//! needs the system's LAPACK. If the plots do not allow a figure,
//! there is a [`NoModel`] or a [`Remark`] instead. No figure is infinite or not a number.

mod basis;
mod binomial;
mod checks;
mod design;
mod interval;
mod linear;
mod variance;

pub use binomial::{BinomialModel, OddsTerm};
pub use checks::Checks;
pub(crate) use checks::{SIGNIFICANCE, probability};
pub use design::{Design, NoModel, Remark};
pub(crate) use design::{grouped, mean};
pub use interval::{CONFIDENCE, Mean, Share};
pub use linear::{LinearModel, Term};
pub use variance::{AnalysisOfVariance, Source};
