//! Examples in flash: the built-in ones, and tables of the benchmark.

use avr_progmem::{raw::read_byte, wrapper::ProgMem};
use control::ground::{examples, features};
use knn::{Example, Examples};

/// An example in flash: its features, then its label.
pub type Row = [u8; features::COUNT + 1];

avr_progmem::progmem! {
    static progmem BUILT_IN: [Row; examples::COUNT] = rows(&examples::EXAMPLES);
}

/// The built-in examples.
pub struct BuiltIn;

impl BuiltIn {
    /// The table.
    pub fn table() -> InFlash {
        InFlash::new(&BUILT_IN)
    }
}

impl Examples<{ features::COUNT }> for BuiltIn {
    fn len(&self) -> usize {
        examples::COUNT
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        Self::table().example(index)
    }
}

/// Examples as rows of a table in flash.
pub const fn rows<const N: usize>(examples: &[Example<{ features::COUNT }>; N]) -> [Row; N] {
    let mut rows = [[0; features::COUNT + 1]; N];
    let mut index = 0;
    while index < N {
        let Example { features: [a, b, c, d, e], label } = examples[index];
        rows[index] = [a, b, c, d, e, label];
        index += 1;
    }
    rows
}

/// Examples in flash, at most 254.
pub struct InFlash {
    /// The rows, sorted by their first feature, and their number.
    rows: *const Row,
    count: u8,
}

impl InFlash {
    /// The examples of a table.
    pub fn new<const N: usize>(table: &ProgMem<[Row; N]>) -> Self {
        const { assert!(N < u8::MAX as usize, "a byte counts the rows, and one more") };
        Self { rows: table.as_ptr().cast(), count: N as u8 }
    }
}

impl Examples<{ features::COUNT }> for InFlash {
    fn len(&self) -> usize {
        self.count.into()
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        (index < self.len()).then(|| {
            // SAFETY: the row belongs to the table, so it is in flash.
            let byte = |place| unsafe { read_byte(self.rows.cast::<u8>().wrapping_add(6 * index + place)) };
            Example::new([byte(0), byte(1), byte(2), byte(3), byte(4)], byte(5))
        })
    }
}
