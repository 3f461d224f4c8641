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

/// The EEPROM, and what is yet to be written.
pub struct Eeprom {
    registers: EEPROM,
    bytes: [u8; SLOT],
    /// Address of the next byte.
    address: u16,
    /// Bytes still to go.
    left: u8,
}

impl Eeprom {
    /// The EEPROM, with nothing to be written.
    pub const fn new(registers: EEPROM) -> Self {
        Self { registers, bytes: [0; SLOT], address: 0, left: 0 }
    }

    fn is_busy(&self) -> bool {
        self.registers.eecr().read().eepe().bit_is_set()
    }

    /// Waits for the byte under way, at most 3.4 ms.
    fn wait(&self) {
        while self.is_busy() {}
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
        self.wait();
        let start = BASE + u16::from(slot) * SLOT as u16;
        let mut address = start;
        [(); SLOT].map(|()| {
            self.registers.eear().write(|w| w.set(address));
            self.registers.eecr().modify(|_, w| w.eere().set_bit());
            address += 1;
            self.registers.eedr().read().bits()
        })
    }

    fn write(&mut self, slot: u8, bytes: [u8; SLOT]) {
        while !self.carry_on() {}
        self.bytes = bytes;
        self.address = BASE + u16::from(slot) * SLOT as u16;
        self.left = SLOT as u8;
    }

    fn carry_on(&mut self) -> bool {
        if self.is_busy() {
            return false;
        }
        if self.left == 0 {
            return true;
        }
        let byte = self.bytes[SLOT - usize::from(self.left)];
        self.write_byte(self.address, byte);
        self.address += 1;
        self.left -= 1;
        false
    }
}
