//! The memories of the ATmega328P that keep their content.

/// Flash of the ATmega328P in bytes (data sheet, section 8.2).
pub const FLASH_BYTES: usize = 32 * 1024;

/// EEPROM of the ATmega328P in bytes (data sheet, section 8.4).
pub const EEPROM_BYTES: usize = 1024;
