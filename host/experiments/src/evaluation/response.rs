//! The four measures that the paper models on speed and spacing.

use super::plot::{Performance, PlotRecord};
use serde::Serialize;

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
