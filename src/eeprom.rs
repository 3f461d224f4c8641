//! The EEPROM, for the examples taught in the field: eight bytes a slot, from [`BASE`] on.
//!
//! A byte takes 3.4 ms to write (data sheet, 8.4.2). The bytes of one slot wait here and go out one at a time, whenever
//! the loop comes by and the last one is done. Only somebody who reads or writes meanwhile has to wait for what is
//! under way. What the bytes mean is not known here.

use avr_device::{atmega328p::EEPROM, interrupt};
use control::taught::{Memory, SLOT};
use core::arch::asm;

/// Where the slots begin: the lower half is for settings.
const BASE: u16 = 512;

/// The EEPROM, and the slot that is being written.
pub struct Eeprom {
    registers: EEPROM,
    slot: u8,
    bytes: [u8; SLOT],
    /// Bytes still to go.
    left: u8,
}

impl Eeprom {
    /// The EEPROM, with nothing to be written.
    pub const fn new(registers: EEPROM) -> Self {
        Self { registers, slot: 0, bytes: [0; SLOT], left: 0 }
    }

    fn is_busy(&self) -> bool {
        self.registers.eecr().read().eepe().bit_is_set()
    }

    fn write_byte(&mut self, address: u16, byte: u8) {
        self.registers.eear().write(|w| w.set(address));
        self.registers.eedr().write(|w| w.set(byte));
        interrupt::free(|_| {
            // SAFETY: EECR (0x1f) belongs to this file alone; EEPE is set right after EEMPE, within the four cycles that
            // the chip allows, which no interrupt can stretch in here (8.6.3).
            unsafe { asm!("sbi 0x1f, 2", "sbi 0x1f, 1") };
        });
    }
}

impl Memory for Eeprom {
    fn read(&self, slot: u8) -> [u8; SLOT] {
        if self.left > 0 && slot == self.slot {
            return self.bytes;
        }
        // Nothing can be read while a byte is written: it is there in 3.4 ms at the most.
        while self.is_busy() {}
        let mut bytes = [0; SLOT];
        for (address, byte) in (address(slot)..).zip(&mut bytes) {
            self.registers.eear().write(|w| w.set(address));
            self.registers.eecr().modify(|_, w| w.eere().set_bit());
            *byte = self.registers.eedr().read().bits();
        }
        bytes
    }

    fn write(&mut self, slot: u8, bytes: [u8; SLOT]) {
        while !self.carry_on() {}
        self.slot = slot;
        self.bytes = bytes;
        self.left = SLOT as u8;
    }

    fn carry_on(&mut self) -> bool {
        if self.is_busy() {
            return false;
        }
        if self.left == 0 {
            return true;
        }
        let written = SLOT as u8 - self.left;
        self.write_byte(address(self.slot) + u16::from(written), self.bytes[usize::from(written)]);
        self.left -= 1;
        false
    }
}

/// Where a slot begins.
const fn address(slot: u8) -> u16 {
    BASE + slot as u16 * SLOT as u16
}
