//! Labelled examples, and the trait of their stores.
//!
//! Examples may be in flash, EEPROM or SRAM. A store returns them one by one. A pair of stores is a store.

use crate::{Nearest, Neighbour, squared_distance};
use core::ops::Range;

/// A labelled example: its features, and its class.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Example<const FEATURES: usize> {
    /// The features, each scaled to a byte (see [`Scale::quantise`](crate::Scale::quantise)).
    pub features: [u8; FEATURES],
    /// The class: 0 for the first, `CLASSES - 1` for the last.
    pub label: u8,
}

impl<const FEATURES: usize> Example<FEATURES> {
    /// An example of the class `label`.
    #[must_use]
    pub const fn new(features: [u8; FEATURES], label: u8) -> Self {
        Self { features, label }
    }

    /// Its distance to `query`, and its class.
    #[inline]
    #[must_use]
    pub fn neighbour_of(&self, query: &[u8; FEATURES]) -> Neighbour {
        Neighbour::new(squared_distance(query, &self.features), self.label)
    }
}

/// A store of labelled examples.
///
/// Implemented for slices, arrays, [`Table`](crate::Table), references to stores, and pairs of stores, which are searched as one
/// set: `(&in_flash, &in_eeprom)`, or `(&a, (&b, &c))` for three.
///
/// ```
/// use knn::{Example, Examples};
///
/// let built_in = [Example::new([10, 10], 0), Example::new([200, 10], 1)];
/// let from_the_field = [Example::new([190, 30], 1)];
/// let both = (&built_in, &from_the_field);
/// assert_eq!(both.len(), 3);
/// assert_eq!(both.count(1), 2);
/// assert_eq!(both.example(2), Some(from_the_field[0]));
/// ```
pub trait Examples<const FEATURES: usize> {
    /// The number of examples.
    fn len(&self) -> usize;

    /// The example at `index`; `None` from [`len`](Self::len) on.
    fn example(&self, index: usize) -> Option<Example<FEATURES>>;

    /// Lets the examples of a range of indices join a search. A store whose examples are slow to load may leave one early: once its
    /// squared distance exceeds that of [`Nearest::reach`], it cannot be among the nearest.
    fn join<const CLASSES: usize>(&self, range: Range<usize>, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        for example in range.filter_map(|index| self.example(index)) {
            nearest.join(example.neighbour_of(query));
        }
    }

    /// Whether there are no examples.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The number of examples of one class.
    fn count(&self, label: u8) -> usize {
        (0..self.len()).filter_map(|index| self.example(index)).filter(|example| example.label == label).count()
    }
}

impl<const FEATURES: usize> Examples<FEATURES> for [Example<FEATURES>] {
    fn len(&self) -> usize {
        self.len()
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        self.get(index).copied()
    }
}

impl<const FEATURES: usize, const N: usize> Examples<FEATURES> for [Example<FEATURES>; N] {
    fn len(&self) -> usize {
        N
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        self.as_slice().get(index).copied()
    }
}

impl<const FEATURES: usize, Store: Examples<FEATURES> + ?Sized> Examples<FEATURES> for &Store {
    fn len(&self) -> usize {
        Examples::len(*self)
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        Examples::example(*self, index)
    }
}

/// Two stores searched as one; the second's examples follow the first's.
impl<const FEATURES: usize, First: Examples<FEATURES>, Second: Examples<FEATURES>> Examples<FEATURES>
    for (First, Second)
{
    fn len(&self) -> usize {
        self.0.len() + self.1.len()
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        match index.checked_sub(self.0.len()) {
            None => self.0.example(index),
            Some(index) => self.1.example(index),
        }
    }
}
