//! Examples in flash, and the loop that searches them and those in SRAM.
//!
//! The search is most of what a classification costs, so it is written in assembly: the query stays in registers, LPM
//! brings one feature after the other, and an example is left as soon as it is known to be too far. For that the sum
//! does not begin at 0 but at 2^24 - 1 less the farthest neighbour's distance, so that the carry out of its 24 bits says that the
//! example is beyond it. An example costs 7 cycles and 12 for each feature that is looked at: 19 to 67. One that is near enough
//! moves those that are farther up by a place, 24 cycles each, and takes its own, some 50 cycles. Those that find no place although
//! they are as far as the farthest are counted.
//!
//! A table in flash is sorted by its first feature. The search begins at the query's own and goes on to the table's end, and then from
//! there back to its beginning: the nearest come first, and where the first feature alone is too far, nothing nearer follows in that
//! direction.

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

/// Examples as rows, for a table in flash. Those that are not sorted by their first feature do not compile.
pub const fn rows<const N: usize>(examples: &[Example<{ features::COUNT }>; N]) -> [Row; N] {
    let mut rows = [[0; features::COUNT + 1]; N];
    let mut index = 0;
    while index < N {
        let Example { features: [a, b, c, d, e], label } = examples[index];
        assert!(label < 2, "the search counts the votes of two classes");
        assert!(index == 0 || rows[index - 1][0] <= a, "the search begins at the query's own first feature");
        rows[index] = [a, b, c, d, e, label];
        index += 1;
    }
    rows
}

/// A feature: its difference, squared, joins the sum. Out of reach, the search goes on elsewhere.
macro_rules! feature {
    ($load:literal, $query:literal, $out_of_reach:literal) => {
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
            "brcs ",
            $out_of_reach,
        )
    };
}

