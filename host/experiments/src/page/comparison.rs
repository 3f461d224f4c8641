//! The comparison of several controllers in the same field, by speed, for the page.

use crate::statistics::Share;
use field::budget::Budget;

/// Plant damage, in-row weeding and zones reached by several controllers in the same field.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The controllers, in the order of the legend.
    pub controllers: Vec<ControllerCurve>,
    /// The largest share of the row that this servo can weed with every zone and margin kept: speed in km/h, and % of
    /// the row's ground. A controller above it has cut margins or reached zones, but has not necessarily touched a
    /// stem.
    pub bound: Vec<(f64, f64)>,
    /// The work of the firmware's machine at each speed. Empty if the firmware took no part.
    pub work: Vec<Work>,
}

/// The work of the firmware's machine at one speed, in the measures of published machines.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Speed of the machine, km/h.
    pub speed_km_h: f64,
    /// Damaged plants, from any cause.
    pub damage: Share,
    /// Weeds removed in the row, %; `None` if there was no weed.
    pub in_row_percent: Option<f64>,
    /// Weeds gone in the whole plot, %.
    pub in_plot_percent: Option<f64>,
    /// The loss budget.
    pub budget: Budget,
}

/// The results of one controller at each speed.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerCurve {
    /// The controller's name.
    pub name: String,
    /// A point a speed, with growing speed.
    pub points: Vec<ControllerPoint>,
}

/// The result of a controller at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerPoint {
    /// Speed of the machine, km/h.
    pub speed_km_h: f64,
    /// Damaged plants, % of all: the tool was in the protected zone round the stem.
    pub plant_damage_percent: f64,
    /// Zones over which the tool was not fully out, % of all. This is stricter than damage. Joined plants have one
    /// zone.
    pub zones_reached_percent: f64,
    /// Ground of the row that the tool weeded, % of the row's length.
    pub in_row_weeding_percent: f64,
}
