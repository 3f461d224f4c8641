//! Objects in the row, from the edges of the beam.
//!
//! The beam is watched along the ground, not along time: what counts is its level at ground that it has not seen before.
//! [`Watch`] keeps the frontier, the farthest ground seen. Rolling back lets the beam cross known ground, where its edges
//! mean nothing; when the machine reaches the frontier again, watching goes on with the level that the beam then has. So
//! a plant is one object, however often it is passed.
//!
//! A canopy is ragged: clear stretches shorter than the merging gap belong to the object, which ends only once the gap
//! behind it has been seen in full. The same gap has to be seen before an object for its beginning to be known: where
//! watching begins, and where it has to forget, an object is open of which nothing is known but that it may be the rest of
//! a canopy. What an object is, plant or weed, is not decided here.

use super::object::Object;
use crate::units::{Length, Place};

/// Watches the row through the beam.
#[derive(Clone, Debug)]
pub struct Watch {
    frontier: Place,
    /// The beam's level where the machine now is, at or behind the frontier.
    broken: bool,
    /// The beam's level at the frontier.
    broken_at_frontier: bool,
    /// The object whose end has not been seen in full. Clear ground behind it may turn out to be a gap in it.
    object: Option<Object>,
}

impl Watch {
    /// A watch that has not begun.
    pub const NONE: Self =
        Self { frontier: Place::new(0), broken: false, broken_at_frontier: false, object: Some(Object::NONE) };

    /// Begins to watch at a place, with the beam broken or not.
    pub fn start(place: Place, broken: bool) -> Self {
        Self { frontier: place, broken, broken_at_frontier: broken, object: Some(Object::cut_at(place)) }
    }

    /// Forgets what was seen: what is at the frontier may be the rest of anything.
    pub fn forget(&mut self) {
        self.object = Some(Object::cut_at(self.frontier));
    }

    /// Edges were lost: where the machine now is, the beam is `broken` or not. At the frontier it may be the other way, which
    /// shows when the machine comes there.
    pub fn lose_edges(&mut self, broken: bool) {
        (self.broken, self.broken_at_frontier) = (broken, broken);
        self.forget();
    }

    /// The farthest ground seen.
    pub fn frontier(&self) -> Place {
        self.frontier
    }

    /// Whether the beam is broken where the machine now is.
    pub fn is_broken(&self) -> bool {
        self.broken
    }

