//! A number that an interrupt handler and the loop share.
//!
//! A byte is read or written by one instruction, so nothing can come in between, and no interrupt has to be held off. The
//! core library's atomic byte would do the same, but on this chip it turns interrupts off around every access. A longer
//! number is read byte by byte: where the other side could come in between and change it, its reader turns interrupts off.
//! All accesses are volatile, so they stay in the order in which they are written.

use core::cell::UnsafeCell;

/// A type all of whose patterns of bits are values.
///
/// # Safety
///
/// That, and nothing that has to be dropped.
pub unsafe trait AnyBits: Copy {}

// SAFETY: every pattern of bits is a number.
unsafe impl AnyBits for u8 {}
// SAFETY: every pattern of bits is a number.
unsafe impl AnyBits for u16 {}

/// A number, from either side.
#[repr(transparent)]
pub struct Shared<T>(UnsafeCell<T>);

/// A byte, from either side: always whole.
pub type Byte = Shared<u8>;

// SAFETY: the chip has one core. A handler that comes into an access can leave half of an old number and half of a new one
// there, which is a number all the same.
unsafe impl<T: AnyBits> Sync for Shared<T> {}

impl<T: AnyBits> Shared<T> {
    /// A number with a first value.
    pub const fn new(value: T) -> Self {
        Self(UnsafeCell::new(value))
    }

    /// The value.
    #[inline(always)]
    pub fn get(&self) -> T {
        // SAFETY: the number lives as long as `self`, and no reference into the cell is ever made.
        unsafe { self.0.get().read_volatile() }
    }

    /// Gives it a new value.
    #[inline(always)]
    pub fn set(&self, value: T) {
        // SAFETY: as in `get`.
        unsafe { self.0.get().write_volatile(value) }
    }
}
