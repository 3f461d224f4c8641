//! What each controller did at each speed, all plots together, and the controllers side by side.

use super::{Canopies, Controller, PlotOutcome};
use crate::page::{Comparison, ControllerCurve, ControllerPoint};
use field::tool_path::Effect;

/// All plots of one speed that one controller weeded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Total {
    /// Who weeded them.
    pub controller: Controller,
    /// The speed, km/h.
    pub speed_km_h: f64,
    /// Plants and weeds, counted.
    pub effect: Effect,
    /// Canopies, counted.
    pub canopies: Canopies,
    /// Share of the rows' ground that the tool weeded, from 0 to 1.
    pub weeded_share: f64,
    /// Share that this servo could weed with every canopy and margin kept.
    pub weedable_share: f64,
    /// Rows in which an alarm took the tool out.
    pub alarms: u32,
}

impl Total {
    /// Plants damaged, % (Eq. 23).
    pub fn plant_damage_percent(&self) -> f64 {
        percent(self.effect.damaged, self.effect.plants)
    }

    /// Canopies over which the tool was not fully out, % of all.
    pub fn canopies_reached_percent(&self) -> f64 {
        percent(self.canopies.reached, self.canopies.all)
    }

    /// Canopies whose margin was cut, but not they, % of all.
    pub fn margins_cut_percent(&self) -> f64 {
        percent(self.canopies.margins_cut, self.canopies.all)
    }
}

fn percent(part: u32, whole: u32) -> f64 {
    100.0 * f64::from(part) / f64::from(whole.max(1))
}

/// What each controller did at each speed, all spacings and replications together: by speed, then in the order in which the
/// controllers took part.
pub fn totals(outcomes: &[PlotOutcome]) -> Vec<Total> {
    let mut totals: Vec<(Total, f64)> = Vec::new();
    for outcome in outcomes {
        let (controller, speed_km_h) = (outcome.controller, outcome.record.speed_km_h);
        let is_its = |(total, _): &(Total, f64)| total.controller == controller && total.speed_km_h == speed_km_h;
        let index = totals.iter().position(is_its).unwrap_or_else(|| {
            let (effect, canopies) = Default::default();
            let none =
                Total { controller, speed_km_h, effect, canopies, weeded_share: 0.0, weedable_share: 0.0, alarms: 0 };
            totals.push((none, 0.0));
            totals.len() - 1
        });
        let (total, plots) = &mut totals[index];
        total.effect += outcome.effect;
        total.canopies += outcome.canopies;
        total.weeded_share += outcome.weeded_share;
        total.weedable_share += outcome.weedable_share;
        total.alarms += outcome.alarms;
        *plots += 1.0;
    }
    let mean = |(total, plots): (Total, f64)| Total {
        weeded_share: total.weeded_share / plots,
        weedable_share: total.weedable_share / plots,
        ..total
    };
    let mut totals: Vec<Total> = totals.into_iter().map(mean).collect();
    totals.sort_by(|a, b| a.speed_km_h.total_cmp(&b.speed_km_h));
    totals
}

/// The controllers side by side, for the report.
pub fn compare(totals: &[Total]) -> Comparison {
    let point = |total: &Total| ControllerPoint {
        speed_km_h: total.speed_km_h,
        plant_damage_percent: total.plant_damage_percent(),
        over_canopy_percent: total.canopies_reached_percent(),
        in_row_weeding_percent: 100.0 * total.weeded_share,
    };
    let of = |controller: Controller| totals.iter().filter(move |total| total.controller == controller);
    let curve = |controller: Controller| ControllerCurve {
        name: controller.title().to_owned(),
        points: of(controller).map(point).collect(),
    };
    let first = totals.first().map_or(Controller::Firmware, |total| total.controller);
    Comparison {
        controllers: Controller::ALL.into_iter().filter(|&one| of(one).next().is_some()).map(curve).collect(),
        bound: of(first).map(|total| (total.speed_km_h, 100.0 * total.weedable_share)).collect(),
    }
}
