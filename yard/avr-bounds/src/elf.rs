//! Reads an ELF: flash, initialised variables, functions, the chip, and the program's records of loop bounds.

use crate::chip::{CHIPS, Chip};
use crate::error::BoundsError;
use crate::file;
use crate::loops;
use addr2line::Loader;
use object::read::elf::{ElfFile32, ElfSymbol32, FileHeader, ProgramHeader};
use object::{
    Architecture, LittleEndian, Object, ObjectSection, ObjectSymbol, RelocationFlags, RelocationTarget, SectionKind,
    SymbolKind, elf,
};
use std::cell::OnceCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Addresses of SRAM and EEPROM in the single address space of AVR ELF files.
const SRAM_ORIGIN: u32 = 0x80_0000;
const EEPROM_ORIGIN: u32 = 0x81_0000;
const EEPROM_END: u32 = 0x82_0000;

/// The section in which avr-gcc names the chip.
const DEVICE_INFO: &str = ".note.gnu.avr.deviceinfo";

/// The core that a linker writes if it was told none.
const ANY_CORE: u32 = 2;

/// A function's symbol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Its name in its source: a Rust or C++ path, without the compiler's numbers.
    pub name: String,
    /// Its size in bytes; 0 if the file does not have it.
    pub bytes: u32,
}

/// Relocations that can hold an address of code.
#[derive(Default)]
pub(crate) struct Relocations {
    /// Where each stands, and the address that it holds.
    pub(crate) all: Vec<Relocation>,
    /// Places in flash with a relocation of any kind.
    pub(crate) in_code: BTreeSet<u32>,
    /// Whether the initial values of variables have any.
    pub(crate) in_data: bool,
}

/// A relocation that can hold an address of code.
pub(crate) struct Relocation {
    /// Its address in flash, or in the data space from [`SRAM_ORIGIN`] on.
    pub(crate) place: u32,
    pub(crate) address: u32,
    /// Whether it holds an address in bytes, which calls do not take.
    pub(crate) is_of_bytes: bool,
}

/// An ELF, taken apart.
pub struct Program {
    /// Its chip.
    pub chip: Chip,
    /// Flash from address 0 to the last byte used.
    pub flash: Vec<u8>,
    /// Its start address, in bytes of flash.
    pub start: u32,
    /// Whether it begins with interrupt vectors.
    pub has_vectors: bool,
    /// Its functions by address. Of two names for one address the alphabetically first is kept.
    pub functions: BTreeMap<u32, Symbol>,
    /// The records of loops: an address in the loop, and the most executions of that address.
    pub records: BTreeMap<u32, u64>,
    /// Every symbol in flash by its raw name.
    pub(crate) labels: BTreeMap<String, u32>,
    /// Entries of libgcc's routines that jump through a table.
    pub(crate) table_jumps: BTreeSet<u32>,
    /// Addresses of symbols in a section of code, of any type but data's.
    pub(crate) marked: BTreeSet<u32>,
    /// Data in flash, by symbols that have its type and size.
    pub(crate) objects: Vec<Range<u32>>,
    /// The end of flash without the initial values of variables.
    pub(crate) code_end: u32,
    /// Initial values of variables, from this address on, then the EEPROM's content.
    pub(crate) data: Vec<u8>,
    pub(crate) data_start: u32,
    /// Which of these bytes are virtual tables.
    pub(crate) virtual_tables: Vec<Range<usize>>,
    /// The relocations that `--emit-relocs` keeps.
    pub(crate) relocations: Relocations,
    path: PathBuf,
    /// Its debug information, which is read when the first line is asked for.
    debug_information: OnceCell<Option<Loader>>,
}

