//! The upper bound of weeded ground: the most that any controller could weed with this machine without damage to a
//! plant.
//!
//! It is not a controller. To reach it, a controller would need to know in advance each stem, the exact zone round it,
//! the machine's deviations, and each swing's dead time. Each swing would also have to be as quick as the servo is
//! without load. At every position beside a stem the tool needs an angle at which its edge is past the zone. The
//! servo's rate limits how close to a zone the tool can still work the row's line. The remaining ground is the bound:
//! no tool path that touches no zone weeds more.
//!
//! Canopies and margins play no part here. With them, [`crate::verdict::weedable_share`] is the bound.

use crate::driving::Steering;
use crate::ground::{share_of, union};
use crate::machine::Machine;
use crate::motion::Motion;
use crate::servo::OUT_DEGREES;
use crate::stand::Stand;
use std::ops::Range;

/// Distance between the positions in a zone at which the angle is calculated. A zone is round, so the positions between
/// need at least the smaller angle of the two.
const STEP_MM: f64 = 1.0;

/// The share of the row's ground, from 0 to 1, that can be weeded at most without the tool touching the zone round a stem.
pub fn undamaged_share(stand: &Stand, machine: &Machine, motion: &Motion, steering: &Steering) -> f64 {
    let (half_mm, half_length_mm) = (machine.tool_width_mm / 2.0, machine.half_length_mm());
    let degrees_a_s = OUT_DEGREES / (machine.servo.travel_ms / 1000.0);
    let line_degrees = machine.line_degrees();
    let mut lost = Vec::new();
    for stem in &stand.stems {
        let mut before: Option<Range<f64>> = None;
        let reach_mm = stem.protected_mm + half_length_mm;
        let steps = (2.0 * reach_mm / STEP_MM).ceil() as u32;
        for step in 1..steps {
            let place_mm = stem.along_mm - reach_mm + f64::from(step) * STEP_MM;
            let chord_mm = stem.half_chord_beside_mm(place_mm - stem.along_mm, half_length_mm);
            let across_mm = stem.across_mm - steering.tool_across_mm(place_mm);
            // A tool in the row that passes to the right of the zone, or to the left of one on the far side.
            if half_mm <= across_mm - chord_mm || across_mm + chord_mm <= -half_mm {
                before = None;
                continue;
            }
            let aside = ((across_mm + chord_mm + half_mm) / machine.arm_mm).clamp(0.0, 1.0);
            let before_s = (aside.asin().to_degrees() - line_degrees) / degrees_a_s;
            let mut passed = motion.passings(place_mm + machine.beam_to_tool_mm);
            if before_s > 0.0
                && let Some(passing) = passed.next()
            {
                let ground = machine.worked_mm(motion, &(passing.time_s - before_s..passing.time_s + before_s));
                let between_mm = before.as_ref().map_or(ground.start, |before| before.start.min(ground.start));
                lost.push(between_mm..before.map_or(ground.end, |before| before.end.max(ground.end)));
                before = Some(ground);
            }
        }
    }
    // The tool also weeds half of its length beyond its middle.
    let left = union(lost).into_iter().map(|lost| lost.start + half_length_mm..lost.end - half_length_mm);
    1.0 - share_of(&stand.span_mm, &left.filter(|left| left.start < left.end).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tool_path::tests::stand;

    #[test]
    fn the_bound_is_the_row_less_each_zone_and_the_quickest_swings() {
        let mut stand = stand();
        stand.stems[0].protected_mm = 45.0;
        let share = |speed_mm_s: f64| {
            let motion = Motion::steady(-500.0, 1e6, speed_mm_s, 3000.0);
            undamaged_share(&stand, &Machine::default(), &motion, &Steering::default())
        };
        // As good as standing still: the zone of 90 mm, but for its ends that the tool may touch.
        assert!((share(1.0) - (1.0 - 90.0 / 2000.0)).abs() < 0.002, "{}", share(1.0));
        // At 500 mm/s the tool has to be 72.5 mm aside of the zone's middle: 12 degrees less 4.5. This takes 20
        // ms or 10 mm. Nearer to the zone's ends it needs less, but has less time: the stretch is a little wider than
        // the zone.
        let lost_mm = 2000.0 * (1.0 - share(500.0));
        assert!((90.0..110.0).contains(&lost_mm), "{lost_mm} mm");
        assert!(share(1500.0) < share(500.0));
    }
}
