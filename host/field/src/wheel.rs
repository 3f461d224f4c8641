//! The ground wheel of a machine that is rolled tick by tick, with varying slip.
//!
//! Over known ground the wheel turns as far as it did the first time. With another slip the ground would move under the
//! count, and no beam can detect that.

/// The greatest slip, as a share of the ground, for which a machine must keep its margin. Three times its error over
/// the distance from beam to tool fits into the margin: for values measured before a change of slip and used after it.
pub fn most_slip(margin_mm: f64, beam_to_tool_mm: f64) -> f64 {
    0.3 * margin_mm / beam_to_tool_mm
}

/// The wheel.
#[derive(Clone, Debug)]
pub struct Wheel {
    /// How far it turns for a tick of new ground.
    pub turns_a_tick: f64,
    ticks: f64,
    /// How far it has turned for each tick of ground so far.
    turned: Vec<f64>,
}

impl Default for Wheel {
    fn default() -> Self {
        Self { turns_a_tick: 1.0, ticks: 0.0, turned: Vec::new() }
    }
}

impl Wheel {
    /// Counts of a perfect encoder, net.
    pub fn ticks(&self) -> i64 {
        self.ticks.floor() as i64
    }

    /// Rolls by a tick of ground, forward or back from `ground`. Returns the counts of a perfect encoder.
    pub fn roll(&mut self, ground: i64, forward: bool) -> i64 {
        let tick = usize::try_from(if forward { ground } else { ground - 1 });
        while tick.is_ok_and(|tick| self.turned.len() <= tick) {
            self.turned.push(self.turns_a_tick);
        }
        let (before, turned) = (self.ticks(), tick.map_or(1.0, |tick| self.turned[tick]));
        self.ticks += if forward { turned } else { -turned };
        self.ticks() - before
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wheel_that_slips_now_turns_over_known_ground_as_it_did_before() {
        let mut wheel = Wheel::default();
        let forward =
            |wheel: &mut Wheel, ground: std::ops::Range<i64>| -> i64 { ground.map(|g| wheel.roll(g, true)).sum() };
        assert_eq!(forward(&mut wheel, 0..1000), 1000);
        wheel.turns_a_tick = 1.0625;
        assert_eq!((1..=1000).rev().map(|ground| wheel.roll(ground, false)).sum::<i64>(), -1000);
        assert_eq!(forward(&mut wheel, 0..1000), 1000);
        assert_eq!(forward(&mut wheel, 1000..1800), 850);
        assert_eq!(wheel.ticks(), 1850);
    }
}
