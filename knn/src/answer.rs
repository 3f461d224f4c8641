//! The result of a search, and the errors.

/// The largest k.
pub const MAX_K: u8 = 15;

/// How reliable an answer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kind {
    /// One class has more votes than any other, and its nearest example is within the radius.
    Known,
    /// Two or more classes share the most votes; the nearest example of the one that is named is within the radius.
    Tie,
    /// The nearest example of the named class is farther than the radius: none of that class is similar.
    Stranger,
}

/// The class of a query, and its votes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Answer<const CLASSES: usize> {
    /// The class with the most votes; among equals the one with the nearest example. For a [`Kind::Tie`] or a [`Kind::Stranger`] it
    /// is only the best guess.
    pub label: u8,
    /// The votes of each class: k in all.
    pub votes: [u8; CLASSES],
    /// The squared distance to the nearest example of that class (see [`squared_distance`](crate::squared_distance)).
    pub nearest: u32,
    /// How reliable the answer is.
    pub kind: Kind,
}

/// Why there is no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum ClassifyError {
    /// k is 0 or above [`MAX_K`].
    KOutOfRange,
    /// There are no examples.
    NoExamples,
    /// There are examples, but fewer than k.
    TooFewExamples,
    /// A voting example's label is not below the number of classes.
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
