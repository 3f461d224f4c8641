//! The nearest examples of a search, the insertion of another, and their vote.
//!
//! There are k places, sorted, farthest first. A new example takes the farthest's place. Then it changes places with its neighbours,
//! up to the first that is nearer. Most examples that join stop early.

use crate::{Answer, ClassifyError, Kind, MAX_K, Neighbour};

/// The nearest examples found so far, of `CLASSES` classes, and their places: an array, passed on as a slice.
///
/// [`classify`](crate::classify) is a complete search. A loop with little time at once keeps a `Nearest`, and lets some examples join
/// in each turn.
///
/// ```
/// use knn::{Example, Nearest, Neighbour};
///
/// let mut nearest = Nearest::<2, _>::new([Neighbour::NONE; 5]);
/// let nearest: &mut Nearest<2> = &mut nearest;
/// nearest.begin(3)?;
/// for example in [Example::new([20], 0), Example::new([90], 1)] {
///     nearest.join(example.neighbour_of(&[30]));
/// }
/// // Later on:
/// nearest.join(Example::new([35], 0).neighbour_of(&[30]));
/// assert_eq!(nearest.answer(u32::MAX)?.votes, [2, 1]);
/// # Ok::<(), knn::ClassifyError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Nearest<const CLASSES: usize, Places: ?Sized = [Neighbour]> {
    /// Places in use, counted from the first.
    k: u8,
    places: Places,
}

impl<const CLASSES: usize, const PLACES: usize> Nearest<CLASSES, [Neighbour; PLACES]> {
    /// No neighbours yet; the contents of `places` do not matter. No place is used before [`begin`](Self::begin).
    #[inline]
    #[must_use]
    pub const fn new(places: [Neighbour; PLACES]) -> Self {
        const { assert!(CLASSES > 0 && CLASSES <= 256, "there are 1 to 256 classes") };
        Self { k: 0, places }
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
        let Some(places) = self.places.get_mut(..k.into()).filter(|_| k > 0 && k <= MAX_K) else {
            return Err(ClassifyError::KOutOfRange);
        };
        places.fill(Neighbour::NONE);
        self.k = k;
        Ok(())
    }

    /// Gives an example its place, if it is near enough. The farthest leaves.
    ///
    /// Out of line, because it takes more code than a call.
    #[inline(never)]
    pub fn join(&mut self, example: Neighbour) {
        let Some((mut free, nearer)) = self.places.split_first_mut().filter(|(farthest, _)| example < **farthest)
        else {
            return;
        };
        for (place, _) in nearer.iter_mut().zip(1..self.k) {
            if example >= *place {
                break;
            }
            *free = *place;
            free = place;
        }
        *free = example;
    }

    /// The farthest of the k places: no example beyond it can join. While a place is free, none is beyond.
    #[inline]
    #[must_use]
    pub fn reach(&self) -> Neighbour {
        self.places.first().copied().unwrap_or(Neighbour::VACANT)
    }

    /// The k places, farthest first. Places without an example come first, and hold [`Neighbour::NONE`].
    #[inline]
    #[must_use]
    pub fn places(&self) -> &[Neighbour] {
        self.places.get(..self.k.into()).unwrap_or_default()
    }

    /// The class by the vote of the k nearest that have joined since [`begin`](Self::begin), with the rules of
    /// [`classify`](crate::classify).
    ///
    /// # Errors
    ///
    /// [`ClassifyError`] if fewer than k have joined, or a voter's label is not a class.
    pub fn answer(&self, radius: u32) -> Result<Answer<CLASSES>, ClassifyError> {
        let places = self.places();
        let ([farthest, ..], [.., nearest]) = (places, places) else {
            return Err(ClassifyError::KOutOfRange);
        };
        if *farthest == Neighbour::NONE {
            let is_empty = *nearest == Neighbour::NONE;
            return Err(if is_empty { ClassifyError::NoExamples } else { ClassifyError::TooFewExamples });
        }
        let mut votes = [0_u8; CLASSES];
        let (mut label, mut most, mut is_tie) = (0, 0, false);
        // The nearest comes last, so among equals its class is named.
        for place in places {
            let Some(votes) = votes.get_mut(usize::from(place.label())) else {
                return Err(ClassifyError::UnknownLabel);
            };
            *votes += 1;
            if *votes >= most {
                is_tie = *votes == most;
                (label, most) = (place.label(), *votes);
            }
        }
        // Never none: the class has votes.
        let nearest = places.iter().rfind(|place| place.label() == label).unwrap_or(nearest).distance();
        let kind = match (nearest > radius, is_tie) {
            (true, _) => Kind::Stranger,
            (false, true) => Kind::Tie,
            (false, false) => Kind::Known,
        };
        Ok(Answer { label, votes, nearest, kind })
    }
}