    /// Where the object began whose end has not been seen yet.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn open(&self) -> Option<Place> {
        self.object.filter(|object| self.broken_at_frontier || !object.is_nothing()).map(|object| object.leading)
    }

    /// Takes an edge of the beam at a place; returns the object that was complete before it.
    pub fn edge(&mut self, place: Place, broken: bool, merge_gap: Length) -> Option<Object> {
        let complete = self.roll_to(place, merge_gap);
        self.broken = broken;
        if place == self.frontier {
            self.turn();
        }
        complete
    }

    /// The machine has rolled to a place without an edge; returns the object that this completes.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn roll_to(&mut self, place: Place, merge_gap: Length) -> Option<Object> {
        if !place.is_ahead_of(self.frontier) {
            return None;
        }
        // The machine may have come back to the frontier with another level than it left with.
        self.turn();
        self.frontier = place;
        let clear = !self.broken_at_frontier;
        let complete = self.object.take_if(|object| clear && place - object.trailing >= merge_gap);
        complete.filter(|object| !object.is_nothing())
    }

    /// Takes the beam's level at the frontier for what is seen there.
    #[cfg_attr(not(target_arch = "avr"), inline)]
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

    const GAP: Length = Length(40);

    /// Rolls tick by tick through `places`, with the beam broken inside `canopies`, and collects the objects.
    fn objects(canopies: &[(i16, i16)], places: impl IntoIterator<Item = i16>) -> Vec<(i16, i16)> {
        let broken_at = |place: i16| canopies.iter().any(|&(from, to)| (from..to).contains(&place));
        let mut places = places.into_iter();
        let first = places.next().expect("a place to start from");
        let mut watch = Watch::start(Place::new(first), broken_at(first));
        let mut found = Vec::new();
        for place in places {
            let ground = Place::new(place);
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
        let mut watch = Watch::start(Place::new(0), true);
        assert_eq!(watch.edge(Place::new(20), false, GAP), None);
        assert_eq!(watch.edge(Place::new(30), true, GAP), None, "its own leaves");
        assert_eq!(watch.edge(Place::new(35), false, GAP), None);
        let object = watch.edge(Place::new(100), true, GAP).expect("the gap has been seen");
        assert!(object.cut, "{object:?}");
        watch.edge(Place::new(400), false, GAP);
        let object = watch.roll_to(Place::new(440), GAP).expect("the gap has been seen");
        assert!(!object.cut, "{object:?}");
    }

    #[test]
    fn a_plant_that_comes_into_the_beam_behind_the_frontier_begins_at_the_frontier() {
        let mut watch = Watch::start(Place::new(0), false);
        watch.roll_to(Place::new(500), GAP);
        watch.edge(Place::new(450), true, GAP);
        assert_eq!(watch.open(), None, "what stands behind the frontier means nothing");
        watch.roll_to(Place::new(501), GAP);
        assert_eq!(watch.open(), Some(Place::new(500)));
    }

    /// The first object that a watch sees from a place on, behind which it has seen so much clear ground.
    fn first_object(mut watch: Watch, begins: i16) -> Object {
        watch.edge(Place::new(begins), true, GAP);
        watch.edge(Place::new(begins + 100), false, GAP);
        watch.roll_to(Place::new(begins + 200), GAP).expect("the gap has been seen")
    }

    #[test]
    fn an_object_before_which_no_whole_gap_was_seen_may_be_the_rest_of_one() {
        for clear in 0..80 {
            let whole = Object { leading: Place::new(clear), trailing: Place::new(clear + 100), cut: false };
            let rest = Object { leading: Place::new(0), cut: true, ..whole };
            let expected = if clear < GAP.0 { rest } else { whole };
            assert_eq!(first_object(Watch::start(Place::new(0), false), clear), expected);
            let mut forgetful = Watch::start(Place::new(-900), false);
            forgetful.roll_to(Place::new(-500), GAP);
            forgetful.edge(Place::new(-400), true, GAP);
            forgetful.edge(Place::new(-10), false, GAP);
            forgetful.roll_to(Place::new(0), GAP);
            forgetful.forget();
            assert_eq!(first_object(forgetful, clear), expected);
        }
    }

    #[test]
    fn the_rest_of_a_half_seen_plant_is_cut_wherever_the_machine_stood_when_it_had_to_forget() {
        for back in [0, 1, 50, 400] {
            for level_there in [false, true] {
                let mut watch = Watch::start(Place::new(0), false);
                watch.edge(Place::new(500), true, GAP);
                watch.roll_to(Place::new(700), GAP);
                if !level_there {
                    watch.edge(Place::new(690 - back), false, GAP);
                }
                watch.roll_to(Place::new(690 - back), GAP);
                watch.forget();
                watch.edge(Place::new(695), true, GAP);
                watch.edge(Place::new(720), false, GAP);
                let rest = watch.roll_to(Place::new(800), GAP).expect("the gap has been seen");
                assert!(rest.cut, "{rest:?}");
                assert_eq!((rest.leading, rest.trailing), (Place::new(700), Place::new(720)));
            }
        }
    }

    #[test]
    fn nothing_is_not_an_object() {
        let mut watch = Watch::start(Place::new(0), false);
        assert_eq!(watch.open(), None);
        for place in 1..200 {
            assert_eq!(watch.roll_to(Place::new(place), GAP), None);
        }
    }

    #[test]
    fn objects_are_the_same_where_the_counter_wraps() {
        let base = i16::MAX - 250;
        let mut watch = Watch::start(Place::new(base), false);
        let at = |offset: i16| Place::new(base.wrapping_add(offset));
        assert_eq!(watch.edge(at(100), true, GAP), None);
        assert_eq!(watch.edge(at(400), false, GAP), None);
        let object = watch.roll_to(at(440), GAP).expect("the gap has been seen");
        assert_eq!((object.leading, object.trailing), (at(100), at(400)));
        assert_eq!(object.width(), Length(300));
    }
}
