//! The search for the k nearest examples, and their vote.
//!
//! One pass over the examples keeps the k + 1 nearest so far, sorted. A neighbour is a key of four bytes, its distance
//! above its label, so that comparing keys compares distances first and labels next. Where the last of them is as far as the k-th, there may be more such examples, which vote too: only then does a
//! second pass count all that lie within this distance.

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
    // Clearing room for all 16 takes 200 cycles more than for 4 on an ATmega328P.
    match k {
        1..=3 => search(examples, features, &mut [Neighbour::NONE; 4][..=usize::from(k)], radius),
        4..=MAX_K => search(examples, features, &mut [Neighbour::NONE; MAX_K as usize + 1][..=usize::from(k)], radius),
        _ => Err(ClassifyError::KOutOfRange),
    }
}

/// [`classify`] with room for the k + 1 nearest, all of them [`Neighbour::NONE`] yet.
///
/// Out of line, because AVR reaches the first 63 bytes of a stack frame by far the fastest: the neighbours lie in the
/// caller's.
#[inline(never)]
fn search<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    nearest: &mut [Neighbour],
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    examples.visit_near(features, DISTANCE_LIMIT - 1, &mut |distance, label| {
        admit(nearest, Neighbour::new(distance, label)).distance()
    });
    let [next, neighbours @ ..] = nearest else { return Err(ClassifyError::KOutOfRange) };
    let (Some(&last), Some(&first)) = (neighbours.first(), neighbours.last()) else {
        return Err(ClassifyError::KOutOfRange);
    };
    if last == Neighbour::NONE {
        return Err(if first == last { ClassifyError::NoExamples } else { ClassifyError::TooFewExamples });
    }
    let mut ballot = Ballot { votes: [0; CLASSES], unknown: false };
    if next.distance() == last.distance() {
        // There are more than k within the last neighbour's distance, perhaps more than found room: all of them vote.
        examples.visit_near(features, last.distance(), &mut |_, label| {
            ballot.count(label);
            last.distance()
        });
    } else {
        for neighbour in neighbours.iter() {
            ballot.count(neighbour.label());
        }
    }
    ballot.decide(neighbours, first.distance(), radius)
}

/// Gives an example its place among the k + 1 nearest, farthest first, and returns the k-th nearest.
///
/// The nearest k vote; the one before them only tells whether more examples are as far as the k-th. It has one caller:
/// inline, it saves the 60 cycles of keeping the caller's registers.
#[inline(always)]
fn admit(nearest: &mut [Neighbour], candidate: Neighbour) -> Neighbour {
    let mut rest = &mut *nearest;
    while let [place, nearer @ ..] = rest {
        match nearer.first() {
            Some(&neighbour) if candidate.is_nearer(neighbour) => *place = neighbour,
            _ => {
                *place = candidate;
                break;
            }
        }
        rest = nearer;
    }
    nearest.get(1).copied().unwrap_or(candidate)
}

/// A distance of 24 bits above a label of 8, in two halves: AVR compares 16 bits faster than 32.
#[derive(Clone, Copy, PartialEq, Eq)]
struct Neighbour {
    upper: u16,
    lower: u16,
}

impl Neighbour {
    /// Farther than every example.
    const NONE: Self = Self::new(DISTANCE_LIMIT - 1, 0);

    const fn new(distance: u32, label: u8) -> Self {
        let key = (distance << 8) | label as u32;
        Self { upper: (key >> 16) as u16, lower: key as u16 }
    }

    const fn distance(self) -> u32 {
        (self.upper as u32) << 8 | (self.lower >> 8) as u32
    }

    const fn label(self) -> u8 {
        self.lower as u8
    }

    /// Whether it comes before `other`: by distance, then by label.
    const fn is_nearer(self, other: Self) -> bool {
        self.upper < other.upper || (self.upper == other.upper && self.lower < other.lower)
    }
}

/// The votes.
struct Ballot<const CLASSES: usize> {
    votes: [usize; CLASSES],
    /// Whether a voter's label is not a class.
    unknown: bool,
}

impl<const CLASSES: usize> Ballot<CLASSES> {
    fn count(&mut self, label: u8) {
        match self.votes.get_mut(usize::from(label)) {
            Some(votes) => *votes = votes.wrapping_add(1),
            None => self.unknown = true,
        }
    }

    /// The answer by these votes, with the neighbours farthest first.
    #[inline(always)]
    fn decide(self, neighbours: &[Neighbour], nearest: u32, radius: u32) -> Result<Answer<CLASSES>, ClassifyError> {
        let Self { votes, unknown: false } = self else { return Err(ClassifyError::UnknownLabel) };
        let mut most = 0;
        let mut label = 0;
        let mut tie = false;
        for (class, &votes) in votes.iter().enumerate() {
            if votes > most {
                (most, label, tie) = (votes, class as u8, false);
            } else if votes == most {
                tie = true;
            }
        }
        if tie {
            // Neighbours are sorted by distance and then by label, and the examples that found no room are behind them
            // in the same order: the first leading class met this way is the nearest, and the smallest among equals.
            // Where none is met, `label` is the smallest already.
            let mut labels = neighbours.iter().rev().map(|neighbour| neighbour.label());
            label = labels.find(|&label| votes.get(usize::from(label)) == Some(&most)).unwrap_or(label);
        }
        let kind = match (nearest > radius, tie) {
            (true, _) => Kind::Stranger,
            (false, true) => Kind::Tie,
            (false, false) => Kind::Known,
        };
        Ok(Answer { label, votes, nearest, kind })
    }
}
