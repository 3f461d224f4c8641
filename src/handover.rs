//! Hands a value over to an interrupt handler, which then owns it.
//!
//! A queue has two ends; the loop keeps one and the handler gets the other. Taking a lock each time would cost more than
//! what the handler does, so who may touch the value is settled once and for all, by the two functions' contracts.

use avr_device::interrupt::CriticalSection;
use core::cell::UnsafeCell;

/// A place for a value that one interrupt handler owns.
pub struct Handover<T>(UnsafeCell<Option<T>>);

// SAFETY: `give` runs with interrupts off and `with` in the one handler that owns the value, so the value is never
// touched by two at once; being sent from the loop to the handler takes `Send`.
unsafe impl<T: Send> Sync for Handover<T> {}

impl<T> Handover<T> {
    /// An empty place.
    pub const fn new() -> Self {
        Self(UnsafeCell::new(None))
    }

    /// Hands the value over.
    pub fn give(&self, _: CriticalSection, value: T) {
        // SAFETY: with interrupts off, as the argument shows, the handler is not in `with`; nor is this function, which
        // the loop calls and does not leave halfway.
        unsafe { *self.0.get() = Some(value) }
    }

    /// Lets the handler use its value; nothing happens before it was handed over.
    ///
    /// # Safety
    /// To be called by the one handler that owns the value, and not from within `action`.
    pub unsafe fn with(&self, action: impl FnOnce(&mut T)) {
        // SAFETY: the caller is the owner and handlers do not interrupt themselves, so this is the only reference.
        if let Some(value) = unsafe { &mut *self.0.get() } {
            action(value);
        }
    }
}
