//! Compares the classifier with a plain one in floats, with smartcore's, and with itself after reordering the examples.
//!
//! Features come from few values, or from the extremes, as often as from all bytes. Then equal distances are common, which the
//! rule for them needs.

use knn::{Answer, ClassifyError, Example, Examples, Kind, MAX_K, Nearest, Neighbour, Scale, Table, classify};
use proptest::prelude::*;
use smartcore::{
    dataset::iris,
    linalg::basic::matrix::DenseMatrix,
    metrics::distance::Distances,
    neighbors::knn_classifier::{KNNClassifier, KNNClassifierParameters},
};

/// The documented rules in floats: sort all by distance, the greatest label first, take k, count.
fn reference<const FEATURES: usize, const CLASSES: usize>(
    examples: &[Example<FEATURES>],
    query: &[u8; FEATURES],
    k: u8,
    radius: u32,
) -> Result<Answer<CLASSES>, ClassifyError> {
    let k = usize::from(k);
    if !(1..=15).contains(&k) {
        return Err(ClassifyError::KOutOfRange);
    }
    if examples.is_empty() {
        return Err(ClassifyError::NoExamples);
    }
    if examples.len() < k {
        return Err(ClassifyError::TooFewExamples);
    }
    let mut sorted: Vec<(f64, u8)> =
        examples.iter().map(|example| (float_distance(example, query), example.label)).collect();
    sorted.sort_by(|left, right| left.0.total_cmp(&right.0).then(right.1.cmp(&left.1)));
    let voters = &sorted[..k];
    if voters.iter().any(|&(_, label)| usize::from(label) >= CLASSES) {
        return Err(ClassifyError::UnknownLabel);
    }
    let votes: [u8; CLASSES] =
        std::array::from_fn(|class| voters.iter().filter(|&&(_, label)| usize::from(label) == class).count() as u8);
    let most = votes.into_iter().max().expect("there are classes");
    let leads = |label: u8| votes[usize::from(label)] == most;
    let label = voters.iter().map(|&(_, label)| label).find(|&label| leads(label)).expect("a class leads");
    let nearest = voters.iter().find(|voter| voter.1 == label).expect("it has votes").0;
    let kind = if nearest > f64::from(radius) {
        Kind::Stranger
    } else if votes.into_iter().filter(|&votes| votes == most).count() > 1 {
        Kind::Tie
    } else {
        Kind::Known
    };
    Ok(Answer { label, votes, nearest: nearest as u32, kind })
}

fn float_distance<const FEATURES: usize>(example: &Example<FEATURES>, query: &[u8; FEATURES]) -> f64 {
    example.features.iter().zip(query).map(|(&left, &right)| (f64::from(left) - f64::from(right)).powi(2)).sum()
}

/// The most features in a test. A test with fewer takes the first ones.
const MOST: usize = 8;

fn features() -> impl Strategy<Value = [u8; MOST]> {
    prop_oneof![
        proptest::array::uniform(any::<u8>()),
        proptest::array::uniform(100_u8..104),
        proptest::array::uniform(prop_oneof![Just(0_u8), Just(255)]),
    ]
}

/// Examples whose labels are mostly, but not always, below 4.
fn examples() -> impl Strategy<Value = Vec<Example<MOST>>> {
    let label = prop_oneof![60 => 0_u8..2, 20 => 0_u8..4, 1 => any::<u8>()];
    proptest::collection::vec((features(), label).prop_map(|(features, label)| Example::new(features, label)), 0..60)
}

fn radius() -> impl Strategy<Value = u32> {
    prop_oneof![0_u32..30, 0_u32..600_000, Just(u32::MAX)]
}

fn first<const FEATURES: usize>(features: &[u8; MOST]) -> [u8; FEATURES] {
    std::array::from_fn(|feature| features[feature])
}

fn first_of_all<const FEATURES: usize>(examples: &[Example<MOST>]) -> Vec<Example<FEATURES>> {
    examples.iter().map(|example| Example::new(first(&example.features), example.label)).collect()
}

