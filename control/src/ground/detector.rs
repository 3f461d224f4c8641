//! Detections in the row, from the edges of the beam.
//!
//! The beam is read along the ground, not along time: only its level on new ground counts. [`Detector`] keeps the frontier, the
//! farthest ground seen. When the machine rolls back, the beam crosses known ground, and its edges there are ignored. At the
//! frontier, detection continues with the beam's level there. So a plant is one detection, even if the machine passes it several
//! times.
//!
//! A canopy is ragged. Clear stretches shorter than the merging gap belong to the detection. It ends only after a clear stretch of
//! that length. The beginning of a detection is certain only after such a clear stretch too. At the start, and after forgetting, an
//! open detection therefore stands for the possible rest of a canopy. The detector does not classify.

use super::detection::Detection;
use crate::units::{Length, WrappedPosition};

/// Turns beam edges into detections.
#[derive(Clone, Debug)]
pub struct Detector {
    frontier: WrappedPosition,
    /// The beam's level at the machine's position, at or behind the frontier.
    broken: bool,
    /// The beam's level at the frontier.
    broken_at_frontier: bool,
    /// The detection that has no certain end yet. Clear ground behind it may turn out to be a gap in it.
    detection: Option<Detection>,
    /// Whether, since the last query, a clear stretch was wider than the gaps between one plant's leaves.
    parted: bool,
}

impl Detector {
    /// A detector before [`begin`](Self::begin).
    pub const NONE: Self = Self {
        frontier: WrappedPosition::new(0),
        broken: false,
        broken_at_frontier: false,
        detection: Some(Detection::NONE),
        parted: false,
    };

    /// Starts at a position. `broken` is the beam's level.
    #[cfg_attr(target_arch = "avr", inline(never))]
    pub fn begin(&mut self, position: WrappedPosition, broken: bool) {
        (self.frontier, self.parted) = (position, false);
        self.lose_edges(broken);
    }

    /// Forgets the ground seen: a detection at the frontier may be the rest of any plant.
    pub fn forget(&mut self) {
        self.detection = Some(Detection::cut_at(self.frontier));
    }

    /// Edges were lost. The beam is now `broken` at the machine's position. The level at the frontier may differ; that shows when
    /// the machine reaches it.
    pub fn lose_edges(&mut self, broken: bool) {
        (self.broken, self.broken_at_frontier) = (broken, broken);
        self.forget();
    }

    /// The farthest ground seen.
    pub fn frontier(&self) -> WrappedPosition {
        self.frontier
    }

    /// Whether the beam is broken at the machine's position.
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// Whether gaps show that the last complete detection may be more than one plant. Clears the mark.
    pub fn take_parted(&mut self) -> bool {
        core::mem::take(&mut self.parted)
    }

