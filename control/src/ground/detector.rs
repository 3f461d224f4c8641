//! Detections in the row, from the edges of the beam.
//!
//! The beam is watched along the ground, not along time: what counts is its level at ground that it has not seen before.
//! [`Detector`] keeps the frontier, the farthest ground seen. Rolling back lets the beam cross known ground, where its edges
//! mean nothing; when the machine reaches the frontier again, watching goes on with the level that the beam then has. So
//! a plant is one detection, however often it is passed.
//!
//! A canopy is ragged: clear stretches shorter than the merging gap belong to the detection, which ends only once the gap
//! behind it has been seen in full. The same gap has to be seen before a detection for its beginning to be known: where
//! watching begins, and where it has to forget, a detection is open of which nothing is known but that it may be the rest of
//! a canopy. What a detection is, plant or weed, is not decided here.

use super::detection::{Detection, End};
use crate::units::{Length, WrappedPosition};

/// Watches the row through the beam.
#[derive(Clone, Debug)]
pub struct Detector {
    frontier: WrappedPosition,
    /// The beam's level where the machine now is, at or behind the frontier.
    broken: bool,
    /// The beam's level at the frontier.
    broken_at_frontier: bool,
    /// The detection whose end has not been seen in full. Clear ground behind it may turn out to be a gap in it.
    detection: Option<Detection>,
    /// Whether a clear stretch in what was seen since that was last asked is wider than between the leaves of one plant.
    parted: bool,
}

impl Detector {
    /// A watch that has not begun.
    pub const NONE: Self = Self {
        frontier: WrappedPosition::new(0),
        broken: false,
        broken_at_frontier: false,
        detection: Some(Detection::NONE),
        parted: false,
    };

