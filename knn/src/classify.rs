//! The search for the k nearest examples, and their vote.
//!
//! One pass over the examples keeps the k nearest so far, sorted, and counts those that are as far as the k-th of them but
//! have found no place: they vote too.

use crate::{Examples, Neighbour};

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
    const FREE: Neighbour = Neighbour::FARTHEST;
    match k {
        1..=3 => search(examples, features, [FREE, FREE, FREE].get_mut(..usize::from(k)), radius),
        _ => search(examples, features, [FREE; MAX_K as usize].get_mut(..usize::from(k)), radius),
    }
}

/// [`classify`] with places for the k nearest, nothing in any of them yet.
///
/// Out of line, because AVR reaches the first 63 bytes of a stack frame by far the fastest: the places lie in the caller's.
#[inline(never)]
fn search<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    nearest: Option<&mut [Neighbour]>,
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    let Some(nearest @ [_, ..]) = nearest else { return Err(ClassifyError::KOutOfRange) };
    // Those that found no place although they are as far as the farthest that has one. Where a nearer one is the farthest
    // later on, they were none after all.
    let mut level = Level::at(Neighbour::FARTHEST);
    examples.keep_nearest(features, nearest, &mut |neighbour| level.count(neighbour));
    let (Some(last), Some(first)) = (nearest.first(), nearest.last()) else {
        return Err(ClassifyError::KOutOfRange);
    };
    if last.is_none() {
        return Err(if first.is_none() { ClassifyError::NoExamples } else { ClassifyError::TooFewExamples });
    }
    if !level.neighbour.is_as_far_as(last) {
        (level.votes, level.unknown) = ([0; CLASSES], false);
    }
    for neighbour in nearest.iter() {
        level.vote(neighbour.label());
    }
    let Level { votes, unknown: false, .. } = level else { return Err(ClassifyError::UnknownLabel) };
    let (mut label, mut most, mut tie, mut class) = (0, votes[0], false, 0);
    while class + 1 < CLASSES {
        class += 1;
        if votes[class] > most {
            (label, most, tie) = (class as u8, votes[class], false);
        } else if votes[class] == most {
            tie = true;
        }
    }
    if tie {
        // Neighbours are sorted by distance and then by label, and the examples that found no place are behind them
        // in the same order: the first leading class met this way is the nearest, and the smallest among equals.
        // Where none is met, `label` is the smallest already. Of two classes, both lead.
        let mut labels = nearest.iter().rev().map(|neighbour| neighbour.label());
        let mut leads = |label: &u8| CLASSES == 2 || votes.get(usize::from(*label)) == Some(&most);
        label = labels.find(&mut leads).unwrap_or(label);
    }
    let nearest = first.distance();
    let kind = match (nearest > radius, tie) {
        (true, _) => Kind::Stranger,
        (false, true) => Kind::Tie,
        (false, false) => Kind::Known,
    };
    Ok(Answer { label, votes, nearest, kind })
}

/// The votes of those that are as far as the k-th nearest and found no place among them.
struct Level<const CLASSES: usize> {
    /// One of them.
    neighbour: Neighbour,
    votes: [usize; CLASSES],
    /// Whether a voter's label is not a class.
    unknown: bool,
}

impl<const CLASSES: usize> Level<CLASSES> {
    /// None, at the distance of a neighbour.
    #[inline(always)]
    fn at(neighbour: Neighbour) -> Self {
        Self { neighbour, votes: [0; CLASSES], unknown: false }
    }

    fn count(&mut self, neighbour: Neighbour) {
        if !self.neighbour.is_as_far_as(&neighbour) {
            *self = Self::at(neighbour);
        }
        self.vote(neighbour.label());
    }

    #[inline(always)]
    fn vote(&mut self, label: u8) {
        if CLASSES == 2 {
            // The chip asks which of two it is in fewer cycles than it takes to find the place.
            match (label, self.votes.as_mut_slice()) {
                (0, [votes, _]) | (1, [_, votes]) => *votes = votes.wrapping_add(1),
                _ => self.unknown = true,
            }
            return;
        }
        match self.votes.get_mut(usize::from(label)) {
            Some(votes) => *votes = votes.wrapping_add(1),
            None => self.unknown = true,
        }
    }
}
