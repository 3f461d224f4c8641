//! What several controllers did in the same field, speed by speed, as the page draws it.

use crate::statistics::Share;
use field::budget::Budget;

/// Plant damage, in-row weeding and zones reached by several controllers in the same field.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The controllers, in the order in which they are to be named.
    pub controllers: Vec<ControllerCurve>,
    /// The most of the row that this servo can weed with every zone and its margin kept: speed in km/h, and % of the row's
    /// ground. Who is above it has cut margins or reached zones, but not necessarily touched a stem.
    pub bound: Vec<(f64, f64)>,
    /// What the firmware's machine did at each speed; empty where it took no part.
    pub work: Vec<Work>,
}

/// What the firmware's machine did at one speed, in the terms in which machines are published.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Work {
    /// Speed of the machine, km/h.
    pub speed_km_h: f64,
    /// Damaged plants, from any cause.
    pub damage: Share,
    /// Weeds gone in the row, %; none where no weed stood.
    pub in_row_percent: Option<f64>,
    /// Weeds gone in the whole plot, %.
    pub in_plot_percent: Option<f64>,
    /// Where the row's ground went.
    pub budget: Budget,
}

/// What one controller did at each speed.
#[derive(Debug, Clone, PartialEq)]
pub struct ControllerCurve {
    /// What the controller is called.
    pub name: String,
    /// A point a speed, with growing speed.
    pub points: Vec<ControllerPoint>,
}

/// What a controller did at one speed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControllerPoint {
    /// Speed of the machine, km/h.
    pub speed_km_h: f64,
    /// Plants damaged, % of all: the tool was in the protected zone round the stem.
    pub plant_damage_percent: f64,
    /// Zones over which the tool was not fully out, % of all: stricter than damage. Plants that have grown together have one.
    pub zones_reached_percent: f64,
    /// Ground of the row that the tool weeded, % of the row's length.
    pub in_row_weeding_percent: f64,
}
