//! Field examples: taught by the operator, and kept in the EEPROM.
//!
//! Each of [`CAPACITY`] examples has a slot of eight bytes: five features, the label, and a CRC-16. The CRC covers features, label
//! and the features' scale, because on another scale the bytes mean something else. An erased slot reads as ones. A slot with a
//! wrong CRC, after a power loss or a flipped bit, is dropped and counted. All slots are read once at start-up into SRAM. A search
//! in the EEPROM would take two turns of the loop, and more with the CRC. It would also wait for a byte that is being written. The
//! bytes of a slot are written one at a time, each when the memory is ready.

use crate::{
    ground::{class::label, examples, features},
    memory::{ERASED, Memory, checksum},
};
use knn::{Example, Examples, VACANT};

/// Most field examples.
pub const CAPACITY: u8 = 32;

/// Bytes of a slot.
const SLOT: usize = features::COUNT + 3;

/// A field example.
type Taught = Example<{ features::COUNT }>;

/// The scale, in each slot's CRC.
const SCALE_MARK: [u8; 2] = checksum(&examples::SCALE_BYTES).to_le_bytes();

/// The store of field examples.
#[derive(Clone, Debug)]
pub struct FieldExamples<M> {
    memory: M,
    /// The example of each slot; label [`VACANT`] if it holds none.
    examples: [Taught; CAPACITY as usize],
    /// Number of slots up to the last example.
    used: u8,
    /// One bit for each slot that is yet to be written or erased.
    pending: [u8; CAPACITY as usize / 8],
    spoiled: u8,
    /// The slot that is being written.
    writing: u8,
    bytes: [u8; SLOT],
    /// Bytes of that slot still to write.
    left: u8,
}

impl<M: Memory> FieldExamples<M> {
    /// The store before [`init`](Self::init).
    pub const fn uninit(memory: M) -> Self {
        // Zeros take no flash. `used` is 0, so none of them counts.
        let examples = [Example::new([0; features::COUNT], 0); CAPACITY as usize];
        Self {
            memory,
            examples,
            used: 0,
            pending: [0; CAPACITY as usize / 8],
            spoiled: 0,
            writing: 0,
            bytes: [0; SLOT],
            left: 0,
        }
    }

    /// Reads the examples from the memory.
    pub fn init(&mut self) {
        self.spoiled = 0;
        for (number, example) in (0..).zip(&mut self.examples) {
            let bytes: [u8; SLOT] = core::array::from_fn(|place| self.memory.read(address(number) + place as u16));
            let (features, rest) = bytes.split_at(features::COUNT);
            example.features.copy_from_slice(features);
            example.label = rest[0];
            if bytes != encode(*example) || usize::from(example.label) >= label::COUNT {
                example.label = VACANT;
                self.spoiled += u8::from(bytes != [ERASED; SLOT]);
            } else {
                self.used = number + 1;
            }
        }
    }

    /// Slots with a wrong CRC.
    pub fn spoiled(&self) -> u8 {
        self.spoiled
    }

    /// The example in a slot.
    pub fn slot(&self, number: u8) -> Option<Taught> {
        self.examples.get(usize::from(number)).copied().filter(is_held)
    }

    /// Adds an example and returns its slot. [`carry_on`](Self::carry_on) writes it.
    ///
    /// # Errors
    /// The example, if all slots are taken.
    pub fn add(&mut self, example: Taught) -> Result<u8, Taught> {
        let Some(number) = self.examples.iter().position(|example| !is_held(example)) else {
            return Err(example);
        };
        self.examples[number] = example;
        *self.pending(number as u8) |= bit(number as u8);
        self.used = self.used.max(number as u8 + 1);
        Ok(number as u8)
    }

    /// Forgets the example in a slot. [`carry_on`](Self::carry_on) erases it. Returns whether there was one.
    pub fn forget(&mut self, number: u8) -> bool {
        let Some(example) = self.examples.get_mut(usize::from(number)).filter(|example| is_held(example)) else {
            return false;
        };
        example.label = VACANT;
        *self.pending(number) |= bit(number);
        true
    }

    /// Writes the next byte, if the memory is ready. Returns whether all is written.
    pub fn carry_on(&mut self) -> bool {
        if !self.write_next_byte() {
            return false;
        }
        // The usual case, checked first because every turn comes here.
        if self.pending == [0; CAPACITY as usize / 8] {
            return true;
        }
        let Some(number) = (0..CAPACITY).find(|&number| *self.pending(number) & bit(number) != 0) else {
            return true;
        };
        *self.pending(number) ^= bit(number);
        let example = &self.examples[usize::from(number)];
        let bytes = if is_held(example) { encode(*example) } else { [ERASED; SLOT] };
        self.begin(number, bytes);
        false
    }

    /// The slots up to the last example; empty ones are [`VACANT`].
    pub fn places(&self) -> &[Taught] {
        self.examples.get(..self.used.into()).unwrap_or(&self.examples)
    }

    /// The memory, for a test or another machine.
    pub fn into_memory(self) -> M {
        self.memory
    }

    /// The byte that holds a slot's pending bit.
    fn pending(&mut self, number: u8) -> &mut u8 {
        &mut self.pending[usize::from(number / 8)]
    }

    #[inline(never)]
    fn begin(&mut self, number: u8, bytes: [u8; SLOT]) {
        self.writing = number;
        self.bytes = bytes;
        self.left = SLOT as u8;
    }

