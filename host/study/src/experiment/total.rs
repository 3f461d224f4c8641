//! Totals of each controller at each speed, over all plots.

use super::PlotOutcome;
use crate::statistics::{Mean, Share, grouped, mean};

/// The total of one controller at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Total {
    /// All plots as one: counts are sums, and shares are means.
    pub plots: PlotOutcome,
    /// The weeded share, percent: the mean of the replications, each with all its spacings.
    pub weeded_percent: Mean,
}

impl Total {
    /// The speed.
    pub fn speed_km_h(&self) -> f64 {
        self.plots.record.speed_km_h
    }

    /// Plants damaged by the tool, a sweep or the next row's tool, with the interval of their share (Eq. 23).
    pub fn damage(&self) -> Share {
        Share::of(self.plots.effect.injured(), self.plots.effect.plants)
    }

    /// Plants damaged of those that the beam can see, with the interval of their share.
    pub fn damage_of_seen(&self) -> Share {
        let (damaged, seen) = self.plots.effect.injured_of_seen();
        Share::of(damaged, seen)
    }

    /// Plants damaged of those that the beam cannot see.
    pub fn damage_of_unseen(&self) -> Share {
        Share::of(self.plots.effect.unseen, self.plots.effect.all_unseen)
    }

    /// Zones over which the tool was not fully out, of all.
    pub fn zones_reached(&self) -> Share {
        Share::of(self.plots.zones.reached, self.plots.zones.all)
    }

    /// Other zones whose margin was cut, of all.
    pub fn margins_cut(&self) -> Share {
        Share::of(self.plots.zones.margins_cut, self.plots.zones.all)
    }
}

/// The totals of each controller at each speed, over all spacings and replications: by speed, then in the order of
/// controllers.
pub fn totals(outcomes: &[PlotOutcome]) -> Vec<Total> {
    let of_total = |outcome: &PlotOutcome| (outcome.controller, outcome.record.speed_km_h);
    let groups = grouped(outcomes.iter().map(|outcome| (of_total(outcome), outcome)));
    let mut totals: Vec<Total> = groups.iter().map(|(_, plots)| total(plots)).collect();
    totals.sort_by(|a, b| a.speed_km_h().total_cmp(&b.speed_km_h()));
    totals
}

/// The total of some plots, at least one.
fn total(plots: &[&PlotOutcome]) -> Total {
    let mut sum = *plots[0];
    plots[1..].iter().for_each(|plot| sum.add(plot));
    let count = plots.len() as f64;
    sum.weeded_share /= count;
    sum.weedable_share /= count;
    sum.undamaged_share /= count;
    sum.budget = sum.budget / count;
    Total { plots: sum, weeded_percent: Mean::of(&by_replication(plots)) }
}

/// The weeded share of each replication in percent, its spacings together: a block each, so that they are independent.
fn by_replication(plots: &[&PlotOutcome]) -> Vec<f64> {
    let blocks = grouped(plots.iter().map(|plot| (plot.record.replication, 100.0 * plot.weeded_share)));
    blocks.iter().map(|(_, shares)| mean(shares)).collect()
}
