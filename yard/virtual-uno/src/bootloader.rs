//! A bootloader, read from its HEX file or compiled.
//!
//! A bootloader is at the end of the flash, and every reset starts it. If it receives new firmware in time it writes
//! that, otherwise it starts the present firmware. [`Uno`](crate::Uno) runs it.

use crate::elf::Image;
use crate::error::UnoError;
use crate::file_error::FileError;
use crate::hex;
use crate::memory::FLASH_BYTES;
use std::fmt::Display;
use std::ops::Range;
use std::path::Path;
use std::process::{Command, Stdio};

/// Sizes of the boot section in bytes, selected by the fuses (data sheet, boot size configuration).
const BOOT_SECTION_BYTES: [usize; 4] = [512, 1024, 2048, 4096];

/// Path of Optiboot's source in Debian's arduino-core-avr.
const OPTIBOOT_SOURCE: &str = "/usr/share/arduino/hardware/arduino/avr/bootloaders/optiboot/optiboot.c";

/// Start address of Optiboot, in the smallest boot section.
const OPTIBOOT_START: u16 = 0x7E00;

/// A bootloader for the ATmega328P.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bootloader {
    start: u16,
    code: Vec<u8>,
}

impl Bootloader {
    /// Reads a bootloader's Intel HEX file.
    ///
    /// # Errors
    /// If it cannot be read, is not Intel HEX, or does not lie in the chip's boot section.
    pub fn read(path: &Path) -> Result<Bootloader, FileError> {
        let wrong = |problem: String| FileError::new(path, problem);
        let right = "take a bootloader's .hex, such as ATmegaBOOT_168_atmega328.hex";
        let text = String::from_utf8_lossy(&FileError::bytes(path)?).into_owned();
        let filled = hex::filled(&text).map_err(|reason| wrong(format!("is no Intel HEX file: {reason}; {right}")))?;
        let (Range { start, end }, flash) = filled;
        if end == 0 {
            return Err(wrong(format!("is empty: {right}")));
        }
        let fits = end <= FLASH_BYTES && BOOT_SECTION_BYTES.contains(&FLASH_BYTES.wrapping_sub(start));
        let Some(start_address) = u16::try_from(start).ok().filter(|_| fits) else {
            return Err(wrong(format!(
                "is no bootloader for the ATmega328P: it fills flash from {start:#06x} to {end:#06x}, and should begin at \
                 0x7000, 0x7800, 0x7c00 or 0x7e00 and end by 0x8000"
            )));
        };
        Ok(Bootloader { start: start_address, code: flash[start..end].to_vec() })
    }

    /// Compiles Optiboot, the Uno's own bootloader. The file of it that Debian has ready is longer than its boot section.
    ///
    /// # Errors
    /// If avr-gcc or the source is missing.
    pub fn optiboot() -> Result<Bootloader, FileError> {
        let not_compiled = |reason: &dyn Display| {
            let needs = "it takes avr-gcc and the source, which Debian has as gcc-avr and arduino-core-avr";
            FileError::new(Path::new(OPTIBOOT_SOURCE), format_args!("cannot be compiled ({reason}): {needs}"))
        };
        let elf = tempfile::NamedTempFile::new().map_err(|error| not_compiled(&error))?;
        let status = Command::new("avr-gcc")
            .args(["-mmcu=atmega328p", "-DF_CPU=16000000L", "-DBAUD_RATE=115200", "-w", "-Os", "-mrelax", "-nostdlib"])
            .args(["-fno-split-wide-types", "-fno-inline-small-functions", "-nostartfiles"])
            .arg(format!("-Wl,--section-start=.text={OPTIBOOT_START:#x}"))
            .arg("-o")
            .args([elf.path(), Path::new(OPTIBOOT_SOURCE)])
            .stdin(Stdio::null())
            .status()
            .map_err(|error| not_compiled(&error))?;
        if !status.success() {
            return Err(not_compiled(&status));
        }
        let code = Image::read(elf.path())?.flash.split_off(OPTIBOOT_START.into());
        Ok(Bootloader { start: OPTIBOOT_START, code })
    }

    /// Address of its first byte in flash, where a reset starts it. It equals the number of bytes for the firmware.
    pub fn start(&self) -> u16 {
        self.start
    }

    /// All that goes into flash: the firmware, then erased flash, then the bootloader.
    ///
    /// # Errors
    /// If the firmware reaches into the bootloader.
    pub fn behind(&self, firmware: &[u8]) -> Result<Vec<u8>, UnoError> {
        check_room(firmware.len(), self.start.into())?;
        let mut flash = firmware.to_vec();
        flash.resize(self.start.into(), 0xFF);
        flash.extend_from_slice(&self.code);
        Ok(flash)
    }
}

/// Checks that a firmware of `bytes` fits into the flash beside a bootloader.
///
/// # Errors
/// If it does not.
pub fn check_room(bytes: usize, available: usize) -> Result<(), UnoError> {
    if bytes <= available { Ok(()) } else { Err(UnoError::NoRoom { bytes, available }) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use ihex::Record;

    /// The text of a file with these bytes from an address on.
    fn hex(address: u16, bytes: &[u8]) -> String {
        let lines = bytes.chunks(255).zip((address..).step_by(255));
        let data = lines.map(|(line, offset)| Record::Data { offset, value: line.to_vec() });
        let records: Vec<Record> = data.chain([Record::EndOfFile]).collect();
        ihex::create_object_file_representation(&records).unwrap()
    }

    fn read(text: &str) -> Result<Bootloader, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        Bootloader::read(file.path()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_bootloader_stands_at_its_address_behind_the_firmware() {
        let bootloader = read(&hex(0x7800, &[1, 2, 3])).unwrap();
        assert_eq!(bootloader.start(), 0x7800);
        let flash = bootloader.behind(&[9, 8]).unwrap();
        assert_eq!(flash.len(), 0x7803);
        assert_eq!((&flash[..3], &flash[0x77FF..]), (&[9, 8, 0xFF][..], &[0xFF, 1, 2, 3][..]));
    }

    #[test]
    fn optiboot_is_compiled_into_the_smallest_boot_section() {
        let optiboot = Bootloader::optiboot().unwrap();
        assert_eq!(optiboot.start(), 0x7E00);
        assert!(optiboot.code.len() <= 512, "{} bytes", optiboot.code.len());
    }

    #[test]
    fn a_firmware_may_reach_up_to_the_bootloader_and_no_further() {
        let bootloader = read(&hex(0x7E00, &[1; 255])).unwrap();
        assert!(bootloader.behind(&[0; 32_256]).is_ok());
        let error = bootloader.behind(&[0; 32_257]).unwrap_err().to_string();
        assert_eq!(error, "the firmware takes 32257 bytes of flash: the bootloader leaves 32256");
    }

    #[test]
    fn other_files_are_refused_with_the_reason() {
        for (text, reason) in [
            (hex(0, &[1]), "is no bootloader for the ATmega328P"),
            (hex(0x7900, &[1]), "is no bootloader for the ATmega328P"),
            (hex(0x7E00, &[0; 0x210]), "from 0x7e00 to 0x8010"),
            (hex(0, &[]), "is empty"),
            (String::new(), "it has no end record"),
            ("no hex\n".to_owned(), "is no Intel HEX file"),
        ] {
            let error = read(&text).unwrap_err();
            assert!(error.contains(reason), "{error}");
        }
        let error = Bootloader::read(Path::new("no-such.hex")).unwrap_err().to_string();
        assert!(error.starts_with("no-such.hex cannot be read"), "{error}");
    }
}
