//! Examples in flash, and the loop that searches them and those in SRAM.
//!
//! The search is most of what a classification costs, so it is written in assembly: the query stays in registers, LPM
//! brings one feature after the other, and an example is left as soon as it is known to be too far. For that the sum
//! does not begin at 0 but at 2^24 - 1 less the farthest neighbour's distance, so that the carry out of its 24 bits says that the
//! example is beyond it. An example costs 7 cycles and 12 for each feature that is looked at: 19 to 67. One that is near enough
//! moves those that are farther up by a place, 24 cycles each, and takes its own, some 60 cycles. Those that find no place although
//! they are as far as the farthest are counted.
//!
//! How many find a place, and so what a search takes, is up to the order in which it meets them. So a table may be sorted by its
//! first feature, and is searched from the query's own on to its end, and then from its beginning.

use avr_progmem::{raw::read_byte, wrapper::ProgMem};
use control::ground::{examples, features};
use core::arch::asm;
use knn::{Example, Examples, Nearest, Neighbour, VACANT};

/// An example as it lies in flash: its features, then its label.
pub type Row = [u8; features::COUNT + 1];

avr_progmem::progmem! {
    static progmem BUILT_IN: [Row; examples::COUNT] = rows(&examples::EXAMPLES);
}

/// The built-in examples.
pub struct BuiltIn;

impl BuiltIn {
    /// Where they lie.
    pub fn table() -> InFlash {
        InFlash::sorted(&BUILT_IN)
    }
}

impl Examples<{ features::COUNT }> for BuiltIn {
    fn len(&self) -> usize {
        examples::COUNT
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        Self::table().example(index)
    }

    // Out of line, as an object is classified in one go, for a label, and in several.
    #[inline(never)]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; features::COUNT], nearest: &mut Nearest<CLASSES>) {
        Self::table().keep_nearest(query, nearest);
    }

    #[inline]
    fn keep_nearest_of<const CLASSES: usize>(
        &self,
        others: &[Example<{ features::COUNT }>],
        query: &[u8; features::COUNT],
        nearest: &mut Nearest<CLASSES>,
    ) {
        Self::table().keep_nearest_of(others, query, nearest);
    }
}

/// Examples as rows, for a table in flash.
pub const fn rows<const N: usize>(examples: &[Example<{ features::COUNT }>; N]) -> [Row; N] {
    let mut rows = [[0; features::COUNT + 1]; N];
    let mut index = 0;
    while index < N {
        let Example { features: [a, b, c, d, e], label } = examples[index];
        assert!(label < 2, "the search counts the votes of two classes");
        rows[index] = [a, b, c, d, e, label];
        index += 1;
    }
    rows
}

/// A feature: its difference, squared, joins the sum. Out of reach, the next example has its turn.
macro_rules! feature {
    ($load:literal, $query:literal) => {
        concat!(
            $load,
            "  {byte}, Z+\n",
            "sub  {byte}, {",
            $query,
            "}\n",
            "brcc 4f\n",
            "neg  {byte}\n",
            "4:\n",
            "mul  {byte}, {byte}\n",
            "add  {low}, r0\n",
            "adc  r16, r1\n",
            "adc  r17, {zero}\n",
            "brcs 2b",
        )
    };
}

