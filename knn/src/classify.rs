//! The search for the k nearest examples, and their vote.
//!
//! One pass over the examples keeps the k nearest so far, sorted. A neighbour is one 32-bit key, its distance above
//! its label, so that comparing keys compares distances first and labels next, and moving a neighbour moves four
//! bytes. Examples that are as far as the k-th nearest, but found no room, are counted by class: they vote too.

use crate::{Examples, distance::DISTANCE_LIMIT};

/// The largest k.
pub const MAX_K: u8 = 15;

/// What an answer is worth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// One class has more votes than any other, and the nearest example is within the radius.
    Known,
    /// Two or more classes share the most votes; the nearest example is within the radius.
    Tie,
    /// The nearest example is farther than the radius: nothing like it was learned.
    Stranger,
}

/// The class of a query, and what speaks for it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Answer<const CLASSES: usize> {
    /// The class with the most votes. Among equals the one with the nearest example; among these the smallest label.
    /// For a [`Kind::Tie`] or a [`Kind::Stranger`] it is only the best guess.
    pub label: u8,
    /// The votes of each class: k in all, and more where several examples are as far as the k-th nearest.
    pub votes: [usize; CLASSES],
    /// The squared distance to the nearest example (see [`squared_distance`](crate::squared_distance)).
    pub nearest: u32,
    /// What the answer is worth.
    pub kind: Kind,
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClassifyError {
    /// k is 0 or above [`MAX_K`].
    KOutOfRange,
    /// There is no example at all.
    NoExamples,
    /// There are examples, but fewer than k.
    TooFewExamples,
    /// The label of an example that would vote is not below the number of classes.
    UnknownLabel,
}

impl core::fmt::Display for ClassifyError {
    fn fmt(&self, formatter: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        formatter.write_str(match self {
            Self::KOutOfRange => "k is out of range: choose 1 to 15",
            Self::NoExamples => "there are no examples: add at least k",
            Self::TooFewExamples => "k is above the number of examples: add examples or choose a smaller k",
            Self::UnknownLabel => {
                "an example's label is not a class: labels run from 0 to the number of classes less 1"
            }
        })
    }
}

impl core::error::Error for ClassifyError {}

/// The class of `features` by the vote of its `k` nearest examples.
///
/// - All examples that are as far as the k-th nearest vote, so that the order of the examples never matters.
/// - Each vote counts one, near or far; the class with the most votes wins (see [`Answer::label`] for ties).
/// - `radius` is a squared distance: an answer whose nearest example is farther is a [`Kind::Stranger`], whatever the
///   votes. `u32::MAX` knows no strangers.
///
/// ```
/// use knn::{Answer, Example, Kind, classify};
///
/// const EXAMPLES: [Example<2>; 4] = [
///     Example::new([20, 30], 0),
///     Example::new([25, 35], 0),
///     Example::new([180, 190], 1),
///     Example::new([185, 200], 1),
/// ];
/// let answer: Answer<2> = classify(&EXAMPLES, &[30, 30], 3, 2_000)?;
/// assert_eq!((answer.label, answer.votes, answer.kind), (0, [2, 1], Kind::Known));
/// assert_eq!(answer.nearest, 50);
///
/// let answer: Answer<2> = classify(&EXAMPLES, &[100, 100], 3, 2_000)?;
/// assert_eq!(answer.kind, Kind::Stranger);
/// # Ok::<(), knn::ClassifyError>(())
/// ```
///
/// # Errors
///
/// [`ClassifyError`], where k does not suit the number of examples or a voter's label is not a class.
pub fn classify<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    k: u8,
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    const { assert!(CLASSES > 0 && CLASSES <= 256, "there are 1 to 256 classes") };
    let mut neighbours = [Neighbour::NONE; MAX_K as usize];
    match neighbours.get_mut(..usize::from(k)) {
        Some(neighbours @ [_, ..]) => search(examples, features, neighbours, radius),
        _ => Err(ClassifyError::KOutOfRange),
    }
}

