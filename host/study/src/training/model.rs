//! A classifier like the firmware's, and its classes for detections.

use super::confusion::Confusion;
use super::table::Recorded;
use super::{Labelled, label_of};
use comfy_table::{CellAlignment, Table};
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
        let header = [
            "detection",
            "speed\nmm/s",
            "spacing\nmm",
            "hold\nmm",
            "answer",
            "votes\nplant",
            "votes\nweed",
            "nearest\nsquared",
            "kind",
            "label",
        ];
        let mut table = number_table(header, 0);
        for (index, Recorded { features, kind }) in objects.iter().enumerate() {
            let answer = self.answer(features)?;
            table.add_row([
                (index + 1).to_string(),
                features.speed_mm_s().to_string(),
                features.spacing_mm().to_string(),
                features.hold_mm().to_string(),
                format!("{:?}", class_of(&answer)).to_lowercase(),
                answer.votes[usize::from(label::PLANT)].to_string(),
                answer.votes[usize::from(label::WEED)].to_string(),
                answer.nearest.to_string(),
                format!("{:?}", answer.kind).to_lowercase(),
                kind.map_or(String::new(), |kind| kind.to_string()),
            ]);
        }
        for (index, column) in table.column_iter_mut().enumerate() {
            if matches!(index, 4 | 8 | 9) {
                column.set_cell_alignment(CellAlignment::Left);
            }
        }
        Ok(table)
    }

    /// The confusion matrix of `objects`.
    pub fn classify(&self, objects: &[Labelled]) -> Confusion {
        objects.iter().map(|object| (object.kind, self.class(&object.features))).collect()
    }
}

/// The objects as examples.
pub(super) fn quantised(scale: &Scale<COUNT>, objects: &[Labelled]) -> Vec<Example<COUNT>> {
    let example = |object: &Labelled| Example::new(scale.quantise(object.features.values()), label_of(object.kind));
    objects.iter().map(example).collect()
}

/// The answer of all other examples to the one at `index`.
pub(super) fn answer_of_others(
    examples: &[Example<COUNT>],
    index: usize,
    k: u8,
    radius: u32,
) -> Result<Answer<{ label::COUNT }>, ClassifyError> {
    let others = (&examples[..index], &examples[index + 1..]);
    classify(&others, &examples[index].features, k, radius)
}
