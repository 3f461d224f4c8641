//! Memory that keeps bytes without power, and the CRC for its contents.
//!
//! The EEPROM takes 3.4 ms to write a byte. So its users write one byte each time the memory is ready, and nothing waits. The
//! contents belong to [`saved`](crate::operate::saved) and [`field_examples`](crate::ground::field_examples). On the chip each has
//! half of the EEPROM, [`SIZE`] bytes. On the host each may have a memory of its own.

/// Bytes of a memory: half of an ATmega328P's EEPROM.
pub const SIZE: usize = 512;

/// The value of an erased byte.
pub const ERASED: u8 = 0xFF;

/// CRC-16/IBM-SDLC, a byte at a time and without a table, which would cost flash. A library's, bit by bit, takes 13,000 cycles for
/// the settings. That is too long, because a save computes it within a turn.
pub(crate) const fn checksum(mut bytes: &[u8]) -> u16 {
    let mut crc = u16::MAX;
    while let Some((&byte, rest)) = bytes.split_first() {
        let low = byte ^ crc as u8;
        let mixed = (low ^ low << 4) as u16;
        crc = (mixed << 8 | crc >> 8) ^ mixed >> 4 ^ mixed << 3;
        bytes = rest;
    }
    !crc
}

/// Memory that keeps bytes without power.
pub trait Memory {
    /// Where the field examples begin. The settings begin at 0.
    const EXAMPLES: u16 = 0;

    /// The byte at an address. Only if [`is_ready`](Self::is_ready): during a write nothing can be read.
    fn read(&self, address: u16) -> u8;

    /// Whether the memory can read, and start a write.
    fn is_ready(&self) -> bool;

    /// Starts to write the first byte that differs from `bytes`, from index `next` on, if the memory is ready. Returns whether all are
    /// written. Correct bytes are not written again, because an EEPROM wears out. Nor is a wrong byte that was just written: the
    /// console must not wait for a cell that no longer holds it.
    #[cfg_attr(target_arch = "avr", inline(never))]
    fn update(&mut self, address: u16, bytes: &[u8], next: &mut u8) -> bool {
        if !self.is_ready() {
            return false;
        }
        while let Some(&byte) = bytes.get(usize::from(*next)) {
            let address = address + u16::from(*next);
            *next += 1;
            if self.read(address) != byte {
                self.write(address, byte);
                return false;
            }
        }
        *next = 0;
        true
    }

    /// Starts to write a byte. Only if [`is_ready`](Self::is_ready).
    fn write(&mut self, address: u16, byte: u8);
}

/// A memory for the host, in RAM. A test can make its power fail.
#[derive(Clone, Debug)]
pub struct Volatile {
    /// The contents.
    pub bytes: [u8; SIZE],
    /// Bytes that can be written until the power fails.
    power: usize,
}

impl Volatile {
    /// An erased memory.
    pub const fn new() -> Self {
        Self::holding([ERASED; SIZE])
    }

    /// A memory that holds these bytes.
    pub const fn holding(bytes: [u8; SIZE]) -> Self {
        Self { bytes, power: usize::MAX }
    }

    /// Makes the power fail after this many more bytes: later writes are lost.
    pub const fn lose_power_after(&mut self, bytes: usize) {
        self.power = bytes;
    }

    /// The memory after the power is back.
    pub const fn with_power(self) -> Self {
        Self::holding(self.bytes)
    }
}

impl Default for Volatile {
    fn default() -> Self {
        Self::new()
    }
}

impl Memory for Volatile {
    fn read(&self, address: u16) -> u8 {
        self.bytes[usize::from(address)]
    }

    fn is_ready(&self) -> bool {
        true
    }

    fn write(&mut self, address: u16, byte: u8) {
        if self.power > 0 {
            self.bytes[usize::from(address)] = byte;
            self.power -= 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;

    /// A memory with a cell that no longer changes. It counts the writes, and takes some calls for each.
    struct Worn {
        memory: Volatile,
        cell: u16,
        written: usize,
        busy: Cell<u8>,
    }

    impl Memory for Worn {
        fn read(&self, address: u16) -> u8 {
            assert_eq!(self.busy.get(), 0, "nothing can be read during a write");
            self.memory.read(address)
        }

        fn is_ready(&self) -> bool {
            self.busy.set(self.busy.get().saturating_sub(1));
            self.busy.get() == 0
        }

        fn write(&mut self, address: u16, byte: u8) {
            if address != self.cell {
                self.memory.write(address, byte);
            }
            self.written += 1;
            self.busy.set(3);
        }
    }

    #[test]
    fn an_update_writes_each_wrong_byte_once_despite_a_worn_cell() {
        let bytes = [1, 2, ERASED, 4];
        for cell in 9..=14 {
            let mut worn = Worn { memory: Volatile::new(), cell, written: 0, busy: Cell::new(0) };
            for written in [3, usize::from([10, 11, 13].contains(&cell))] {
                (worn.written, worn.busy) = (0, Cell::new(0));
                let mut next = 0;
                let calls = (1..).find(|_| worn.update(10, &bytes, &mut next));
                assert!(calls <= Some(1 + 3 * 3), "{calls:?}");
                assert_eq!((worn.written, next), (written, 0), "cell {cell}");
            }
            let holds = |address: u16| worn.memory.read(address) == bytes[usize::from(address - 10)];
            assert!((10..14).all(|address| address == cell || holds(address)), "cell {cell}");
        }
    }

    #[test]
    fn the_checksum_matches_the_crc_catalogue() {
        let catalogue = crc::Crc::<u16>::new(&crc::CRC_16_IBM_SDLC);
        let mut bytes = [0_u8; 600];
        let mut number = 1_u32;
        for byte in &mut bytes {
            number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            *byte = (number >> 24) as u8;
        }
        for length in 0..=bytes.len() {
            assert_eq!(checksum(&bytes[..length]), catalogue.checksum(&bytes[..length]), "{length} bytes");
        }
    }
}
