//! The machine's deviation across the row's line: a random motion between limits.
//!
//! The deviation follows straight lines between random values at positions a metre or two apart. The machine strays as
//! a whole, tool and sweeps together, without an angle to the row. It does not change what the beam sees.

use crate::planting::scatter;
use rand::{Rng, RngExt};
use std::ops::Range;

/// Distance between two corrections of the steering.
const LEG_MM: Range<f64> = 1000.0..2000.0;

/// The machine's position across the row, at each position along it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steering {
    /// Positions, and the deviation from the line there, positive to the left. Empty for a machine that stays on the
    /// line.
    knots: Vec<(f64, f64)>,
    within_mm: f64,
}

impl Steering {
    /// A machine that strays by up to `within_mm` on this ground.
    pub fn within(within_mm: f64, ground_mm: Range<f64>, rng: &mut impl Rng) -> Self {
        if within_mm <= 0.0 {
            return Self::default();
        }
        let mut knots = vec![(ground_mm.start, scatter(rng, within_mm))];
        let mut place_mm = ground_mm.start;
        while place_mm < ground_mm.end {
            place_mm += rng.random_range(LEG_MM);
            knots.push((place_mm, scatter(rng, within_mm)));
        }
        Self { knots, within_mm }
    }

    /// Deviation of the machine's middle from the row's line, when its tool works this ground.
    pub fn across_mm(&self, place_mm: f64) -> f64 {
        let next = self.knots.partition_point(|(knot_mm, _)| *knot_mm <= place_mm);
        match (next.checked_sub(1).map(|last| self.knots[last]), self.knots.get(next)) {
            (Some((from, before)), Some((to, beyond))) => before + (beyond - before) * (place_mm - from) / (to - from),
            (Some((_, across)), None) => across,
            (None, Some((_, across))) => *across,
            (None, None) => 0.0,
        }
    }

    /// The farthest that it strays.
    pub fn within_mm(&self) -> f64 {
        self.within_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_machine_strays_within_its_limits_and_gradually() {
        let steering = Steering::within(15.0, 0.0..20_000.0, &mut ChaCha8Rng::seed_from_u64(1));
        let places: Vec<f64> = (-100..2100).map(|place| steering.across_mm(f64::from(place) * 10.0)).collect();
        assert!(places.iter().all(|across| across.abs() <= 15.0));
        // From one limit to the other takes a metre at least: 0.3 mm in 10.
        assert!(places.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= 0.3 + 1e-9));
        assert!(places.iter().any(|across| across.abs() > 8.0));
        assert_eq!(Steering::default().across_mm(5.0), 0.0);
    }
}
