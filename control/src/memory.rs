//! Memory that outlives the power, a byte at a time, and the check on what it keeps.
//!
//! The EEPROM takes 3.4 ms to write a byte. So whoever keeps something there writes one byte whenever the memory can take
//! one, and nothing waits. What the bytes mean is the business of [`saved`](crate::operate::saved) and [`field_examples`](crate::ground::field_examples),
//! each of which has a memory of [`SIZE`] bytes to itself.

/// Bytes of a memory: half an ATmega328P's EEPROM.
pub const SIZE: usize = 512;

/// What erased memory reads as.
pub const ERASED: u8 = 0xFF;

/// The CRC over what is kept, CRC-16/IBM-SDLC: a byte at a time, and without a table, which would cost flash. A library's would do it bit by
/// bit, in 13,000 cycles for the settings, which are saved within a turn of the loop.
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
    /// The byte at an address; only when [`is_ready`](Self::is_ready), as nothing can be read while a byte is being written.
    fn read(&self, address: u16) -> u8;

    /// Whether bytes can be read and one be written now.
    fn is_ready(&self) -> bool;

    /// Begins to write a byte; only when [`is_ready`](Self::is_ready).
    fn write(&mut self, address: u16, byte: u8);
}

/// A memory for the host, which forgets with the program, and whose power can be made to fail.
#[derive(Clone, Debug)]
pub struct Volatile {
    /// What it holds.
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

    /// Takes the power away after so many more bytes: what is written then is lost.
    pub const fn lose_power_after(&mut self, bytes: usize) {
        self.power = bytes;
    }

    /// The memory as it is found when the power is back.
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

    #[test]
    fn the_checksum_is_that_of_its_catalogue() {
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
