//! The errors of a virtual Uno: it could not start, it stopped, or a wait timed out.

use crate::file_error::FileError;
use crate::memory::EEPROM_BYTES;

/// Why a virtual Uno could not start, or stopped.
#[derive(Debug, thiserror::Error)]
pub enum UnoError {
    /// The ELF or the bootloader cannot be used.
    #[error(transparent)]
    File(#[from] FileError),
    /// The firmware reaches into the bootloader.
    #[error("the firmware takes {bytes} bytes of flash: the bootloader leaves {available}")]
    NoRoom {
        /// The firmware's size.
        bytes: usize,
        /// The available flash in bytes.
        available: usize,
    },
    /// The EEPROM content does not fit.
    #[error("{0} bytes of EEPROM content were given: the ATmega328P holds {EEPROM_BYTES}")]
    EepromTooLarge(usize),
    /// The firmware met an invalid instruction, or ran past the end of its flash.
    #[error("the firmware crashed at cycle {cycle}, address {program_counter:#06x} of flash")]
    Crashed {
        /// When.
        cycle: u64,
        /// The address in bytes.
        program_counter: u32,
    },
    /// The firmware sleeps with interrupts off, and the watchdog does not reset it. Only a reset from outside can.
    #[error(
        "the firmware halted at cycle {cycle}, address {program_counter:#06x} of flash: it sleeps with interrupts off"
    )]
    Halted {
        /// When.
        cycle: u64,
        /// The address in bytes.
        program_counter: u32,
    },
    /// The ELF has no such symbol, or the bytes do not fit into it.
    #[error("the firmware has no variable `{symbol}` of at least {length} bytes: give its path from the crate on")]
    NoVariable {
        /// The symbol asked for.
        symbol: String,
        /// Number of bytes to write.
        length: usize,
    },
    /// The bytes do not fit into SRAM.
    #[error("{length} bytes from {address:#06x} do not fit into SRAM, which is from 0x0100 to 0x08ff")]
    NotInSram {
        /// Address of the first byte.
        address: u16,
        /// Their number.
        length: usize,
    },
    /// The ELF has no such function.
    #[error("the firmware has no function `{0}`: give its path from the crate on")]
    NoFunction(String),
    /// The firmware did not reach a function.
    #[error("the firmware did not reach `{symbol}` within {timeout_cycles} cycles")]
    NotReached {
        /// The function.
        symbol: String,
        /// The timeout.
        timeout_cycles: u64,
    },
    /// A text that was waited for did not come.
    #[error("the firmware did not send {text:?} within {timeout_cycles} cycles; it sent {received:?}")]
    NoAnswer {
        /// The awaited text.
        text: String,
        /// The time limit.
        timeout_cycles: u64,
        /// The received text; [`Uno::received`](crate::Uno::received) still returns it.
        received: String,
    },
}
