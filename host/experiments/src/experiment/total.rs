//! Totals of each controller at each speed, over all plots.

use super::{PlotOutcome, Treatment, Zones};
use crate::statistics::{Mean, Share, grouped, mean};
use field::budget::Budget;
use field::tool_path::Effect;

/// The total of one controller at one speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Total {
    /// Who weeded them.
    pub controller: Treatment,
    /// The speed, km/h.
    pub speed_km_h: f64,
    /// Plants and weeds, counted.
    pub effect: Effect,
    /// Plants' zones, counted.
    pub zones: Zones,
    /// Share of the rows' ground that the tool weeded, from 0 to 1.
    pub weeded_share: f64,
    /// The largest share that this servo could weed with every canopy and margin kept.
    pub weedable_share: f64,
    /// Share that could be weeded at best without a plant damaged.
    pub undamaged_share: f64,
    /// The loss budget.
    pub budget: Budget,
    /// The weeded share, percent: the mean of the replications, each with all its spacings.
    pub weeded_percent: Mean,
    /// Rows in which an alarm took the tool out.
    pub alarms: u32,
}

impl Total {
    /// Plants damaged by the tool or by sweeps, with the interval of their share.
    pub fn damage(&self) -> Share {
        Share::of(self.effect.injured(), self.effect.plants)
    }

    /// Zones over which the tool was not fully out, with the interval of their share.
    pub fn reached(&self) -> Share {
        Share::of(self.zones.reached, self.zones.all)
    }

    /// Plants damaged, % (Eq. 23).
    pub fn plant_damage_percent(&self) -> f64 {
        self.damage().percent()
    }

    /// Zones over which the tool was not fully out, % of all.
    pub fn zones_reached_percent(&self) -> f64 {
        self.reached().percent()
    }

    /// Other zones whose margin was cut, % of all.
    pub fn margins_cut_percent(&self) -> f64 {
        Share::of(self.zones.margins_cut, self.zones.all).percent()
    }
}

/// The totals of each controller at each speed, over all spacings and replications: by speed, then in the order of
/// controllers.
pub fn totals(outcomes: &[PlotOutcome]) -> Vec<Total> {
    let of_total = |outcome: &PlotOutcome| (outcome.controller, outcome.record.speed_km_h);
    let groups = grouped(outcomes.iter().map(|outcome| (of_total(outcome), outcome)));
    let mut totals: Vec<Total> = groups.iter().map(|(_, plots)| total(plots)).collect();
    totals.sort_by(|a, b| a.speed_km_h.total_cmp(&b.speed_km_h));
    totals
}

/// The total of some plots, at least one.
fn total(plots: &[&PlotOutcome]) -> Total {
    let mut sum = plots[0].clone();
    plots[1..].iter().for_each(|plot| sum.add(plot));
    let count = plots.len() as f64;
    Total {
        controller: sum.controller,
        speed_km_h: sum.record.speed_km_h,
        effect: sum.effect,
        zones: sum.zones,
        weeded_share: sum.weeded_share / count,
        weedable_share: sum.weedable_share / count,
        undamaged_share: sum.undamaged_share / count,
        budget: sum.budget / count,
        weeded_percent: Mean::of(&by_replication(plots)),
        alarms: sum.alarms,
    }
}

/// The weeded share of each replication in percent, its spacings together: a block each, so that they are independent.
fn by_replication(plots: &[&PlotOutcome]) -> Vec<f64> {
    let blocks = grouped(plots.iter().map(|plot| (plot.record.replication, 100.0 * plot.weeded_share)));
    blocks.iter().map(|(_, shares)| mean(shares)).collect()
}
