//! A field trial judged: from what somebody with a notebook writes down of each plot to the paper's measures (Eq. 22 to 27),
//! and from these to models and analyses of variance, with the paper's own figures beside them.
//!
//! A trial has plots of some speeds and plant spacings, with replications. [`PlotRecord`] is one plot, [`table`] reads and
//! writes them as CSV, [`PlotRecord::performance`] is what follows from one, [`Analysis`] what follows from all, and [`published`] is what
//! the paper printed. Nothing here knows whether a plot was real or simulated.

mod findings;
pub mod published;
mod report;
pub mod table;

use crate::statistics::{AnalysisOfVariance, BinomialModel, Checks, Design, LinearModel, Mean, NoModel, Share};
use published::Published;
use serde::{Deserialize, Serialize};
pub use table::{FileError, read_csv, write_csv};
use thiserror::Error;

/// Square metres in a hectare.
const M2_PER_HA: f64 = 10_000.0;

/// Seconds in an hour.
const S_PER_H: f64 = 3600.0;

/// One plot of a trial, as counted and measured in it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PlotRecord {
    /// Which repetition of its speed and spacing it is.
    pub replication: u32,
    /// Forward speed that the machine was set to, km/h.
    pub speed_km_h: f64,
    /// Plant spacing along the row, cm.
    pub spacing_cm: f64,
    /// Weeds counted before weeding.
    pub weeds_before: u32,
    /// Weeds counted after weeding, on the same ground.
    pub weeds_after: u32,
    /// Crop plants in the plot.
    pub plants: u32,
    /// Crop plants that the machine injured.
    pub damaged: u32,
    /// Area that was weeded, m2.
    pub area_m2: f64,
    /// Time that this took, with turns and stops, s.
    pub time_s: f64,
    /// Working width of the machine, m.
    pub width_m: f64,
    /// Power that the machine needs, hp.
    pub power_hp: f64,
}

/// What follows from one plot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Performance {
    /// Plants injured, percent of those in the plot (Eq. 23).
    pub plant_damage_percent: f64,
    /// Weeds gone, percent of those before weeding (Eq. 22).
    pub weeding_efficiency_percent: f64,
    /// Area an hour at the set speed with the whole width and no time lost, ha/h (Eq. 25).
    pub theoretical_capacity_ha_h: f64,
    /// Area an hour that was weeded, ha/h (Eq. 26).
    pub effective_capacity_ha_h: f64,
    /// Effective in percent of theoretical capacity (Eq. 24).
    pub field_efficiency_percent: f64,
    /// Capacity times the percentages of plants and weeds done right, a horsepower (Eq. 27). The paper does not say which
    /// capacity it takes; here it is the effective one. ha %2/(h hp).
    pub performance_index: f64,
}

/// A plot cannot be as it is written down.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{column} is {value}: {right}")]
pub struct Implausible {
    /// The column, which is the field of [`PlotRecord`].
    pub column: &'static str,
    /// What stands there.
    pub value: f64,
    /// What would be right.
    pub right: &'static str,
}

impl PlotRecord {
    /// Says whether a plot can be like this.
    ///
    /// # Errors
    /// Names the first quantity that is out of its range or contradicts another.
    pub fn check(&self) -> Result<(), Implausible> {
        let within = |value: f64, lowest: f64, highest: f64| (lowest..=highest).contains(&value);
        let checks = [
            ("speed_km_h", self.speed_km_h, within(self.speed_km_h, 0.1, 15.0), "it has to be from 0.1 to 15 km/h"),
            ("spacing_cm", self.spacing_cm, within(self.spacing_cm, 5.0, 500.0), "it has to be from 5 to 500 cm"),
            (
                "weeds_before",
                self.weeds_before.into(),
                self.weeds_before > 0,
                "without a weed before weeding there is no weeding efficiency",
            ),
            (
                "weeds_after",
                self.weeds_after.into(),
                self.weeds_after <= self.weeds_before,
                "it cannot exceed weeds_before",
            ),
            ("plants", self.plants.into(), self.plants > 0, "without a plant there is no plant damage in percent"),
            ("damaged", self.damaged.into(), self.damaged <= self.plants, "it cannot exceed plants"),
            ("area_m2", self.area_m2, within(self.area_m2, 0.01, 1e6), "it has to be from 0.01 to 1000000 m2"),
            ("time_s", self.time_s, within(self.time_s, 0.1, 1e6), "it has to be from 0.1 to 1000000 s"),
            ("width_m", self.width_m, within(self.width_m, 0.01, 50.0), "it has to be from 0.01 to 50 m"),
            ("power_hp", self.power_hp, within(self.power_hp, 0.001, 1000.0), "it has to be from 0.001 to 1000 hp"),
        ];
        let wrong = checks.into_iter().find(|(_, _, fits, _)| !fits);
        wrong.map_or(Ok(()), |(column, value, _, right)| Err(Implausible { column, value, right }))
    }

