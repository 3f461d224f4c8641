//! Margin, leads and stem zone, and the keep-out zone that they give a plant.

use crate::row::Canopy;
use control::{ground::keep_out::trim, units::Length};
use std::f64::consts::FRAC_PI_2;
use std::ops::Range;

/// Margin and leads, as the firmware's settings have them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ZoneSettings {
    /// Margin on both sides of a canopy.
    pub margin_mm: u32,
    /// Lead of the command to leave the row.
    pub lead_out_ms: u32,
    /// Lead of the command to come back.
    pub lead_in_ms: u32,
    /// The zone that is kept for a single plant, if the tool may work under its leaves. 0 keeps its whole canopy.
    pub stem_zone_mm: u32,
}

impl Default for ZoneSettings {
    /// For the unloaded servo of [`Machine::default`](crate::machine::Machine). The firmware's own default is for a servo in the soil.
    fn default() -> Self {
        Self { margin_mm: 50, lead_out_ms: 180, lead_in_ms: 40, stem_zone_mm: 0 }
    }
}

impl ZoneSettings {
    /// The paper's schedule, without leads (Eq. 1 to 3).
    pub fn as_in_the_paper() -> Self {
        Self { lead_out_ms: 0, lead_in_ms: 0, ..Self::default() }
    }

    /// The ground that the tool must not enter for a plant, without the margin: its canopy. With a stem zone it is what the
    /// firmware keeps of a plant seen whole, at least the zone.
    pub(super) fn kept_mm(&self, plant: &Canopy) -> Range<f64> {
        let (span, zone_mm) = (plant.span_mm(), f64::from(self.stem_zone_mm));
        // In steps of 0.1 mm, which is finer than the wheel's.
        let steps = |mm: f64| Length((10.0 * mm) as i16);
        let trim_mm = f64::from(trim(steps(span.end - span.start), steps(zone_mm)).0) / 10.0;
        span.start + trim_mm..span.end - trim_mm
    }

    /// A plant's keep-out zone: that ground with its margins.
    pub(super) fn window_mm(&self, plant: &Canopy) -> Range<f64> {
        let (kept, margin_mm) = (self.kept_mm(plant), f64::from(self.margin_mm));
        kept.start - margin_mm..kept.end + margin_mm
    }

    /// How wide the kept ground is across the row.
    pub(super) fn kept_across_mm(&self, plant: &Canopy) -> f64 {
        if self.stem_zone_mm == 0 { plant.across_mm } else { self.stem_zone_mm.into() }
    }

    /// The outline of a keep-out zone, from its ends on the row's line to its widest: how far the tool's edge has to be
    /// from the line, and how far inside the zone's end, as a share of half its length. A canopy is a rectangle.
    pub(super) fn outline(&self) -> Vec<Level> {
        let half_mm = f64::from(self.stem_zone_mm) / 2.0;
        let level = |step: u32| {
            let (sin, cos) = (FRAC_PI_2 * f64::from(step) / f64::from(LEVELS)).sin_cos();
            Level { aside_mm: half_mm * sin, inside_mm: half_mm * (1.0 - cos) }
        };
        if self.stem_zone_mm == 0 {
            return vec![Level { aside_mm: f64::INFINITY, inside_mm: 0.0 }];
        }
        (0..=LEVELS).map(level).collect()
    }
}

/// Points of a quarter of a circle. Between two of them the circle is within 0.1 mm of a straight line.
const LEVELS: u32 = 16;

/// A point of a zone's outline.
#[derive(Clone, Copy)]
pub(super) struct Level {
    /// From the row's line.
    pub(super) aside_mm: f64,
    /// From the zone's end, along the row.
    pub(super) inside_mm: f64,
}
