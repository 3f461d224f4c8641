//! A trial's report as a page for a browser: one file with its plots and tables, that needs nothing beside it.
//!
//! [`Page`] says what is on it. The plots are SVG within the page, and its colours follow the reader's choice of light or
//! dark. It holds no script, asks no network, and comes out the same for the same trial: there is no clock in it.

use svg::Document;

/// Plant damage and in-row weeding of several controllers in the same field, and what no controller can beat.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The controllers, in the order in which they are to be named.
    pub controllers: Vec<ControllerCurve>,
    /// The most of the row that this servo allows to be weeded: speed in km/h, and % of the row's ground.
    pub bound: Vec<(f64, f64)>,
    /// The least damage that slip and scatter allow: speed in km/h, and % of the plants. Empty where none is unavoidable.
    pub unavoidable: Vec<(f64, f64)>,
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
    /// Plants damaged, % of all.
    pub plant_damage_percent: f64,
    /// Ground of the row that the tool weeded, % of the row's length.
    pub in_row_weeding_percent: f64,
}

/// One row drawn along the ground, as [`crate::picture::draw`] draws it.
#[derive(Debug, Clone)]
pub struct RowPicture {
    /// The drawing.
    pub drawing: Document,
    /// What is to be seen in it, in a sentence.
    pub caption: String,
}
