//! Stretches of ground: their union, and how much of a row they cover.

use std::ops::Range;

/// The union of stretches, in ascending order and without overlaps.
pub fn union(mut stretches: Vec<Range<f64>>) -> Vec<Range<f64>> {
    stretches.sort_by(|a, b| a.start.total_cmp(&b.start));
    let mut union: Vec<Range<f64>> = Vec::with_capacity(stretches.len());
    for stretch in stretches {
        match union.last_mut() {
            Some(last) if stretch.start <= last.end => last.end = last.end.max(stretch.end),
            _ => union.push(stretch),
        }
    }
    union
}

/// The share of `row` that the stretches of a [`union`] cover, from 0 to 1.
pub fn share_of(row: &Range<f64>, union: &[Range<f64>]) -> f64 {
    let covered = union
        .iter()
        .map(|stretch| stretch.end.min(row.end) - stretch.start.max(row.start))
        .filter(|length| *length > 0.0)
        .fold(0.0, |sum, length| sum + length);
    covered / (row.end - row.start)
}

/// The parts of `whole` between the stretches of a union.
pub(crate) fn between(union: &[Range<f64>], whole: &Range<f64>) -> Vec<Range<f64>> {
    let starts = std::iter::once(whole.start).chain(union.iter().map(|stretch| stretch.end));
    let ends = union.iter().map(|stretch| stretch.start).chain([whole.end]);
    starts.zip(ends).map(|(start, end)| start..end).filter(|stretch| stretch.start < stretch.end).collect()
}

/// The spans between these ends, in any order, over whose middle a condition holds.
pub(crate) fn spans_where(mut ends: Vec<f64>, holds_at: impl Fn(f64) -> bool) -> Vec<Range<f64>> {
    ends.sort_by(f64::total_cmp);
    let spans = ends.windows(2).map(|pair| pair[0]..pair[1]);
    spans.filter(|span| span.start < span.end && holds_at((span.start + span.end) / 2.0)).collect()
}

/// The value at a place on the straight lines between knots, which are in ascending order. Beyond the outermost knots
/// it stays as it is there. `None` without a knot.
pub fn interpolated(knots: &[(f64, f64)], place: f64) -> Option<f64> {
    let next = knots.partition_point(|(knot, _)| *knot <= place);
    match (next.checked_sub(1).map(|last| knots[last]), knots.get(next)) {
        (Some((from, before)), Some((to, beyond))) => Some(before + (beyond - before) * ((place - from) / (to - from))),
        (Some((_, value)), None) | (None, Some(&(_, value))) => Some(value),
        (None, None) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ground_covered_twice_counts_once() {
        let union = union(vec![50.0..70.0, 0.0..20.0, 10.0..30.0, 60.0..65.0]);
        assert_eq!(union, [0.0..30.0, 50.0..70.0]);
        assert_eq!(share_of(&(0.0..100.0), &union), 0.5);
    }

    #[test]
    fn ground_beyond_the_row_does_not_count() {
        let stretches = [0.0..30.0, 50.0..70.0, 90.0..95.0];
        assert_eq!(share_of(&(20.0..60.0), &stretches), 0.5);
    }
}
