//! Examples in flash: the built-in ones, and tables of the benchmark.
//!
//! # How it works
//!
//! The compiler turns each example into a row of six bytes: five features, then the label. The rows stay in flash, and
//! [`InFlash`] reads them there.
//!
//! A search compares a detection with each row. Its reach is the distance of the farthest neighbour that it keeps so
//! far. `neighbour` subtracts the squared difference of each feature from the reach. A borrow shows that the row is
//! beyond the reach. The search then goes on to the next row.
//!
//! `neighbour` is in assembly. The benchmark compares its results on the built-in examples with the plain search of
//! `knn`.
//!
//! # Limits
//!
//! - A table has at most 254 examples, because a byte counts the rows and one more.
//! - The assembly takes exactly five features.
//! - This file does not hold the examples that the operator teaches. They are in the EEPROM.
//! - The built-in examples come from simulated rows (`weeder train --synthetic`). They know plants from 100 to 180 mm
//!   and weeds up to 20 mm (docs/training.md). No real row has shown that they fit a crop.
//! - The simulator simavr counts the cycles of a search. No real board has shown them.

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
            let row = self.rows.wrapping_add(index).cast::<u8>();
            // SAFETY: the row belongs to the table, so it is in flash.
            let byte = |place| unsafe { read_byte(row.wrapping_add(place)) };
            Example::new(core::array::from_fn(byte), byte(features::COUNT))
        })
    }

    fn join<const CLASSES: usize>(&self, range: Range<usize>, query: &Query, nearest: &mut Nearest<CLASSES>) {
        let (mut row, mut reach) = (self.rows.wrapping_add(range.start), nearest.reach());
        // A byte counts them, in fewer cycles than the range's 16 bits.
        for _ in 0..range.len() as u8 {
            if let Some(neighbour) = neighbour(row, query, reach) {
                nearest.join(neighbour);
                reach = nearest.reach();
            }
            row = row.wrapping_add(1);
        }
    }
}

/// The neighbour in a row of flash; `None` if it is beyond `reach`, which two features of five mostly show.
///
/// It subtracts the squares from the reach. A borrow shows that the row is beyond. If none comes, the distance is the reach less the
/// rest. In assembly, because the compiler takes twice the cycles.
#[inline(always)]
fn neighbour(row: *const Row, query: &Query, reach: Neighbour) -> Option<Neighbour> {
    let (reach_far, reach_near) = reach.parts();
    let [a, b, c, d, e] = *query;
    let (far, near): (u16, u16);
    let beyond: u8;
    // SAFETY: it reads the row, which is in flash. R0 is free for use, and R1 is 0 again.
    unsafe {
        asm!(
            ".irp feature, {a}, {b}, {c}, {d}, {e}", // for each feature of the query, up to .endr
            "lpm {byte}, Z+",
            "sub {byte}, \\feature",
            "brcc 3f",
            "neg {byte}",
            "3:",
            "mul {byte}, {byte}",
            "sub {near_rest}, r0",
            "sbc {far_rest:l}, r1",
            "sbci {far_rest:h}, 0",
            "brcs 4f",
            ".endr",
            "lpm {near:l}, Z",
            "com {near:l}",
            "mov {near:h}, {reach_near:h}",
            "mov {far:l}, {reach_far:l}",
            "mov {far:h}, {reach_far:h}",
            "sub {near:h}, {near_rest}",
            "sbc {far:l}, {far_rest:l}",
            "sbc {far:h}, {far_rest:h}",
            "4:",
            "clr r1", // keeps the borrow
            "sbc {byte}, {byte}",
            a = in(reg) a,
            b = in(reg) b,
            c = in(reg) c,
            d = in(reg) d,
            e = in(reg) e,
            byte = out(reg) beyond,
            reach_far = in(reg_pair) reach_far,
            reach_near = in(reg_pair) reach_near,
            near_rest = inout(reg) (reach_near >> 8) as u8 => _,
            far_rest = inout(reg_iw) reach_far => _,
            far = out(reg_pair) far,
            near = out(reg_pair) near,
            inout("Z") row => _,
            options(nostack, readonly),
        );
    }
    (beyond == 0).then(|| Neighbour::of_parts(far, near))
}
