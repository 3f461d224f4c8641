//! A plot's counts and measurements, and its measures by the paper's Eq. 22 to 27. The paper models four of them on
//! speed and spacing.

use crate::table::{fixed, short};
use anyhow::{Result, anyhow};
use files::FileError;
use files::csv_table::Line;
use serde::{Deserialize, Serialize};
use std::str::FromStr;

const M2_PER_HA: f64 = 10_000.0;
const S_PER_H: f64 = 3600.0;

/// Declares a plot's record. Each column of a table of plots has its type, how it is read, its heading in a report, and
/// its text there.
macro_rules! plot_record {
    ($(
        $(#[doc = $about:literal])+
        $column:ident: $type:ty = $read:ident($($least:literal)?), $heading:literal => $shown:expr;
    )+) => {
        /// The counts and measurements of one plot.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct PlotRecord {
            $($(#[doc = $about])+ pub $column: $type,)+
        }

        /// The columns of a table of plots, which carry their units.
        pub const COLUMNS: &[&str] = &[$(stringify!($column)),+];

        impl PlotRecord {
            /// The headings of a report's columns.
            pub(super) const HEADINGS: &[&str] = &[$($heading),+];

            /// The cells of a report.
            pub(super) fn cells(&self) -> Vec<String> {
                let Self { $($column),+ } = *self;
                vec![$($shown),+]
            }

            /// Each column with its value.
            pub(crate) fn columns(&self) -> Vec<(&'static str, String)> {
                vec![$((stringify!($column), self.$column.to_string())),+]
            }

            /// Parses a line of a table. The values are not checked yet.
            pub(super) fn read(line: Line) -> Result<Self, FileError> {
                Ok(Self { $($column: $read(line, stringify!($column) $(, $least)?)?),+ })
            }
        }
    };
}

plot_record! {
    /// The number of its replication.
    replication: u32 = count(0), "replication" => replication.to_string();
    /// Forward speed that the machine was set to, km/h.
    speed_km_h: f64 = number(), "speed, km/h" => short(speed_km_h);
    /// Plant spacing along the row, cm.
    spacing_cm: f64 = number(), "spacing, cm" => short(spacing_cm);
    /// Weeds counted before weeding.
    weeds_before: u32 = count(1), "weeds before" => weeds_before.to_string();
    /// Weeds counted after weeding, on the same ground.
    weeds_after: u32 = count(0), "weeds after" => weeds_after.to_string();
    /// Crop plants in the plot.
    plants: u32 = count(1), "plants" => plants.to_string();
    /// Crop plants that the machine injured.
    damaged: u32 = count(0), "damaged" => damaged.to_string();
    /// Area that was weeded, m2.
    area_m2: f64 = number(), "area, m²" => fixed(area_m2, 2);
    /// Time that this took, with turns and stops, s.
    time_s: f64 = number(), "time, s" => fixed(time_s, 1);
    /// Working width of the machine, m.
    width_m: f64 = number(), "width, m" => fixed(width_m, 2);
    /// Power that the machine needs, hp.
    power_hp: f64 = number(), "power, hp" => fixed(power_hp, 2);
}

/// The measures of one plot.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Performance {
    /// Plants injured, percent of those in the plot (Eq. 23).
    pub plant_damage_percent: f64,
    /// Weeds removed, percent of those before weeding (Eq. 22).
    pub weeding_efficiency_percent: f64,
    /// Area an hour at the set speed with the whole width and no time lost, ha/h (Eq. 25).
    pub theoretical_capacity_ha_h: f64,
    /// Area an hour that was weeded, ha/h (Eq. 26).
    pub effective_capacity_ha_h: f64,
    /// Effective in percent of theoretical capacity (Eq. 24).
    pub field_efficiency_percent: f64,
    /// Capacity times the percentages of undamaged plants and removed weeds, divided by power (Eq. 27), in ha %2/(h
    /// hp). The paper does not say which capacity it uses; this is the effective one.
    pub performance_index: f64,
}

impl PlotRecord {
    /// Checks that a plot's values are possible.
    ///
    /// # Errors
    /// Names the first quantity that is out of its range or contradicts another.
    pub fn check(&self) -> Result<()> {
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
        wrong.map_or(Ok(()), |(column, value, _, right)| Err(anyhow!("{column} is {value}: {right}")))
    }

    /// The plot's measures by Eq. 22 to 27. They are finite if [`PlotRecord::check`] succeeds.
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

    /// Its unit. That of the index is seldom printed.
    pub fn unit(self) -> &'static str {
        match self {
            Self::PerformanceIndex => "ha %²/(h hp)",
            Self::PlantDamage | Self::WeedingEfficiency | Self::FieldEfficiency => "%",
        }
    }

    /// The count in a plot, and its total. `None` for a measure that is not counted.
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

/// Parses a count. Its least value is the one in [`PlotRecord::check`].
fn count(line: Line, column: &str, least: u32) -> Result<u32, FileError> {
    line.value(column, &format!("a whole number, {least} or more"))
}

fn number(line: Line, column: &str) -> Result<f64, FileError> {
    let Number(value) = line.value(column, "a number, like 1.5")?;
    Ok(value)
}

/// A decimal number, without `inf` and `nan`.
struct Number(f64);

impl FromStr for Number {
    type Err = ();

    fn from_str(text: &str) -> Result<Self, ()> {
        text.parse().ok().filter(|value: &f64| value.is_finite()).map(Self).ok_or(())
    }
}
