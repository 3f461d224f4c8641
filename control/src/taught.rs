//! Examples taught in the field, in memory that outlives the power.
//!
//! Each of [`CAPACITY`] examples has a slot of eight bytes: five features, the label, and a CRC-16 of both and of the scale
//! by which the features became bytes, as under another scale they would mean something else. An erased slot reads as ones. A slot whose CRC does not fit, because the power went away while it was written or a bit fell over, is
//! dropped, and counted so that it can be told. Which slots hold an example is kept in SRAM, as checking them all takes
//! longer than searching them.

use crate::{examples, features};
use crc::{CRC_16_IBM_SDLC, Crc, NoTable};
use knn::{Example, Examples};

/// Examples that can be taught.
pub const CAPACITY: u8 = 32;

/// Bytes of a slot.
pub const SLOT: usize = features::COUNT + 3;

/// An example as it was taught.
type Taught = Example<{ features::COUNT }>;

/// The CRC, without a table: a byte at a time is fast enough for eight bytes, and tables cost flash.
const CHECK: Crc<u16, NoTable> = Crc::<u16, NoTable>::new(&CRC_16_IBM_SDLC);

/// Stands for the scale in each slot's CRC.
const SCALE_MARK: [u8; 2] = CHECK.checksum(&examples::SCALE_BYTES).to_le_bytes();

/// Memory that keeps slots without power.
pub trait Memory {
    /// What lies in a slot, or will lie there once it is written.
    fn read(&self, slot: u8) -> [u8; SLOT];

    /// Begins to write a slot. Whatever is still being written is finished first, which may take time: ask
    /// [`carry_on`](Self::carry_on) before.
    fn write(&mut self, slot: u8, bytes: [u8; SLOT]);

    /// Carries on with a write, without waiting; whether all has been written.
    fn carry_on(&mut self) -> bool;
}

/// A memory that forgets when the power goes: for the host.
#[derive(Clone, Debug)]
pub struct Volatile([[u8; SLOT]; CAPACITY as usize]);

impl Volatile {
    /// A memory with nothing in it.
    pub const fn new() -> Self {
        Self([[ERASED; SLOT]; CAPACITY as usize])
    }
}

impl Default for Volatile {
    fn default() -> Self {
        Self::new()
    }
}

impl Memory for Volatile {
    fn read(&self, slot: u8) -> [u8; SLOT] {
        self.0[usize::from(slot)]
    }

    fn write(&mut self, slot: u8, bytes: [u8; SLOT]) {
        self.0[usize::from(slot)] = bytes;
    }

    fn carry_on(&mut self) -> bool {
        true
    }
}

/// The store of examples taught in the field.
#[derive(Clone, Debug)]
pub struct FieldExamples<M> {
    memory: M,
    slots: [Slot; CAPACITY as usize],
    spoiled: u8,
}

/// What a slot is known to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Slot {
    /// Free.
    Free,
    /// It holds an example.
    Held,
    /// Its example is forgotten and yet to be erased.
    Forgotten,
}

impl<M: Memory> FieldExamples<M> {
    /// Looks through a memory for the examples that it holds.
    pub fn new(memory: M) -> Self {
        let mut store = Self { memory, slots: [Slot::Free; CAPACITY as usize], spoiled: 0 };
        for (number, slot) in (0..).zip(&mut store.slots) {
            let bytes = store.memory.read(number);
            if bytes == encode(example_in(bytes)) {
                *slot = Slot::Held;
            } else if bytes != [ERASED; SLOT] {
                store.spoiled += 1;
            }
        }
        store
    }

    /// Slots that were found spoiled.
    pub fn spoiled(&self) -> u8 {
        self.spoiled
    }

    /// The example in a slot.
    pub fn slot(&self, number: u8) -> Option<Taught> {
        match self.slots.get(usize::from(number)) {
            Some(Slot::Held) => Some(example_in(self.memory.read(number))),
            _ => None,
        }
    }

    /// Adds an example; returns its slot.
    ///
    /// # Errors
    /// The example, when all slots are taken.
    pub fn add(&mut self, example: Taught) -> Result<u8, Taught> {
        for (number, slot) in (0..).zip(&mut self.slots) {
            if *slot != Slot::Held {
                *slot = Slot::Held;
                self.memory.write(number, encode(example));
                return Ok(number);
            }
        }
        Err(example)
    }

    /// Forgets the example in a slot, which [`carry_on`](Self::carry_on) will erase; whether there was one.
    pub fn forget(&mut self, number: u8) -> bool {
        match self.slots.get_mut(usize::from(number)) {
            Some(slot @ Slot::Held) => {
                *slot = Slot::Forgotten;
                true
            }
            _ => false,
        }
    }

    /// Carries on with what is to be written, without waiting; whether all has been.
    pub fn carry_on(&mut self) -> bool {
        if !self.memory.carry_on() {
            return false;
        }
        for (number, slot) in (0..).zip(&mut self.slots) {
            if *slot == Slot::Forgotten {
                *slot = Slot::Free;
                self.memory.write(number, [ERASED; SLOT]);
                return false;
            }
        }
        true
    }
}

impl<M: Memory> Examples<{ features::COUNT }> for FieldExamples<M> {
    fn len(&self) -> usize {
        self.slots.iter().filter(|&&slot| slot == Slot::Held).count()
    }

