//! The nearest examples of a search, the insertion of another, and their vote.
//!
//! There are k places, sorted, farthest first; free places come before them. Examples without a place that are as far as the
//! farthest vote too. Their votes are counted together with their distance, and dropped when a nearer example becomes the farthest.

use crate::{Answer, ClassifyError, Kind, MAX_K, Neighbour, ballot::Ballot};

/// The nearest examples found so far, of `CLASSES` classes, and their places: an array, passed on as a slice.
///
/// [`classify`](crate::classify) is a complete search. A loop with little time at once keeps a `Nearest`, and searches one store or
/// another in each turn.
///
/// ```
/// use knn::{Answer, Example, Examples, Nearest, Neighbour};
///
/// let mut nearest = Nearest::<2, _>::new([Neighbour::NONE; 5]);
/// let nearest: &mut Nearest<2> = &mut nearest;
/// nearest.begin(3)?;
/// [Example::new([20], 0), Example::new([90], 1)].keep_nearest(&[30], nearest);
/// // Later on:
/// [Example::new([35], 0), Example::new([99], 1)].keep_nearest(&[30], nearest);
/// assert_eq!(nearest.answer(u32::MAX)?.votes, [2, 1]);
/// # Ok::<(), knn::ClassifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Nearest<const CLASSES: usize, Places: ?Sized = [Neighbour]> {
    /// Places in use, counted from the first.
    k: u8,
    /// The number of these that are free.
    free: u8,
    /// The votes of examples without a place, and a neighbour at their distance.
    level: Ballot<CLASSES>,
    as_far: Neighbour,
    places: Places,
}

impl<const CLASSES: usize, const PLACES: usize> Nearest<CLASSES, [Neighbour; PLACES]> {
    /// No neighbours yet; the contents of `places` do not matter. No place is used before [`begin`](Self::begin).
    #[inline]
    #[must_use]
    pub const fn new(places: [Neighbour; PLACES]) -> Self {
        const { assert!(CLASSES > 0 && CLASSES <= 256, "there are 1 to 256 classes") };
        Self { k: 0, free: 0, level: Ballot::EMPTY, as_far: Neighbour::NONE, places }
    }
}

impl<const CLASSES: usize> Nearest<CLASSES> {
    /// Begins a search for the `k` nearest, and drops earlier results.
    ///
    /// # Errors
    ///
    /// [`ClassifyError::KOutOfRange`] if `k` is 0, above [`MAX_K`], or above the number of places.
    #[inline]
    pub fn begin(&mut self, k: u8) -> Result<(), ClassifyError> {
        if k == 0 || k > MAX_K || usize::from(k) > self.places.len() {
            return Err(ClassifyError::KOutOfRange);
        }
        (self.k, self.free) = (k, k);
        (self.level, self.as_far) = (Ballot::EMPTY, Neighbour::NONE);
        Ok(())
    }

    /// The places: first the free ones, whose number is returned, then those taken, farthest first.
    ///
    /// For a store with a faster way than [`join`](Self::join). The store does what that does, and reports it with
    /// [`have_joined`](Self::have_joined) and then [`are_level`](Self::are_level).
    #[inline]
    #[must_use]
    pub fn places(&mut self) -> (&mut [Neighbour], usize) {
        (self.places.get_mut(..self.k.into()).unwrap_or_default(), self.free.into())
    }

    /// Reports that `free` of the [`places`](Self::places) are still free, at most as many as before.
    #[inline]
    pub fn have_joined(&mut self, free: usize) {
        self.free = free.min(self.free.into()) as u8;
    }

    /// Reports examples of a label without a place that are as far as the farthest is now.
    pub fn are_level(&mut self, label: u8, examples: u8) {
        self.vote_level(label, examples);
    }

