//! How the machine strays from the row's line, across it: a wandering between limits.
//!
//! Where the machine is across the row follows straight lines between places a metre or two apart, each by chance. It strays as
//! a whole, tool and sweeps together: an angle to the row is not in it. What the beam sees does not change.

use crate::planting::scatter;
use rand::{Rng, RngExt};
use std::ops::Range;

/// From one place at which the machine is steered to the next.
const LEG_MM: Range<f64> = 1000.0..2000.0;

/// Where the machine is across the row, at each place along it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Steering {
    /// Places, and how far from the line there, left above 0. None for a machine that stays on the line.
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

    /// How far from the row's line the machine's middle is where its tool works this ground.
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