impl Program {
    /// Reads the ELF at `path`, for the chip named, or the one that the file names.
    ///
    /// # Errors
    /// If the file cannot be read, is no ELF for AVR, is for no known chip or another one, or holds more than the chip.
    pub fn read(path: &Path, chip: Option<&str>) -> Result<Program, BoundsError> {
        let error = |reason: String| BoundsError(format!("{} {reason}", path.display()));
        let not_elf = |reason| error(format!("is not a readable ELF file ({reason})"));
        let bytes = file::bytes(path)?;
        let architecture = object::File::parse(&*bytes).map_err(not_elf)?.architecture();
        if architecture != Architecture::Avr {
            return Err(error(format!("was made for {architecture:?}: an ELF for AVR is needed")));
        }
        let file: ElfFile32<LittleEndian> = ElfFile32::parse(&*bytes).map_err(not_elf)?;
        let chips = CHIPS.map(|chip| chip.name).join(", ");
        let of_file = device(&file);
        if let (Some(named), Some(of_file)) = (chip, &of_file)
            && !named.eq_ignore_ascii_case(of_file)
        {
            return Err(error(format!("was made for the {of_file}, not for the {named}: name no other chip")));
        }
        let name = chip.map(str::to_owned).or(of_file).ok_or_else(|| {
            error(format!(
                "does not name its chip: name it with --chip or `chip = ..` in the budgets, as one of {chips}"
            ))
        })?;
        let unknown = || BoundsError(format!("the chip {name} is not known: the known ones are {chips}"));
        let chip = Chip::named(&name).ok_or_else(unknown)?;
        let core = file.elf_header().e_flags(LittleEndian).avr_arch().0;
        if ![0, ANY_CORE, chip.core()].contains(&core) {
            let (name, own) = (chip.name, chip.core());
            return Err(error(format!("was made for the core avr{core}, and the {name} has avr{own}: name its chip")));
        }

        let (mut flash, mut variables, mut eeprom) = (Vec::new(), Vec::new(), Vec::new());
        let (mut start, mut code_end) = (u32::MAX, 0);
        for header in file.elf_program_headers() {
            let content = header.data(LittleEndian, &*bytes).unwrap_or_default();
            let (address, runs_at) = (header.p_paddr(LittleEndian), header.p_vaddr(LittleEndian));
            if header.p_type(LittleEndian) != elf::PT_LOAD || content.is_empty() {
                continue;
            }
            if address >= SRAM_ORIGIN {
                if (EEPROM_ORIGIN..EEPROM_END).contains(&address) {
                    eeprom.extend_from_slice(content);
                }
                continue;
            }
            let end = u64::from(address) + content.len() as u64;
            if end > chip.flash_bytes.into() {
                let Chip { name, flash_bytes, .. } = chip;
                return Err(error(format!(
                    "has {end} bytes for the flash: the {name} holds {flash_bytes}; --chip names another chip"
                )));
            }
            let end = end as u32;
            start = start.min(address);
            if flash.len() < end as usize {
                // Erased flash reads as 0xFF.
                flash.resize(end as usize, 0xFF);
            }
            flash[address as usize..end as usize].copy_from_slice(content);
            if (SRAM_ORIGIN..EEPROM_ORIGIN).contains(&runs_at) {
                variables.push((runs_at, content));
            } else {
                code_end = code_end.max(end);
            }
        }
        // All variables as one memory, from the first one on. The EEPROM's content comes behind it.
        let data_start = variables.iter().map(|(runs_at, _)| *runs_at).min().unwrap_or(SRAM_ORIGIN);
        let mut data = Vec::new();
        for (runs_at, content) in variables {
            let first = (runs_at - data_start) as usize;
            data.resize(data.len().max(first + content.len()), 0);
            data[first..first + content.len()].copy_from_slice(content);
        }
        data.extend(eeprom);
        let in_flash = || file.symbols().filter(|symbol| symbol.address() < u64::from(SRAM_ORIGIN));
        let labels: BTreeMap<String, u32> =
            in_flash().filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address() as u32))).collect();
        let table_jumps = labels.iter().filter(|(name, _)| name.starts_with("__tablejump"));
        let table_jumps = table_jumps.map(|(_, address)| *address).collect();
        let of_code = || in_flash().filter(|symbol| is_in_code(&file, symbol));
        let is_mark =
            |symbol: &ElfSymbol32<LittleEndian>| matches!(symbol.kind(), SymbolKind::Text | SymbolKind::Unknown);
        let marked = of_code().filter(is_mark).map(|symbol| symbol.address() as u32).collect();
        let objects = of_code().filter(|symbol| symbol.kind() == SymbolKind::Data).map(|symbol| {
            let first = symbol.address() as u32;
            first..first + size_of(&symbol, code_end)
        });
        let virtual_tables = (file.symbols())
            .filter(|symbol| symbol.name().is_ok_and(|name| name.starts_with("_ZTV")))
            .filter_map(|symbol| {
                let first = symbol.address().checked_sub(data_start.into())?;
                let table = first as usize..first.checked_add(symbol.size())? as usize;
                data.get(table.clone()).map(|_| table)
            })
            .collect();
        // A program at a higher address than 0 is a bootloader; some have no vectors.
        let start = if start == u32::MAX { 0 } else { start };
        let has_vectors = start == 0 || labels.get("__vectors") == Some(&start);
        let records = loops::records_of(&file).map_err(not_elf)?;
        Ok(Program {
            chip,
            flash,
            start,
            has_vectors,
            functions: functions(&file, code_end),
            relocations: relocations(&file),
            labels,
            table_jumps,
            marked,
            objects: objects.collect(),
            code_end,
            data_start,
            data,
            virtual_tables,
            records,
            path: path.into(),
            debug_information: OnceCell::new(),
        })
    }

    pub(crate) fn label(&self, name: &str) -> Option<u32> {
        self.labels.get(name).copied()
    }

    /// File and line of an address, if the ELF has debug information.
    pub fn line(&self, address: u32) -> Option<String> {
        let loader = self.debug_information.get_or_init(|| Loader::new(&self.path).ok()).as_ref()?;
        let location = loader.find_location(address.into()).ok()??;
        let file = Path::new(location.file?).file_name()?.to_string_lossy().into_owned();
        Some(format!("{file}:{}", location.line?))
    }

    /// The functions of a name.
    pub(crate) fn functions_called(&self, name: &str) -> Vec<u32> {
        let all = self.functions.iter().filter(|(_, symbol)| symbol.name == name);
        all.map(|(address, _)| *address).collect()
    }

    /// The last function up to an address: its beginning and end. A function without a size ends at the next one.
    pub(crate) fn extent(&self, address: u32) -> Option<(u32, u32)> {
        let (&first, symbol) = self.functions.range(..=address).next_back()?;
        let next = self.functions.range(address + 1..).next().map_or(self.flash.len() as u32, |(&next, _)| next);
        Some((first, if symbol.bytes > 0 { first + symbol.bytes } else { next }))
    }

    /// The function that an address lies in, if its symbol has a size.
    pub(crate) fn sized(&self, address: u32) -> Option<Range<u32>> {
        // A function can lie within another one, as in assembly with two entries.
        let before = self.functions.range(..=address).rev().filter(|(_, symbol)| symbol.bytes > 0);
        before.map(|(&first, symbol)| first..first + symbol.bytes).take(8).find(|function| function.contains(&address))
    }
}

