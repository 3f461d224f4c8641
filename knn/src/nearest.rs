//! The nearest examples of a search, and how one more finds its place among them.
//!
//! They stand in as many places as examples are to vote, sorted, farthest first; while some places are still free, these are in
//! front. Those that are as far as the farthest but have found no place vote too, so their votes are counted, together with how
//! far they are: where a nearer one is the farthest later on, they are worth nothing any more.

use crate::{Neighbour, ballot::Ballot};

/// The nearest examples found so far, of `CLASSES` classes.
///
/// ```
/// use knn::{Nearest, Neighbour};
///
/// let [near, far, farther] = [1, 4, 9].map(|distance| Neighbour::new(distance, 0));
/// let mut places = [Neighbour::new(0, 0); 2];
/// let mut nearest = Nearest::<2>::new(&mut places);
/// nearest.join(farther);
/// assert_eq!(nearest.places().1, 1, "one place is free");
/// nearest.join(near);
/// nearest.join(far);
/// assert_eq!(places, [far, near]);
/// ```
#[derive(Debug)]
pub struct Nearest<'places, const CLASSES: usize> {
    places: &'places mut [Neighbour],
    /// Places that nobody has taken.
    free: usize,
    /// The votes of those that have found no place, and one that is as far as they are.
    level: Ballot<CLASSES>,
    as_far: Neighbour,
}

impl<'places, const CLASSES: usize> Nearest<'places, CLASSES> {
    /// Nobody yet, and as many places as are to vote.
    #[inline]
    #[must_use]
    pub const fn new(places: &'places mut [Neighbour]) -> Self {
        Self { free: places.len(), places, level: Ballot::EMPTY, as_far: Neighbour::new(0, 0) }
    }

    /// The places: the free ones, of which there are so many, then those taken, farthest first.
    ///
    /// For a store that has a faster way than [`join`](Self::join). It does what that does, and says so by
    /// [`have_joined`](Self::have_joined) and then [`are_level`](Self::are_level).
    #[inline]
    #[must_use]
    pub fn places(&mut self) -> (&mut [Neighbour], usize) {
        (self.places, self.free)
    }

    /// Examples have joined the [`places`](Self::places), of which so many are still free, and no more than were.
    #[inline]
    pub fn have_joined(&mut self, free: usize) {
        self.free = free.min(self.free);
    }

    /// So many examples of a label have found no place although they are as far as the farthest is now.
    #[inline(never)]
    pub fn are_level(&mut self, label: u8, examples: u8) {
        for _ in 0..examples {
            self.vote_level(label);
        }
    }

    /// An example takes its place, where it is not too far for that.
    ///
    /// Where none is free, one has to make room: the farthest, or this one where it is no nearer; of two that are as far, the one
    /// of the greater label.
    ///
    /// Out of line, as it takes more code than a call of it.
    #[inline(never)]
    pub fn join(&mut self, example: Neighbour) {
        let Some(&farthest) = self.places.first() else { return };
        let mut out = example;
        let is_full = self.is_full();
        if !is_full || example.key() < farthest.key() {
            self.free -= usize::from(!is_full);
            let Some([place, places @ ..]) = self.places.get_mut(self.free..) else { return };
            let mut place = place;
            // Those that are farther move up.
            for nearer in places {
                if example.key() >= nearer.key() {
                    break;
                }
                *place = *nearer;
                place = nearer;
            }
            *place = example;
            if !is_full {
                return;
            }
            out = farthest;
        }
        if let Some(farthest) = self.places.first()
            && farthest.is_as_far_as(&out)
        {
            self.vote_level(out.label());
        }
    }

    /// One votes that is as far as the farthest.
    fn vote_level(&mut self, label: u8) {
        if let Some(&farthest) = self.places.first()
            && !self.as_far.is_as_far_as(&farthest)
        {
            (self.level, self.as_far) = (Ballot::EMPTY, farthest);
        }
        self.level.vote(label);
    }

    /// All of them, farthest first, and their votes.
    #[inline(always)]
    pub(crate) fn vote(&mut self) -> (&[Neighbour], &Ballot<CLASSES>) {
        if let [farthest, ..] = self.places
            && !farthest.is_as_far_as(&self.as_far)
        {
            self.level = Ballot::EMPTY;
        }
        self.level.count(self.places);
        (self.places, &self.level)
    }

    /// Whether every place is taken.
    #[inline]
    pub(crate) const fn is_full(&self) -> bool {
        self.free == 0
    }

    /// Whether nobody has taken a place.
    #[inline]
    pub(crate) const fn is_empty(&self) -> bool {
        self.free == self.places.len()
    }
}
