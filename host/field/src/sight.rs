//! What a beam sees of a row: which canopies and weeds are tall enough, their width at its height, and which leaves
//! cover enough of it.
//!
//! A canopy is an ellipse from the ground to its top, widest half way up. A lower or higher beam sees it narrower, and
//! a beam above its top does not see it. The ellipse is an assumption.
//!
//! A beam has a diameter. Its sensor reports it broken while more than half of it is covered. So it does not see
//! objects or gaps that are narrower than half its diameter. The edges of wider objects stay where they are.

use crate::ground::union;
use std::ops::Range;

/// The width, at the beam's height, of a canopy of this height and greatest width. `None` if the beam passes above it.
pub fn width_at(beam_height_mm: f64, height_mm: f64, widest_mm: f64) -> Option<f64> {
    let from_middle = 2.0 * beam_height_mm / height_mm - 1.0;
    (beam_height_mm < height_mm).then(|| widest_mm * (1.0 - from_middle * from_middle).max(0.0).sqrt())
}

/// The stretches over which more than half of a beam of this diameter is covered. `blocks_mm` is a [`union`].
pub fn half_covered(blocks_mm: Vec<Range<f64>>, beam_mm: f64) -> Vec<Range<f64>> {
    if beam_mm <= 0.0 {
        return blocks_mm;
    }
    let half_mm = beam_mm / 2.0;
    // Between the positions at which an edge of the beam passes an end, the covered part follows straight lines.
    let mut places: Vec<f64> = blocks_mm
        .iter()
        .flat_map(|block| [block.start - half_mm, block.start + half_mm, block.end - half_mm, block.end + half_mm])
        .collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    let mut first = 0;
    let mut last: Option<(f64, f64)> = None;
    let mut seen = Vec::new();
    for place in places {
        while blocks_mm.get(first).is_some_and(|block| block.end < place - half_mm) {
            first += 1;
        }
        let covered: f64 = blocks_mm[first..]
            .iter()
            .take_while(|block| block.start <= place + half_mm)
            .map(|block| (block.end.min(place + half_mm) - block.start.max(place - half_mm)).max(0.0))
            .sum();
        let beyond = covered - half_mm;
        if let Some((from, before)) = last {
            let crossing = || from + (place - from) * before / (before - beyond);
            match (before > 0.0, beyond > 0.0) {
                (true, true) => seen.push(from..place),
                (true, false) => seen.push(from..crossing()),
                (false, true) => seen.push(crossing()..place),
                (false, false) => {}
            }
        }
        last = Some((place, beyond));
    }
    union(seen)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_canopy_is_widest_half_way_up_and_invisible_above_its_top() {
        assert_eq!(width_at(150.0, 300.0, 160.0), Some(160.0));
        assert_eq!(width_at(150.0, 150.0, 160.0), None);
        let low = width_at(150.0, 187.5, 160.0).unwrap();
        assert!((low - 128.0).abs() < 1e-9, "{low}");
    }

    #[test]
    fn a_beam_is_broken_while_more_than_half_of_it_is_covered() {
        assert_eq!(half_covered(vec![0.0..3.0], 0.0), [0.0..3.0]);
        // Wide blocks keep their ends. Blocks narrower than half of the beam are not seen.
        assert_eq!(half_covered(vec![0.0..100.0], 6.0), [0.0..100.0]);
        assert_eq!(half_covered(vec![0.0..2.5], 6.0), []);
        // A gap narrower than half of it is not seen either; a wider one is.
        assert_eq!(half_covered(vec![0.0..20.0, 22.0..40.0], 6.0), [0.0..40.0]);
        assert_eq!(half_covered(vec![0.0..20.0, 24.0..40.0], 6.0), [0.0..20.0, 24.0..40.0]);
        // Two leaves that cover it together.
        assert_eq!(half_covered(vec![0.0..2.0, 3.0..5.0], 6.0), [1.0..4.0]);
    }
}
