//! What the machine may know of the ground, in the plainest form: whole numbers that never wrap, and a memory that never
//! forgets.
//!
//! An alarm empties the machine's schedule, again and again while its fault lasts. How often, the model does not follow: of what
//! the beam sees meanwhile it takes nothing for sure, neither that it is known nor that it is not.

use control::schedule::CAPACITY;

/// An object of the row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Seen {
    /// The first place at which the beam was broken.
    pub leading: i64,
    /// The last.
    pub trailing: i64,
    /// Whether its beginning was not seen.
    pub cut: bool,
}

/// The ground as the beam has seen it.
#[derive(Debug)]
pub struct Model {
    /// The farthest place that the beam has come to.
    frontier: i64,
    /// Whether the beam is broken.
    broken: bool,
    /// The object that has not come to its end.
    open: Option<Seen>,
    /// Whether the machine may know more, or less, of that object: it was there during an alarm.
    doubtful: bool,
    /// All behind the first is unknown for sure; ahead of the second, all is known.
    unknown_up_to: i64,
    known_from: i64,
    /// The canopies that the machine has to know, and those that it may know.
    canopies: Vec<Seen>,
    perhaps: Vec<Seen>,
}

impl Model {
    /// Nothing is known but the beam's level.
    pub fn new(place: i64, broken: bool) -> Self {
        Self {
            frontier: place,
            broken,
            open: broken.then_some(Seen { leading: place, trailing: place, cut: true }),
            doubtful: false,
            unknown_up_to: place,
            known_from: place,
            canopies: Vec::new(),
            perhaps: Vec::new(),
        }
    }

    pub fn frontier(&self) -> i64 {
        self.frontier
    }

    pub fn is_doubtful(&self) -> bool {
        self.doubtful
    }

    /// The beam has come to a place; the object that is complete now.
    pub fn roll_to(&mut self, place: i64, merge_gap: i64) -> Option<Seen> {
        if place <= self.frontier {
            return None;
        }
        for place in [self.frontier, place] {
            self.frontier = place;
            self.touch();
        }
        let complete = self.open.filter(|open| !self.broken && place - open.trailing >= merge_gap)?;
        self.open = None;
        Some(complete)
    }

    /// The beam breaks or clears at a place.
    pub fn edge(&mut self, place: i64, broken: bool, merge_gap: i64) -> Option<Seen> {
        let complete = self.roll_to(place, merge_gap);
        self.broken = broken;
        if place == self.frontier {
            self.touch();
        }
        complete
    }

    /// Something is in the beam at the farthest place, or nothing is.
    fn touch(&mut self) {
        if self.broken {
            let first = Seen { leading: self.frontier, trailing: self.frontier, cut: false };
            self.open.get_or_insert(first).trailing = self.frontier;
        }
    }

    /// The doubt about an object ends with it.
    pub fn settle(&mut self) {
        self.doubtful = false;
    }

    /// An object is a plant, for all that the machine can tell.
    pub fn keep(&mut self, canopy: Seen) {
        self.canopies.push(canopy);
    }

    /// The machine went into an alarm, when the beam had come to `frontier`.
    pub fn latch(&mut self, frontier: i64) {
        self.unknown_up_to = frontier;
        self.perhaps.append(&mut self.canopies);
    }

    /// The machine may have seen this.
    pub fn perhaps(&mut self, seen: impl IntoIterator<Item = Seen>) {
        self.perhaps.extend(seen);
    }

    /// The machine is in an alarm, and may have seen this.
    pub fn alarmed(&mut self, seen: impl Iterator<Item = Seen>) {
        self.perhaps(seen);
        self.known_from = self.frontier;
        self.doubtful = self.open.is_some();
    }

    /// The machine does not know how far it has rolled: all that was seen is unknown, and a margin ahead of it.
    pub fn lose_place(&mut self, margin: i64) {
        self.latch(self.frontier);
        self.known_from = self.frontier + margin;
        self.doubtful = self.open.is_some();
    }

    /// Edges were lost: the beam's level is now `broken`.
    pub fn lose_edges(&mut self, broken: bool) {
        self.broken = broken;
        let cut = Seen { leading: self.frontier, trailing: self.frontier, cut: true };
        self.open = broken.then_some(cut);
    }

    /// The operator says that the ground from a place on is without plants, whatever was forgotten.
    pub fn trust_from(&mut self, place: i64) {
        self.unknown_up_to = self.unknown_up_to.min(place);
        self.known_from = self.known_from.min(place);
    }

    /// Whether the machine has to keep its tool off some of the ground from `near` to `far`.
    pub fn is_closed(&self, near: i64, far: i64, margin: i64) -> bool {
        let open = self.open.filter(|_| !self.doubtful);
        near < self.unknown_up_to
            || far > self.frontier
            || open.is_some_and(|open| far >= open.leading - margin)
            || self.canopies.iter().any(|canopy| touches(canopy, near, far, margin))
    }

    /// Whether anything gives the machine a reason to keep its tool off some of the ground from `near` to `far`.
    pub fn may_be_closed(&self, near: i64, far: i64, margin: i64) -> bool {
        near < self.known_from
            || self.may_have_forgotten()
            || self.open.is_some_and(|open| far >= open.leading - margin)
            || self.canopies.iter().chain(&self.perhaps).any(|canopy| touches(canopy, near, far, margin))
    }

    /// Whether the machine may have had to forget, for want of room or after a long way.
    fn may_have_forgotten(&self) -> bool {
        self.canopies.len() + self.perhaps.len() >= CAPACITY || self.frontier - self.known_from > 1 << 19
    }
}

fn touches(canopy: &Seen, near: i64, far: i64, margin: i64) -> bool {
    canopy.leading - margin <= far && canopy.trailing + margin >= near
}
