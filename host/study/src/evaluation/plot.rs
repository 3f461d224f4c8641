//! A plot's counts and measurements, and its measures by the paper's Eq. 22 to 27. The paper models four of them on
//! speed and spacing.

use crate::table::{fixed, optional, short};
use anyhow::{Result, bail, ensure};
use files::FileError;
use files::csv_table::Line;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

const M2_PER_HA: f64 = 10_000.0;
const S_PER_H: f64 = 3600.0;

/// The counts and measurements of one plot. What was not counted or measured is `None`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PlotRecord {
    /// Its number in the field, from 1; 0 if it has none of its own.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub plot: u32,
    /// The number of its replication.
    pub replication: u32,
    /// Forward speed that the machine was set to, or that was measured, km/h.
    pub speed_km_h: f64,
    /// Plant spacing along the row, cm.
    pub spacing_cm: f64,
    /// Weeds counted before weeding.
    pub weeds_before: Option<u32>,
    /// Weeds counted after weeding, on the same ground. More may be there than before: some emerge, and counts scatter.
    pub weeds_after: Option<u32>,
    /// Crop plants in the plot.
    pub plants: Option<u32>,
    /// Crop plants that the machine injured.
    pub damaged: Option<u32>,
    /// Area that was weeded, m2.
    pub area_m2: Option<f64>,
    /// Time that this took, with turns and stops, s.
    pub time_s: Option<f64>,
    /// Working width of the machine, m.
    pub width_m: Option<f64>,
    /// Power that the machine needs, hp.
    pub power_hp: Option<f64>,
}

/// A column of a table of plots: its name there, its heading in a report, its decimals there, its range, and its value
/// in a plot. `None` prints all decimals.
type Column = (&'static str, &'static str, Option<usize>, (f64, f64), fn(&PlotRecord) -> Option<f64>);

const COUNT: (f64, f64) = (0.0, f64::INFINITY);

/// The columns of a table of plots, which carry their units. The plots of every simulated field are in the ranges.
pub(crate) const COLUMNS: [Column; 11] = [
    ("replication", "replication", None, COUNT, |plot| Some(plot.replication.into())),
    ("speed_km_h", "speed, km/h", None, (0.1, 15.0), |plot| Some(plot.speed_km_h)),
    ("spacing_cm", "spacing, cm", None, (5.0, 500.0), |plot| Some(plot.spacing_cm)),
    ("weeds_before", "weeds before", None, COUNT, |plot| plot.weeds_before.map(f64::from)),
    ("weeds_after", "weeds after", None, COUNT, |plot| plot.weeds_after.map(f64::from)),
    ("plants", "plants", None, COUNT, |plot| plot.plants.map(f64::from)),
    ("damaged", "damaged", None, COUNT, |plot| plot.damaged.map(f64::from)),
    ("area_m2", "area, m²", Some(2), (0.01, 1e7), |plot| plot.area_m2),
    ("time_s", "time, s", Some(1), (0.1, 1e9), |plot| plot.time_s),
    ("width_m", "width, m", Some(2), (0.01, 50.0), |plot| plot.width_m),
    ("power_hp", "power, hp", Some(2), (0.001, 1000.0), |plot| plot.power_hp),
];

#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde passes a reference")]
fn is_zero(number: &u32) -> bool {
    *number == 0
}

/// The measures of one plot. A measure is `None` if something that it needs was not counted or measured.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Performance {
    /// Plants injured, percent of those in the plot (Eq. 23).
    pub plant_damage_percent: Option<f64>,
    /// Weeds removed, percent of those before weeding (Eq. 22). It is below 0 if more weeds were counted after weeding.
    pub weeding_efficiency_percent: Option<f64>,
    /// Area an hour at the set speed with the whole width and no time lost, ha/h (Eq. 25).
    pub theoretical_capacity_ha_h: Option<f64>,
    /// Area an hour that was weeded, ha/h (Eq. 26).
    pub effective_capacity_ha_h: Option<f64>,
    /// Effective in percent of theoretical capacity (Eq. 24).
    pub field_efficiency_percent: Option<f64>,
    /// Capacity times the percentages of undamaged plants and removed weeds, divided by power (Eq. 27), in ha %2/(h
    /// hp). The paper does not say which capacity it uses; this is the effective one.
    pub performance_index: Option<f64>,
}

/// A part in percent of the whole. `None` if the whole is 0.
fn percent(part: f64, whole: u32) -> Option<f64> {
    (whole > 0).then(|| 100.0 * part / f64::from(whole))
}

impl PlotRecord {
    /// Parses a line of a table. The values are not checked yet.
    pub(super) fn read(line: Line) -> Result<Self, FileError> {
        Ok(Self {
            plot: 0,
            replication: whole(line, "replication")?,
            speed_km_h: number(line, "speed_km_h")?,
            spacing_cm: number(line, "spacing_cm")?,
            weeds_before: count(line, "weeds_before")?,
            weeds_after: count(line, "weeds_after")?,
            plants: count(line, "plants")?,
            damaged: count(line, "damaged")?,
            area_m2: measured(line, "area_m2")?,
            time_s: measured(line, "time_s")?,
            width_m: measured(line, "width_m")?,
            power_hp: measured(line, "power_hp")?,
        })
    }

    pub(super) fn cells(&self) -> Vec<String> {
        let shown = |decimals: Option<usize>, value| decimals.map_or_else(|| short(value), |some| fixed(value, some));
        COLUMNS.map(|(_, _, decimals, _, value)| optional(value(self), |value| shown(decimals, value))).to_vec()
    }