    /// Writes the next byte of the slot, if the memory is ready. Returns whether the slot is complete.
    fn write_next_byte(&mut self) -> bool {
        if !self.memory.is_ready() {
            return false;
        }
        let Some(left) = self.left.checked_sub(1) else {
            return true;
        };
        let place = SLOT as u8 - self.left;
        self.memory.write(address(self.writing) + u16::from(place), self.bytes[usize::from(place)]);
        self.left = left;
        false
    }
}

/// A slot's bit in its byte.
const fn bit(number: u8) -> u8 {
    1 << (number % 8)
}

/// A slot's first address.
const fn address(number: u8) -> u16 {
    number as u16 * SLOT as u16
}

impl<M: Memory> Examples<{ features::COUNT }> for FieldExamples<M> {
    fn len(&self) -> usize {
        self.examples.iter().filter(|example| is_held(example)).count()
    }

    fn example(&self, index: usize) -> Option<Taught> {
        (0..CAPACITY).filter_map(|slot| self.slot(slot)).nth(index)
    }
}

/// Whether a slot holds an example.
const fn is_held(example: &Taught) -> bool {
    example.label != VACANT
}

fn encode(example: Taught) -> [u8; SLOT] {
    let [a, b, c, d, e] = example.features;
    let [mark, scale] = SCALE_MARK;
    let [low, high] = checksum(&[a, b, c, d, e, example.label, mark, scale]).to_le_bytes();
    [a, b, c, d, e, example.label, low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Volatile;

    fn store() -> FieldExamples<Volatile> {
        init(Volatile::new())
    }

    fn init(memory: Volatile) -> FieldExamples<Volatile> {
        let mut store = FieldExamples::uninit(memory);
        store.init();
        store
    }

    fn example(number: u8) -> Taught {
        Example::new([number, 2, 3, 4, 5], number % 2)
    }

    /// A store with examples of these numbers, all written.
    fn holding(numbers: impl Iterator<Item = u8>) -> FieldExamples<Volatile> {
        let mut store = store();
        for number in numbers {
            store.add(example(number)).unwrap();
        }
        while !store.carry_on() {}
        store
    }

    /// The store after all is written and the power was off.
    fn restart(mut store: FieldExamples<Volatile>) -> FieldExamples<Volatile> {
        while !store.carry_on() {}
        init(store.memory.with_power())
    }

    #[test]
    fn taught_examples_survive_a_restart() {
        let mut store = store();
        for number in 0..CAPACITY {
            assert_eq!(store.add(example(number)), Ok(number));
        }
        assert_eq!(store.add(example(99)), Err(example(99)), "a full store returns the example");
        let mut store = restart(store);
        assert_eq!(store.len(), usize::from(CAPACITY));
        assert!(store.forget(7));
        assert!(!store.forget(7) && !store.forget(CAPACITY));
        let mut store = restart(store);
        assert_eq!((store.slot(7), store.slot(8)), (None, Some(example(8))));
        assert_eq!(store.add(example(50)), Ok(7), "the free slot is used again");
    }

    #[test]
    fn power_lost_at_any_byte_costs_at_most_the_example_being_written() {
        for power in 0..=SLOT {
            for forgetting in [false, true] {
                let mut store = holding(0..4);
                store.memory.lose_power_after(power);
                if forgetting {
                    store.forget(2);
                } else {
                    store.add(example(4)).unwrap();
                }
                let store = restart(store);
                for number in [0, 1, 3] {
                    assert_eq!(store.slot(number), Some(example(number)), "{power} {forgetting}");
                }
                let (slot, before, after) =
                    if forgetting { (2, Some(example(2)), None) } else { (4, None, Some(example(4))) };
                let now = store.slot(slot);
                match power {
                    0 => assert_eq!((now, store.spoiled()), (before, 0)),
                    SLOT => assert_eq!((now, store.spoiled()), (after, 0)),
                    _ => assert!(now.is_none() || now == before, "{power} {forgetting}: {now:?}"),
                }
            }
        }
    }

    #[test]
    fn a_flipped_bit_drops_its_example_and_is_counted() {
        for byte in 0..SLOT {
            for bit in 0..8 {
                let mut store = holding(0..2);
                store.memory.bytes[byte] ^= 1 << bit;
                let store = restart(store);
                assert_eq!((store.slot(0), store.slot(1), store.spoiled()), (None, Some(example(1)), 1));
            }
        }
    }

    #[test]
    fn an_example_of_another_scale_or_with_an_unknown_label_is_invalid() {
        let encoded = |label| encode(Example::new([1, 2, 3, 4, 5], label));
        let check = checksum(&[1, 2, 3, 4, 5, 0, !SCALE_MARK[0], SCALE_MARK[1]]);
        let mut of_another_scale = encoded(0);
        of_another_scale[6..].copy_from_slice(&check.to_le_bytes());
        for slot in [of_another_scale, encoded(label::COUNT as u8), encoded(VACANT)] {
            let mut memory = Volatile::new();
            memory.bytes[..SLOT].copy_from_slice(&slot);
            let store = init(memory);
            assert_eq!((store.slot(0), store.len(), store.spoiled()), (None, 0, 1), "{slot:?}");
        }
    }

    #[test]
    fn an_example_forgotten_before_it_is_written_is_erased() {
        let mut store = store();
        store.add(example(1)).unwrap();
        store.add(example(2)).unwrap();
        assert!(!store.carry_on(), "the first is being written");
        assert!(store.forget(0) && store.forget(1));
        assert_eq!(store.add(example(3)), Ok(0), "its slot is free, although bytes are still to be written");
        let store = restart(store);
        assert_eq!((store.slot(0), store.slot(1), store.spoiled()), (Some(example(3)), None, 0));
    }
}
