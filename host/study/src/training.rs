//! Training of the classifier: from labelled detections of plants and tall weeds to the firmware's example table.
//!
//! [`table`] reads labelled detections from CSV files, and [`synthetic`] gets some from simulated rows. [`train`] makes
//! the table. [`condense`] chooses its few examples, and [`Confusion`] counts the errors. [`listing`] writes a table as
//! Rust or CSV, and [`regions`] draws its decisions.
//!
//! The crate `knn` makes all decisions, on the same bytes as on the machine. So measurements here are valid there. The
//! training selects among the options of that crate (scale, radius, k, examples), and has no other classifier.

pub mod condense;
mod confusion;
pub mod listing;
mod model;
pub mod regions;
pub mod synthetic;
pub mod table;

pub use self::confusion::Confusion;
pub use self::model::{Model, class_of};
pub use knn::MAX_K;

use self::model::{answer_of_others, quantised};
use anyhow::{Context, Result, anyhow, ensure};
use control::ground::{
    class::{Class, label},
    examples,
    features::{COUNT, Features},
};
use field::counted;
use field::row::Kind;
use knn::{Example, Range, Scale, squared_distance};

/// A detection with a known kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Labelled {
    /// The measured features.
    pub features: Features,
    /// Its true kind.
    pub kind: Kind,
}

/// The label for a kind in an example.
pub const fn label_of(kind: Kind) -> u8 {
    match kind {
        Kind::Plant => label::PLANT,
        Kind::Weed => label::WEED,
    }
}

/// Most examples that the firmware's flash budget has room for.
pub const MOST_EXAMPLES: usize = examples::CAPACITY;

/// Default maximum of examples. It suffices for the simulated field, and each example makes the search longer.
pub const DEFAULT_MOST_EXAMPLES: usize = 64;

/// The result of a training, with its accuracy.
#[derive(Clone, Debug)]
pub struct Training {
    /// The values of each feature that map onto 0 and 255.
    pub ranges: [Range; COUNT],
    /// Squared distance beyond which no example is near enough.
    pub radius: u32,
    /// Examples that vote.
    pub k: u8,
    /// Detections that Wilson's rule removed.
    pub edited_out: usize,
    /// The table: the detections that were chosen as examples.
    pub kept: Vec<Labelled>,
    /// All detections, each classified by all others.
    pub leave_one_out: Confusion,
    /// All detections, classified by the table.
    pub by_table: Confusion,
}

impl Training {
    /// The table as a classifier.
    pub fn model(&self) -> Model {
        let scale = Scale::new(self.ranges);
        Model { scale, radius: self.radius, k: self.k, examples: quantised(&scale, &self.kept) }
    }

    /// How many more plants are unknown by the table than by leave-one-out. `None` if these are at most a fifth of all.
    pub fn forgotten(&self) -> Option<usize> {
        let more = self.by_table.plants_unknown().saturating_sub(self.leave_one_out.plants_unknown());
        (5 * more > self.by_table.count(Kind::Plant)).then_some(more)
    }
}

const NO_OBJECTS: &str = "there are no detections to learn from: label some plants and some weeds";

/// A detection is a stranger if it is farther from every example than nearly all detections are from their nearest
/// neighbour of the same class. These are the share that is nearly all, and the factor of the squared distance (twice
/// as far).
const FELLOW_QUANTILE: f64 = 0.99;
const FELLOW_FACTOR: u32 = 4;

/// For nearly all detections, the radius must also not exceed half the distance to the other class (a quarter of the
/// squared distance).
const ENEMY_QUANTILE: f64 = 0.01;
const ENEMY_DIVISOR: u32 = 4;

/// Trains from detections, and condenses them to at most `most` examples.
///
/// - **Scale**: [`Scale::learn_ranges`] of all detections.
/// - **Radius**: four times the 99 % quantile of the squared distances from each detection to the nearest other of its
///   class. It is at most a quarter of the 1 % quantile of the distances to the nearest of the other class. Noise does
///   not count.
/// - **k**, if none is given: each odd k is tried by leaving one detection out and classifying it by all others. The
///   best k has the fewest plants classified as weeds, then the fewest weeds left, then the fewest unknown plants. Among equals the smallest from 3 on wins: with a k of 1 a single detection with a wrong label
///   decides. A k is passed over if its table has no room, or cuts more plants than all detections together.
/// - **Examples**: see [`condense`].
///
/// # Errors
/// If the detections teach nothing; says what would help.
pub fn train(objects: &[Labelled], k: Option<u8>, most: usize) -> Result<Training> {
    let first = objects.first().context(NO_OBJECTS)?;
    let is_mixed = objects.iter().any(|object| object.kind != first.kind);
    ensure!(is_mixed, "all detections are of the class {}: label some of the other class too", first.kind);
    let fewest = k.unwrap_or(1);
    ensure!((1..=MAX_K).contains(&fewest), "k is {fewest}: it has to be 1 to {MAX_K}");
    ensure!(
        objects.len() > usize::from(fewest),
        "there are {} detections, too few for a vote of {fewest}: label more, or choose a smaller --k",
        objects.len()
    );

    let values: Vec<[i16; COUNT]> = objects.iter().map(|object| *object.features.values()).collect();
    let ranges = Scale::learn_ranges(&values).context(NO_OBJECTS)?;
    let examples = quantised(&Scale::new(ranges), objects);
    let edited = condense::edit(&examples);
    let radius = learn_radius(&examples, &edited);
    let votes = k.map_or_else(|| (3..=MAX_K).step_by(2).chain([1]).collect(), |k| vec![k]);
    let votes = votes.into_iter().filter(|&k| usize::from(k) < objects.len());
    let mut tried: Vec<(u8, Confusion)> = votes.map(|k| (k, leave_one_out(&examples, objects, k, radius))).collect();
    // It keeps the order of equals.
    tried.sort_by_key(|(_, leave_one_out)| leave_one_out.harm());
    let mut refused = None;
    for (k, leave_one_out) in tried {
        let kept = match condense::condense(&examples, &edited, k, radius, most) {
            Ok(kept) => kept,
            Err(error) => {
                refused.get_or_insert(error);
                continue;
            }
        };
        let mut training = Training {
            ranges,
            radius,
            k,
            edited_out: examples.len() - edited.len(),
            kept: kept.into_iter().map(|index| objects[index]).collect(),
            leave_one_out,
            by_table: Confusion::default(),
        };
        training.by_table = training.model().classify(objects);
        match training.by_table.plants_taken_for_weeds().saturating_sub(leave_one_out.plants_taken_for_weeds()) {
            0 => return Ok(training),
            plants => {
                refused.get_or_insert_with(|| {
                    let plants = counted(plants, "plant");
                    anyhow!("with a vote of {k}, so few examples cut {plants} that all detections together spare: choose a smaller --k, or label more")
                });
            }
        }
    }
    Err(refused.context(NO_OBJECTS)?)
}

