//! An example that the operator tells the machine on the console, a feature a line.

use crate::ground::features;

/// The features of an example that the operator tells, one after the other.
#[derive(Clone, Debug)]
pub struct ExampleEntry {
    features: [u8; features::COUNT],
    /// How many were told.
    count: u8,
}

impl ExampleEntry {
    /// Nothing.
    pub const NONE: Self = Self { features: [0; features::COUNT], count: 0 };

    /// Takes the next feature. One more than there are is none of any example.
    pub fn add(&mut self, feature: u8) {
        if let Some(next) = self.features.get_mut(usize::from(self.count)) {
            *next = feature;
        }
        self.count = self.count.saturating_add(1);
    }

    /// The features, if they were told, all and no more. The next example begins anew in any case.
    pub fn take(&mut self) -> Option<[u8; features::COUNT]> {
        let count = core::mem::take(&mut self.count);
        (usize::from(count) == features::COUNT).then_some(self.features)
    }
}