    fn example(&self, index: usize) -> Option<Taught> {
        (0..CAPACITY).filter_map(|slot| self.slot(slot)).nth(index)
    }

    /// Reads each slot once.
    fn visit_near(&self, query: &[u8; features::COUNT], mut reach: u32, visit: &mut impl FnMut(u32, u8) -> u32) -> u32 {
        for example in (0..CAPACITY).filter_map(|slot| self.slot(slot)) {
            let distance = knn::squared_distance(query, &example.features);
            if distance <= reach {
                reach = visit(distance, example.label);
            }
        }
        reach
    }
}

/// What erased memory reads as.
const ERASED: u8 = 0xFF;

fn encode(example: Taught) -> [u8; SLOT] {
    let [a, b, c, d, e] = example.features;
    let [mark, scale] = SCALE_MARK;
    let [low, high] = CHECK.checksum(&[a, b, c, d, e, example.label, mark, scale]).to_le_bytes();
    [a, b, c, d, e, example.label, low, high]
}

/// What a slot's bytes say, right or not.
fn example_in(bytes: [u8; SLOT]) -> Taught {
    let [a, b, c, d, e, label, ..] = bytes;
    Example::new([a, b, c, d, e], label)
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::{vec, vec::Vec};

    /// A memory whose power goes away after so many bytes.
    #[derive(Clone, Debug)]
    struct Flaky {
        bytes: Vec<[u8; SLOT]>,
        power: usize,
    }

    impl Memory for Flaky {
        fn read(&self, slot: u8) -> [u8; SLOT] {
            self.bytes[usize::from(slot)]
        }

        fn write(&mut self, slot: u8, bytes: [u8; SLOT]) {
            for (old, new) in self.bytes[usize::from(slot)].iter_mut().zip(bytes) {
                if self.power > 0 {
                    *old = new;
                    self.power -= 1;
                }
            }
        }

        fn carry_on(&mut self) -> bool {
            true
        }
    }

    fn store() -> FieldExamples<Flaky> {
        FieldExamples::new(Flaky { bytes: vec![[ERASED; SLOT]; usize::from(CAPACITY)], power: usize::MAX })
    }

    fn example(number: u8) -> Taught {
        Example::new([number, 2, 3, 4, 5], number % 2)
    }

    fn restart(store: FieldExamples<Flaky>) -> FieldExamples<Flaky> {
        FieldExamples::new(Flaky { power: usize::MAX, ..store.memory })
    }

    #[test]
    fn what_was_taught_is_there_after_a_restart() {
        let mut store = store();
        for number in 0..CAPACITY {
            assert_eq!(store.add(example(number)), Ok(number));
        }
        assert_eq!(store.add(example(99)), Err(example(99)), "a full store hands the example back");
        let mut store = restart(store);
        assert_eq!(store.len(), usize::from(CAPACITY));
        assert!(store.forget(7));
        assert!(!store.forget(7) && !store.forget(CAPACITY));
        while !store.carry_on() {}
        let mut store = restart(store);
        assert_eq!((store.slot(7), store.slot(8)), (None, Some(example(8))));
        assert_eq!(store.add(example(50)), Ok(7), "the free slot is taken again");
    }

    #[test]
    fn power_lost_at_any_byte_costs_at_most_the_example_being_written() {
        for power in 0..=SLOT {
            for forgetting in [false, true] {
                let mut store = store();
                for number in 0..4 {
                    store.add(example(number)).unwrap();
                }
                store.memory.power = power;
                if forgetting {
                    store.forget(2);
                } else {
                    store.add(example(4)).unwrap();
                }
                while !store.carry_on() {}
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
    fn a_spoiled_byte_drops_its_example_and_is_counted() {
        for byte in 0..SLOT {
            for bit in 0..8 {
                let mut store = store();
                store.add(example(0)).unwrap();
                store.add(example(1)).unwrap();
                store.memory.bytes[0][byte] ^= 1 << bit;
                let store = restart(store);
                assert_eq!((store.slot(0), store.slot(1), store.spoiled()), (None, Some(example(1)), 1));
            }
        }
    }

    #[test]
    fn an_example_of_another_scale_is_spoiled() {
        let mut store = store();
        store.add(example(0)).unwrap();
        let [a, b, c, d, e, label, ..] = store.memory.bytes[0];
        let [low, high] = CHECK.checksum(&[a, b, c, d, e, label, !SCALE_MARK[0], SCALE_MARK[1]]).to_le_bytes();
        store.memory.bytes[0][6..].copy_from_slice(&[low, high]);
        let store = restart(store);
        assert_eq!((store.slot(0), store.spoiled()), (None, 1));
    }

    #[test]
    fn field_examples_are_searched_like_any_others() {
        let mut store = store();
        for number in 0..10 {
            store.add(example(number)).unwrap();
        }
        store.forget(3);
        let plain: Vec<_> = (0..10).filter(|&number| number != 3).map(example).collect();
        let query = [4, 2, 3, 4, 9];
        let answer = knn::classify::<{ features::COUNT }, 2>(&store, &query, 3, 1000);
        assert_eq!(answer, knn::classify(&plain[..], &query, 3, 1000));
    }
}