/// Into how many parts the detections are divided, to hold out one after the other.
const PARTS: usize = 5;

/// Detections that a table was not learned from: each fifth of them, classified by a table of the others.
///
/// # Errors
/// As [`train`], if four fifths teach nothing.
pub fn held_out(objects: &[Labelled], k: Option<u8>, most: usize) -> Result<Confusion> {
    let mut classified = Vec::new();
    for part in 0..PARTS {
        let in_part = |index: &usize| index % PARTS == part;
        let (held, rest): (Vec<usize>, Vec<usize>) = (0..objects.len()).partition(in_part);
        let rest: Vec<Labelled> = rest.into_iter().map(|index| objects[index]).collect();
        let model = train(&rest, k, most)?.model();
        classified.extend(held.into_iter().map(|index| (objects[index].kind, model.class(&objects[index].features))));
    }
    Ok(classified.into_iter().collect())
}

/// Examples to teach in the field, in addition to the built-in ones.
#[derive(Clone, Debug)]
pub struct Beside {
    /// The chosen detections.
    pub chosen: Vec<Labelled>,
    /// All detections, classified by the built-in examples alone.
    pub before: Confusion,
    /// All detections, classified by both together.
    pub after: Confusion,
}

/// Chooses at most `most` of the detections to teach in addition to the built-in table, on its scale and with its
/// radius and k. No plant may be classified as a weed, and as many weeds as possible are recognised
/// ([`condense::beside`]).
///
/// # Errors
/// If there is no detection, or `most` is too few.
pub fn beside(objects: &[Labelled], k: Option<u8>, most: usize) -> Result<Beside> {
    ensure!(!objects.is_empty(), NO_OBJECTS);
    let mut model = Model::built_in();
    let before = model.classify(objects);
    model.k = k.unwrap_or(model.k);
    let examples = quantised(&model.scale, objects);
    let chosen = condense::beside(&model.examples, &examples, model.k, model.radius, most)?;
    model.examples.extend(chosen.iter().map(|&index| examples[index]));
    let after = model.classify(objects);
    Ok(Beside { chosen: chosen.into_iter().map(|index| objects[index]).collect(), before, after })
}

/// The radius, from the distances within one class and between both. `edited` has the indices of those without noise.
fn learn_radius(examples: &[Example<COUNT>], edited: &[usize]) -> u32 {
    let distances = |of_one_class: bool| {
        let nearest = |&index: &usize| {
            let one = &examples[index];
            let others = edited.iter().filter(|&&other| other != index).map(|&other| &examples[other]);
            let wanted = others.filter(|other| (other.label == one.label) == of_one_class);
            wanted.map(|other| squared_distance(&one.features, &other.features)).min()
        };
        edited.iter().filter_map(nearest).collect::<Vec<u32>>()
    };
    let near = quantile(distances(true), FELLOW_QUANTILE).map_or(0, |distance| distance * FELLOW_FACTOR);
    let far = quantile(distances(false), ENEMY_QUANTILE).map_or(u32::MAX, |distance| distance / ENEMY_DIVISOR);
    // Rounding to bytes moves a detection by up to one in each feature. That alone must not make a stranger.
    near.min(far).max(COUNT as u32)
}

/// The value that a share of all does not exceed; `None` without values.
fn quantile(mut values: Vec<u32>, share: f64) -> Option<u32> {
    values.sort_unstable();
    values.get((values.len() as f64 * share) as usize).copied()
}

/// Each detection classified by all others.
fn leave_one_out(examples: &[Example<COUNT>], objects: &[Labelled], k: u8, radius: u32) -> Confusion {
    let class = |index| answer_of_others(examples, index, k, radius).map_or(Class::Unknown, |answer| class_of(&answer));
    objects.iter().enumerate().map(|(index, object)| (object.kind, class(index))).collect()
}