    /// Gives an example its place, if it is near enough.
    ///
    /// If no place is free, the farthest example leaves, or this one if it is not nearer. Of two at the same distance, the one with
    /// the greater label leaves.
    ///
    /// Out of line, because it takes more code than a call.
    #[inline(never)]
    pub fn join(&mut self, example: Neighbour) {
        let is_full = self.is_full();
        let free = usize::from(self.free);
        let (places, _) = self.places();
        let Some(&farthest) = places.first() else { return };
        let mut out = example;
        if !is_full || example.key() < farthest.key() {
            let begin = free - usize::from(!is_full);
            let Some([place, places @ ..]) = places.get_mut(begin..) else { return };
            let mut place = place;
            // Move up the farther ones.
            for nearer in places {
                if example.key() >= nearer.key() {
                    break;
                }
                *place = *nearer;
                place = nearer;
            }
            *place = example;
            self.free = begin as u8;
            if !is_full {
                return;
            }
            out = farthest;
        }
        if let Some(farthest) = self.places.first()
            && farthest.is_as_far_as(&out)
        {
            self.vote_level(out.label(), 1);
        }
    }

    /// Counts votes at the distance of the farthest.
    #[inline(never)]
    fn vote_level(&mut self, label: u8, votes: u8) {
        if let Some(&farthest) = self.places.first()
            && !self.as_far.is_as_far_as(&farthest)
        {
            (self.level, self.as_far) = (Ballot::EMPTY, farthest);
        }
        self.level.vote(label, votes);
    }

    /// The class by the vote of all that have joined since [`begin`](Self::begin), with the rules of [`classify`](crate::classify).
    ///
    /// # Errors
    ///
    /// [`ClassifyError`] if fewer than k have joined, or a voter's label is not a class.
    #[inline(never)]
    pub fn answer(&self, radius: u32) -> Result<Answer<CLASSES>, ClassifyError> {
        if !self.is_full() {
            return Err(if self.free == self.k { ClassifyError::NoExamples } else { ClassifyError::TooFewExamples });
        }
        let Some(places @ [farthest, .., nearest] | places @ [farthest @ nearest]) = self.places.get(..self.k.into())
        else {
            return Err(ClassifyError::KOutOfRange);
        };
        let mut ballot = if farthest.is_as_far_as(&self.as_far) { self.level.clone() } else { Ballot::EMPTY };
        ballot.count(places);
        let Some(votes) = ballot.votes() else { return Err(ClassifyError::UnknownLabel) };
        let (mut label, most, tie) = lead(&votes);
        if tie {
            // Neighbours are sorted by distance and then by label, and the examples without a place follow in the same order. So
            // the first leading class found is the nearest, and the smallest among equals. If none is found, `label` already is the
            // smallest. With two classes, both lead.
            if CLASSES == 2 {
                label = nearest.label();
            } else {
                let mut labels = places.iter().rev().map(|neighbour| neighbour.label());
                label = labels.find(|label| votes.get(usize::from(*label)) == Some(&most)).unwrap_or(label);
            }
        }
        let nearest = nearest.distance();
        let kind = match (nearest > radius, tie) {
            (true, _) => Kind::Stranger,
            (false, true) => Kind::Tie,
            (false, false) => Kind::Known,
        };
        Ok(Answer { label, votes, nearest, kind })
    }

    /// Whether all places are taken.
    const fn is_full(&self) -> bool {
        self.free == 0
    }
}

/// The class with the most votes, the smallest among equals; its votes; and whether another class has as many.
#[inline(always)]
fn lead<const CLASSES: usize>(votes: &[usize; CLASSES]) -> (u8, usize, bool) {
    if let [zeros, ones] = votes.as_slice() {
        return (u8::from(ones > zeros), *zeros.max(ones), ones == zeros);
    }
    let (mut label, mut most, mut tie) = (0, 0, false);
    for (class, &votes) in votes.iter().enumerate() {
        if votes > most {
            (label, most, tie) = (class as u8, votes, false);
        } else if votes == most {
            tie = true;
        }
    }
    (label, most, tie)
}
