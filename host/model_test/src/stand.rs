//! The real plants of a row, and the swinging tool that must not touch them.
//!
//! The model of the ground judges commands against what the beam saw at each count. This file judges the tool itself:
//! an order takes the servo's dead time and travel until the tool is clear, the wheel slips, and either of two beams
//! may miss a plant. So it compares real positions, in ticks of ground.
//!
//! A plant that the tool touches is harmed. Two cases are excused: the classifier took the plant for a weed, or the
//! firmware was blind, because a faulty encoder had put its count off by more than it can know.

use crate::run::Run;
use std::{collections::BTreeMap, ops::Range};

/// Error of the count, in ticks, from which on the firmware is blind: a quarter of the default margin. A push, a jerk
/// or slip may use up the rest.
const BLIND_TICKS: f64 = 24.0;

/// The measured speed, and so the leads, are right again this long after the encoder was silent.
const SPEED_SETTLES_US: u64 = 100_000;

/// Tolerance of a reported weed's ends, in ticks.
const EDGE_TICKS: i64 = 4;

/// The real machine, in ticks of ground and microseconds. The settings may be wrong about it.
#[derive(Clone, Copy, Debug)]
pub struct Geometry {
    /// From the first beam to the tool.
    pub beam_to_tool: i64,
    /// From the first beam to the second; 0 for a machine with one beam.
    pub second_beam: i64,
    /// From an order until the tool begins to move.
    pub dead_us: u64,
    /// From an order until the tool has arrived.
    pub swing_us: u64,
}

/// The fate of a plant.
#[derive(Clone, Copy, Debug, Default)]
struct Fate {
    passed: bool,
    harmed: bool,
    mistaken: bool,
    blind: bool,
}

/// The result of a row.
#[derive(Clone, Copy, Debug, Default)]
pub struct Score {
    /// Metres rolled.
    pub metres: f64,
    /// Metres rolled with the tool ordered into the row.
    pub weeded_metres: f64,
    /// Plants that the tool came to.
    pub plants: u64,
    /// Plants harmed without an excuse.
    pub harmed: u64,
    /// Plants harmed because they were classified as weeds.
    pub mistaken: u64,
    /// Plants harmed while the firmware was blind.
    pub blind: u64,
}

/// The plants, and the tool.
#[derive(Debug, Default)]
pub struct Stand {
    /// The keep-out zones without margins, in order, in one period of the row.
    zones: Vec<Range<i64>>,
    /// The canopies of the same plants.
    canopies: Vec<Range<i64>>,
    /// Length of the period.
    period: i64,
    /// Fates by the start of the plant's zone on the ground.
    fates: BTreeMap<i64, Fate>,
    /// The last order, its time, and whether the tool was clear at that time.
    in_row: bool,
    ordered_us: u64,
    was_in_row: bool,
    /// Error of the count, in ticks, over ground that the firmware still remembers.
    lost_ticks: i64,
    blind_until_us: u64,
}

impl Stand {
    /// The plants of a run, with the tool clear. `stem_zone` is the width that the tool must keep clear of at each
    /// plant's centre, in ticks; 0 for the whole canopy.
    pub fn new(run: &Run, stem_zone: i64) -> Self {
        let canopies = run.plants();
        let zone = |canopy: &Range<i64>| {
            let cut = if stem_zone > 0 { ((canopy.end - canopy.start - stem_zone) / 2).max(0) } else { 0 };
            canopy.start + cut..canopy.end - cut
        };
        let zones = canopies.iter().map(zone).collect();
        Self { zones, canopies, period: run.period(), ..Self::default() }
    }

    /// Returns the plant whose zone holds a position: its number in the period, and the start of its zone.
    fn plant_at(&self, position: i64) -> Option<(usize, i64)> {
        let in_period = position.rem_euclid(self.period);
        let number = self.zones.partition_point(|zone| zone.end <= in_period);
        let zone = self.zones.get(number).filter(|zone| zone.contains(&in_period))?;
        // The run began at position 0: the beam never saw the plants behind it.
        let start = position - in_period + zone.start;
        (start > 0).then_some((number, start))
    }

