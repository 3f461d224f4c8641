//! Reads the firmware's ELF, or its flash from an Intel HEX file.
//!
//! [`Image`] has the contents of flash and EEPROM, the memory that the program takes, and the addresses of its symbols.
//! This module neither builds nor runs the firmware; [`Uno`](crate::Uno) runs it.

use crate::file_error::FileError;
use crate::hex;
use crate::memory::{EEPROM_BYTES, FLASH_BYTES};
use object::read::elf::{ElfFile32, ElfSymbol32, ProgramHeader};
use object::{
    Architecture, LittleEndian, Object, ObjectSection, ObjectSymbol, SectionFlags, SectionKind, SymbolKind, elf,
};
use std::collections::HashMap;
use std::path::Path;

/// Origins of SRAM, EEPROM and the following sections in the single address space of AVR ELF files.
const SRAM_ORIGIN: u64 = 0x80_0000;
const EEPROM_ORIGIN: u64 = 0x81_0000;
const FUSES_ORIGIN: u64 = 0x82_0000;

/// The section in which avr-libc's start-up code names the chip, and the offset of that name: behind the note's head, six
/// sizes, and the table of one name.
const DEVICE_INFO: &str = ".note.gnu.avr.deviceinfo";
const DEVICE_NAME: usize = 0x31;

/// The chips whose programs run on the ATmega328P: they differ in their power consumption alone (data sheet, section 2.2).
const CHIPS: [&str; 2] = ["atmega328p", "atmega328"];

/// Memory that a firmware takes, in bytes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// Flash: code, constants, and the first values of variables (.text, .data).
    pub flash: u64,
    /// Static SRAM (.data, .bss, .noinit), without the stack.
    pub sram: u64,
}

impl Size {
    /// The memory that the ELF at `path` takes, whether or not the chip has it.
    ///
    /// # Errors
    /// Where the file cannot be read or is no ELF for AVR.
    pub fn read(path: &Path) -> Result<Size, FileError> {
        let bytes = FileError::bytes(path)?;
        parse(path, &bytes).map(|file| size(&file))
    }
}

/// A variable's place in SRAM.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Variable {
    /// Address in the data space.
    pub address: u16,
    /// Size in bytes.
    pub size: u16,
}

/// The contents of an ELF for the chip; empty by default.
#[derive(Clone, Debug, Default)]
pub struct Image {
    /// Flash from address 0 to the last byte used.
    pub flash: Vec<u8>,
    /// EEPROM from address 0 to the last byte in the ELF; usually empty.
    pub eeprom: Vec<u8>,
    /// Memory taken.
    pub size: Size,
    /// Variables in SRAM by their symbol's name.
    pub variables: HashMap<String, Variable>,
    /// Addresses of functions in flash, in bytes, by their symbol's name.
    pub functions: HashMap<String, u32>,
}

impl Image {
    /// Whether it has the program's symbols. A HEX file has none.
    pub fn has_symbols(&self) -> bool {
        !self.functions.is_empty()
    }

    /// Reads the ELF or the Intel HEX file at `path`. A HEX file has the flash alone.
    ///
    /// # Errors
    /// Where the file cannot be read, is neither an ELF for AVR nor HEX, is for another chip, or holds more than the
    /// ATmega328P does.
    pub fn read(path: &Path) -> Result<Image, FileError> {
        let bytes = FileError::bytes(path)?;
        if is_hex(&bytes) {
            return Ok(Image { flash: hex::flash(path, &bytes)?, ..Image::default() });
        }
        let file = parse(path, &bytes)?;
        check_chip(path, &file)?;
        let mut flash = Vec::new();
        let mut eeprom = Vec::new();
        for header in file.elf_program_headers() {
            let content = header.data(LittleEndian, &*bytes).unwrap_or_default();
            if header.p_type(LittleEndian) != elf::PT_LOAD || content.is_empty() {
                continue;
            }
            // The physical address: for .data it is the address of its initial values in flash.
            let (memory, name, start, limit) = match u64::from(header.p_paddr(LittleEndian)) {
                address @ ..SRAM_ORIGIN => (&mut flash, "flash", address, FLASH_BYTES),
                address @ EEPROM_ORIGIN..FUSES_ORIGIN => (&mut eeprom, "EEPROM", address - EEPROM_ORIGIN, EEPROM_BYTES),
                // Fuses and lock bits are ignored.
                _ => continue,
            };
            let end = start + content.len() as u64;
            if end > limit as u64 {
                let problem = format!("has {end} bytes for the {name}: the ATmega328P holds {limit}");
                return Err(FileError::new(path, problem));
            }
            let (start, end) = (start as usize, end as usize);
            if memory.len() < end {
                // Erased flash and EEPROM read as 0xFF.
                memory.resize(end, 0xFF);
            }
            memory[start..end].copy_from_slice(content);
        }

        Ok(Image { flash, eeprom, size: size(&file), variables: variables(&file), functions: functions(&file) })
    }
}

