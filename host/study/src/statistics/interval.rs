//! Intervals of figures: exact intervals of counted shares, and intervals of means.
//!
//! A share's interval is Clopper and Pearson's, by the quantiles of the beta distribution, as in R's `binom.test`. If none
//! or all were counted, the 5 % lie on one side (R's `alternative = "less"` or `"greater"`). So none of `n` gives "below
//! about `3 / n`". Each of these intervals by itself covers the true share in at least 95 of 100 trials, for any number of
//! plants, if they are independent. Because the count chooses the side, it is 92.5 of 100 for the rule as a whole. The
//! plants of a row are not independent: they share its slip, steering and servo. If plots scatter by more than counting
//! does, the interval covers less. A mean's interval is Student's, as in R's `t.test`, over replications that are
//! assumed independent.

use super::design::{is_zero, mean, scatter};
use crate::table::{fixed, optional, visible};
use serde::Serialize;
use statrs::distribution::{Beta, ContinuousCDF, Normal, StudentsT};
use std::fmt::{self, Display, Formatter};

/// The least probability that an interval by itself covers the true figure, if what is counted is independent.
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

    /// The share itself, percent; `None` if the total is 0.
    pub fn percent(&self) -> Option<f64> {
        (self.of > 0).then(|| 100.0 * self.count as f64 / self.of as f64)
    }

    /// The share itself as text, percent: `0.5`, a small one as `0.0090`, and a dash if the total is 0.
    pub fn shown(&self) -> String {
        self.in_interval(1)
    }

    /// The same with this many decimal places, or with more if only these keep the text inside the share's interval.
    pub(crate) fn in_interval(&self, decimals: usize) -> String {
        let interval = self.least_percent..=self.greatest_percent;
        let is_inside = |text: &String| text.parse().is_ok_and(|shown: f64| interval.contains(&shown));
        optional(self.percent(), |percent| {
            let mut texts = (decimals..MOST_PLACES).map(|places| visible(percent, places));
            texts.find(is_inside).unwrap_or_else(|| visible(percent, decimals))
        })
    }

    /// What kind of interval it has, in words. If none or all were counted, it has one end.
    pub fn kind(&self) -> &'static str {
        if self.count == 0 || self.count >= self.of { "one-sided 95 % bound" } else { "two-sided 95 % interval" }
    }

    /// The lower end as text, rounded down. It has two significant digits or more, so it never reads as 0.
    fn least(&self) -> String {
        let places = 1.0 - self.least_percent.log10().floor();
        rounded(self.least_percent, places.max(self.places()), f64::floor)
    }

    /// The upper end as text, rounded up.
    fn greatest(&self) -> String {
        rounded(self.greatest_percent, self.places(), f64::ceil)
    }

    /// The decimal places in which the ends differ.
    fn places(&self) -> f64 {
        let width = self.greatest_percent - self.least_percent;
        if width >= 2.0 { 1.0 } else { (-(width / 5.0).log10().floor()).max(2.0) }
    }
}

/// An `f64` has no more decimal places at 99 %.
const MOST_PLACES: usize = 14;

/// A percentage as text, rounded to so many decimal places.
fn rounded(percent: f64, places: f64, round: fn(f64) -> f64) -> String {
    let places = places.min(MOST_PLACES as f64);
    let scale = 10_f64.powf(places);
    fixed(round(percent * scale) / scale, places as usize)
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

/// The interval as text behind a share: `below 0.07` if none was counted, else `0.52 to 1.69`.
impl Display for Share {
    fn fmt(&self, f: &mut Formatter) -> fmt::Result {
        match (self.count, self.of) {
            (_, 0) => f.write_str("none counted"),
            (0, _) => write!(f, "below {}", self.greatest()),
            (count, of) if count == of => write!(f, "above {}", self.least()),
            _ => write!(f, "{} to {}", self.least(), self.greatest()),
        }
    }
}

/// A mean and its interval.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Mean {
    /// The mean, in the values' unit.
    pub mean: f64,
    /// Half the width of its interval, in the same unit. `None` for a single value, and if the values do not scatter.
    pub within: Option<f64>,
    /// How many values there are.
    pub of: usize,
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
            within: (!is_zero(scatter(values), values)).then(quantile).flatten().map(|quantile| quantile * error()),
            of: values.len(),
        }
    }
}