    /// Begins to watch at a place, with the beam broken or not.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn begin(&mut self, place: WrappedPosition, broken: bool) {
        (self.frontier, self.parted) = (place, false);
        self.lose_edges(broken);
    }

    /// Forgets what was seen: what is at the frontier may be the rest of anything.
    pub fn forget(&mut self) {
        self.detection = Some(Detection::cut_at(self.frontier));
    }

    /// Edges were lost: where the machine now is, the beam is `broken` or not. At the frontier it may be the other way, which
    /// shows when the machine comes there.
    pub fn lose_edges(&mut self, broken: bool) {
        (self.broken, self.broken_at_frontier) = (broken, broken);
        self.forget();
    }

    /// The farthest ground seen.
    pub fn frontier(&self) -> WrappedPosition {
        self.frontier
    }

    /// Whether the beam is broken where the machine now is.
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// The end of a detection that the next edge is, at a place: in the midst of one, as on ground that was seen before, it may be a leaf's.
    pub fn end(&self, place: WrappedPosition) -> End {
        if self.frontier.is_ahead_of(place) {
            End::None
        } else if self.broken {
            End::Trailing
        } else if self.detection.is_none() {
            End::Leading
        } else {
            End::None
        }
    }

    /// What is asked next may be more than one plant.
    pub fn doubt(&mut self) {
        self.parted = true;
    }

    /// Whether the detection that was complete last may be more than one plant, for the gaps in it.
    pub fn is_parted(&mut self) -> bool {
        core::mem::take(&mut self.parted)
    }

    /// Where the detection began whose end has not been seen yet.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<WrappedPosition> {
        self.detection
            .filter(|detection| self.broken_at_frontier || !detection.is_nothing())
            .map(|detection| detection.leading)
    }

    /// How far the detection goes that is [`open`](Self::open), as far as was seen; the frontier where none is.
    pub fn open_to(&self) -> WrappedPosition {
        match self.detection {
            Some(detection) if !self.broken_at_frontier => detection.trailing,
            _ => self.frontier,
        }
    }

    /// Takes an edge of the beam at a place; returns the detection that was complete before it.
    pub fn edge(&mut self, place: WrappedPosition, broken: bool, merge_gap: Length) -> Option<Detection> {
        let complete = self.roll_to(place, merge_gap);
        self.broken = broken;
        if place == self.frontier {
            self.turn(merge_gap);
        }
        complete
    }

    /// The machine has rolled to a place without an edge; returns the detection that this completes.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn roll_to(&mut self, place: WrappedPosition, merge_gap: Length) -> Option<Detection> {
        if !place.is_ahead_of(self.frontier) {
            return None;
        }
        // The machine may have come back to the frontier with another level than it left with.
        self.turn(merge_gap);
        self.frontier = place;
        let clear = !self.broken_at_frontier;
        let complete = self.detection.take_if(|detection| clear && place - detection.trailing >= merge_gap);
        complete.filter(|detection| !detection.is_nothing())
    }

    /// Takes the beam's level at the frontier for what is seen there.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn turn(&mut self, merge_gap: Length) {
        if self.broken == self.broken_at_frontier {
            return;
        }
        self.broken_at_frontier = self.broken;
        let here = self.frontier;
        // Where the beam breaks behind a detection, what was clear until now was a gap in it.
        let detection = self.detection.get_or_insert(Detection { leading: here, trailing: here, ..Detection::NONE });
        if !self.broken {
            detection.trailing = here;
        } else if here - detection.trailing > Length(merge_gap.0 >> 1) {
            // Between the leaves of one plant there is less.
            self.parted = true;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    const GAP: Length = Length(40);

    fn begun(place: i16, broken: bool) -> Detector {
        let mut detector = Detector::NONE;
        detector.begin(WrappedPosition::new(place), broken);
        detector
    }

    /// Rolls tick by tick through `places`, with the beam broken inside `canopies`, and collects the detections.
    fn detections(canopies: &[(i16, i16)], places: impl IntoIterator<Item = i16>) -> Vec<(i16, i16)> {
        let broken_at = |place: i16| canopies.iter().any(|&(from, to)| (from..to).contains(&place));
        let mut places = places.into_iter();
        let first = places.next().expect("a place to start from");
        let mut detector = begun(first, broken_at(first));
        let mut found = Vec::new();
        for place in places {
            let ground = WrappedPosition::new(place);
            found.extend(if broken_at(place) == detector.is_broken() {
                detector.roll_to(ground, GAP)
            } else {
                detector.edge(ground, broken_at(place), GAP)
            });
        }
        found.into_iter().map(|detection| (detection.leading.count(), detection.trailing.count())).collect()
    }

    #[test]
    fn a_canopy_is_one_detection_from_edge_to_edge() {
        assert_eq!(detections(&[(100, 400)], 0..600), [(100, 400)]);
    }

    #[test]
    fn a_ragged_canopy_is_one_detection() {
        assert_eq!(detections(&[(100, 200), (215, 300), (339, 400)], 0..600), [(100, 400)]);
    }

    #[test]
    fn two_canopies_a_gap_apart_are_two_detections() {
        assert_eq!(detections(&[(100, 200), (240, 300)], 0..600), [(100, 200), (240, 300)]);
    }

    #[test]
    fn a_detection_is_complete_only_once_the_gap_behind_it_has_been_seen() {
        assert_eq!(detections(&[(100, 200)], 0..240), []);
        assert_eq!(detections(&[(100, 200)], 0..241), [(100, 200)]);
    }

    #[test]
    fn a_plant_passed_three_times_is_one_detection() {
        let there_and_back = (0..350).chain((50..350).rev()).chain(50..600);
        assert_eq!(detections(&[(100, 400)], there_and_back), [(100, 400)]);
        let past_it = (0..700).chain((0..700).rev()).chain(0..900);
        assert_eq!(detections(&[(100, 400)], past_it), [(100, 400)]);
    }

    #[test]
    fn a_gap_wider_than_between_leaves_is_told_of() {
        for (gap, parted) in [(1, false), (GAP.0 / 2, false), (GAP.0 / 2 + 1, true), (GAP.0 - 1, true)] {
            let mut detector = begun(-100, false);
            for (place, broken) in [(0, true), (100, false), (100 + gap, true), (200, false), (201, true), (300, false)]
            {
                assert_eq!(detector.edge(WrappedPosition::new(place), broken, GAP), None);
            }
            detector.roll_to(WrappedPosition::new(300) + GAP, GAP).expect("the gap has been seen");
            assert_eq!((detector.is_parted(), detector.is_parted()), (parted, false), "{gap}");
        }
    }

    #[test]
    fn what_was_in_the_beam_when_watching_began_is_known_to_be_cut() {
        let mut detector = begun(0, true);
        assert_eq!(detector.edge(WrappedPosition::new(20), false, GAP), None);
        assert_eq!(detector.edge(WrappedPosition::new(30), true, GAP), None, "its own leaves");
        assert_eq!(detector.edge(WrappedPosition::new(35), false, GAP), None);
        let detection = detector.edge(WrappedPosition::new(100), true, GAP).expect("the gap has been seen");
        assert!(detection.cut, "{detection:?}");
        detector.edge(WrappedPosition::new(400), false, GAP);
        let detection = detector.roll_to(WrappedPosition::new(440), GAP).expect("the gap has been seen");
        assert!(!detection.cut, "{detection:?}");
    }

    #[test]
    fn a_plant_that_comes_into_the_beam_behind_the_frontier_begins_at_the_frontier() {
        let mut detector = begun(0, false);
        detector.roll_to(WrappedPosition::new(500), GAP);
        detector.edge(WrappedPosition::new(450), true, GAP);
        assert_eq!(detector.open(), None, "what stands behind the frontier means nothing");
        detector.roll_to(WrappedPosition::new(501), GAP);
        assert_eq!(detector.open(), Some(WrappedPosition::new(500)));
    }

    /// The first detection that a watch sees from a place on, behind which it has seen so much clear ground.
    fn first_detection(mut detector: Detector, begins: i16) -> Detection {
        detector.edge(WrappedPosition::new(begins), true, GAP);
        detector.edge(WrappedPosition::new(begins + 100), false, GAP);
        detector.roll_to(WrappedPosition::new(begins + 200), GAP).expect("the gap has been seen")
    }

    #[test]
    fn a_detection_before_which_no_whole_gap_was_seen_may_be_the_rest_of_one() {
        for clear in 0..80 {
            let whole = Detection {
                leading: WrappedPosition::new(clear),
                trailing: WrappedPosition::new(clear + 100),
                ..Detection::NONE
            };
            let rest = Detection { leading: WrappedPosition::new(0), cut: true, ..whole };
            let expected = if clear < GAP.0 { rest } else { whole };
            assert_eq!(first_detection(begun(0, false), clear), expected);
            let mut forgetful = begun(-900, false);
            forgetful.roll_to(WrappedPosition::new(-500), GAP);
            forgetful.edge(WrappedPosition::new(-400), true, GAP);
            forgetful.edge(WrappedPosition::new(-10), false, GAP);
            forgetful.roll_to(WrappedPosition::new(0), GAP);
            forgetful.forget();
            assert_eq!(first_detection(forgetful, clear), expected);
        }
    }

    #[test]
    fn the_rest_of_a_half_seen_plant_is_cut_wherever_the_machine_stood_when_it_had_to_forget() {
        for back in [0, 1, 50, 400] {
            for level_there in [false, true] {
                let mut detector = begun(0, false);
                detector.edge(WrappedPosition::new(500), true, GAP);
                detector.roll_to(WrappedPosition::new(700), GAP);
                if !level_there {
                    detector.edge(WrappedPosition::new(690 - back), false, GAP);
                }
                detector.roll_to(WrappedPosition::new(690 - back), GAP);
                detector.forget();
                detector.edge(WrappedPosition::new(695), true, GAP);
                detector.edge(WrappedPosition::new(720), false, GAP);
                let rest = detector.roll_to(WrappedPosition::new(800), GAP).expect("the gap has been seen");
                assert!(rest.cut, "{rest:?}");
                assert_eq!((rest.leading, rest.trailing), (WrappedPosition::new(700), WrappedPosition::new(720)));
            }
        }
    }

    #[test]
    fn nothing_is_no_detection() {
        let mut detector = begun(0, false);
        assert_eq!(detector.open(), None);
        for place in 1..200 {
            assert_eq!(detector.roll_to(WrappedPosition::new(place), GAP), None);
        }
    }

    #[test]
    fn detections_are_the_same_where_the_counter_wraps() {
        let base = i16::MAX - 250;
        let mut detector = begun(base, false);
        let at = |offset: i16| WrappedPosition::new(base.wrapping_add(offset));
        assert_eq!(detector.edge(at(100), true, GAP), None);
        assert_eq!(detector.edge(at(400), false, GAP), None);
        let detection = detector.roll_to(at(440), GAP).expect("the gap has been seen");
        assert_eq!((detection.leading, detection.trailing), (at(100), at(400)));
        assert_eq!(detection.width(), Length(300));
    }
}