    /// What follows from the plot by Eq. 22 to 27. Finite where [`PlotRecord::check`] is content.
    pub fn performance(&self) -> Performance {
        let share = |part: u32, whole: u32| f64::from(part) / f64::from(whole);
        let plant_damage_percent = share(self.damaged, self.plants) * 100.0;
        let weeding_efficiency_percent =
            share(self.weeds_before.saturating_sub(self.weeds_after), self.weeds_before) * 100.0;
        let theoretical_capacity_ha_h = self.speed_km_h * self.width_m / 10.0;
        let effective_capacity_ha_h = (self.area_m2 / M2_PER_HA) / (self.time_s / S_PER_H);
        Performance {
            plant_damage_percent,
            weeding_efficiency_percent,
            theoretical_capacity_ha_h,
            effective_capacity_ha_h,
            field_efficiency_percent: effective_capacity_ha_h / theoretical_capacity_ha_h * 100.0,
            performance_index: effective_capacity_ha_h * (100.0 - plant_damage_percent) * weeding_efficiency_percent
                / self.power_hp,
        }
    }
}

/// A measure that the paper models on speed and spacing.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Response {
    /// Plants injured, % (the paper's Eq. 28 and Fig. 8).
    PlantDamage,
    /// Weeds gone, % (Eq. 29, Fig. 9).
    WeedingEfficiency,
    /// Performance index, ha %2/(h hp) (Eq. 30, Fig. 10).
    PerformanceIndex,
    /// Field efficiency, % (Eq. 31, Fig. 11).
    FieldEfficiency,
}

impl Response {
    /// All, in the paper's order.
    pub const ALL: [Self; 4] =
        [Self::PlantDamage, Self::WeedingEfficiency, Self::PerformanceIndex, Self::FieldEfficiency];

    /// Its name, as in a heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::PlantDamage => "Plant damage",
            Self::WeedingEfficiency => "Weeding efficiency",
            Self::PerformanceIndex => "Performance index",
            Self::FieldEfficiency => "Field efficiency",
        }
    }

    /// Its unit; that of the index is seldom printed.
    pub fn unit(self) -> &'static str {
        match self {
            Self::PerformanceIndex => "ha %²/(h hp)",
            Self::PlantDamage | Self::WeedingEfficiency | Self::FieldEfficiency => "%",
        }
    }

    /// What it counts in a plot, and of how many; none of a measure that is not counted.
    pub fn count(self, record: &PlotRecord) -> Option<(u32, u32)> {
        match self {
            Self::PlantDamage => Some((record.damaged, record.plants)),
            Self::WeedingEfficiency => {
                Some((record.weeds_before.saturating_sub(record.weeds_after), record.weeds_before))
            }
            Self::PerformanceIndex | Self::FieldEfficiency => None,
        }
    }

    /// Its value in a plot.
    pub fn value(self, performance: &Performance) -> f64 {
        match self {
            Self::PlantDamage => performance.plant_damage_percent,
            Self::WeedingEfficiency => performance.weeding_efficiency_percent,
            Self::PerformanceIndex => performance.performance_index,
            Self::FieldEfficiency => performance.field_efficiency_percent,
        }
    }
}

/// A trial cannot be analysed.
#[derive(Clone, Debug, Error, PartialEq)]
pub enum AnalysisError {
    /// Nothing was written down.
    #[error("a trial has at least one plot")]
    NoPlots,
    /// A plot that cannot be.
    #[error("plot {plot}: {problem}")]
    Plot {
        /// The plot, counted from 1.
        plot: usize,
        /// What is wrong with it.
        problem: Implausible,
    },
}

/// What follows from all plots of a trial.
#[derive(Clone, Debug)]
pub struct Analysis {
    /// The plots.
    pub records: Vec<PlotRecord>,
    /// What follows from each, in the same order.
    pub performances: Vec<Performance>,
    /// What follows for each measure, in the order of [`Response::ALL`].
    pub responses: Vec<ResponseAnalysis>,
}

/// What all plots together say of one measure.
#[derive(Clone, Debug)]
pub struct ResponseAnalysis {
    /// The measure.
    pub response: Response,
    /// Its lowest and its highest value in a plot, in its unit.
    pub range: (f64, f64),
    /// It as a linear function of speed in km/h and spacing in cm.
    pub model: Result<LinearModel, NoModel>,
    /// What that model's residuals say; none without one.
    pub checks: Option<Checks>,
    /// The binomial model of its counts; none for a measure that is not counted.
    pub binomial: Option<Result<BinomialModel, NoModel>>,
    /// Its two-way analysis of variance by speed and spacing, with their interaction, and the replications as blocks.
    pub variance: Result<AnalysisOfVariance, NoModel>,
    /// What the paper printed of it.
    pub published: Published,
}

