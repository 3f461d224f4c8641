//! Totals of each controller at each speed, over all plots.

use super::{PlotOutcome, Treatment, Zones};
use crate::statistics::{Mean, Share};
use field::budget::Budget;
use field::tool_path::Effect;
use std::collections::BTreeMap;

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
    let mut totals: Vec<(Total, Vec<&PlotOutcome>)> = Vec::new();
    for outcome in outcomes {
        let (controller, speed_km_h) = (outcome.controller, outcome.record.speed_km_h);
        let is_its =
            |(total, _): &(Total, Vec<&PlotOutcome>)| total.controller == controller && total.speed_km_h == speed_km_h;
        let index = totals.iter().position(is_its).unwrap_or_else(|| {
            let (effect, zones) = Default::default();
            let none = Total {
                controller,
                speed_km_h,
                effect,
                zones,
                weeded_share: 0.0,
                weedable_share: 0.0,
                undamaged_share: 0.0,
                budget: Budget::default(),
                weeded_percent: Mean::of(&[]),
                alarms: 0,
            };
            totals.push((none, Vec::new()));
            totals.len() - 1
        });
        let (total, plots) = &mut totals[index];
        total.effect += outcome.effect;
        total.zones += outcome.zones;
        total.weeded_share += outcome.weeded_share;
        total.weedable_share += outcome.weedable_share;
        total.undamaged_share += outcome.undamaged_share;
        total.budget += outcome.budget;
        total.alarms += outcome.alarms;
        plots.push(outcome);
    }
    let mean = |(total, plots): (Total, Vec<&PlotOutcome>)| Total {
        weeded_share: total.weeded_share / plots.len() as f64,
        weedable_share: total.weedable_share / plots.len() as f64,
        undamaged_share: total.undamaged_share / plots.len() as f64,
        budget: total.budget / plots.len() as f64,
        weeded_percent: Mean::of(&by_replication(&plots)),
        ..total
    };
    let mut totals: Vec<Total> = totals.into_iter().map(mean).collect();
    totals.sort_by(|a, b| a.speed_km_h.total_cmp(&b.speed_km_h));
    totals
}

/// The weeded share of each replication in percent, its spacings together: a block each, so that they are independent.
fn by_replication(plots: &[&PlotOutcome]) -> Vec<f64> {
    let mut blocks: BTreeMap<u32, Vec<f64>> = BTreeMap::new();
    for plot in plots {
        blocks.entry(plot.record.replication).or_default().push(100.0 * plot.weeded_share);
    }
    blocks.values().map(|shares| shares.iter().sum::<f64>() / shares.len() as f64).collect()
}