fn is_that_of_a_plain_classifier<const FEATURES: usize>(
    examples: &[Example<MOST>],
    query: &[u8; MOST],
    k: u8,
    radius: u32,
) -> Result<(), TestCaseError> {
    let (examples, query) = (&first_of_all::<FEATURES>(examples)[..], &first(query));
    prop_assert_eq!(classify::<FEATURES, 2>(examples, query, k, radius), reference(examples, query, k, radius));
    prop_assert_eq!(classify::<FEATURES, 3>(examples, query, k, radius), reference(examples, query, k, radius));
    prop_assert_eq!(classify::<FEATURES, 4>(examples, query, k, radius), reference(examples, query, k, radius));
    Ok(())
}

fn is_the_same_by_every_store<const FEATURES: usize>(
    examples: &[Example<MOST>],
    shuffled: &[Example<MOST>],
    split: prop::sample::Index,
    query: &[u8; MOST],
    k: u8,
    radius: u32,
) -> Result<(), TestCaseError> {
    let (examples, shuffled) = (first_of_all::<FEATURES>(examples), first_of_all::<FEATURES>(shuffled));
    let query = first(query);
    let answer = classify::<FEATURES, 3>(examples.as_slice(), &query, k, radius);
    prop_assert_eq!(classify(shuffled.as_slice(), &query, k, radius), answer);
    let (left, right) = shuffled.split_at(split.index(shuffled.len() + 1));
    prop_assert_eq!(classify(&(left, right), &query, k, radius), answer);
    let mut table: Table<FEATURES, 60> = Table::new();
    for &example in right {
        prop_assert_eq!(table.add_example(example), Ok(()));
    }
    prop_assert_eq!(classify(&(&table, left), &query, k, radius), answer);
    prop_assert_eq!(classify(&OneByOne(&shuffled), &query, k, radius), answer);
    let nearest: &mut Nearest<3> = &mut Nearest::<3, _>::new([Neighbour::new(99, 1); MAX_K as usize]);
    for _ in 0..2 {
        prop_assert_eq!(nearest.begin(k), Ok(()));
        left.iter().chain(right).for_each(|example| nearest.join(example.neighbour_of(&query)));
        prop_assert_eq!(nearest.answer(radius), answer);
        prop_assert_eq!(nearest.answer(radius), answer);
    }
    Ok(())
}

proptest! {
    #[test]
    fn the_answer_is_that_of_a_plain_float_classifier(
        examples in examples(), query in features(), k in 0_u8..18, radius in radius(),
    ) {
        use self::is_that_of_a_plain_classifier as holds;
        for holds in [holds::<1>, holds::<2>, holds::<3>, holds::<4>, holds::<5>, holds::<6>, holds::<7>, holds::<8>] {
            holds(&examples, &query, k, radius)?;
        }
    }

    #[test]
    fn neither_order_nor_store_changes_the_answer(
        (examples, shuffled) in
            examples().prop_flat_map(|examples| (Just(examples.clone()), Just(examples).prop_shuffle())),
        split in any::<prop::sample::Index>(), query in features(), k in 1_u8..=MAX_K, radius in radius(),
    ) {
        use self::is_the_same_by_every_store as holds;
        for holds in [holds::<1>, holds::<2>, holds::<3>, holds::<4>, holds::<5>, holds::<6>, holds::<7>, holds::<8>] {
            holds(&examples, &shuffled, split, &query, k, radius)?;
        }
    }
}

/// A store of another type.
struct OneByOne<'a, const FEATURES: usize>(&'a [Example<FEATURES>]);

impl<const FEATURES: usize> Examples<FEATURES> for OneByOne<'_, FEATURES> {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        self.0.get(index).copied()
    }
}

/// Whether the example after the k-th is as far as the k-th. Which of them votes is then a rule of its own.
fn has_level<const FEATURES: usize>(examples: &[Example<FEATURES>], query: &[u8; FEATURES], k: u8) -> bool {
    let mut distances: Vec<f64> = examples.iter().map(|example| float_distance(example, query)).collect();
    distances.sort_by(f64::total_cmp);
    distances.get(usize::from(k)) == distances.get(usize::from(k) - 1)
}

