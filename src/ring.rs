//! The indices of a queue between an interrupt handler and the loop, which neither has to lock.
//!
//! One side only pushes and one side only takes. Each has an index of its own, which the other reads and never writes:
//! a slot is filled before the index passes it on, and emptied before it is given back. The indices count on past the
//! last slot and wrap with their byte, so that their difference is the queue's length and every slot can be used. An item lies
//! in the slot that the index behind it names, which is what a handler has at hand once it has counted on. The slots belong
//! to the user, who knows what is in one.
//!
//! The loop's side of a queue is here. The handlers' sides are a few lines of assembly each, beside their slots; of a queue
//! they know [`Ring::PUSHED`], [`Ring::TAKEN`] and [`Ring::MASK`].

use crate::shared::Byte;
use core::mem::offset_of;

/// The indices of a queue of `SLOTS` items, a power of two up to 128.
///
/// Used from two sides otherwise than described above, it gives the wrong slot; it never gives one that is not there.
#[repr(C)]
pub struct Ring<const SLOTS: usize> {
    /// Items pushed since power-up, modulo 256; written where items come in.
    pushed: Byte,
    /// Items taken since power-up, modulo 256; written where items go out.
    taken: Byte,
}

impl<const SLOTS: usize> Ring<SLOTS> {
    const LENGTH: u8 = {
        assert!(SLOTS.is_power_of_two() && SLOTS <= 128);
        SLOTS as u8
    };

    /// Where in the memory of a queue the index lies that counts on where items come in.
    pub const PUSHED: usize = offset_of!(Self, pushed);
    /// And the one that counts on where items go out.
    pub const TAKEN: usize = offset_of!(Self, taken);
    /// The bits of an index that name a slot.
    pub const MASK: u8 = Self::LENGTH - 1;

    /// The indices of an empty queue.
    pub const fn new() -> Self {
        Self { pushed: Byte::new(0), taken: Byte::new(0) }
    }

    /// Items that can be pushed now, or more if some are taken meanwhile.
    #[inline(always)]
    pub fn room(&self) -> u8 {
        Self::LENGTH - self.pushed.get().wrapping_sub(self.taken.get())
    }

    /// Whether no item waits.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.pushed.get() == self.taken.get()
    }

    /// Has `fill` fill the next slot and passes it on. Returns whether there was room.
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

    /// Has `empty` read the oldest item's slot and gives it back.
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

    /// The slot of the item that this index comes behind.
    #[inline(always)]
    fn slot(index: u8) -> usize {
        usize::from(index & Self::MASK)
    }
}
