//! A classifier like the firmware's, and its classes for detections.

use super::confusion::Confusion;
use super::table::Recorded;
use super::{Labelled, label_of};
use comfy_table::CellAlignment::{self, Left, Right};
use comfy_table::Table;
use control::ground::{
    class::{Class, label},
    examples,
    features::{COUNT, Features},
};
use knn::{Answer, ClassifyError, Example, Scale, classify};
use uno_run::report::number_table;

/// The machine's class for a classifier's answer.
pub const fn class_of<const CLASSES: usize>(answer: &Answer<CLASSES>) -> Class {
    match (answer.kind, answer.label) {
        (knn::Kind::Known, label::PLANT) => Class::Plant,
        (knn::Kind::Known, label::WEED) => Class::Weed,
        _ => Class::Unknown,
    }
}

/// A column of [`Model::table`]: its heading, and its cell for a detection with its number and its answer.
type Column = (&'static str, CellAlignment, fn(usize, &Recorded, &Answer<{ label::COUNT }>) -> String);

const COLUMNS: [Column; 10] = [
    ("detection", Right, |number, _, _| number.to_string()),
    ("speed\nmm/s", Right, |_, of, _| of.features.speed_mm_s().to_string()),
    ("spacing\nmm", Right, |_, of, _| of.features.spacing_mm().to_string()),
    ("hold\nmm", Right, |_, of, _| of.features.hold_mm().to_string()),
    ("answer", Left, |_, _, answer| format!("{:?}", class_of(answer)).to_lowercase()),
    ("votes\nplant", Right, |_, _, answer| answer.votes[usize::from(label::PLANT)].to_string()),
    ("votes\nweed", Right, |_, _, answer| answer.votes[usize::from(label::WEED)].to_string()),
    ("nearest\nsquared", Right, |_, _, answer| answer.nearest.to_string()),
    ("kind", Left, |_, _, answer| format!("{:?}", answer.kind).to_lowercase()),
    ("label", Left, |_, of, _| of.kind.map_or(String::new(), |kind| kind.to_string())),
];

/// A classifier: the examples as in `control::ground::examples`, with their k.
#[derive(Clone, Debug)]
pub struct Model {
    /// From features to bytes.
    pub scale: Scale<COUNT>,
    /// Squared distance beyond which no example is near enough.
    pub radius: u32,
    /// Examples that vote.
    pub k: u8,
    /// The examples.
    pub examples: Vec<Example<COUNT>>,
}

impl Model {
    /// The firmware's built-in table, with its default k.
    pub fn built_in() -> Self {
        Self { scale: examples::SCALE, radius: examples::RADIUS, k: examples::K, examples: examples::EXAMPLES.to_vec() }
    }

    /// The classifier's answer to an object.
    ///
    /// # Errors
    /// If k does not suit the number of examples.
    pub fn answer(&self, features: &Features) -> Result<Answer<{ label::COUNT }>, ClassifyError> {
        classify(self.examples.as_slice(), &self.scale.quantise(features.values()), self.k, self.radius)
    }

    /// The machine's class for a detection; unknown if the classifier has no answer.
    pub fn class(&self, features: &Features) -> Class {
        self.answer(features).map_or(Class::Unknown, |answer| class_of(&answer))
    }

    /// A line for each detection: its true kind, its class, and the votes.
    ///
    /// # Errors
    /// If k does not suit the number of examples.
    pub fn table(&self, objects: &[Recorded]) -> Result<Table, ClassifyError> {
        let mut table = number_table(COLUMNS.map(|(heading, ..)| heading), 0);
        for (column, (_, alignment, _)) in table.column_iter_mut().zip(COLUMNS) {
            column.set_cell_alignment(alignment);
        }
        for (number, object) in (1..).zip(objects) {
            let answer = self.answer(&object.features)?;
            table.add_row(COLUMNS.map(|(_, _, cell)| cell(number, object, &answer)));
        }
        Ok(table)
    }

    /// The confusion matrix of `objects`.
    pub fn classify(&self, objects: &[Labelled]) -> Confusion {
        objects.iter().map(|object| (object.kind, self.class(&object.features))).collect()
    }
}

pub(super) fn quantised(scale: &Scale<COUNT>, objects: &[Labelled]) -> Vec<Example<COUNT>> {
    let example = |object: &Labelled| Example::new(scale.quantise(object.features.values()), label_of(object.kind));
    objects.iter().map(example).collect()
}

pub(super) fn answer_of_others(
    examples: &[Example<COUNT>],
    index: usize,
    k: u8,
    radius: u32,
) -> Result<Answer<{ label::COUNT }>, ClassifyError> {
    let others = (&examples[..index], &examples[index + 1..]);
    classify(&others, &examples[index].features, k, radius)
}
