//! The indices of a queue between an interrupt handler and the loop, which neither has to lock.
//!
//! One side only pushes and one side only takes. Each has an index of its own, which the other reads and never writes:
//! a slot is filled before the index passes it on, and emptied before it is given back. The indices count on past the
//! last slot and wrap with their byte, so that their difference is the queue's length and every slot can be used. The
//! slots belong to the user, who knows what is in one.

use crate::shared::Byte;

/// The indices of a queue of `SLOTS` items, a power of two up to 128.
///
/// Used from two sides otherwise than described above, it gives the wrong slot; it never gives one that is not there.
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

    /// Has `fill` fill the next slot and passes it on. Returns whether there was room. `fill` is given the slot and the
    /// room, of which this slot is a part.
    #[inline(always)]
    #[must_use]
    pub fn push(&self, fill: impl FnOnce(usize, u8)) -> bool {
        let pushed = self.pushed.get();
        let room = Self::LENGTH - pushed.wrapping_sub(self.taken.get());
        if room == 0 {
            return false;
        }
        fill(Self::slot(pushed), room);
        self.pushed.set(pushed.wrapping_add(1));
        true
    }

    /// Has `empty` read the oldest item's slot and gives it back.
    #[inline(always)]
    pub fn take<Item>(&self, empty: impl FnOnce(usize) -> Item) -> Option<Item> {
        let taken = self.taken.get();
        if taken == self.pushed.get() {
            return None;
        }
        let item = empty(Self::slot(taken));
        self.taken.set(taken.wrapping_add(1));
        Some(item)
    }

    /// The slot of the item with this number.
    #[inline(always)]
    fn slot(number: u8) -> usize {
        usize::from(number % Self::LENGTH)
    }
}