impl fmt::Debug for Program {
    fn fmt(&self, to: &mut fmt::Formatter) -> fmt::Result {
        write!(to, "program of {}", self.path.display())
    }
}

/// The ELF's chip, if it names one.
fn device(file: &ElfFile32<LittleEndian>) -> Option<String> {
    /// The offset of the names: after the note's head, six sizes, and the table of one name.
    const NAMES: usize = 0x31;

    let note = file.section_by_name(DEVICE_INFO)?.data().ok()?;
    let name = note.get(NAMES..)?.split(|byte| *byte == 0).next()?;
    Some(String::from_utf8_lossy(name).into_owned()).filter(|name| !name.is_empty())
}

/// Whether a symbol is in a section of code.
fn is_in_code(file: &ElfFile32<LittleEndian>, symbol: &ElfSymbol32<LittleEndian>) -> bool {
    let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
    section.is_some_and(|section| section.kind() == SectionKind::Text)
}

/// A symbol's size; 0 if it has none, or one that leads beyond the code.
fn size_of(symbol: &ElfSymbol32<LittleEndian>, code_end: u32) -> u32 {
    let is_within = symbol.address().saturating_add(symbol.size()) <= u64::from(code_end);
    if is_within { symbol.size() as u32 } else { 0 }
}

fn functions(file: &ElfFile32<LittleEndian>, code_end: u32) -> BTreeMap<u32, Symbol> {
    // Symbols of libgcc have a size and no type.
    let is_function = |symbol: &ElfSymbol32<LittleEndian>| match symbol.kind() {
        SymbolKind::Text => true,
        SymbolKind::Unknown => is_in_code(file, symbol) && symbol.size() > 0,
        _ => false,
    };
    let mut functions: Vec<(u32, Symbol)> = (file.symbols())
        .filter(|symbol| is_function(symbol) && symbol.address() < u64::from(SRAM_ORIGIN))
        .filter_map(|symbol| {
            let named = Symbol { name: demangled(symbol.name().ok()?), bytes: size_of(&symbol, code_end) };
            Some((symbol.address() as u32, named))
        })
        .filter(|(_, symbol)| !symbol.name.is_empty())
        .collect();
    // Of several at one address the map keeps the last.
    functions.sort_by_cached_key(|(_, symbol)| (symbol.bytes == 0, symbol.name.clone()));
    functions.into_iter().rev().collect()
}

