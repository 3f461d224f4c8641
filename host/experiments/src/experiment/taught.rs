//! Serialises examples in a study's settings: the features and label of each. The classifier's crate also runs on the
//! chip, and has no serialisation.

use control::ground::features;
use knn::Example;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// The serialised form of an example.
type Written = ([u8; features::COUNT], u8);

pub fn serialize<S: Serializer>(examples: &[Example<{ features::COUNT }>], serializer: S) -> Result<S::Ok, S::Error> {
    examples.iter().map(|example| (example.features, example.label)).collect::<Vec<Written>>().serialize(serializer)
}

pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Vec<Example<{ features::COUNT }>>, D::Error> {
    let written = Vec::<Written>::deserialize(deserializer)?;
    Ok(written.into_iter().map(|(features, label)| Example::new(features, label)).collect())
}