    /// Each column with its value, which is empty if it is not known.
    pub(crate) fn columns(&self) -> impl Iterator<Item = (&'static str, String)> {
        let text = |value: Option<f64>| value.map(|value| value.to_string()).unwrap_or_default();
        COLUMNS.into_iter().map(move |(column, .., value)| (column, text(value(self))))
    }

    /// Checks that a plot's values are possible.
    ///
    /// # Errors
    /// Names the first quantity that is out of its range or contradicts another.
    pub fn check(&self) -> Result<()> {
        for (column, heading, _, (least, greatest), value) in COLUMNS {
            if let Some(value) = value(self).filter(|value| !(least..=greatest).contains(value)) {
                let unit = heading.split(", ").nth(1).unwrap_or_default().replace('²', "2");
                bail!("{column} is {value}: it has to be from {least} to {greatest} {unit}");
            }
        }
        if let (Some(damaged), Some(plants)) = (self.damaged, self.plants) {
            ensure!(damaged <= plants, "damaged is {damaged}: it cannot exceed plants");
        }
        Ok(())
    }

    /// The plot's measures by Eq. 22 to 27. They are finite if [`PlotRecord::check`] succeeds.
    pub fn performance(&self) -> Performance {
        let weeds = self.weeds_before.zip(self.weeds_after);
        self.performance_with(weeds.and_then(|(before, after)| percent(f64::from(before) - f64::from(after), before)))
    }

    /// The same, with the weeding efficiency of other weeds, percent.
    pub fn performance_with(&self, weeding_efficiency_percent: Option<f64>) -> Performance {
        let plant_damage_percent =
            self.damaged.zip(self.plants).and_then(|(damaged, plants)| percent(f64::from(damaged), plants));
        let theoretical_capacity_ha_h = self.width_m.map(|width_m| self.speed_km_h * width_m / 10.0);
        let effective_capacity_ha_h =
            self.area_m2.zip(self.time_s).map(|(area_m2, time_s)| (area_m2 / M2_PER_HA) / (time_s / S_PER_H));
        let field_efficiency_percent = effective_capacity_ha_h
            .zip(theoretical_capacity_ha_h)
            .map(|(effective, theoretical)| effective / theoretical * 100.0);
        let index = || {
            let undamaged = 100.0 - plant_damage_percent?;
            Some(effective_capacity_ha_h? * undamaged * weeding_efficiency_percent? / self.power_hp?)
        };
        Performance {
            plant_damage_percent,
            weeding_efficiency_percent,
            theoretical_capacity_ha_h,
            effective_capacity_ha_h,
            field_efficiency_percent,
            performance_index: index(),
        }
    }

    /// Whether nothing of the plot was counted or timed. Area, width and power may be known beforehand.
    pub fn is_blank(&self) -> bool {
        [self.weeds_before, self.weeds_after, self.plants, self.damaged].iter().all(Option::is_none)
            && self.time_s.is_none()
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

    /// Its unit. That of the index is seldom printed.
    pub fn unit(self) -> &'static str {
        match self {
            Self::PerformanceIndex => "ha %²/(h hp)",
            Self::PlantDamage | Self::WeedingEfficiency | Self::FieldEfficiency => "%",
        }
    }

    /// The count in a plot, and its total. `None` for a measure that is not counted, and if it was not. Of a plot with
    /// more weeds after than before, no weed counts as removed.
    pub fn count(self, record: &PlotRecord) -> Option<(u32, u32)> {
        match self {
            Self::PlantDamage => record.damaged.zip(record.plants),
            Self::WeedingEfficiency => {
                let (before, after) = record.weeds_before.zip(record.weeds_after)?;
                Some((before.saturating_sub(after), before))
            }
            Self::PerformanceIndex | Self::FieldEfficiency => None,
        }
    }

    /// Whether it is counted, so that it has a binomial model.
    pub fn is_counted(self) -> bool {
        matches!(self, Self::PlantDamage | Self::WeedingEfficiency)
    }

    /// Its value in a plot.
    pub fn value(self, performance: &Performance) -> Option<f64> {
        match self {
            Self::PlantDamage => performance.plant_damage_percent,
            Self::WeedingEfficiency => performance.weeding_efficiency_percent,
            Self::PerformanceIndex => performance.performance_index,
            Self::FieldEfficiency => performance.field_efficiency_percent,
        }
    }
}

/// Texts of a cell that say that a count or measurement was not made.
const NOT_COUNTED: [&str; 8] = ["", "na", "n/a", "n.a.", "-", "\u{2013}", "?", "."];

pub(super) fn whole(line: Line, column: &str) -> Result<u32, FileError> {
    line.value(column, "a whole number, 0 or more")
}

fn number(line: Line, column: &str) -> Result<f64, FileError> {
    let Number(value) = line.value(column, "a number, like 1.5")?;
    Ok(value)
}

fn count(line: Line, column: &str) -> Result<Option<u32>, FileError> {
    made(line, column, "a whole number, 0 or more, or empty if it was not counted")
}

fn measured(line: Line, column: &str) -> Result<Option<f64>, FileError> {
    let number = made(line, column, "a number, like 1.5, or empty if it was not measured")?;
    Ok(number.map(|Number(value)| value))
}

/// A count or measurement, if it was made.
fn made<T: FromStr>(line: Line, column: &str, right: &str) -> Result<Option<T>, FileError> {
    let is_made = !NOT_COUNTED.contains(&line.text(column).to_lowercase().as_str());
    is_made.then(|| line.value(column, right)).transpose()
}

/// A decimal number, without `inf` and `nan`.
struct Number(f64);

impl FromStr for Number {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        text.parse().ok().filter(|value: &f64| value.is_finite()).map(Self).ok_or(())
    }
}
