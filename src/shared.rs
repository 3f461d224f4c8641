//! A number that an interrupt handler and the loop share.
//!
//! One instruction reads or writes a byte, so access needs no critical section. The core library's atomic byte turns interrupts off
//! around each access on this chip. A longer number is read byte by byte: if the other side may change it, the reader turns
//! interrupts off. All accesses are volatile, so they keep their order.

use core::cell::UnsafeCell;

/// A type for which every bit pattern is a value.
///
/// # Safety
///
/// The implementer guarantees that, and that the type needs no drop.
pub unsafe trait AnyBits: Copy {}

// SAFETY: every pattern of bits is a number.
unsafe impl AnyBits for u8 {}
// SAFETY: every pattern of bits is a number.
unsafe impl AnyBits for u16 {}

/// A shared number.
#[repr(transparent)]
pub struct Shared<T>(UnsafeCell<T>);

/// A shared byte; each access is atomic.
pub type Byte = Shared<u8>;

// SAFETY: the chip has one core. A handler that interrupts an access can leave half of an old and half of a new number. That is a
// valid number too.
unsafe impl<T: AnyBits> Sync for Shared<T> {}

impl<T: AnyBits> Shared<T> {
    /// A number with this value.
    pub const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// The value.
    #[inline(always)]
    pub fn get(&self) -> T {
        // SAFETY: the number lives as long as `self`, and no reference into the cell is ever made.
        unsafe { self.0.get().read_volatile() }
    }

    /// Sets the value.
    #[inline(always)]
    pub fn set(&self, value: T) {
        // SAFETY: as in `get`.
        unsafe { self.0.get().write_volatile(value) }
    }
}
