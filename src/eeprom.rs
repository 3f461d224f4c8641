//! The EEPROM, in two halves: one for the settings, one for the examples taught in the field.
//!
//! A byte takes 3.4 ms to write (data sheet, 8.4.2), in which nothing can be read. Nobody waits for that but [`finish`], once and
//! before the loop turns. What the bytes mean is not known here.

use avr_device::{
    atmega328p::{EEPROM, eeprom},
    interrupt,
};
use control::memory::{Memory, SIZE};
use core::arch::asm;

/// A half of the EEPROM: the one that begins at address `BASE`.
pub struct Half<const BASE: u16>(());

/// The half with the settings.
pub type Lower = Half<0>;

/// The half with the examples taught in the field.
pub type Upper = Half<{ SIZE as u16 }>;

/// Waits, 3.4 ms at the most, for the byte whose write a reset has come into: the chip finishes it (data sheet, 8.4.3).
pub fn finish(eeprom: &EEPROM) {
    while eeprom.eecr().read().eepe().bit_is_set() {}
}

impl<const BASE: u16> Half<BASE> {
    /// The half.
    ///
    /// # Safety
    /// To be had once for each `BASE`, by the loop alone, before anybody else uses the EEPROM.
    pub const unsafe fn new() -> Self {
        Self(())
    }

    fn registers(&self) -> &eeprom::RegisterBlock {
        // SAFETY: who made the halves vouches that the loop alone uses the EEPROM.
        unsafe { &*EEPROM::ptr() }
    }

    fn choose(&self, address: u16) {
        self.registers().eear().write(|w| w.set(BASE + address));
    }
}

impl<const BASE: u16> Memory for Half<BASE> {
    fn read(&self, address: u16) -> u8 {
        self.choose(address);
        self.registers().eecr().modify(|_, w| w.eere().set_bit());
        self.registers().eedr().read().bits()
    }

    fn is_ready(&self) -> bool {
        self.registers().eecr().read().eepe().bit_is_clear()
    }

    fn write(&mut self, address: u16, byte: u8) {
        self.choose(address);
        self.registers().eedr().write(|w| w.set(byte));
        interrupt::free(|_| {
            // SAFETY: EECR (0x1f) belongs to this file alone; EEPE is set right after EEMPE, within the four cycles that
            // the chip allows, which no interrupt can stretch in here (8.6.3).
            unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1") };
        });
    }
}
