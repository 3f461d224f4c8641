//! Examples in SRAM, in an array of fixed capacity. They can be added and removed at run time.

use crate::{Example, Examples};

/// Up to `CAPACITY` examples in SRAM: `CAPACITY * (FEATURES + 1)` bytes and a `usize`.
///
/// ```
/// use knn::{Example, Examples, Table};
///
/// let mut table: Table<2, 1> = Table::new();
/// let first = Example::new([3, 4], 0);
/// let second = Example::new([5, 6], 1);
/// assert_eq!(table.add_example(first), Ok(()));
/// assert_eq!(table.add_example(second), Err(second), "a full table returns the example");
/// assert_eq!(table.remove(0), Some(first));
/// assert!(table.is_empty());
/// ```
#[derive(Clone, Debug)]
pub struct Table<const FEATURES: usize, const CAPACITY: usize> {
    examples: [Example<FEATURES>; CAPACITY],
    len: usize,
}

impl<const FEATURES: usize, const CAPACITY: usize> Table<FEATURES, CAPACITY> {
    /// An empty table, all zeros, so that a `static` one costs no flash. A capacity of 0 does not compile.
    #[must_use]
    pub const fn new() -> Self {
        const { assert!(CAPACITY > 0, "a table holds at least one example") };
        Self { examples: [Example::new([0; FEATURES], 0); CAPACITY], len: 0 }
    }

    /// Adds an example after the others.
    ///
    /// # Errors
    ///
    /// If the table is full, it returns the example and does not change.
    pub fn add_example(&mut self, example: Example<FEATURES>) -> Result<(), Example<FEATURES>> {
        let Some(free) = self.examples.get_mut(self.len) else {
            return Err(example);
        };
        *free = example;
        self.len += 1;
        Ok(())
    }

    /// Removes the example at `index`; later ones move up by one. `None` if there is no such example.
    pub fn remove(&mut self, index: usize) -> Option<Example<FEATURES>> {
        let tail = self.examples.get_mut(..self.len)?.get_mut(index..)?;
        let removed = *tail.first()?;
        tail.rotate_left(1);
        self.len -= 1;
        Some(removed)
    }

    /// Removes all examples.
    pub fn clear(&mut self) {
        self.len = 0;
    }

    /// The examples, oldest first.
    #[inline]
    #[must_use]
    pub fn as_slice(&self) -> &[Example<FEATURES>] {
        self.examples.get(..self.len).unwrap_or_default()
    }
}

impl<const FEATURES: usize, const CAPACITY: usize> Default for Table<FEATURES, CAPACITY> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const FEATURES: usize, const CAPACITY: usize> Examples<FEATURES> for Table<FEATURES, CAPACITY> {
    fn len(&self) -> usize {
        self.len
    }

    fn example(&self, index: usize) -> Option<Example<FEATURES>> {
        self.as_slice().get(index).copied()
    }
}
