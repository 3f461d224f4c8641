//! A rehearsal: a row that is only thought of, to see the servo swing without a field or a sensor.
//!
//! It gives the positions and beam edges of a machine that rolls past plants of 150 mm, 500 mm apart, at a steady speed. What it
//! gives goes through the same decisions as a real row.

use crate::units::{Instant, Interval, Position, Ticks, TicksPerSecond, Wheel};

/// Plants in the row.
pub const PLANTS: u8 = 6;

const SPACING_MM: u16 = 500;
const CANOPY_MM: u16 = 150;

/// A row that is being played.
#[derive(Clone, Debug)]
pub struct Rehearsal {
    speed: TicksPerSecond,
    position: Position,
    now: Instant,
    /// What was rolled beyond `position`, in ticks times steps of the clock a second.
    rest: u32,
    canopy: Ticks,
    gap: Ticks,
    /// The next edge of the beam, and whether it breaks there.
    edge: Position,
    breaks: bool,
    plants_left: u8,
    /// Where the tool has passed the last plant.
    end: Position,
}

impl Rehearsal {
    /// A row that begins at `position`, for a machine with its beam `distance` ahead of the tool.
    pub fn new(now: Instant, position: Position, wheel: Wheel, speed: TicksPerSecond, distance: Ticks) -> Self {
        let (canopy, spacing) = (wheel.ticks(CANOPY_MM), wheel.ticks(SPACING_MM));
        // The tool comes into the row before the first plant reaches it.
        let edge = position + distance + spacing;
        let length = Ticks(spacing.0 * i32::from(PLANTS));
        let end = edge + length + distance;
        Self {
            speed,
            position,
            now,
            rest: 0,
            canopy,
            gap: spacing - canopy,
            edge,
            breaks: true,
            plants_left: PLANTS,
            end,
        }
    }

    /// Rolls on to `now`; returns where the machine is.
    pub fn roll_to(&mut self, now: Instant) -> Position {
        // The loop comes by at least every quarter of a second, in which nobody rolls 17,000 ticks.
        let rolled = self.rest + (now - self.now).steps() * self.speed.0.unsigned_abs();
        self.now = now;
        self.rest = rolled % Interval::STEPS_PER_SECOND;
        self.position = self.position + Ticks((rolled / Interval::STEPS_PER_SECOND) as i32);
        self.position
    }

    /// The next edge of the beam that the machine has come to, and whether the beam is broken from there on.
    pub fn next_edge(&mut self) -> Option<(Position, bool)> {
        if self.plants_left == 0 || self.edge.is_ahead_of(self.position) {
            return None;
        }
        let edge = (self.edge, self.breaks);
        self.edge = self.edge + if self.breaks { self.canopy } else { self.gap };
        self.plants_left -= u8::from(!self.breaks);
        self.breaks = !self.breaks;
        Some(edge)
    }

    /// Whether the tool has passed the last plant.
    pub fn is_over(&self) -> bool {
        self.position.is_ahead_of(self.end)
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_row_has_its_plants_at_their_places_whatever_the_loop_takes() {
        let wheel = Wheel { ticks_per_rev: 2400, diameter_mm: 400, ticks_per_m: 0 };
        let first = Position::new(i32::MAX - 1000);
        for turn_us in [300, 700, 5000] {
            let now = Instant::new(u32::MAX - 300_000);
            let mut row = Rehearsal::new(now, first, wheel, TicksPerSecond(1326), wheel.ticks(400));
            let mut edges = Vec::new();
            let mut turns = 0;
            while !row.is_over() {
                turns += 1;
                row.roll_to(now + Interval::from_steps(turns * turn_us / 4));
                while let Some((edge, broken)) = row.next_edge() {
                    edges.push(((edge - first).0, broken));
                }
            }
            let expected: Vec<(i32, bool)> = (0..6)
                .flat_map(|plant| [(764 + 955 * (plant + 1), true), (764 + 955 * (plant + 1) + 286, false)])
                .collect();
            assert_eq!(edges, expected);
            // 764 and 955 ticks, six plants, and 764 again at 1326 ticks a second.
            let seconds = f64::from(turns * turn_us) / 1e6;
            assert!((seconds - (764.0 + 955.0 + 6.0 * 955.0 + 764.0) / 1326.0).abs() < 0.01, "{seconds}");
        }
    }
}