/// smartcore's class for `query`.
fn smartcore_class<const FEATURES: usize>(examples: &[Example<FEATURES>], query: &[u8; FEATURES], k: u8) -> u32 {
    let floats = |features: &[u8; FEATURES]| features.iter().copied().map(f64::from).collect::<Vec<_>>();
    let rows: Vec<Vec<f64>> = examples.iter().map(|example| floats(&example.features)).collect();
    let labels: Vec<u32> = examples.iter().map(|example| u32::from(example.label)).collect();
    let rows = DenseMatrix::from_2d_vec(&rows).expect("rows of one length");
    let parameters =
        KNNClassifierParameters::default().with_k(usize::from(k)).with_distance(Distances::euclidian::<f64>());
    let classifier = KNNClassifier::fit(&rows, &labels, parameters).expect("rows and labels match");
    let query = DenseMatrix::from_2d_vec(&vec![floats(query)]).expect("one row");
    classifier.predict(&query).expect("as many columns as the rows")[0]
}

#[test]
fn on_fishers_irises_smartcore_gives_the_same_classes_and_few_are_wrong() {
    let irises = iris::load_dataset();
    let rows: Vec<[i16; 4]> = irises
        .data
        .chunks_exact(4)
        .map(|row| std::array::from_fn(|feature| (f64::from(row[feature]) * 10.0).round() as i16))
        .collect();
    let scale = Scale::learn(&rows).expect("there are rows");
    let examples: Vec<Example<4>> =
        rows.iter().zip(&irises.target).map(|(row, &label)| Example::new(scale.quantise(row), label as u8)).collect();
    assert_eq!(examples.len(), 150);
    let mut compared = 0;
    let mut wrong = 0;
    for left_out in 0..examples.len() {
        let mut others = examples.clone();
        let query = others.remove(left_out);
        let answer: Answer<3> = classify(others.as_slice(), &query.features, 5, u32::MAX).unwrap();
        if answer.kind == Kind::Known && !has_level(&others, &query.features, 5) {
            assert_eq!(u32::from(answer.label), smartcore_class(&others, &query.features, 5));
            compared += 1;
        }
        wrong += usize::from(answer.label != query.label);
    }
    assert!(compared > 100, "{compared} of 150 had neither a tie nor level neighbours");
    assert!(wrong <= 9, "{wrong} of 150 irises were taken for another kind");
}

proptest! {
    #[test]
    fn smartcore_gives_the_same_class_without_a_tie(
        examples in proptest::collection::vec(
            (any::<[u8; 5]>(), 0_u8..3).prop_map(|(features, label)| Example::new(features, label)), 15..60),
        query in any::<[u8; 5]>(), k in 3_u8..=MAX_K,
    ) {
        let answer: Answer<3> = classify(examples.as_slice(), &query, k, u32::MAX).expect("k examples or more");
        prop_assume!(answer.kind == Kind::Known && !has_level(&examples, &query, k));
        prop_assert_eq!(u32::from(answer.label), smartcore_class(&examples, &query, k));
    }
}

#[test]
fn of_examples_at_the_same_distance_the_greater_label_is_nearer() {
    let level = [([1, 0], 0), ([0, 1], 1)].map(|(features, label)| Example::new(features, label));
    let near = [Example::new([0, 0], 1)];
    let answer: Answer<2> = classify(&(&near, &level), &[0, 0], 2, 0).unwrap();
    assert_eq!(answer, Answer { label: 1, votes: [0, 2], nearest: 0, kind: Kind::Known });
    let answer: Answer<2> = classify(&level, &[0, 0], 1, u32::MAX).unwrap();
    assert_eq!(answer, Answer { label: 1, votes: [0, 1], nearest: 1, kind: Kind::Known });
}

#[test]
fn a_tie_names_the_class_of_the_nearest_example() {
    let examples = [Example::new([9], 0), Example::new([12], 1)];
    let answer: Answer<2> = classify(&examples, &[11], 2, u32::MAX).unwrap();
    assert_eq!(answer, Answer { label: 1, votes: [1, 1], nearest: 1, kind: Kind::Tie });
}

