//! Labelled examples, and the trait that searches them in any memory.
//!
//! Examples may be in flash, EEPROM or SRAM. The classifier asks a store to do one thing: to add its examples to the nearest found
//! so far. A store that returns examples one by one gets this search from the trait. A store with a faster way, such as an assembly
//! loop that reads flash, overrides [`Examples::keep_nearest`]. A pair of stores is a store.

use crate::{Nearest, Neighbour, squared_distance};

/// The label of an empty place.
pub const VACANT: u8 = u8::MAX;

/// A labelled example: its features, and its class.
///
/// In memory the features come first, then the label, for a search in assembly.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[repr(C)]
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

    /// Adds its examples that are near enough to `query` to the `nearest`. The result must be that of [`Nearest::join`] with each
    /// example, in any order, and distances must equal [`squared_distance`].
    #[inline]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        for example in (0..self.len()).filter_map(|index| self.example(index)) {
            nearest.join(example.neighbour_of(query));
        }
    }

    /// As [`keep_nearest`](Self::keep_nearest), for examples in another store's SRAM, if this store has a faster way for them.
    /// Skips those labelled [`VACANT`].
    #[inline]
    fn keep_nearest_of<const CLASSES: usize>(
        &self,
        others: &[Example<FEATURES>],
        query: &[u8; FEATURES],
        nearest: &mut Nearest<CLASSES>,
    ) {
        for example in others.iter().filter(|example| example.label != VACANT) {
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

    #[inline]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        for example in self {
            nearest.join(example.neighbour_of(query));
        }
    }
}

impl<const FEATURES: usize, const N: usize> Examples<FEATURES> for [Example<FEATURES>; N] {
    fn len(&self) -> usize {
        N
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        self.as_slice().get(index).copied()
    }

    #[inline]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        self.as_slice().keep_nearest(query, nearest)
    }
}

impl<const FEATURES: usize, Store: Examples<FEATURES> + ?Sized> Examples<FEATURES> for &Store {
    fn len(&self) -> usize {
        Examples::len(*self)
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        Examples::example(*self, index)
    }

    #[inline]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        (**self).keep_nearest(query, nearest)
    }

    #[inline]
    fn keep_nearest_of<const CLASSES: usize>(
        &self,
        others: &[Example<FEATURES>],
        query: &[u8; FEATURES],
        nearest: &mut Nearest<CLASSES>,
    ) {
        (**self).keep_nearest_of(others, query, nearest)
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

    #[inline]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; FEATURES], nearest: &mut Nearest<CLASSES>) {
        self.0.keep_nearest(query, nearest);
        self.1.keep_nearest(query, nearest);
    }
}
