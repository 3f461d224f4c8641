//! The EEPROM. The settings have its first half, the field examples the second.
//!
//! A byte takes 3.4 ms to write (data sheet, 8.4.2), and during a write nothing can be read. Only [`finish`] waits for a write,
//! once, before the loop starts. This file does not interpret the bytes.

use avr_device::{
    atmega328p::{EEPROM, eeprom},
    interrupt,
};
use control::memory::{Memory, SIZE};
use core::arch::asm;

/// The chip's EEPROM.
pub struct Eeprom(());

/// Waits at most 3.4 ms for a write that a reset interrupted: the chip completes it (data sheet, 8.4.3).
pub fn finish(eeprom: &EEPROM) {
    while eeprom.eecr.read().eepe().bit_is_set() {}
}

impl Eeprom {
    /// The EEPROM.
    ///
    /// # Safety
    /// The caller uses all of them from the loop only. No other code writes the EEPROM before.
    pub const unsafe fn new() -> Self {
        Self(())
    }

    fn registers(&self) -> &eeprom::RegisterBlock {
        // SAFETY: the caller of `new` guarantees that only the loop uses the EEPROM.
        unsafe { &*EEPROM::ptr() }
    }

    fn choose(&self, address: u16) {
        self.registers().eear.write(|w| w.bits(address));
    }
}

impl Memory for Eeprom {
    const EXAMPLES: u16 = SIZE as u16;

    fn read(&self, address: u16) -> u8 {
        self.choose(address);
        self.registers().eecr.modify(|_, w| w.eere().set_bit());
        self.registers().eedr.read().bits()
    }

    fn is_ready(&self) -> bool {
        self.registers().eecr.read().eepe().bit_is_clear()
    }

    fn write(&mut self, address: u16, byte: u8) {
        self.choose(address);
        self.registers().eedr.write(|w| w.bits(byte));
        interrupt::free(|_| {
            // SAFETY: only this file uses EECR (0x1f). EEPE is set right after EEMPE, within the four cycles that the chip allows.
            // Interrupts are off, so none can delay it (8.6.3).
            unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1") };
        });
    }
}
