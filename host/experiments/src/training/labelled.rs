//! A labelled detection.

use control::ground::{class::label, features::Features};
use field::row::Kind;

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
