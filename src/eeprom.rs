//! The EEPROM, in two halves: one for the settings, one for the examples taught in the field.
//!
//! A byte takes 3.4 ms to write (data sheet, 8.4.2), and nothing here waits for it, but who reads meanwhile: nothing can be
//! read while a byte is written. What the bytes mean is not known here.

use avr_device::{
    atmega328p::{EEPROM, eeprom},
    interrupt,
};
use control::memory::{Memory, SIZE};
use core::arch::asm;

/// A half of the EEPROM.
pub struct Half {
    base: u16,
}

/// Both halves: the lower and the upper one.
pub fn halves(_: EEPROM) -> (Half, Half) {
    (Half { base: 0 }, Half { base: SIZE as u16 })
}

impl Half {
    fn registers(&self) -> &eeprom::RegisterBlock {
        // SAFETY: `halves` took the EEPROM, so nobody else has it, and both halves are used by the loop alone.
        unsafe { &*EEPROM::ptr() }
    }

    fn choose(&self, address: u16) {
        self.registers().eear().write(|w| w.set(self.base + address));
    }
}

impl Memory for Half {
    fn read(&self, address: u16) -> u8 {
        // It is there in 3.4 ms at the most.
        while !self.is_ready() {}
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
