//! Field examples: taught by the operator, and kept in the EEPROM.
//!
//! Each of [`CAPACITY`] examples has a slot of eight bytes: five features, the label, and a CRC-16. The CRC covers features, label
//! and the features' scale, because on another scale the bytes mean something else. A slot without a label is free, as after an
//! unfinished save. One with a label and a wrong CRC, as after a flipped bit, is free too, and counted as spoiled.
//!
//! The examples stay in the EEPROM: a search reads them there, a few in each turn. It waits while a byte is being written. A change
//! writes one byte each time the memory is ready. Until all are written, the slot counts as spoiled or as it was.

use crate::{
    ground::{class::label, examples, features},
    memory::{ERASED, Memory, checksum},
};
use knn::{Example, Examples};

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
    /// The slots that are yet to hold `bytes`: from the first up to the second.
    next: u8,
    end: u8,
    bytes: [u8; SLOT],
    /// The next byte of the slot that is being written.
    next_byte: u8,
}

impl<M: Memory> FieldExamples<M> {
    /// The store in a memory.
    pub const fn new(memory: M) -> Self {
        Self { memory, next: 0, end: 0, bytes: [0; SLOT], next_byte: 0 }
    }

    /// Whether the memory can be read now.
    pub fn is_ready(&self) -> bool {
        self.memory.is_ready()
    }

    /// Slots with a label and a wrong CRC.
    pub fn spoiled(&self) -> u8 {
        (0..CAPACITY).filter(|&number| self.label(number) != ERASED && self.slot(number).is_none()).count() as u8
    }

    fn label(&self, number: u8) -> u8 {
        self.memory.read(Self::address(number) + features::COUNT as u16)
    }

    /// The example in a slot. Only if [`is_ready`](Self::is_ready).
    #[inline(never)]
    pub fn slot(&self, number: u8) -> Option<Taught> {
        // Most slots have no label, and need no CRC.
        if number >= CAPACITY || usize::from(self.label(number)) >= label::COUNT {
            return None;
        }
        let mut bytes = [0; SLOT];
        for (address, byte) in (Self::address(number)..).zip(&mut bytes) {
            *byte = self.memory.read(address);
        }
        let [a, b, c, d, e, label, low, high] = bytes;
        (check(&mut bytes) == u16::from_le_bytes([low, high])).then_some(Example::new([a, b, c, d, e], label))
    }

    /// Adds an example. [`carry_on`](Self::carry_on) writes it. Returns whether there was room.
    ///
    /// Like the other changes only once the last one is written. A command's answer waits for that, so the next command comes later.
    pub fn add(&mut self, example: Taught) -> bool {
        let free = (0..CAPACITY).find(|&number| self.slot(number).is_none());
        if let Some(number) = free {
            self.write(number, number + 1, encode(example));
        }
        free.is_some()
    }

    /// Forgets the example in a slot. [`carry_on`](Self::carry_on) erases it. Returns whether there was one.
    pub fn forget(&mut self, number: u8) -> bool {
        let is_held = self.slot(number).is_some();
        if is_held {
            self.erase(number, number + 1);
        }
        is_held
    }

    /// Forgets all examples. [`carry_on`](Self::carry_on) erases them.
    pub fn forget_all(&mut self) {
        self.erase(0, CAPACITY);
    }

    #[inline(never)]
    fn erase(&mut self, from: u8, end: u8) {
        self.write(from, end, [ERASED; SLOT]);
    }

    fn write(&mut self, from: u8, end: u8, bytes: [u8; SLOT]) {
        debug_assert!(self.next == self.end, "a change waits until the last one is written");
        (self.next, self.end, self.bytes) = (from, end, bytes);
    }

    /// Writes the next byte, if the memory is ready. Returns whether all is written.
    pub fn carry_on(&mut self) -> bool {
        if self.next == self.end {
            return true;
        }
        if self.memory.update(Self::address(self.next), &self.bytes, &mut self.next_byte) {
            self.next += 1;
        }
        false
    }

    /// The memory, for a test or another machine.
    pub fn into_memory(self) -> M {
        self.memory
    }

    /// A slot's first address.
    const fn address(number: u8) -> u16 {
        M::EXAMPLES + number as u16 * SLOT as u16
    }
}

impl<M: Memory> Examples<{ features::COUNT }> for FieldExamples<M> {
    fn len(&self) -> usize {
        (0..CAPACITY).filter_map(|slot| self.slot(slot)).count()
    }

    fn example(&self, index: usize) -> Option<Taught> {
        (0..CAPACITY).filter_map(|slot| self.slot(slot)).nth(index)
    }
}

fn encode(example: Taught) -> [u8; SLOT] {
    let [a, b, c, d, e] = example.features;
    let mut bytes = [a, b, c, d, e, example.label, 0, 0];
    let [low, high] = check(&mut bytes).to_le_bytes();
    [bytes[6], bytes[7]] = [low, high];
    bytes
}

/// The CRC of an example, with the scale in the place of the CRC.
#[inline(never)]
fn check(bytes: &mut [u8; SLOT]) -> u16 {
    [bytes[6], bytes[7]] = SCALE_MARK;
    checksum(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::memory::Volatile;

    fn store() -> FieldExamples<Volatile> {
        init(Volatile::new())
    }

    fn init(memory: Volatile) -> FieldExamples<Volatile> {
        FieldExamples::new(memory)
    }

    fn example(number: u8) -> Taught {
        Example::new([number, 2, 3, 4, 5], number % 2)
    }

    /// A store with examples of these numbers, all written.
    fn holding(numbers: impl Iterator<Item = u8>) -> FieldExamples<Volatile> {
        let mut store = store();
        for number in numbers {
            assert!(store.add(example(number)));
            while !store.carry_on() {}
        }
        store
    }

    /// The store after all is written and the power was off.
    fn restart(mut store: FieldExamples<Volatile>) -> FieldExamples<Volatile> {
        while !store.carry_on() {}
        init(store.memory.with_power())
    }

    #[test]
    fn taught_examples_survive_a_restart() {
        let mut store = holding(0..CAPACITY);
        assert!(!store.add(example(99)), "a full store takes no example");
        let mut store = restart(store);
        assert_eq!(store.len(), usize::from(CAPACITY));
        assert!(store.forget(7));
        let mut store = restart(store);
        assert!(!store.forget(7) && !store.forget(CAPACITY));
        assert_eq!((store.slot(7), store.slot(8)), (None, Some(example(8))));
        assert!(store.add(example(50)));
        let mut store = restart(store);
        assert_eq!(store.slot(7), Some(example(50)), "the free slot is used again");
        store.forget_all();
        let store = restart(store);
        assert_eq!((store.len(), store.spoiled()), (0, 0));
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
                    assert!(store.add(example(4)));
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
        for slot in [of_another_scale, encoded(label::COUNT as u8), encoded(254)] {
            let mut memory = Volatile::new();
            memory.bytes[..SLOT].copy_from_slice(&slot);
            let store = init(memory);
            assert_eq!((store.slot(0), store.len(), store.spoiled()), (None, 0, 1), "{slot:?}");
        }
    }
}
