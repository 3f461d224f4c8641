//! A complete search and its vote.

use crate::{Answer, ClassifyError, Examples, MAX_K, Nearest, Neighbour};

/// The class of `features`, by the vote of its `k` nearest examples.
///
/// - Of examples at the same distance, those with the greater label are nearer. So the order of the examples never matters. Give the
///   class that is the costlier to miss the greater label.
/// - Each vote counts one, near or far; the class with the most votes wins (see [`Answer::label`] for ties).
/// - `radius` is a squared distance: if the nearest example of the winning class is farther, the answer is a
///   [`Kind::Stranger`](crate::Kind::Stranger) with any votes. So far examples that outvote a similar one are not believed.
///   `u32::MAX` turns this off.
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
    let nearest: &mut Nearest<CLASSES> = &mut Nearest::<CLASSES, _>::new([Neighbour::NONE; MAX_K as usize]);
    nearest.begin(k)?;
    examples.join(0..examples.len(), features, nearest);
    nearest.answer(radius)
}