    /// Where the detection without a certain end begins.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<WrappedPosition> {
        self.detection
            .filter(|detection| self.broken_at_frontier || !detection.is_empty())
            .map(|detection| detection.leading)
    }

    /// How far the [`open`](Self::open) detection reaches so far; the frontier if there is none.
    pub fn open_to(&self) -> WrappedPosition {
        match self.detection {
            Some(detection) if !self.broken_at_frontier => detection.trailing,
            _ => self.frontier,
        }
    }

    /// Takes a beam edge at a position. Returns the detection that was complete before it.
    pub fn edge(&mut self, position: WrappedPosition, broken: bool, merge_gap: Length) -> Option<Detection> {
        let complete = self.roll_to(position, merge_gap);
        self.broken = broken;
        if position == self.frontier {
            self.turn(merge_gap);
        }
        complete
    }

    /// The machine has rolled to a position without an edge. Returns the detection that this completes.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn roll_to(&mut self, position: WrappedPosition, merge_gap: Length) -> Option<Detection> {
        if !position.is_ahead_of(self.frontier) {
            return None;
        }
        // The machine may return to the frontier with another level than it left with.
        self.turn(merge_gap);
        self.frontier = position;
        let detection = self.detection?;
        if self.broken_at_frontier || position - detection.trailing < merge_gap {
            return None;
        }
        self.detection = None;
        (!detection.is_empty()).then_some(detection)
    }

    /// Applies the beam's level to the frontier.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    fn turn(&mut self, merge_gap: Length) {
        if self.broken == self.broken_at_frontier {
            return;
        }
        self.broken_at_frontier = self.broken;
        let here = self.frontier;
        // If the beam breaks inside the merging gap, the clear stretch was a gap in the detection.
        let detection = self.detection.get_or_insert(Detection { leading: here, trailing: here, ..Detection::NONE });
        if !self.broken {
            detection.trailing = here;
        } else if here - detection.trailing > Length(merge_gap.0 >> 1) {
            // The gaps between one plant's leaves are narrower.
            self.parted = true;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    const GAP: Length = Length(40);

    fn begun(position: i16, broken: bool) -> Detector {
        let mut detector = Detector::NONE;
        detector.begin(WrappedPosition::new(position), broken);
        detector
    }

    /// Rolls tick by tick through `positions`, counted from `base`, with the beam broken inside `canopies`. Collects the
    /// detections.
    fn detections(base: i16, canopies: &[(i16, i16)], positions: &[i16]) -> Vec<(i16, i16)> {
        let broken_at = |position: i16| canopies.iter().any(|&(from, to)| (from..to).contains(&position));
        let mut detector = begun(base.wrapping_add(positions[0]), broken_at(positions[0]));
        let mut found = Vec::new();
        for &position in &positions[1..] {
            let ground = WrappedPosition::new(base.wrapping_add(position));
            found.extend(if broken_at(position) == detector.is_broken() {
                detector.roll_to(ground, GAP)
            } else {
                detector.edge(ground, broken_at(position), GAP)
            });
        }
        let offset = |end: WrappedPosition| end.count().wrapping_sub(base);
        found.into_iter().map(|detection| (offset(detection.leading), offset(detection.trailing))).collect()
    }

    #[test]
    fn a_gap_separates_detections_on_any_path_of_the_machine() {
        let ragged = [(100, 200), (215, 300), (339, 400)];
        let there_and_back: Vec<_> = (0..350).chain((50..350).rev()).chain(50..600).collect();
        let past_it: Vec<_> = (0..700).chain((0..700).rev()).chain(0..900).collect();
        let to = |end: i16| (0..end).collect::<Vec<_>>();
        for (canopies, positions, expected) in [
            (&[][..], to(200), &[][..]),
            (&[(100, 400)], to(600), &[(100, 400)]),
            (&ragged, to(600), &[(100, 400)]),
            (&[(100, 200), (240, 300)], to(600), &[(100, 200), (240, 300)]),
            // It is complete only once the gap behind it has been seen.
            (&[(100, 200)], to(240), &[]),
            (&[(100, 200)], to(241), &[(100, 200)]),
            (&[(100, 400)], there_and_back, &[(100, 400)]),
            (&[(100, 400)], past_it, &[(100, 400)]),
        ] {
            // The counter wraps inside the canopy, or does not.
            for base in [0, i16::MAX - 250] {
                assert_eq!(detections(base, canopies, &positions), expected, "{canopies:?} from {base}");
            }
        }
    }

    #[test]
    fn a_gap_wider_than_between_leaves_is_reported_once() {
        for (gap, parted) in [(1, false), (GAP.0 / 2, false), (GAP.0 / 2 + 1, true), (GAP.0 - 1, true)] {
            let mut detector = begun(-100, false);
            for (position, broken) in
                [(0, true), (100, false), (100 + gap, true), (200, false), (201, true), (300, false)]
            {
                assert_eq!(detector.edge(WrappedPosition::new(position), broken, GAP), None);
            }
            detector.roll_to(WrappedPosition::new(300) + GAP, GAP).expect("the gap has been seen");
            assert_eq!((detector.take_parted(), detector.take_parted()), (parted, false), "{gap}");
        }
    }

    #[test]
    fn a_detection_in_the_beam_at_the_start_is_cut() {
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
    fn a_plant_entering_behind_the_frontier_begins_at_the_frontier() {
        let mut detector = begun(0, false);
        assert_eq!(detector.open(), None);
        detector.roll_to(WrappedPosition::new(500), GAP);
        detector.edge(WrappedPosition::new(450), true, GAP);
        assert_eq!(detector.open(), None, "edges behind the frontier are ignored");
        detector.roll_to(WrappedPosition::new(501), GAP);
        assert_eq!(detector.open(), Some(WrappedPosition::new(500)));
    }

    /// The first detection of a plant that begins at `begins`.
    fn first_detection(mut detector: Detector, begins: i16) -> Detection {
        detector.edge(WrappedPosition::new(begins), true, GAP);
        detector.edge(WrappedPosition::new(begins + 100), false, GAP);
        detector.roll_to(WrappedPosition::new(begins + 200), GAP).expect("the gap has been seen")
    }

    #[test]
    fn a_detection_without_a_whole_gap_before_it_is_cut() {
        for clear in 0..80 {
            let whole = Detection::whole(clear, clear + 100);
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
    fn the_rest_of_a_half_seen_plant_is_cut_after_forgetting_at_any_position() {
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
}