    /// Follows the tool's orders. Returns whether the tool is clear of the row. An order to leave may be `lateness_us` old when it
    /// is seen.
    pub fn follow(&mut self, out: bool, now_us: u64, lateness_us: u64, geometry: &Geometry) -> bool {
        let age_us = now_us - self.ordered_us;
        let clear = if self.in_row {
            !self.was_in_row && age_us < geometry.dead_us
        } else {
            !self.was_in_row || age_us >= geometry.swing_us
        };
        if out == self.in_row {
            // A tool that has not begun to move yet is still where it was.
            let lateness_us = if out { lateness_us } else { 0 };
            (self.in_row, self.ordered_us, self.was_in_row) = (!out, now_us.saturating_sub(lateness_us), !clear);
        }
        clear
    }

    /// Judges the tool at a position. `is_unseen` tells that the beam has not seen this ground since the last reset, so that the
    /// tool may have been ordered out too late.
    ///
    /// # Errors
    /// If the tool touches a plant without an excuse.
    pub fn judge(
        &mut self,
        clear: bool,
        tool: i64,
        now_us: u64,
        geometry: &Geometry,
        is_unseen: bool,
    ) -> Result<(), String> {
        let Some((number, start)) = self.plant_at(tool) else { return Ok(()) };
        let is_blind = self.is_blind(geometry) || now_us <= self.blind_until_us || is_unseen;
        let fate = self.fates.entry(start).or_default();
        fate.passed = true;
        if clear {
            return Ok(());
        }
        fate.harmed = true;
        fate.blind |= is_blind;
        if fate.mistaken || fate.blind {
            return Ok(());
        }
        let (canopy, age_us) = (&self.canopies[number], now_us - self.ordered_us);
        let (order, lost) = (if self.in_row { "in" } else { "out" }, self.lost_ticks);
        Err(format!(
            "a plant was harmed: the tool is at {tool} ticks of ground, {age_us} us after it was ordered {order}, in the \
             plant at {canopy:?} of the row; the encoder lacks {lost} ticks"
        ))
    }

    /// Whether the count is off by more than the firmware can know. It takes the error between two beams for slip, and
    /// extends it to the tool.
    fn is_blind(&self, geometry: &Geometry) -> bool {
        let share = match geometry.second_beam {
            0 => 1.0,
            second_beam => second_beam as f64 / geometry.beam_to_tool as f64,
        };
        self.lost_ticks.abs() as f64 >= BLIND_TICKS * share
    }

    /// The encoder failed to count these ticks, or counted them too much if they are negative.
    pub fn lose_ticks(&mut self, ticks: i64) {
        self.lost_ticks += ticks;
    }

    /// The encoder is faulty now: the measured speed is wrong, so that a swing may be late.
    pub fn mistrust_speed(&mut self, now_us: u64, geometry: &Geometry) {
        self.blind_until_us = now_us + geometry.swing_us + SPEED_SETTLES_US;
    }

    /// The firmware forgets its ground. The tool may still be swinging out of a wrong position.
    pub fn forget(&mut self, now_us: u64, geometry: &Geometry) {
        if self.is_blind(geometry) {
            self.blind_until_us = self.blind_until_us.max(now_us + geometry.swing_us);
        }
        self.lost_ticks = 0;
    }

    /// The firmware reported a weed of this width that begins at a position, `behind` ticks behind the beam.
    pub fn mistake(&mut self, leading: i64, width: i64, behind: i64) {
        // The wheel may have slipped since.
        let tolerance = EDGE_TICKS + behind.abs() / 16;
        let weed = leading - tolerance..leading + width + tolerance;
        let period = leading - leading.rem_euclid(self.period);
        for (zone, canopy) in self.zones.iter().zip(&self.canopies) {
            if period + canopy.start < weed.end && weed.start < period + canopy.end {
                self.fates.entry(period + zone.start).or_default().mistaken = true;
            }
        }
    }

    /// Replaces the row by that of another run. The tool stays as it is.
    pub fn replace(&mut self, run: &Run, stem_zone: i64) {
        let Self { in_row, ordered_us, was_in_row, .. } = *self;
        *self = Self { in_row, ordered_us, was_in_row, ..Self::new(run, stem_zone) };
    }

    /// Adds the plants that the tool came to.
    pub fn add_to(&self, score: &mut Score) {
        for fate in self.fates.values().filter(|fate| fate.passed) {
            score.plants += 1;
            match fate {
                Fate { harmed: false, .. } => {}
                Fate { mistaken: true, .. } => score.mistaken += 1,
                Fate { blind: true, .. } => score.blind += 1,
                _ => score.harmed += 1,
            }
        }
    }
}
