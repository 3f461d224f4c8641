//! Examples in flash, and the loop that searches them.
//!
//! The search is most of what a classification costs, so it is written in assembly: the query stays in registers, LPM
//! brings one feature after the other, and an example is left as soon as it is known to be too far. For that the sum
//! does not begin at 0 but at 2^24 - 1 less the farthest neighbour's distance, so that the carry out of its 24 bits says that the
//! example is beyond it. An example costs 9 cycles and 12 for each feature that is looked at: 21 to 69. One that is near enough
//! moves those that are farther up by a place, 27 cycles each, and takes its own: some 75 cycles with three places. Only those
//! that find no place although they are as far as the farthest go to the classifier.

use avr_progmem::wrapper::ProgMem;
use control::ground::{examples, features};
use core::arch::asm;
use knn::{Example, Examples, Neighbour};

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
    fn keep_nearest(
        &self,
        query: &[u8; features::COUNT],
        nearest: &mut [Neighbour],
        level: &mut impl FnMut(Neighbour),
    ) {
        Self::table().keep_nearest(query, nearest, level);
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
    fn keep_nearest(
        &self,
        query: &[u8; features::COUNT],
        nearest: &mut [Neighbour],
        level: &mut impl FnMut(Neighbour),
    ) {
        let table = self.0.as_ptr();
        let mut search = Search { next: table.cast::<Row>() as u16, end: 0 };
        search.end = search.next + size_of::<Row>() as u16 * table.len() as u16;
        while let Some(label) = search.next_level(query, nearest) {
            if let Some(farthest) = nearest.first() {
                level(farthest.with_label(label));
            }
        }
    }
}

/// Where a search stands, as addresses of flash.
struct Search {
    next: u16,
    end: u16,
}

impl Search {
    /// Has the examples join the nearest up to one that is `level`, see [`Neighbour::join`]; returns the label of that one,
    /// which is as far as the farthest.
    #[inline(always)]
    fn next_level(&mut self, query: &[u8; features::COUNT], nearest: &mut [Neighbour]) -> Option<u8> {
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
                    "add  {low}, r0\n",
                    "adc  r16, r1\n",
                    "adc  r17, {zero}\n",
                    "brcs 2b",
                )
            };
        }

        /// The distance's upper byte where no example is left; five features stay below 5 * 2^16.
        const NONE: u8 = u8::MAX;

        let [a, b, c, d, e] = *query;
        let farthest = nearest.first()?.key();
        // What a sum begins with: the complement of the farthest's distance.
        let [_, start_low, start_middle, start_high] = (!farthest).to_le_bytes();
        let (label, high): (u8, u8);
        // SAFETY: the loop reads flash from `next` to `end` and nothing else, both of them a row's start or the table's end
        // (`keep_nearest` makes them, and each turn takes `next` one row on). Of SRAM it reads and writes the places of
        // `nearest`, of which there is a first one: it stops at the last of them, or of the first
        // 256. R0 is free for use, and R1 is 0 again at the end.
        unsafe {
            asm!(
                // The sum has its upper bytes in R17 and R16, what it begins with in R19 and R18: MOVW wants pairs that begin with
                // an even register, which the compiler's own choice of a pair need not be.
                // R1, which is 0 elsewhere, takes the products: the carry is added by a register of its own.
                "clr  {zero}",
                "rjmp 2f",
                "3:",
                "ldi  r30, {none}",
                "mov  r17, r30",
                "rjmp 9f",
                "2:",
                "cp   {next:l}, {end:l}",
                "cpc  {next:h}, {end:h}",
                "breq 3b",
                "movw r30, {next:l}",
                "adiw {next:l}, {row}",
                "mov  {low}, {start_low}",
                "movw r16, r18",
                feature!("a"),
                feature!("b"),
                feature!("c"),
                feature!("d"),
                feature!("e"),
                // Within reach. The sum is all ones where the example is as far as the farthest.
                "mov  {byte}, {low}",
                "and  {byte}, r16",
                "and  {byte}, r17",
                // The distance is what the sum has grown by.
                "sub  {low}, {start_low}",
                "sbc  r16, r18",
                "sbc  r17, r19",
                "lpm  {label}, Z",
                "movw r30, {nearest:l}",
                "ld   {old_label}, Z",
                "inc  {byte}",
                "brne 5f",
                // The smaller label has the place, the other one is level.
                "cp   {label}, {old_label}",
                "brcc 9f",
                "5:",
                // Those that are farther than it move up, into the farthest's place.
                "mov  r0, {places}",
                "6:",
                "dec  r0",
                "breq 7f",
                "ldd  {byte}, Z+4",
                "ldd  {second}, Z+5",
                "ldd  {third:l}, Z+6",
                "ldd  {third:h}, Z+7",
                "cp   {label}, {byte}",
                "cpc  {low}, {second}",
                "cpc  r16, {third:l}",
                "cpc  r17, {third:h}",
                "brcc 7f",
                "st   Z, {byte}",
                "std  Z+1, {second}",
                "std  Z+2, {third:l}",
                "std  Z+3, {third:h}",
                "adiw r30, {place}",
                "rjmp 6b",
                "7:",
                "st   Z, {label}",
                "std  Z+1, {low}",
                "std  Z+2, r16",
                "std  Z+3, r17",
                // The reach is where the farthest is now.
                "movw r30, {nearest:l}",
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
                "breq 7f",
                "8:",
                "rjmp 2b",
                // It has not changed: the one that lost its place is level, unless nothing had taken that place.
                "7:",
                "mov  r0, {low}",
                "or   r0, r16",
                "or   r0, r17",
                "breq 8b",
                "com  r17",
                "mov  {label}, {old_label}",
                "9:",
                "clr  r1",
                row = const size_of::<Row>(),
                place = const size_of::<Neighbour>(),
                none = const NONE,
                next = inout(reg_iw) self.next,
                end = in(reg_pair) self.end,
                start_low = inout(reg) start_low => _,
                inout("r18") start_middle => _,
                inout("r19") start_high => _,
                a = in(reg) a,
                b = in(reg) b,
                c = in(reg) c,
                d = in(reg) d,
                e = in(reg) e,
                zero = out(reg) _,
                nearest = in(reg_iw) nearest.as_mut_ptr(),
                places = in(reg) nearest.len() as u8,
                label = out(reg) label,
                low = out(reg) _,
                out("r16") _,
                out("r17") high,
                byte = out(reg) _,
                second = out(reg) _,
                third = out(reg_pair) _,
                old_label = out(reg) _,
                out("r30") _,
                out("r31") _,
                options(nostack),
            );
        }
        (high != NONE).then_some(label)
    }
}