fn is_hex(bytes: &[u8]) -> bool {
    bytes.trim_ascii_start().starts_with(b":")
}

/// Takes the content of the file at `path` for an ELF for AVR.
fn parse<'data>(path: &Path, bytes: &'data [u8]) -> Result<ElfFile32<'data, LittleEndian>, FileError> {
    if is_hex(bytes) {
        return Err(FileError::new(path, "is an Intel HEX file, which has no symbols: name the firmware's ELF"));
    }
    let not_elf = |reason| FileError::new(path, format_args!("is not a readable ELF file ({reason})"));
    let architecture = object::File::parse(bytes).map_err(not_elf)?.architecture();
    if architecture != Architecture::Avr {
        return Err(FileError::new(path, format_args!("was made for {architecture:?}: an ELF for AVR is needed")));
    }
    ElfFile32::parse(bytes).map_err(not_elf)
}

/// Checks that an ELF that names its chip is for this one.
fn check_chip(path: &Path, file: &ElfFile32<LittleEndian>) -> Result<(), FileError> {
    let note = file.section_by_name(DEVICE_INFO).and_then(|section| section.data().ok());
    let name = note.and_then(|note| note.get(DEVICE_NAME..)?.split(|byte| *byte == 0).next());
    match name.map(String::from_utf8_lossy).filter(|name| !name.is_empty()) {
        Some(chip) if !CHIPS.contains(&&*chip) => {
            Err(FileError::new(path, format_args!("is for the {chip}: the Uno has an {}", CHIPS[0])))
        }
        _ => Ok(()),
    }
}

fn size(file: &ElfFile32<LittleEndian>) -> Size {
    let mut size = Size::default();
    for section in file.sections() {
        if !matches!(section.flags(), SectionFlags::Elf { sh_flags, .. } if sh_flags.contains(elf::SHF_ALLOC)) {
            continue;
        }
        // Initial values have an address in flash. A section that the start-up code does not fill (.noinit) may have
        // some in the file and no address in flash.
        let is_loaded = file.elf_program_headers().iter().any(|header| {
            let (start, length) = (header.p_vaddr(LittleEndian), header.p_filesz(LittleEndian));
            let in_flash = u64::from(header.p_paddr(LittleEndian)) < SRAM_ORIGIN;
            in_flash && (start..start + length).contains(&(section.address() as u32))
        });
        if section.address() < SRAM_ORIGIN || is_loaded {
            size.flash += section.size();
        }
        if (SRAM_ORIGIN..EEPROM_ORIGIN).contains(&section.address()) {
            size.sram += section.size();
        }
    }
    size
}

fn variables(file: &ElfFile32<LittleEndian>) -> HashMap<String, Variable> {
    file.symbols()
        .filter(|symbol| (SRAM_ORIGIN..EEPROM_ORIGIN).contains(&symbol.address()))
        .filter_map(|symbol| {
            let variable = Variable {
                address: u16::try_from(symbol.address() - SRAM_ORIGIN).ok()?,
                size: u16::try_from(symbol.size()).ok()?,
            };
            Some((name(&symbol)?, variable))
        })
        .collect()
}

fn functions(file: &ElfFile32<LittleEndian>) -> HashMap<String, u32> {
    // Symbols of libgcc have a size and no type.
    let is_untyped = |symbol: &ElfSymbol32<LittleEndian>| {
        let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
        symbol.kind() == SymbolKind::Unknown
            && symbol.size() > 0
            && section.is_some_and(|section| section.kind() == SectionKind::Text)
    };
    file.symbols()
        .filter(|symbol| symbol.kind() == SymbolKind::Text || is_untyped(symbol))
        .filter_map(|symbol| Some((name(&symbol)?, u32::try_from(symbol.address()).ok()?)))
        .collect()
}

/// A symbol's name in its source: a Rust path from the crate on, without the compiler's numbers.
fn name<'data>(symbol: &impl ObjectSymbol<'data>) -> Option<String> {
    // A local variable's symbol may have a number behind its mangled name.
    let mangled = symbol.name().ok()?;
    let (mangled, _) = mangled.split_once('.').unwrap_or((mangled, ""));
    Some(format!("{:#}", rustc_demangle::demangle(mangled)))
}
