//! Learning to tell plants from tall weeds: from labelled objects to the example table that the firmware carries.
//!
//! [`table`] reads objects with their labels from CSV files, and [`synthetic`] meets some on simulated rows. [`train`]
//! makes the table of them, [`condense`] chooses the few that it holds, and [`Confusion`] counts who was taken for whom.
//! [`listing`] writes a table down as Rust or CSV, and [`regions`] draws what it decides.
//!
//! Everything is decided by the crate `knn` on the same bytes as on the machine, so that what is measured here holds
//! there. The training chooses among what the crate offers (scale, radius, k, examples) and knows no other classifier.

pub mod condense;
mod confusion;
mod labelled;
pub mod listing;
mod model;
pub mod regions;
pub mod synthetic;
pub mod table;

pub use self::confusion::Confusion;
pub use self::labelled::{Labelled, label_of};
pub use self::model::{Model, class_of};
pub use knn::MAX_K;

use self::model::{answer_of_others, quantised};
use anyhow::{Context, Result, bail, ensure};
use control::ground::{class::Class, examples, features::COUNT};
use field::counted;
use knn::{Example, Range, Scale, squared_distance};

/// Most examples that the firmware's flash budget has room for.
pub const MOST_EXAMPLES: usize = examples::CAPACITY;

/// Most examples where nobody asks for more: enough for the simulated field, and each makes the search longer.
pub const DEFAULT_MOST_EXAMPLES: usize = 64;

/// What the training learned, and how well.
#[derive(Clone, Debug)]
pub struct Training {
    /// The values of each feature that map onto 0 and 255.
    pub ranges: [Range; COUNT],
    /// Squared distance beyond which a detection is like no example.
    pub radius: u32,
    /// Examples that vote.
    pub k: u8,
    /// Objects that Wilson's rule took out.
    pub edited_out: usize,
    /// The table: the objects that were kept as examples.
    pub kept: Vec<Labelled>,
    /// All objects, each classified by all others.
    pub leave_one_out: Confusion,
    /// All objects, classified by the table.
    pub by_table: Confusion,
}

impl Training {
    /// The table as a classifier.
    pub fn model(&self) -> Model {
        let scale = Scale::new(self.ranges);
        Model { scale, radius: self.radius, k: self.k, examples: quantised(&scale, &self.kept) }
    }
}

const NO_OBJECTS: &str = "there are no objects to learn from: label some plants and some weeds";

/// An object is a stranger when it is farther from every example than nearly all objects are from their nearest fellow:
/// the share that is nearly all, and how much farther, as a factor of the squared distance (twice as far).
const FELLOW_QUANTILE: f64 = 0.99;
const FELLOW_FACTOR: u32 = 4;

/// Nor may the radius reach more than half way to the other class (a quarter of the squared distance), for nearly all.
const ENEMY_QUANTILE: f64 = 0.01;
const ENEMY_DIVISOR: u32 = 4;

/// Learns from objects, and condenses them to at most `most` examples.
///
/// - **Scale**: [`Scale::learn_ranges`] of all objects.
/// - **Radius**: four times the 99 % quantile of the squared distances from each object to the nearest other of its
///   class, but at most a quarter of the 1 % quantile of those to the nearest of the other class. Noise does not count.
/// - **k**, where none is given: each odd k is tried by leaving one object out and asking all others. The best has the
///   fewest plants taken for weeds, then the fewest weeds taken for plants, then the fewest plants unknown. Among
///   equals the smallest from 3 on wins: with a k of 1 a single object with a wrong label decides.
/// - **Examples**: see [`condense`].
///
/// # Errors
/// Where there is nothing to be learned, with what would help.
pub fn train(objects: &[Labelled], k: Option<u8>, most: usize) -> Result<Training> {
    let first = objects.first().context(NO_OBJECTS)?;
    let is_mixed = objects.iter().any(|object| object.kind != first.kind);
    ensure!(is_mixed, "all objects are of the class {}: label some of the other class too", first.kind);
    let fewest = k.unwrap_or(1);
    ensure!((1..=MAX_K).contains(&fewest), "k is {fewest}: it has to be 1 to {MAX_K}");
    ensure!(
        objects.len() > usize::from(fewest),
        "there are {} objects, too few for a vote of {fewest}: label more, or choose a smaller --k",
        objects.len()
    );

    let values: Vec<[i32; COUNT]> = objects.iter().map(|object| object.features.values()).collect();
    let ranges = Scale::learn_ranges(&values).context(NO_OBJECTS)?;
    let examples = quantised(&Scale::new(ranges), objects);
    let edited = condense::edit(&examples);
    let radius = learn_radius(&examples, &edited);
    let left_out = |k| leave_one_out(&examples, objects, k, radius);
    let (k, leave_one_out) = match k {
        Some(k) => (k, left_out(k)),
        // `min_by_key` keeps the first among equals.
        None => (3..=MAX_K)
            .step_by(2)
            .chain([1])
            .filter(|&k| usize::from(k) < objects.len())
            .map(|k| (k, left_out(k)))
            .min_by_key(|(_, confusion)| confusion.harm())
            .context(NO_OBJECTS)?,
    };
    let kept = condense::condense(&examples, &edited, k, radius, most)?;
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
        0 => Ok(training),
        plants => bail!(
            "with a vote of {k}, so few examples cut {} that all objects together spare: choose a smaller --k",
            counted(plants, "plant")
        ),
    }
}

/// Examples that are taught in the field, beside the built-in ones.
#[derive(Clone, Debug)]
pub struct Beside {
    /// The objects that were chosen.
    pub chosen: Vec<Labelled>,
    /// All objects, classified by the built-in examples alone.
    pub before: Confusion,
    /// All objects, classified by both together.
    pub after: Confusion,
}

/// Chooses at most `most` of the objects to be taught beside the built-in table, on its scale and with its radius and k: so that no
/// plant is taken for a weed, and as many weeds as can be are known ([`condense::beside`]).
///
/// # Errors
/// Where there is no object, or more would be needed.
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

/// The radius, from the distances between objects of one class and of both, of those whose places are `edited`.
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
    // Rounding to bytes moves an object by up to one in each feature: that alone makes no stranger.
    near.min(far).max(COUNT as u32)
}

/// The value that a share of all does not exceed; `None` of nothing.
fn quantile(mut values: Vec<u32>, share: f64) -> Option<u32> {
    values.sort_unstable();
    values.get((values.len() as f64 * share) as usize).copied()
}

/// Each object classified by all others.
fn leave_one_out(examples: &[Example<COUNT>], objects: &[Labelled], k: u8, radius: u32) -> Confusion {
    let class = |index| answer_of_others(examples, index, k, radius).map_or(Class::Unknown, |answer| class_of(&answer));
    objects.iter().enumerate().map(|(index, object)| (object.kind, class(index))).collect()
}
