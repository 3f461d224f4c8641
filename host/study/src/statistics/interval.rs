//! Intervals of figures: exact intervals of counted shares, and intervals of means.
//!
//! A share's interval is Clopper and Pearson's, by the quantiles of the beta distribution, as in R's `binom.test`. It
//! covers the true share in at least 95 of 100 trials, for any number of plants. If none or all were counted, the 5 %
//! lie on one side (R's `alternative = "less"` or `"greater"`). So none of `n` gives "below about `3 / n`". A mean's
//! interval is Student's, as in R's `t.test`, over replications that are assumed independent.

use super::design::{mean, scatter};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, Normal, StudentsT};
use std::fmt::{self, Display, Formatter};

/// The least probability that an interval covers the true figure.
pub const CONFIDENCE: f64 = 0.95;

/// A count out of a total, with the interval of its share.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Share {
    /// Those counted.
    pub count: u64,
    /// The total, at least the count.
    pub of: u64,
    /// The lower end of the interval, percent; 0 if none was counted.
    pub least_percent: f64,
    /// The upper end, percent; 100 if all were counted.
    pub greatest_percent: f64,
}

impl Share {
    /// The share of `count` of `of`. If `of` is 0, the interval is everything.
    pub fn of(count: impl Into<u64>, of: impl Into<u64>) -> Self {
        let (count, of) = (count.into(), of.into());
        let chance = 1.0 - CONFIDENCE;
        let (hits, misses) = (count as f64, of.saturating_sub(count) as f64);
        let quantile = |a: f64, b: f64, probability: f64| 100.0 * beta_quantile(a, b, probability);
        // None and all have a one-sided interval, and its quantile has a closed form.
        let one_sided = || -100.0 * (chance.ln() / of.max(1) as f64).exp_m1();
        let (least_percent, greatest_percent) = match (count, of) {
            (_, 0) => (0.0, 100.0),
            (0, _) => (0.0, one_sided()),
            (count, of) if count >= of => (100.0 - one_sided(), 100.0),
            _ => (quantile(hits, misses + 1.0, chance / 2.0), quantile(hits + 1.0, misses, 1.0 - chance / 2.0)),
        };
        Self { count, of, least_percent, greatest_percent }
    }

    /// The share itself, percent; 0 if the total is 0.
    pub fn percent(&self) -> f64 {
        100.0 * self.count as f64 / self.of.max(1) as f64
    }

    /// The share itself as text, percent: `0.5`, or a small one as exactly as its interval, `0.009`.
    pub fn shown(&self) -> String {
        let is_small = self.count > 0 && self.percent() < 0.05;
        format!("{:.*}", if is_small { self.digits() } else { 1 }, self.percent())
    }

    /// What kind of interval it has, in words. If none or all were counted, it has one end.
    pub fn kind(&self) -> &'static str {
        if self.count == 0 || self.count >= self.of { "one-sided 95 % bound" } else { "two-sided 95 % interval" }
    }

    /// The decimal places in which the interval's ends differ.
    fn digits(&self) -> usize {
        match self.greatest_percent - self.least_percent {
            ..0.005 => 4,
            ..0.05 => 3,
            ..2.0 => 2,
            _ => 1,
        }
    }
}

/// Bisections that give the quantile of any count below 2^64 to the last digit of an `f64`.
const HALVINGS: usize = 120;

/// From these counts on the library's distribution is not exact, but the normal distribution is, to a thousandth of the
/// interval.
const MANY: f64 = 1e6;

/// The quantile of a beta distribution, 0 to 1. It uses bisection, which always ends: the library's own quantile does
/// not return for counts of thousands of millions.
fn beta_quantile(a: f64, b: f64, probability: f64) -> f64 {
    if a.min(b) > MANY {
        let (mean, all) = (a / (a + b), a + b);
        return mean + Normal::standard().inverse_cdf(probability) * (mean * (1.0 - mean) / all).sqrt();
    }
    let Ok(distribution) = Beta::new(a, b) else { return f64::NAN };
    let (mut least, mut greatest) = (0.0, 1.0);
    for _ in 0..HALVINGS {
        let middle = f64::midpoint(least, greatest);
        if distribution.cdf(middle) < probability {
            least = middle;
        } else {
            greatest = middle;
        }
    }
    greatest
}

/// The interval as text behind a share: `below 0.07` if none was counted, else `0.53 to 1.68`.
impl Display for Share {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        let digits = self.digits();
        match (self.count, self.of) {
            (_, 0) => f.write_str("none counted"),
            (0, _) => write!(f, "below {:.digits$}", self.greatest_percent),
            (count, of) if count == of => write!(f, "above {:.digits$}", self.least_percent),
            _ => write!(f, "{:.digits$} to {:.digits$}", self.least_percent, self.greatest_percent),
        }
    }
}

/// A mean and its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean, in the values' unit.
    pub mean: f64,
    /// Half the width of its interval, in the same unit. `None` for a single value.
    pub within: Option<f64>,
}

impl Mean {
    /// The mean of independent values; 0 without values.
    pub fn of(values: &[f64]) -> Self {
        let count = values.len() as f64;
        let quantile = || {
            let distribution = StudentsT::new(0.0, 1.0, count - 1.0).ok()?;
            Some(distribution.inverse_cdf(1.0 - (1.0 - CONFIDENCE) / 2.0))
        };
        let error = || (scatter(values) / (count - 1.0) / count).sqrt();
        Self {
            mean: mean(values),
            within: (values.len() > 1).then(quantile).flatten().map(|quantile| quantile * error()),
        }
    }
}
