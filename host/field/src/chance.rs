//! Random deviations.

use rand::{Rng, RngExt};

/// A deviation evenly spread over plus and minus `within`.
pub(crate) fn scatter(rng: &mut impl Rng, within: f64) -> f64 {
    rng.random_range(-1.0..=1.0) * within
}
