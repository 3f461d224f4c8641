//! How much of the servo's time a stem zone's circle saves.
//!
//! The zone is a circle: at its ends on the row's line it has no width. The tool's edge leaves the line while the machine
//! rolls by `k = v T r / A`. Here `v` is the speed, `T` the time of the stroke, `r` half of the zone and `A` how far the
//! tool swings aside. A straight path of the edge then touches the circle if the swing ends `k + r - sqrt(k^2 + r^2)`
//! inside the zone. The faster the machine, the longer is this distance and the shorter its time. So leads for the
//! highest speed hold below it.

/// An arm with its blade and its servo. The default is the paper's. A longer arm swings farther aside, and leads save less.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Arm {
    /// From the servo's axis to the blade's tip, mm.
    pub length_mm: f64,
    /// Change of the pulse that turns the servo by 90 degrees, us.
    pub us_for_90: f64,
    /// The servo's time for 90 degrees without load, ms.
    pub ms_for_90: f64,
    /// The blade's length along the row, mm, with the distance to the tool measured to its middle.
    pub blade_length_mm: f64,
}

impl Default for Arm {
    fn default() -> Self {
        Self { length_mm: 350.0, us_for_90: 1000.0, ms_for_90: 240.0, blade_length_mm: 45.0 }
    }
}

impl Arm {
    /// How far a stroke of this pulse carries the tool aside, mm.
    pub fn aside_mm(self, pulse_us: u16) -> f64 {
        self.length_mm * (90.0 * f64::from(pulse_us) / self.us_for_90).min(90.0).to_radians().sin()
    }

    /// The time of a stroke of this pulse without load, ms.
    pub fn unloaded_ms(self, pulse_us: u16) -> f64 {
        self.ms_for_90 * f64::from(pulse_us) / self.us_for_90
    }

    /// How much farther a trailing arm has to keep off, mm, for a stroke of this pulse. A zone of 0 is a whole canopy: the
    /// tool has to be fully out over it. `rolled_mm` is as for [`carried_mm`].
    pub fn carried_by_stroke_mm(self, pulse_us: u16, tool_mm: f64, zone_mm: f64, rolled_mm: f64) -> f64 {
        if zone_mm > 0.0 {
            return carried_mm(self.length_mm, tool_mm, zone_mm, rolled_mm);
        }
        self.length_mm - (self.length_mm.powi(2) - self.aside_mm(pulse_us).powi(2)).sqrt()
    }
}

/// How far a swing may overlap either end of a zone, mm. The stroke takes `travel_ms`.
pub fn overlap_mm(speed_mm_s: f64, travel_ms: f64, zone_mm: f64, aside_mm: f64) -> f64 {
    let (half_mm, rolled_mm) = (zone_mm / 2.0, rolled_mm(speed_mm_s, travel_ms, zone_mm, aside_mm));
    rolled_mm + half_mm - rolled_mm.hypot(half_mm)
}

/// How far the machine rolls while the tool's edge moves aside by half a zone, mm.
pub fn rolled_mm(speed_mm_s: f64, travel_ms: f64, zone_mm: f64, aside_mm: f64) -> f64 {
    let half_mm = zone_mm / 2.0;
    speed_mm_s * travel_ms / 1000.0 * (half_mm / aside_mm.max(half_mm))
}

/// The same as a time, ms.
pub fn overlap_ms(speed_mm_s: f64, travel_ms: f64, zone_mm: f64, aside_mm: f64) -> f64 {
    if zone_mm <= 0.0 { 0.0 } else { 1000.0 * overlap_mm(speed_mm_s, travel_ms, zone_mm, aside_mm) / speed_mm_s }
}

/// How much farther a trailing arm's margin has to be, mm: it carries the tool towards the zone before the edge has left
/// the line far enough. Leads up to the circle have used its slack at the highest speed, where the machine rolls by
/// [`rolled_mm`].
pub fn carried_mm(arm_mm: f64, tool_mm: f64, zone_mm: f64, rolled_mm: f64) -> f64 {
    let half_mm = zone_mm / 2.0;
    let shares = (0..=100).map(|step| f64::from(step) / 100.0);
    let needed = shares.map(|share| {
        let edge_mm = half_mm * share;
        let sin = ((edge_mm + tool_mm / 2.0) / arm_mm).min(1.0);
        let forward_mm = arm_mm * (1.0 - (1.0 - sin * sin).sqrt());
        // A straight path of the edge that touches the circle.
        let slack_mm = half_mm.hypot(rolled_mm) - rolled_mm * share - (half_mm * half_mm - edge_mm * edge_mm).sqrt();
        forward_mm - slack_mm
    });
    needed.fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_swing_with_the_largest_overlap_only_touches_the_circle() {
        for (speed_mm_s, travel_ms, zone_mm, aside_mm) in [
            (278.0, 60.0, 110.0, 134.0),
            (1111.0, 70.0, 110.0, 134.0),
            (694.0, 50.0, 90.0, 105.0),
            (2000.0, 30.0, 60.0, 70.0),
        ] {
            let overlap_mm = overlap_mm(speed_mm_s, travel_ms, zone_mm, aside_mm);
            let half_mm = zone_mm / 2.0;
            // The edge is clear of the zone at `overlap` behind the zone's end, and nearer to the line before that.
            let deepest_mm = (0..=10_000).map(|step| {
                let before_s = travel_ms / 1000.0 * f64::from(step) / 10_000.0;
                let edge_mm = half_mm - aside_mm * before_s / (travel_ms / 1000.0);
                let from_middle_mm = half_mm - (overlap_mm - speed_mm_s * before_s);
                half_mm - from_middle_mm.hypot(edge_mm.max(0.0))
            });
            let deepest_mm = deepest_mm.fold(f64::NEG_INFINITY, f64::max);
            assert!((-0.01..0.01).contains(&deepest_mm), "{deepest_mm} at {speed_mm_s} mm/s");
        }
    }

    #[test]
    fn a_faster_machine_saves_less_time_by_the_overlap() {
        let ms = |speed_mm_s: f64| overlap_ms(speed_mm_s, 60.0, 110.0, 134.0);
        assert!(ms(278.0) > ms(694.0) && ms(694.0) > ms(1300.0) && ms(1300.0) > 10.0);
        assert!(overlap_mm(1.0, 60.0, 110.0, 134.0) < 0.1);
        assert_eq!(overlap_ms(694.0, 60.0, 0.0, 134.0), 0.0);
        assert!((Arm::default().aside_mm(250) - 133.9).abs() < 0.1);
    }

    #[test]
    fn a_trailing_arm_needs_some_millimetres_more() {
        // 350 mm and a tool of 130 mm: 65 mm aside, the tool is 6.1 mm farther ahead.
        let slow_mm = carried_mm(350.0, 130.0, 110.0, 0.0);
        assert!((6.1..8.0).contains(&slow_mm), "{slow_mm}");
        // At 1300 mm/s the edge touches the circle 28 mm aside, where the tool is 12.7 mm farther ahead.
        let fast_mm = carried_mm(350.0, 130.0, 110.0, rolled_mm(1300.0, 60.0, 110.0, 134.0));
        assert!((12.7..14.0).contains(&fast_mm), "{fast_mm}");
        // Around a canopy, 22.5 degrees carry it by 26.6 mm.
        assert!((Arm::default().carried_by_stroke_mm(250, 130.0, 0.0, 0.0) - 26.6).abs() < 0.1);
    }
}