/// Has rows join the nearest: so many from an address on, and then so many before it, the last one first. They lie where an instruction
/// loads a byte from. One whose first feature alone is out of reach is passed over, `2b`, or ends its direction, `3b`. A line of
/// assembly passes over a row that is none, whose label is known there.
///
/// # Safety
///
/// So many rows lie there, 254 at most on either side of the address, where the instruction loads from.
macro_rules! keep_nearest {
    ($nearest:ident, $query:ident, $rows:expr, $count:expr, $before:expr, $load:literal, $first_is_out:literal, $vacant:literal) => {{
        let (places, free) = $nearest.places();
        if places.is_empty() {
            return;
        }
        let addresses = places.as_mut_ptr_range();
        let (first, end) = (addresses.start as u16, addresses.end as u16);
        let mut front = first + (free * size_of::<Neighbour>()) as u16;
        let (level, ones): (u8, u8);
        asm!(
            // The sum has its upper bytes in R17 and R16, what it begins with in R19 and R18, and the next row is at R25 and R24: MOVW
            // wants pairs that begin with an even register, which the compiler's own choice of a pair need not be.
            // R1, which is 0 elsewhere, takes the products: the carry is added by a register of its own.
            // The stack keeps where the other direction begins and how many rows it has, and one more.
            "push r24",
            "push r25",
            "push {byte}",
            "ld   {a}, Z+",
            "ld   {b}, Z+",
            "ld   {c}, Z+",
            "ld   {d}, Z+",
            "ld   {e}, Z+",
            "clr  {zero}",
            "clr  {ones}",
            // A sum begins with the complement of how far the farthest is, or with 0 while places are free. T says that none is.
            "clr  {start_low}",
            "clr  r18",
            "clr  r19",
            "clt",
            // As long as places are free, no example is level, and the register tells the first place.
            "cp   r26, {level}",
            "brne 2f",
            "rjmp 22f",
            "3:",
            "rjmp 9f",
            "2:",
            "dec  {left}",
            "breq 3b",
            "movw r30, r24",
            "add  r24, {step:l}",
            "adc  r25, {step:h}",
            "mov  {low}, {start_low}",
            "movw r16, r18",
            feature!($load, "a", $first_is_out),
            feature!($load, "b", "2b"),
            feature!($load, "c", "2b"),
            feature!($load, "d", "2b"),
            feature!($load, "e", "2b"),
            // Within reach. The distance is what the sum has grown by.
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
            // The farthest loses its place. Its label is kept.
            "ld   r0, Z",
            // Those that are farther than the example move up.
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
            "cp   r26, {level}",
            "brne 8f",
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
            "breq 4f",
            "clr  {level}",
            "clr  {ones}",
            "rjmp 2b",
            // The reach has not changed: the one that lost its place is level. Of two that are as far, the smaller label has the place.
            "4:",
            "ld   {label}, Z",
            "cp   r0, {label}",
            "brcc 5f",
            "st   Z, r0",
            "mov  r0, {label}",
            "5:",
            "inc  {level}",
            "add  {ones}, r0",
            "8:",
            "rjmp 2b",
            // A direction is done. Rows are passed downwards in the second one.
            "9:",
            "sbrc {step:h}, 7",
            "rjmp 9f",
            "in   r30, 0x3d",
            "in   r31, 0x3e",
            "ldd  {left}, Z+1",
            "ldd  r25, Z+2",
            "ldd  r24, Z+3",
            "neg  {step:l}",
            "com  {step:h}",
            "add  r24, {step:l}",
            "adc  r25, {step:h}",
            "rjmp 2b",
            "9:",
            "pop  r1",
            "pop  r1",
            "pop  r1",
            "brts 3f",
            "clr  {level}",
            "3:",
            "clr  r1",
            place = const size_of::<Neighbour>(),
            step = inout(reg_pair) size_of::<Row>() as u16 => _,
            inout("r25r24") $rows => _,
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
            last = in(reg) end as u8 - size_of::<Neighbour>() as u8,
            label = out(reg) _,
            low = out(reg) _,
            out("r16") _,
            out("r17") _,
            byte = inout(reg) $before + 1 => _,
            third = out(reg_pair) _,
            level = inout(reg) first as u8 => level,
            ones = out(reg) ones,
            inout("Z") $query.as_ptr() => _,
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
    /// Its rows, of which there are so many, sorted by their first feature.
    rows: *const Row,
    count: u8,
}

impl InFlash {
    /// The examples of a table.
    pub fn new<const N: usize>(table: &ProgMem<[Row; N]>) -> Self {
        const { assert!(N < u8::MAX as usize, "a byte counts the rows, and one more") };
        Self { rows: table.as_ptr().cast(), count: N as u8 }
    }

    /// The first row whose first feature is that, or more, and how many rows there are from it on.
    #[inline(always)]
    fn from(&self, first: u8) -> (*const Row, u8) {
        /// Rows that are passed at once, as long as there are so many.
        const STEP: u8 = 8;
        // SAFETY: the row is one of the table's, so it lies in flash.
        let is_less = |row: *const Row| unsafe { read_byte(row.cast()) } < first;
        let (mut rows, mut count) = (self.rows, self.count);
        while count >= STEP && is_less(rows.wrapping_add(usize::from(STEP) - 1)) {
            (rows, count) = (rows.wrapping_add(STEP.into()), count - STEP);
        }
        while count > 0 && is_less(rows) {
            (rows, count) = (rows.wrapping_add(1), count - 1);
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
        let (rows, count) = self.from(query[0]);
        // SAFETY: the loop reads flash from a row of the table on, as many rows as there are from there and before it, and nothing
        // else. Of SRAM it reads the query and reads and writes the places, of which there is a first one: it begins at one of them
        // or, where some are free, behind one, and stops at the last. An address's lower byte tells the last, and the
        // first, as none is met twice before. It takes from the stack what it has put there. R0 is
        // free for use, and R1 is 0 again at the end.
        unsafe { keep_nearest!(nearest, query, rows, count, self.count - count, "lpm", "3b", "") };
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
        unsafe { keep_nearest!(nearest, query, others.as_ptr(), count, 0_u8, "ld", "2b", "sbrc {label}, 7\nrjmp 2b") };
    }
}
