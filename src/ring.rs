//! The indices of a lock-free queue between an interrupt handler and the loop.
//!
//! One side only pushes and the other only takes. Each has its own index, which the other side reads and never writes. A slot is
//! filled before its index passes it on, and read before its index frees it. The indices wrap as bytes, not at the last slot. So
//! their difference is the queue's length, and all slots can be used. An item is in the slot that the incremented index names,
//! which is what a handler has in its register. The user of the queue owns the slots.
//!
//! This file is the loop's side. A handler's side is a few lines of assembly beside its slots, with [`Ring::PUSHED`],
//! [`Ring::TAKEN`] and [`Ring::MASK`].

use crate::shared::Byte;
use core::mem::offset_of;

/// The indices of a queue of `SLOTS` items, a power of two up to 128.
///
/// Wrong use gives a wrong slot, but never a slot outside the queue.
#[repr(C)]
pub struct Ring<const SLOTS: usize> {
    /// Items pushed since power-up, modulo 256; only the pushing side writes it.
    pushed: Byte,
    /// Items taken since power-up, modulo 256; only the taking side writes it.
    taken: Byte,
}

impl<const SLOTS: usize> Ring<SLOTS> {
    const LENGTH: u8 = {
        assert!(SLOTS.is_power_of_two() && SLOTS <= 128);
        SLOTS as u8
    };

    /// Offset of the pushing side's index.
    pub const PUSHED: usize = offset_of!(Self, pushed);
    /// Offset of the taking side's index.
    pub const TAKEN: usize = offset_of!(Self, taken);
    /// The bits of an index that select a slot.
    pub const MASK: u8 = Self::LENGTH - 1;

    /// The indices of an empty queue.
    pub const fn new() -> Self {
        Self { pushed: Byte::new(0), taken: Byte::new(0) }
    }

    /// Items that can be pushed now; more once the other side takes some.
    #[inline(always)]
    pub fn room(&self) -> u8 {
        Self::LENGTH - self.pushed.get().wrapping_sub(self.taken.get())
    }

    /// Whether the queue is empty.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.pushed.get() == self.taken.get()
    }

    /// Lets `fill` fill the next slot, and passes it on. Returns whether there was room.
    #[inline(always)]
    #[must_use]
    pub fn push(&self, fill: impl FnOnce(usize)) -> bool {
        if self.room() == 0 {
            return false;
        }
        let pushed = self.pushed.get().wrapping_add(1);
        fill(Self::slot(pushed));
        self.pushed.set(pushed);
        true
    }

    /// Lets `empty` read the oldest item's slot, and frees the slot.
    #[inline(always)]
    pub fn take<Item>(&self, empty: impl FnOnce(usize) -> Item) -> Option<Item> {
        if self.is_empty() {
            return None;
        }
        let taken = self.taken.get().wrapping_add(1);
        let item = empty(Self::slot(taken));
        self.taken.set(taken);
        Some(item)
    }

    /// The slot of the item at this index.
    #[inline(always)]
    fn slot(index: u8) -> usize {
        usize::from(index & Self::MASK)
    }
}
