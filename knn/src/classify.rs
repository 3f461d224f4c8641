//! A complete search and its vote.

use crate::{Answer, ClassifyError, Examples, MAX_K, Nearest, Neighbour};

/// The class of `features`, by the vote of its `k` nearest examples.
///
/// - All examples that are as far as the k-th nearest vote, so that the order of the examples never matters.
/// - Each vote counts one, near or far; the class with the most votes wins (see [`Answer::label`] for ties).
/// - `radius` is a squared distance: if the nearest example is farther, the answer is a [`Kind::Stranger`](crate::Kind::Stranger)
///   with any votes. `u32::MAX` turns this off.
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
/// [`ClassifyError`] if k does not fit the number of examples, or a voter's label is not a class.
pub fn classify<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    k: u8,
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    // Clearing room for all 15 takes 200 cycles more than for 3 on an ATmega328P.
    match k {
        1..=3 => search(examples, features, k, &mut Nearest::<CLASSES, _>::new([Neighbour::NONE; 3]), radius),
        _ => search(examples, features, k, &mut Nearest::<CLASSES, _>::new([Neighbour::NONE; MAX_K as usize]), radius),
    }
}

/// [`classify`] with at least `k` places.
///
/// Out of line: AVR accesses the first 63 bytes of a stack frame by far the fastest. The places are in the caller's frame.
#[inline(never)]
fn search<const FEATURES: usize, const CLASSES: usize>(
    examples: &(impl Examples<FEATURES> + ?Sized),
    features: &[u8; FEATURES],
    k: u8,
    nearest: &mut Nearest<CLASSES>,
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    nearest.begin(k)?;
    examples.keep_nearest(features, nearest);
    nearest.answer(radius)
}