/// The plots of one speed and spacing together.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Treatment {
    /// Forward speed, km/h.
    pub speed_km_h: f64,
    /// Plant spacing, cm.
    pub spacing_cm: f64,
    /// How many plots there are.
    pub plots: usize,
    /// The mean of each measure over them.
    pub mean: Performance,
    /// The plants of all of them together that were damaged.
    pub damaged: Share,
    /// Their mean weeding efficiency, %, and how far it may be off.
    pub weeding_efficiency: Mean,
}

impl Analysis {
    /// Analyses the plots of a trial.
    ///
    /// # Errors
    /// Where there is no plot, or one that cannot be. What a single measure has no model for is said in its place.
    pub fn of(records: Vec<PlotRecord>) -> Result<Self, AnalysisError> {
        if records.is_empty() {
            return Err(AnalysisError::NoPlots);
        }
        for (index, record) in records.iter().enumerate() {
            record.check().map_err(|problem| AnalysisError::Plot { plot: index + 1, problem })?;
        }
        let performances: Vec<Performance> = records.iter().map(PlotRecord::performance).collect();
        let design = Design::new(records.iter().map(|record| (record.speed_km_h, record.spacing_cm)))
            .in_blocks(records.iter().map(|record| record.replication).collect());
        let analyse = |response: Response| {
            let values: Vec<f64> = performances.iter().map(|performance| response.value(performance)).collect();
            let extreme = |pick: fn(f64, f64) -> f64| values.iter().copied().reduce(pick).unwrap_or_default();
            let model = LinearModel::fit(&design, &values);
            let counts: Option<Vec<(u32, u32)>> = records.iter().map(|record| response.count(record)).collect();
            ResponseAnalysis {
                response,
                range: (extreme(f64::min), extreme(f64::max)),
                checks: model.as_ref().ok().map(|model| Checks::of(&design, &values, model)),
                model,
                binomial: counts.map(|counts| BinomialModel::fit(&design, &counts)),
                variance: AnalysisOfVariance::of(&design, &values),
                published: Published::of(response),
            }
        };
        let responses = Response::ALL.map(analyse).to_vec();
        Ok(Self { records, performances, responses })
    }

    /// The plots, numbered from 1, that cover more ground than their speed and width allow: a field efficiency above
    /// 100 %, which is a mistake in area, time, width or speed.
    pub fn faster_than_possible(&self) -> Vec<usize> {
        let plots = (1..).zip(&self.performances);
        plots.filter(|(_, plot)| plot.field_efficiency_percent > 100.0).map(|(number, _)| number).collect()
    }

    /// The plots by treatment, slow and narrow first.
    pub fn treatments(&self) -> Vec<Treatment> {
        let mut of_treatments: Vec<(f64, f64)> =
            self.records.iter().map(|record| (record.speed_km_h, record.spacing_cm)).collect();
        of_treatments.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.total_cmp(&b.1)));
        of_treatments.dedup();
        of_treatments.into_iter().map(|(speed_km_h, spacing_cm)| self.treatment(speed_km_h, spacing_cm)).collect()
    }

    /// The plots of one speed and spacing.
    fn treatment(&self, speed_km_h: f64, spacing_cm: f64) -> Treatment {
        let is_in = |record: &PlotRecord| record.speed_km_h == speed_km_h && record.spacing_cm == spacing_cm;
        let both = self.records.iter().zip(&self.performances);
        let (records, plots): (Vec<&PlotRecord>, Vec<&Performance>) = both.filter(|(record, _)| is_in(record)).unzip();
        let mean = |quantity: fn(&Performance) -> f64| {
            plots.iter().map(|plot| quantity(plot)).sum::<f64>() / plots.len() as f64
        };
        let mean = Performance {
            plant_damage_percent: mean(|plot| plot.plant_damage_percent),
            weeding_efficiency_percent: mean(|plot| plot.weeding_efficiency_percent),
            theoretical_capacity_ha_h: mean(|plot| plot.theoretical_capacity_ha_h),
            effective_capacity_ha_h: mean(|plot| plot.effective_capacity_ha_h),
            field_efficiency_percent: mean(|plot| plot.field_efficiency_percent),
            performance_index: mean(|plot| plot.performance_index),
        };
        let weeding: Vec<f64> = plots.iter().map(|plot| plot.weeding_efficiency_percent).collect();
        Treatment {
            speed_km_h,
            spacing_cm,
            plots: plots.len(),
            mean,
            damaged: damaged(records),
            weeding_efficiency: Mean::of(&weeding),
        }
    }
}

/// The plants of some plots that were damaged.
fn damaged<'a>(records: impl IntoIterator<Item = &'a PlotRecord>) -> Share {
    let (damaged, plants) = records
        .into_iter()
        .fold((0, 0), |(damaged, plants), plot| (damaged + u64::from(plot.damaged), plants + u64::from(plot.plants)));
    Share::of(damaged, plants)
}

#[cfg(test)]
mod tests;