/// [`classify`] with room for k neighbours, all of them [`Neighbour::NONE`] yet.
///
/// Out of line, because AVR reaches the first 63 bytes of a stack frame by far the fastest: the neighbours lie in the
/// caller's.
#[inline(never)]
fn search<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    neighbours: &mut [Neighbour],
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    let mut nearest = Nearest::<CLASSES> { neighbours, level: [0; CLASSES], level_unknown: false };
    examples.visit_near(features, DISTANCE_LIMIT - 1, &mut |distance, label| {
        nearest.admit(Neighbour::new(distance, label)).distance()
    });
    nearest.vote(radius)
}

/// The k nearest examples so far.
struct Nearest<'a, const CLASSES: usize> {
    /// k of them, nearest first.
    neighbours: &'a mut [Neighbour],
    /// Votes of the examples that are as far as the last neighbour and found no room.
    level: [usize; CLASSES],
    /// Whether one of these examples has a label that is not a class.
    level_unknown: bool,
}

/// A distance of 24 bits above a label of 8.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Neighbour(u32);

impl Neighbour {
    /// Farther than every example.
    const NONE: Self = Self::new(DISTANCE_LIMIT - 1, 0);

    const fn new(distance: u32, label: u8) -> Self {
        Self((distance << 8) | label as u32)
    }

    const fn distance(self) -> u32 {
        self.0 >> 8
    }

    const fn label(self) -> u8 {
        self.0 as u8
    }
}

impl<const CLASSES: usize> Nearest<'_, CLASSES> {
    /// Gives an example that is not farther than the last neighbour its place, and returns the new last neighbour.
    ///
    /// Called for few examples: out of line, it leaves the registers to the loop over all of them.
    #[inline(never)]
    fn admit(&mut self, candidate: Neighbour) -> Neighbour {
        // From the last on, farther neighbours make room, each in the place behind it; the last one falls out.
        let mut places = self.neighbours.iter_mut().rev();
        let mut out = candidate;
        if let Some(mut place) = places.next()
            && candidate < *place
        {
            out = *place;
            for neighbour in places {
                if *neighbour <= candidate {
                    break;
                }
                *place = *neighbour;
                place = neighbour;
            }
            *place = candidate;
        }
        let last = self.neighbours.last().copied().unwrap_or(Neighbour::NONE);
        if out.distance() != last.distance() {
            self.level = [0; CLASSES];
            self.level_unknown = false;
        } else if out != Neighbour::NONE {
            match self.level.get_mut(usize::from(out.label())) {
                Some(votes) => *votes = votes.wrapping_add(1),
                None => self.level_unknown = true,
            }
        }
        last
    }

    fn vote(self, radius: u32) -> Result<Answer<CLASSES>, ClassifyError> {
        let (Some(&nearest), Some(&last)) = (self.neighbours.first(), self.neighbours.last()) else {
            return Err(ClassifyError::KOutOfRange);
        };
        if nearest == Neighbour::NONE {
            return Err(ClassifyError::NoExamples);
        }
        if last == Neighbour::NONE {
            return Err(ClassifyError::TooFewExamples);
        }
        if self.level_unknown {
            return Err(ClassifyError::UnknownLabel);
        }
        let mut votes = self.level;
        for neighbour in self.neighbours.iter() {
            let Some(votes) = votes.get_mut(usize::from(neighbour.label())) else {
                return Err(ClassifyError::UnknownLabel);
            };
            *votes = votes.wrapping_add(1);
        }
        let mut most = 0;
        let mut label = 0;
        let mut tie = false;
        for (class, &votes) in (0..=u8::MAX).zip(&votes) {
            if votes > most {
                (most, label, tie) = (votes, class, false);
            } else if votes == most {
                tie = true;
            }
        }
        if tie {
            // Neighbours are sorted by distance and then by label, and the examples that found no room come after
            // them in the same order: the first leading class met this way is the nearest, and the smallest among
            // equals. Where none is met, `label` is the smallest already.
            let mut labels = self.neighbours.iter().map(|neighbour| neighbour.label());
            label = labels.find(|&label| votes.get(usize::from(label)) == Some(&most)).unwrap_or(label);
        }
        let kind = match (nearest.distance() > radius, tie) {
            (true, _) => Kind::Stranger,
            (false, true) => Kind::Tie,
            (false, false) => Kind::Known,
        };
        Ok(Answer { label, votes, nearest: nearest.distance(), kind })
    }
}
