//! The nearest examples of a search, how one more finds its place among them, and their vote.
//!
//! They stand in as many places as examples are to vote, sorted, farthest first; while some places are still free, these are in
//! front. Those that are as far as the farthest but have found no place vote too, so their votes are counted, together with how
//! far they are: where a nearer one is the farthest later on, they are worth nothing any more.

use crate::{Answer, ClassifyError, Kind, MAX_K, Neighbour, ballot::Ballot};

/// The nearest examples found so far, of `CLASSES` classes, and places for them: an array, which is passed on as a slice.
///
/// [`classify`](crate::classify) is such a search from its beginning to its end. A machine that has little time at once keeps it, and
/// has one store or another join whenever there is some.
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
    /// Places that are to be taken, the first ones.
    k: u8,
    /// Of these, the first that nobody has taken.
    free: u8,
    /// The votes of those that have found no place, and one that is as far as they are.
    level: Ballot<CLASSES>,
    as_far: Neighbour,
    places: Places,
}

impl<const CLASSES: usize, const PLACES: usize> Nearest<CLASSES, [Neighbour; PLACES]> {
    /// Nobody yet, and so many places, whoever stands there. None of them is to be taken before a search has begun.
    #[inline]
    #[must_use]
    pub const fn new(places: [Neighbour; PLACES]) -> Self {
        const { assert!(CLASSES > 0 && CLASSES <= 256, "there are 1 to 256 classes") };
        Self { k: 0, free: 0, level: Ballot::EMPTY, as_far: Neighbour::NONE, places }
    }
}

impl<const CLASSES: usize> Nearest<CLASSES> {
    /// Begins a search for the `k` nearest. What was found before is dropped.
    ///
    /// # Errors
    ///
    /// [`ClassifyError::KOutOfRange`] where `k` is 0, above [`MAX_K`], or more than there are places.
    #[inline]
    pub fn begin(&mut self, k: u8) -> Result<(), ClassifyError> {
        if k == 0 || k > MAX_K || usize::from(k) > self.places.len() {
            return Err(ClassifyError::KOutOfRange);
        }
        (self.k, self.free) = (k, k);
        (self.level, self.as_far) = (Ballot::EMPTY, Neighbour::NONE);
        Ok(())
    }

    /// The places: the free ones, of which there are so many, then those taken, farthest first.
    ///
    /// For a store that has a faster way than [`join`](Self::join). It does what that does, and says so by
    /// [`have_joined`](Self::have_joined) and then [`are_level`](Self::are_level).
    #[inline]
    #[must_use]
    pub fn places(&mut self) -> (&mut [Neighbour], usize) {
        (self.places.get_mut(..self.k.into()).unwrap_or_default(), self.free.into())
    }

    /// Examples have joined the [`gps`](Self::places), of which so many are still free, and no more than were.
    #[inline]
    pub fn have_joined(&mut self, free: usize) {
        self.free = free.min(self.free.into()) as u8;
    }

    /// So many examples of a label have found no place although they are as far as the farthest is now.
    pub fn are_level(&mut self, label: u8, examples: u8) {
        self.vote_level(label, examples);
    }

    /// An example takes its place, where it is not too far for that.
    ///
    /// Where none is free, one has to make room: the farthest, or this one where it is no nearer; of two that are as far, the one
    /// of the greater label.
    ///
    /// Out of line, as it takes more code than a call of it.
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
            // Those that are farther move up.
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

    /// So many vote that are as far as the farthest.
    #[inline(never)]
    fn vote_level(&mut self, label: u8, votes: u8) {
        if let Some(&farthest) = self.places.first()
            && !self.as_far.is_as_far_as(&farthest)
        {
            (self.level, self.as_far) = (Ballot::EMPTY, farthest);
        }
        self.level.vote(label, votes);
    }

    /// The class by the vote of all that have joined since the search [began](Self::begin), as [`classify`](crate::classify) says it.
    ///
    /// # Errors
    ///
    /// [`ClassifyError`] where fewer have joined than are to vote, or a voter's label is not a class.
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
            // Neighbours are sorted by distance and then by label, and the examples that found no place are behind them
            // in the same order: the first leading class met this way is the nearest, and the smallest among equals.
            // Where none is met, `label` is the smallest already. Of two classes, both lead.
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

    /// Whether every place is taken.
    const fn is_full(&self) -> bool {
        self.free == 0
    }
}

/// The class with the most votes, the smallest among equals; its votes; and whether another one has as many.
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
