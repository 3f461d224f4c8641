//! The example table in flash.

use control::{examples, features};
use knn::{Example, Examples};

avr_progmem::progmem! {
    static progmem TABLE: [Example<{ features::COUNT }>; examples::COUNT] = examples::EXAMPLES;
}

/// The built-in examples, read from flash one at a time.
pub struct InFlash;

impl Examples<{ features::COUNT }> for InFlash {
    fn len(&self) -> usize {
        examples::COUNT
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        (index < examples::COUNT).then(|| TABLE.load_at(index))
    }
}
