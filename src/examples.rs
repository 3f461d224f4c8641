//! Examples in flash, and the loop that searches them.
//!
//! The search is most of what a classification costs, so it is written in assembly: the query stays in registers, LPM
//! brings one feature after the other, and an example is left as soon as it is known to be too far. For that the sum
//! does not begin at 0 but at 2^24 - 1 less the reach, so that the carry out of its 24 bits says that the example is out of
//! reach. An example costs 9 cycles and 12 for each feature that is looked at: 21 to 69. Only those within reach go to the
//! classifier.

use avr_progmem::wrapper::ProgMem;
use control::{examples, features};
use core::arch::asm;
use knn::{Example, Examples};

/// An example as it lies in flash: its features, then its label.
pub type Row = [u8; features::COUNT + 1];

avr_progmem::progmem! {
    static progmem BUILT_IN: [Row; examples::COUNT] = rows(&examples::EXAMPLES);
}

/// The built-in examples.
pub struct BuiltIn;

impl BuiltIn {
    fn table() -> InFlash {
        InFlash(BUILT_IN.as_slice())
    }
}

impl Examples<{ features::COUNT }> for BuiltIn {
    fn len(&self) -> usize {
        examples::COUNT
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        Self::table().example(index)
    }

    #[inline]
    fn visit_near(&self, query: &[u8; features::COUNT], reach: u32, visit: &mut impl FnMut(u32, u8) -> u32) -> u32 {
        Self::table().visit_near(query, reach, visit)
    }
}

/// Examples as rows, for a table in flash.
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

/// Examples in flash.
pub struct InFlash(pub ProgMem<[Row]>);

impl Examples<{ features::COUNT }> for InFlash {
    fn len(&self) -> usize {
        self.0.len()
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        (index < self.len()).then(|| {
            let [a, b, c, d, e, label] = self.0.load_at(index);
            Example::new([a, b, c, d, e], label)
        })
    }

    #[inline]
    fn visit_near(&self, query: &[u8; features::COUNT], mut reach: u32, visit: &mut impl FnMut(u32, u8) -> u32) -> u32 {
        let table = self.0.as_ptr();
        let mut search = Search { next: table.cast::<Row>() as u16, end: 0 };
        search.end = search.next + size_of::<Row>() as u16 * table.len() as u16;
        while let Some((distance, label)) = search.next_near(query, reach) {
            reach = visit(distance, label);
        }
        reach
    }
}

/// Where a search stands, as addresses of flash.
struct Search {
    next: u16,
    end: u16,
}

impl Search {
    /// The squared distance and the label of the next example that is not farther than `reach`.
    #[inline(always)]
    fn next_near(&mut self, query: &[u8; features::COUNT], reach: u32) -> Option<(u32, u8)> {
        /// The distance's upper byte where no example is left; five features stay below 5 * 2^16.
        const NONE: u8 = u8::MAX;

        /// A feature: its difference, squared, joins the sum. Out of reach, the next example has its turn.
        macro_rules! feature {
            ($query:literal) => {
                concat!(
                    "lpm  {byte}, Z+\n",
                    "sub  {byte}, {",
                    $query,
                    "}\n",
                    "brcc 4f\n",
                    "neg  {byte}\n",
                    "4:\n",
                    "mul  {byte}, {byte}\n",
                    "add  {lower:h}, r0\n",
                    "adc  {upper:l}, r1\n",
                    "adc  {upper:h}, {zero}\n",
                    "brcs 2b",
                )
            };
        }

        let [a, b, c, d, e] = *query;
        // The sum lies in the upper three of four bytes, above the label. No example is beyond a reach of 24 bits.
        let start = if reach < 1 << 24 { !(reach << 8) } else { 0 };
        let (lower, upper): (u16, u16);
        // SAFETY: the loop reads flash from `next` to `end` and nothing else, both of them a row's start or the table's end
        // (`visit_near` makes them, and each turn takes `next` one row on). R0 is free for use, and R1 is 0 again at the end.
        unsafe {
            asm!(
                // R1, which is 0 elsewhere, takes the products: the carry is added by a register of its own.
                "clr  {zero}",
                "2:",
                "cp   {next:l}, {end:l}",
                "cpc  {next:h}, {end:h}",
                "breq 3f",
                "movw r30, {next:l}",
                "adiw {next:l}, {row}",
                "mov  {lower:h}, {start_lower:h}",
                "movw {upper:l}, {start_upper:l}",
                feature!("a"),
                feature!("b"),
                feature!("c"),
                feature!("d"),
                feature!("e"),
                // Within reach: the distance is what the sum has grown by.
                "sub  {lower:h}, {start_lower:h}",
                "sbc  {upper:l}, {start_upper:l}",
                "sbc  {upper:h}, {start_upper:h}",
                "lpm  {lower:l}, Z",
                "rjmp 4f",
                "3:",
                "mov  {upper:h}, {zero}",
                "dec  {upper:h}",
                "4:",
                "clr  r1",
                row = const size_of::<Row>(),
                next = inout(reg_iw) self.next,
                end = in(reg_pair) self.end,
                start_lower = in(reg_pair) start as u16,
                start_upper = in(reg_pair) (start >> 16) as u16,
                a = in(reg) a,
                b = in(reg) b,
                c = in(reg) c,
                d = in(reg) d,
                e = in(reg) e,
                zero = out(reg) _,
                lower = out(reg_pair) lower,
                upper = out(reg_pair) upper,
                byte = out(reg) _,
                out("r30") _,
                out("r31") _,
                options(readonly, nostack),
            );
        }
        let found = u32::from(lower) | u32::from(upper) << 16;
        ((upper >> 8) as u8 != NONE).then_some((found >> 8, found as u8))
    }
}