#[test]
fn a_tie_of_level_examples_names_the_greatest_label() {
    let examples = [Example::new([12], 2), Example::new([10], 1)];
    let answer: Answer<3> = classify(&examples, &[11], 2, u32::MAX).unwrap();
    assert_eq!(answer, Answer { label: 2, votes: [0, 1, 1], nearest: 1, kind: Kind::Tie });
}

#[test]
fn a_stranger_is_beyond_the_radius_and_not_at_it() {
    let examples = [Example::new([10], 0)];
    let kind = |radius| classify::<1, 1>(&examples, &[13], 1, radius).unwrap().kind;
    assert_eq!(kind(9), Kind::Known);
    assert_eq!(kind(8), Kind::Stranger);
}

#[test]
fn the_farthest_of_258_features_is_still_a_neighbour() {
    let examples = [Example::new([255; 258], 0)];
    let answer: Answer<1> = classify(&examples, &[0; 258], 1, u32::MAX).unwrap();
    assert_eq!(answer.nearest, 258 * 255 * 255);
}

#[test]
fn an_impossible_question_is_an_error_and_not_a_class() {
    let one = [Example::new([1], 0)];
    assert_eq!(classify::<1, 2>(&one, &[1], 0, 0), Err(ClassifyError::KOutOfRange));
    assert_eq!(classify::<1, 2>(&one, &[1], 16, 0), Err(ClassifyError::KOutOfRange));
    assert_eq!(classify::<1, 2>(&one, &[1], 2, 0), Err(ClassifyError::TooFewExamples));
    assert_eq!(classify::<1, 2>(&one[..0], &[1], 1, 0), Err(ClassifyError::NoExamples));
    let erased = [Example::new([1], 255)];
    assert_eq!(classify::<1, 2>(&(&one, &erased), &[1], 1, 0), Err(ClassifyError::UnknownLabel));
}

#[test]
fn an_error_has_advice() {
    for (error, advice) in [
        (ClassifyError::KOutOfRange, "choose 1 to 15"),
        (ClassifyError::NoExamples, "add at least k"),
        (ClassifyError::TooFewExamples, "add examples or choose a smaller k"),
        (ClassifyError::UnknownLabel, "labels run from 0 to the number of classes less 1"),
    ] {
        assert!(error.to_string().ends_with(advice), "{error}");
    }
}

#[test]
fn an_invalid_label_is_an_error_only_among_the_nearest() {
    let at = |place: u8, label| Example::new([place], label);
    let answer = |examples: &[Example<1>]| classify::<1, 2>(examples, &[0], 3, u32::MAX).map(|answer| answer.votes);
    let far = [at(9, 1), at(9, 1), at(9, 7), at(9, 1)];
    assert_eq!(answer(&far), Err(ClassifyError::UnknownLabel));
    let near = [at(5, 0), at(5, 1), at(5, 1), at(5, 1), at(1, 0)];
    assert_eq!(answer(&[&far[..], &near].concat()), Ok([1, 2]));
    assert_eq!(answer(&[&near[..], &far].concat()), Ok([1, 2]));
}

#[test]
fn every_store_counts_and_returns_its_examples() {
    let examples = [[1], [2], [3]].map(|features| Example::new(features, features[0]));
    let [first, second, third] = examples;
    let mut table: Table<1, 4> = Table::new();
    for example in examples {
        assert_eq!(table.add_example(example), Ok(()));
    }
    fn check(store: &(impl Examples<1> + ?Sized), expected: &[Example<1>]) {
        assert_eq!((Examples::len(store), Examples::is_empty(store)), (expected.len(), expected.is_empty()));
        for index in 0..=expected.len() {
            assert_eq!(store.example(index), expected.get(index).copied(), "{index}");
        }
        assert_eq!(store.count(2), expected.iter().filter(|example| example.label == 2).count());
    }
    check(&examples, &examples);
    check(examples.as_slice(), &examples);
    check(&&examples, &examples);
    check(&table, &examples);
    check(&OneByOne(&examples), &examples);
    check(&(&table, &examples), &[first, second, third, first, second, third]);
    check(&(&examples[..1], &examples[1..]), &examples);
    check(&examples[..0], &[]);
    check(&(&examples[..0], &[] as &[Example<1>]), &[]);
}
