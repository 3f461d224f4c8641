//! An example that the operator enters on the console, one feature a line.

use crate::ground::features;

/// The features entered so far.
#[derive(Clone, Debug)]
pub struct ExampleEntry {
    features: [u8; features::COUNT],
    /// The number entered.
    count: u8,
}

impl ExampleEntry {
    /// Nothing entered.
    pub const NONE: Self = Self { features: [0; features::COUNT], count: 0 };

    /// Takes the next feature. More than five make the example invalid.
    pub fn add(&mut self, feature: u8) {
        if let Some(next) = self.features.get_mut(usize::from(self.count)) {
            *next = feature;
        }
        if usize::from(self.count) <= features::COUNT {
            self.count += 1;
        }
    }

    /// Returns the features if exactly five were entered, and clears the buffer.
    pub fn take(&mut self) -> Option<[u8; features::COUNT]> {
        let count = core::mem::take(&mut self.count);
        (usize::from(count) == features::COUNT).then_some(self.features)
    }
}
