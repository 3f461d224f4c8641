//! A rehearsal: a row that is only thought of, to see the servo swing without a field or a sensor.
//!
//! It gives the place and the beam of a machine that rolls past plants of 150 mm, 500 mm apart, at a steady speed. What it gives
//! goes through the same decisions as a real row. Place is counted in millimetres here, and all of it follows from the time.

use crate::units::{Instant, Interval, Position, Ticks};

/// Plants in the row.
pub const PLANTS: u16 = 6;

const SPACING_MM: u16 = 500;
const CANOPY_MM: u16 = 150;

/// A row that is being played.
#[derive(Clone, Copy, Debug)]
pub struct Rehearsal {
    /// When and where it began.
    pub begin: Instant,
    /// Where it began.
    pub start: Position,
    /// The machine's speed in mm/s.
    pub speed_mm_s: u16,
    /// The wheel's ticks a metre.
    pub ticks_per_m: u16,
}

impl Rehearsal {
    /// How far the machine has rolled, in millimetres; it is to be asked for a minute and a half at the most.
    pub fn rolled_mm(&self, now: Instant) -> u16 {
        let milliseconds = (now - self.begin).steps() / (Interval::STEPS_PER_SECOND / 1000);
        (milliseconds * u32::from(self.speed_mm_s) / 1000) as u16
    }

    /// Where a machine is that has rolled so far.
    pub fn position(&self, rolled_mm: u16) -> Position {
        self.start + Ticks((u32::from(rolled_mm) * u32::from(self.ticks_per_m) / 1000) as i32)
    }

    /// Whether the beam is broken after so many millimetres; `None` when the tool has passed the last plant. The tool comes into the
    /// row, which begins `distance_mm` behind the beam, before the first plant reaches it.
    pub const fn beam_is_broken(rolled_mm: u16, distance_mm: u16) -> Option<bool> {
        let first_mm = distance_mm + SPACING_MM;
        if rolled_mm > first_mm + PLANTS * SPACING_MM + distance_mm {
            return None;
        }
        match rolled_mm.checked_sub(first_mm) {
            Some(place_mm) if place_mm < PLANTS * SPACING_MM => Some(place_mm % SPACING_MM < CANOPY_MM),
            _ => Some(false),
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    #[test]
    fn the_row_has_its_plants_at_their_places_and_an_end() {
        for distance_mm in [100, 400, 2000] {
            let edges: Vec<(u16, Option<bool>)> = (1..=u16::MAX)
                .map(|rolled_mm| (rolled_mm, Rehearsal::beam_is_broken(rolled_mm, distance_mm)))
                .filter(|&(rolled_mm, broken)| broken != Rehearsal::beam_is_broken(rolled_mm - 1, distance_mm))
                .collect();
            let first = distance_mm + 500;
            let plants = (0..6).flat_map(|plant| {
                let leading = first + 500 * plant;
                [(leading, Some(true)), (leading + 150, Some(false))]
            });
            let expected: Vec<_> = plants.chain([(first + 3000 + distance_mm + 1, None)]).collect();
            assert_eq!(edges, expected, "{distance_mm}");
        }
    }

    #[test]
    fn the_machine_rolls_at_its_speed_over_the_clocks_and_the_counters_wrap() {
        let begin = Instant::new(u32::MAX - 300_000);
        let start = Position::new(i32::MAX - 1000);
        let row = Rehearsal { begin, start, speed_mm_s: 694, ticks_per_m: 1910 };
        for (milliseconds, rolled_mm, ticks) in [(0, 0, 0), (1000, 694, 1325), (10_000, 6940, 13_255)] {
            let now = begin + Interval::from_ms(milliseconds);
            assert_eq!(row.rolled_mm(now), rolled_mm);
            assert_eq!((row.position(rolled_mm) - start).0, ticks);
        }
    }
}