/// Has so many rows join the nearest, from an address on, from which an instruction loads a byte. A line of assembly passes over a row
/// that is none, whose label is known there.
///
/// # Safety
///
/// So many rows lie there, 254 at most, where the instruction loads from.
macro_rules! keep_nearest {
    ($nearest:ident, $query:ident, $rows:expr, $count:expr, $load:literal, $vacant:literal) => {{
        let (places, free) = $nearest.places();
        if places.is_empty() {
            return;
        }
        let addresses = places.as_mut_ptr_range();
        let (first, end) = (addresses.start as u16, addresses.end as u16);
        let mut front = first + (free * size_of::<Neighbour>()) as u16;
        let (level, ones): (u8, u8);
        asm!(
            // The sum has its upper bytes in R17 and R16, what it begins with in R19 and R18: MOVW wants pairs that begin with
            // an even register, which the compiler's own choice of a pair need not be.
            // R1, which is 0 elsewhere, takes the products: the carry is added by a register of its own.
            "ld   {a}, Z+",
            "ld   {b}, Z+",
            "ld   {c}, Z+",
            "ld   {d}, Z+",
            "ld   {e}, Z+",
            "clr  {zero}",
            "clr  {level}",
            "clr  {ones}",
            // A sum begins with the complement of how far the farthest is, or with 0 while places are free. T says that none is.
            "clr  {start_low}",
            "clr  r18",
            "clr  r19",
            "clt",
            "cp   r26, {first}",
            "brne 2f",
            "rjmp 22f",
            "3:",
            "rjmp 9f",
            "2:",
            "dec  {left}",
            "breq 3b",
            "movw r30, {next:l}",
            "adiw {next:l}, {row}",
            "mov  {low}, {start_low}",
            "movw r16, r18",
            feature!($load, "a"),
            feature!($load, "b"),
            feature!($load, "c"),
            feature!($load, "d"),
            feature!($load, "e"),
            // Within reach. The sum is all ones where the example is as far as the farthest.
            "mov  {byte}, {low}",
            "and  {byte}, r16",
            "and  {byte}, r17",
            // The distance is what the sum has grown by.
            "sub  {low}, {start_low}",
            "sbc  r16, r18",
            "sbc  r17, r19",
            concat!($load, " {label}, Z"),
            $vacant,
            // Where places are free, the one in front is taken, and nobody loses his.
            "brts 3f",
            "sbiw r26, {place}",
            "3:",
            "movw r30, r26",
            "ld   r0, Z",
            "inc  {byte}",
            "brne 6f",
            // The smaller label has the place, the other one is level.
            "cp   {label}, r0",
            "brcs 6f",
            "rjmp 5f",
            // The reach has not changed: the one that lost its place is level.
            "4:",
            "mov  {label}, r0",
            "5:",
            "inc  {level}",
            "add  {ones}, {label}",
            "8:",
            "rjmp 2b",
            // Those that are farther than it move up.
            "6:",
            "cp   r30, {last}",
            "breq 7f",
            "26:",
            "ldd  {byte}, Z+4",
            "ldd  r1, Z+5",
            "ldd  {third:l}, Z+6",
            "ldd  {third:h}, Z+7",
            "cp   {label}, {byte}",
            "cpc  {low}, r1",
            "cpc  r16, {third:l}",
            "cpc  r17, {third:h}",
            "brcc 7f",
            "st   Z+, {byte}",
            "st   Z+, r1",
            "st   Z+, {third:l}",
            "st   Z+, {third:h}",
            "cp   r30, {last}",
            "brne 26b",
            "7:",
            "st   Z, {label}",
            "std  Z+1, {low}",
            "std  Z+2, r16",
            "std  Z+3, r17",
            // Where no place is free any more, the reach is where the farthest is now.
            "brts 7f",
            "cp   r26, {first}",
            "brne 8b",
            "22:",
            "set",
            "7:",
            "movw r30, r26",
            "ldd  {low}, Z+1",
            "ldd  r16, Z+2",
            "ldd  r17, Z+3",
            "com  {low}",
            "com  r16",
            "com  r17",
            "cp   {low}, {start_low}",
            "cpc  r16, r18",
            "cpc  r17, r19",
            "mov  {start_low}, {low}",
            "movw r18, r16",
            "breq 4b",
            "clr  {level}",
            "clr  {ones}",
            "rjmp 2b",
            "9:",
            "clr  r1",
            row = const size_of::<Row>(),
            place = const size_of::<Neighbour>(),
            next = inout(reg_iw) $rows => _,
            left = inout(reg) $count + 1 => _,
            start_low = out(reg) _,
            out("r18") _,
            out("r19") _,
            a = out(reg) _,
            b = out(reg) _,
            c = out(reg) _,
            d = out(reg) _,
            e = out(reg) _,
            zero = out(reg) _,
            inout("X") front,
            first = in(reg) first as u8,
            last = in(reg) end as u8 - size_of::<Neighbour>() as u8,
            label = out(reg) _,
            low = out(reg) _,
            out("r16") _,
            out("r17") _,
            byte = out(reg) _,
            third = out(reg_pair) _,
            level = out(reg) level,
            ones = out(reg) ones,
            inout("Z") $query.as_ptr() => _,
            options(nostack),
        );
        $nearest.have_joined(usize::from(front - first) / size_of::<Neighbour>());
        if level > 0 {
            $nearest.are_level(0, level - ones);
            $nearest.are_level(1, ones);
        }
    }};
}

