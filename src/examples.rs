//! Examples in flash, and the search through them and through those in SRAM.
//!
//! The search is the largest part of a classification, so it is in assembly. The query stays in registers, and LPM loads one
//! feature after the other. The search leaves an example once it is too far. For that the sum starts at 2^24 - 1 minus the farthest
//! neighbour's distance. A carry out of its 24 bits then means "too far". An example costs 7 cycles and 12 for each feature loaded:
//! 19 to 67. An example near enough moves each farther neighbour by one place, 24 cycles each. Taking its own place costs some 50
//! cycles. Examples without a place that are as far as the farthest are counted.
//!
//! A table in flash is sorted by its first feature. The search starts at the query's own value and runs to the table's end. Then it
//! runs from the same start back to the table's beginning. So the nearest come first. Once the first feature alone is too far, that
//! direction ends.

use avr_progmem::{raw::read_byte, wrapper::ProgMem};
use control::ground::{examples, features};
use core::arch::asm;
use knn::{Example, Examples, Nearest, Neighbour, VACANT};

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

    // Out of line, because classifying in one call (for a label) and in several both use it.
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

/// Examples as rows of a table in flash. An unsorted table does not compile.
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

/// Adds one feature's squared difference to the sum. Jumps to `$out_of_reach` if the sum is too far.
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

/// Adds rows to the nearest: `$count` rows from an address on, then `$before` rows before it in reverse order. `$load` is the
/// instruction that loads a byte from them. If the first feature alone is too far, `2b` skips the row and `3b` ends the direction.
/// `$vacant` is assembly that skips a row without an example; the label is loaded at that point.
///
/// # Safety
///
/// The rows exist at the address, at most 254 on either side, in the memory that `$load` reads.
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
            // R17 and R16 are the sum's upper bytes, R19 and R18 those of its start. R25:R24 is the next row's address. MOVW needs
            // pairs with an even first register, which the compiler's choice does not guarantee. R1, elsewhere 0, takes the
            // products, so another register is the zero for the carry. The stack holds the second direction's start and its number
            // of rows plus one.
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
            // A sum starts at the complement of the farthest distance, or at 0 while places are free. T: no place is free.
            "clr  {start_low}",
            "clr  r18",
            "clr  r19",
            "clt",
            // While places are free, no example is level, and this register holds the first place's address.
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
            // Near enough. The distance is the growth of the sum.
            "sub  {low}, {start_low}",
            "sbc  r16, r18",
            "sbc  r17, r19",
            concat!($load, " {label}, Z"),
            $vacant,
            // If places are free, take the one in front; no neighbour is replaced.
            "brts 3f",
            "sbiw r26, {place}",
            "3:",
            "movw r30, r26",
            // The farthest is replaced. Keep its label.
            "ld   r0, Z",
            // Move up the neighbours that are farther than the example.
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
            // If no place is free any more, the limit is the farthest neighbour's distance.
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
            // The limit has not changed: the replaced neighbour is level. Of two at the same distance, the smaller label keeps the
            // place.
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
            // A direction is finished. The second one runs downwards.
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

    /// The first row whose first feature is at least `first`, and the number of rows from it on.
    #[inline(always)]
    fn from(&self, first: u8) -> (*const Row, u8) {
        /// Rows skipped at once, while there are as many.
        const STEP: u8 = 8;
        // SAFETY: the row belongs to the table, so it is in flash.
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
            // SAFETY: the row belongs to the table, so it is in flash.
            let [a, b, c, d, e, label] = unsafe { ProgMem::new(self.rows.wrapping_add(index)) }.load();
            Example::new([a, b, c, d, e], label)
        })
    }

    #[inline(always)]
    fn keep_nearest<const CLASSES: usize>(&self, query: &[u8; features::COUNT], nearest: &mut Nearest<CLASSES>) {
        let (rows, count) = self.from(query[0]);
        // SAFETY: in flash, the loop reads only rows of this table: `count` from the address on, and the others before it. In SRAM,
        // it reads the query, and reads and writes the places, at least one. It starts at a place, or behind one if some are free,
        // and stops at the last. The lower address byte identifies the first and the last place, because none occurs twice before.
        // It pops only what it pushed. R0 is free for use, and R1 is 0 again at the end.
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
        // A byte holds the count plus one.
        let count = others.len().min(usize::from(u8::MAX) - 1) as u8;
        // SAFETY: as above, but the rows are examples in SRAM: features, then the label.
        unsafe { keep_nearest!(nearest, query, others.as_ptr(), count, 0_u8, "ld", "2b", "sbrc {label}, 7\nrjmp 2b") };
    }
}
