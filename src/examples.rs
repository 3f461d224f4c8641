//! Examples in flash: the built-in ones, and tables of the benchmark.

use avr_progmem::{raw::read_byte, wrapper::ProgMem};
use control::ground::{examples, features};
use core::{arch::asm, ops::Range};
use knn::{Example, Examples, Nearest, Neighbour};

/// An example in flash: its features, then its label.
pub type Row = [u8; features::COUNT + 1];

avr_progmem::progmem! {
    static progmem BUILT_IN: [Row; examples::COUNT] = rows(&examples::EXAMPLES);
}

/// The features of a detection that is being classified.
type Query = [u8; features::COUNT];

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

    fn join<const CLASSES: usize>(&self, range: Range<usize>, query: &Query, nearest: &mut Nearest<CLASSES>) {
        Self::table().join(range, query, nearest);
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
    /// The rows, and their number.
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

    fn join<const CLASSES: usize>(&self, range: Range<usize>, query: &Query, nearest: &mut Nearest<CLASSES>) {
        let (mut row, mut reach) = (self.rows.wrapping_add(range.start), nearest.reach());
        for _ in range {
            if let Some(neighbour) = neighbour(row, query, reach) {
                nearest.join(neighbour);
                reach = nearest.reach();
            }
            row = row.wrapping_add(1);
        }
    }
}

/// The neighbour in a row of flash; `None` if its squared distance exceeds `reach`, which two features of five mostly show.
///
/// In assembly, because the compiler takes twice the cycles.
#[inline(always)]
fn neighbour(row: *const Row, query: &Query, reach: u32) -> Option<Neighbour> {
    let [reach_low, reach_middle, reach_high, _] = reach.to_le_bytes();
    let (mut low, mut middle, mut high) = (0, 0, 0);
    let (mut left, mut label) = (features::COUNT as u8, row.cast::<u8>());
    // SAFETY: it reads the features of the row, which is in flash, and those of the query. R0 is free for use, and R1 is 0 again.
    unsafe {
        asm!(
            "2:",
            "lpm {byte}, Z+",
            "ld {other}, X+",
            "sub {byte}, {other}",
            "brcc 3f",
            "neg {byte}",
            "3:",
            "mul {byte}, {byte}",
            "add {low}, r0",
            "adc {middle}, r1",
            "clr r1", // keeps the carry
            "adc {high}, r1",
            "cp {reach_low}, {low}",
            "cpc {reach_middle}, {middle}",
            "cpc {reach_high}, {high}",
            "brcs 4f",
            "dec {left}",
            "brne 2b",
            "4:",
            byte = out(reg) _,
            other = out(reg) _,
            low = inout(reg) low,
            middle = inout(reg) middle,
            high = inout(reg) high,
            reach_low = in(reg) reach_low,
            reach_middle = in(reg) reach_middle,
            reach_high = in(reg) reach_high,
            left = inout(reg) left,
            inout("X") query.as_ptr() => _,
            inout("Z") label,
            options(nostack, readonly),
        );
    }
    // SAFETY: the label follows the features.
    (left == 0).then(|| Neighbour::new(u32::from_le_bytes([low, middle, high, 0]), unsafe { read_byte(label) }))
}