/// Examples in flash, 254 at most.
pub struct InFlash {
    /// Its rows, of which there are so many.
    rows: *const Row,
    count: u8,
    /// Whether the rows are sorted by their first feature.
    is_sorted: bool,
}

impl InFlash {
    /// The examples of a table.
    pub fn new<const N: usize>(table: &ProgMem<[Row; N]>) -> Self {
        const { assert!(N < u8::MAX as usize, "a byte counts the rows, and one more") };
        Self { rows: table.as_ptr().cast(), count: N as u8, is_sorted: false }
    }

    /// The examples of a table whose rows are sorted by their first feature.
    pub fn sorted<const N: usize>(table: &ProgMem<[Row; N]>) -> Self {
        Self { is_sorted: true, ..Self::new(table) }
    }

    /// The rows with which a search begins, from there to the table's end: in a sorted table, those whose first feature is what the
    /// query's is, or more. What is near comes first then, and the others are left after a feature or two.
    #[inline(always)]
    fn begin(&self, first: u8) -> (*const Row, u8) {
        /// Rows that are passed at once.
        const STEP: u8 = 4;
        let (mut rows, mut count) = (self.rows, self.count);
        while self.is_sorted && count > STEP {
            let passed = rows.wrapping_add(STEP.into());
            // SAFETY: the row is one of the table's, so it lies in flash.
            if unsafe { read_byte(passed.cast()) } >= first {
                break;
            }
            (rows, count) = (passed, count - STEP);
        }
        (rows, count)
    }
}

impl Examples<{ features::COUNT }> for InFlash {
    fn len(&self) -> usize {
        self.count.into()
    }

    fn example(&self, index: usize) -> Option<Example<{ features::COUNT }>> {
        (index < self.len()).then(|| {
            // SAFETY: the row lies in flash, as it is one of the table's.
            let [a, b, c, d, e, label] = unsafe { ProgMem::new(self.rows.wrapping_add(index)) }.load();
            Example::new([a, b, c, d, e], label)
        })
    }

    #[inline(always)]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; features::COUNT], nearest: &mut Nearest<CLASSES>) {
        let (mut rows, mut count) = self.begin(query[0]);
        let mut before = self.count - count;
        loop {
            // SAFETY: the loop reads flash from a row of the table on, as many rows as there are from there, and nothing else. Of SRAM
            // it reads the query and reads and writes the places, of which there is a first one: it begins at one of them or,
            // where some are free, behind one, and stops at the last. An address's lower byte tells the last, and the
            // first, as none is met twice before. R0 is free for use, and R1 is 0 again at the end.
            unsafe { keep_nearest!(nearest, query, rows, count, "lpm", "") };
            if before == 0 {
                return;
            }
            (rows, count, before) = (self.rows, before, 0);
        }
    }

    #[inline(always)]
    fn keep_nearest_of<const CLASSES: usize>(
        &self,
        others: &[Example<{ features::COUNT }>],
        query: &[u8; features::COUNT],
        nearest: &mut Nearest<CLASSES>,
    ) {
        const { assert!(VACANT & 1 << 7 != 0 && size_of::<Example<{ features::COUNT }>>() == size_of::<Row>()) };
        // A byte counts them, and one more.
        let count = others.len().min(usize::from(u8::MAX) - 1) as u8;
        // SAFETY: as above, but for the rows, which are examples in SRAM: their features, and then the label.
        unsafe { keep_nearest!(nearest, query, others.as_ptr(), count, "ld", "sbrc {label}, 7\nrjmp 2b") };
    }
}
