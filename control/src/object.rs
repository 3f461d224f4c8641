//! Objects in the row, from the edges of the beam.
//!
//! The beam is watched along the ground, not along time: what counts is its level at ground that it has not seen before.
//! [`Watch`] keeps the frontier, the farthest ground seen. Rolling back lets the beam cross known ground, where its edges
//! mean nothing; when the machine reaches the frontier again, watching goes on with the level that the beam then has. So
//! a plant is one object, however often it is passed.
//!
//! A canopy is ragged: clear stretches shorter than the merging gap belong to the object, which ends only once the gap
//! behind it has been seen in full. What an object is, plant or weed, is not decided here.

use crate::units::{Position, Ticks};

/// A stretch of ground over which the beam was broken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Object {
    /// Where the beam broke.
    pub leading: Position,
    /// Where the beam cleared, at or ahead of `leading`.
    pub trailing: Position,
    /// Whether it was in the beam already when watching began, so that its width is only what was left of it.
    pub cut: bool,
}

impl Object {
    /// How far the machine rolled while the beam was broken, the paper's `t S`.
    pub fn width(&self) -> Ticks {
        self.trailing - self.leading
    }
}

/// Watches the row through the beam.
#[derive(Clone, Debug)]
pub struct Watch {
    frontier: Position,
    /// The beam's level where the machine now is, at or behind the frontier.
    broken: bool,
    /// The beam's level at the frontier.
    broken_at_frontier: bool,
    /// The object whose end has not been seen in full. Clear ground behind it may turn out to be a gap in it.
    object: Option<Object>,
}

impl Watch {
    /// Begins to watch at `ground`, with the beam broken or not.
    pub fn start(ground: Position, broken: bool) -> Self {
        let object = broken.then_some(Object { leading: ground, trailing: ground, cut: true });
        Self { frontier: ground, broken, broken_at_frontier: broken, object }
    }

    /// Begins anew at `ground`: what was seen before is forgotten.
    #[inline(never)]
    pub fn restart(&mut self, ground: Position, broken: bool) {
        *self = Self::start(ground, broken);
    }

    /// The farthest ground seen.
    pub fn frontier(&self) -> Position {
        self.frontier
    }

    /// Whether the beam is broken where the machine now is.
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// Where the object began whose end has not been seen yet.
    pub fn open(&self) -> Option<Position> {
        self.object.map(|object| object.leading)
    }

    /// Takes an edge of the beam at `ground`; returns the object that was complete before it.
    pub fn edge(&mut self, ground: Position, broken: bool, merge_gap: Ticks) -> Option<Object> {
        let complete = self.roll_to(ground, merge_gap);
        self.broken = broken;
        if ground == self.frontier {
            self.turn();
        }
        complete
    }

    /// The machine has rolled to `ground` without an edge; returns the object that this completes.
    pub fn roll_to(&mut self, ground: Position, merge_gap: Ticks) -> Option<Object> {
        if !ground.is_ahead_of(self.frontier) {
            return None;
        }
        // The machine may have come back to the frontier with another level than it left with.
        self.turn();
        self.frontier = ground;
        let clear = !self.broken_at_frontier;
        self.object.take_if(|object| clear && ground - object.trailing >= merge_gap)
    }

    /// Takes the beam's level at the frontier for what is seen there.
    fn turn(&mut self) {
        if self.broken == self.broken_at_frontier {
            return;
        }
        self.broken_at_frontier = self.broken;
        let here = self.frontier;
        // Where the beam breaks behind an object, what was clear until now was a gap in it.
        let object = self.object.get_or_insert(Object { leading: here, trailing: here, cut: false });
        if !self.broken {
            object.trailing = here;
        }
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    const GAP: Ticks = Ticks(40);

    /// Rolls tick by tick through `places`, with the beam broken inside `canopies`, and collects the objects.
    fn objects(canopies: &[(i32, i32)], places: impl IntoIterator<Item = i32>) -> Vec<(i32, i32)> {
        let broken_at = |place: i32| canopies.iter().any(|&(from, to)| (from..to).contains(&place));
        let mut places = places.into_iter();
        let first = places.next().expect("a place to start from");
        let mut watch = Watch::start(Position::new(first), broken_at(first));
        let mut found = Vec::new();
        for place in places {
            let ground = Position::new(place);
            found.extend(if broken_at(place) == watch.is_broken() {
                watch.roll_to(ground, GAP)
            } else {
                watch.edge(ground, broken_at(place), GAP)
            });
        }
        found.into_iter().map(|object| (object.leading.count(), object.trailing.count())).collect()
    }

    #[test]
    fn a_canopy_is_one_object_from_edge_to_edge() {
        assert_eq!(objects(&[(100, 400)], 0..600), [(100, 400)]);
    }

    #[test]
    fn a_ragged_canopy_is_one_object() {
        assert_eq!(objects(&[(100, 200), (215, 300), (339, 400)], 0..600), [(100, 400)]);
    }

    #[test]
    fn two_canopies_a_gap_apart_are_two_objects() {
        assert_eq!(objects(&[(100, 200), (240, 300)], 0..600), [(100, 200), (240, 300)]);
    }

    #[test]
    fn an_object_is_complete_only_once_the_gap_behind_it_has_been_seen() {
        assert_eq!(objects(&[(100, 200)], 0..240), []);
        assert_eq!(objects(&[(100, 200)], 0..241), [(100, 200)]);
    }

    #[test]
    fn a_plant_passed_three_times_is_one_object() {
        let there_and_back = (0..350).chain((50..350).rev()).chain(50..600);
        assert_eq!(objects(&[(100, 400)], there_and_back), [(100, 400)]);
        let past_it = (0..700).chain((0..700).rev()).chain(0..900);
        assert_eq!(objects(&[(100, 400)], past_it), [(100, 400)]);
    }

    #[test]
    fn what_was_in_the_beam_when_watching_began_is_known_to_be_cut() {
        let mut watch = Watch::start(Position::new(0), true);
        assert_eq!(watch.edge(Position::new(20), false, GAP), None);
        assert_eq!(watch.edge(Position::new(30), true, GAP), None, "its own leaves");
        assert_eq!(watch.edge(Position::new(35), false, GAP), None);
        let object = watch.edge(Position::new(100), true, GAP).expect("the gap has been seen");
        assert!(object.cut, "{object:?}");
        watch.edge(Position::new(400), false, GAP);
        let object = watch.roll_to(Position::new(440), GAP).expect("the gap has been seen");
        assert!(!object.cut, "{object:?}");
    }

    #[test]
    fn a_plant_that_comes_into_the_beam_behind_the_frontier_begins_at_the_frontier() {
        let mut watch = Watch::start(Position::new(0), false);
        watch.roll_to(Position::new(500), GAP);
        watch.edge(Position::new(450), true, GAP);
        assert_eq!(watch.open(), None);
        watch.roll_to(Position::new(501), GAP);
        assert_eq!(watch.open(), Some(Position::new(500)));
    }

    #[test]
    fn objects_are_the_same_where_the_counter_wraps() {
        let base = i32::MAX - 250;
        let mut watch = Watch::start(Position::new(base), false);
        let at = |offset: i32| Position::new(base.wrapping_add(offset));
        assert_eq!(watch.edge(at(100), true, GAP), None);
        assert_eq!(watch.edge(at(400), false, GAP), None);
        let object = watch.roll_to(at(440), GAP).expect("the gap has been seen");
        assert_eq!((object.leading, object.trailing), (at(100), at(400)));
        assert_eq!(object.width(), Ticks(300));
    }
}
