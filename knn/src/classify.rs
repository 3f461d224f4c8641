//! The search for the k nearest examples, and their vote.
//!
//! One pass over the examples keeps the [`Nearest`] so far.

use crate::{Examples, Nearest, Neighbour};

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
    // Clearing room for all 15 takes 200 cycles more than for 3 on an ATmega328P.
    const FREE: Neighbour = Neighbour::new(0, 0);
    match k {
        1..=3 => search(examples, features, k, &mut [FREE, FREE, FREE], radius),
        _ => search(examples, features, k, &mut [FREE; MAX_K as usize], radius),
    }
}

/// [`classify`] with places for the k nearest, at least.
///
/// Out of line, because AVR reaches the first 63 bytes of a stack frame by far the fastest: the places lie in the caller's.
#[inline(never)]
fn search<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    k: u8,
    places: &mut [Neighbour],
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    let Some(places @ [_, ..]) = places.get_mut(..k.into()) else { return Err(ClassifyError::KOutOfRange) };
    let mut nearest = Nearest::new(places);
    examples.keep_nearest(features, &mut nearest);
    if !nearest.is_full() {
        return Err(if nearest.is_empty() { ClassifyError::NoExamples } else { ClassifyError::TooFewExamples });
    }
    let (places, ballot) = nearest.vote();
    let Some(nearest) = places.last() else { return Err(ClassifyError::KOutOfRange) };
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