/// The relocations that `--emit-relocs` keeps, and that can hold an address of code.
fn relocations(file: &ElfFile32<LittleEndian>) -> Relocations {
    // Kinds by their number (binutils, elf/avr.h): word addresses, in memory and in `ldi`, directly and by a trampoline;
    // and byte addresses in the same places.
    const NO_RELOCATION: u32 = 0;
    const OF_WORDS: [u32; 6] = [5, 12, 13, 14, 24, 25];
    const OF_BYTES: [u32; 6] = [1, 4, 6, 7, 27, 28];

    let mut relocations = Relocations::default();
    let is_loaded = |kind| matches!(kind, SectionKind::Text | SectionKind::Data | SectionKind::ReadOnlyData);
    for section in file.sections().filter(|section| is_loaded(section.kind()) && section.size() > 0) {
        for (place, relocation) in section.relocations() {
            // In a linked file a relocation's place is an address.
            let place = place as u32;
            let RelocationFlags::Elf { r_type } = relocation.flags() else { continue };
            if r_type.0 == NO_RELOCATION {
                continue;
            }
            if section.kind() == SectionKind::Text {
                relocations.in_code.insert(place);
            } else {
                relocations.in_data = true;
            }
            let RelocationTarget::Symbol(symbol) = relocation.target() else { continue };
            let Ok(symbol) = file.symbol_by_index(symbol) else { continue };
            let address = symbol.address().wrapping_add_signed(relocation.addend()) as u32;
            let is_of_bytes = OF_BYTES.contains(&r_type.0);
            if OF_WORDS.contains(&r_type.0) || is_of_bytes {
                relocations.all.push(Relocation { place, address, is_of_bytes });
            }
        }
    }
    relocations
}

/// A symbol's name in its source: a Rust path without type parameters, or a C++ name without parameters.
fn demangled(name: &str) -> String {
    // A local symbol may have a number behind its mangled name.
    let (mangled, suffix) = name.split_once('.').unwrap_or((name, ""));
    if let Ok(rust) = rustc_demangle::try_demangle(mangled) {
        return without_types(&format!("{rust:#}"));
    }
    let cpp = cpp_demangle::Symbol::new(mangled).ok().filter(|_| mangled.starts_with("_Z"));
    let options = cpp_demangle::DemangleOptions::new().no_return_type().hide_expression_literal_types();
    let cpp = cpp.and_then(|symbol| symbol.demangle_with_options(&options).ok());
    cpp.unwrap_or_else(|| if suffix.is_empty() { mangled.to_owned() } else { name.to_owned() })
}

/// A function's path without type parameters: `<a::B<c::D> as e::F>::g::<h>` becomes `a::B::g`.
fn without_types(name: &str) -> String {
    let Some(inner) = name.strip_prefix('<') else {
        let mut depth = 0;
        let kept = name.replace("::<", "<").replace("->", "");
        return kept
            .chars()
            .filter(|&letter| {
                depth += i32::from(letter == '<');
                let is_kept = depth == 0;
                depth -= i32::from(letter == '>');
                is_kept
            })
            .collect();
    };
    let mut depth = 1;
    let end = inner.char_indices().find(|(_, letter)| {
        depth += i32::from(*letter == '<') - i32::from(*letter == '>');
        depth == 0
    });
    let Some((end, _)) = end else { return name.to_owned() };
    let (of, method) = (without_types(&inner[..end]), without_types(&inner[end + 1..]));
    let of = of.split(" as ").next().unwrap_or_default();
    format!("{of}{method}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_paths_without_types() {
        for (name, short) in [
            ("weeder_firmware::run", "weeder_firmware::run"),
            ("control::say::say_numbers::<weeder_firmware::serial::Serial>", "control::say::say_numbers"),
            (
                "<control::taught::FieldExamples<weeder_firmware::eeprom::Half>>::slot",
                "control::taught::FieldExamples::slot",
            ),
            ("<a::Half as control::memory::Memory>::read", "a::Half::read"),
            ("knn::search::<5, 2, (&a::B, &c::D<e::F>)>::{closure#0}", "knn::search::{closure#0}"),
        ] {
            assert_eq!(without_types(name), short);
        }
    }
}
