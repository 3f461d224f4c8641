//! Reads an ELF: the bytes in flash and of initialised variables, the functions, the chip, and the program's records of
//! loop bounds.

use crate::chip::{CHIPS, Chip};
use crate::error::BoundsError;
use crate::loops;
use addr2line::Loader;
use object::read::elf::{ElfFile32, ElfSymbol32, ProgramHeader};
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

/// The section in which avr-gcc names the chip.
const DEVICE_INFO: &str = ".note.gnu.avr.deviceinfo";

/// A function's symbol.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Its name in its source: a Rust or C++ path, without the compiler's numbers.
    pub name: String,
    /// Its size in bytes; 0 if the file does not have it.
    pub bytes: u32,
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
    /// The first address of code after the vectors, and the end of flash without the initial values of variables.
    pub(crate) code_start: u32,
    code_end: u32,
    /// Initial values of variables.
    pub(crate) data: Vec<u8>,
    /// Which of these bytes are virtual tables.
    pub(crate) virtual_tables: Vec<Range<usize>>,
    /// Functions whose address is taken outside virtual tables and the tables of constructors, if the ELF has
    /// relocations.
    pub(crate) taken: Option<BTreeSet<u32>>,
    path: PathBuf,
    /// Its debug information, which is read when the first line is asked for.
    debug_information: OnceCell<Option<Loader>>,
}

impl Program {
    /// Reads the ELF at `path`, for the chip named, or the one that the file names.
    ///
    /// # Errors
    /// If the file cannot be read, is no ELF for AVR, is for no known chip, or holds more than it.
    pub fn read(path: &Path, chip: Option<&str>) -> Result<Program, BoundsError> {
        let error = |reason: String| BoundsError(format!("{} {reason}", path.display()));
        let not_elf = |reason| error(format!("is not a readable ELF file ({reason})"));
        let bytes = std::fs::read(path).map_err(|reason| error(format!("could not be read: {reason}")))?;
        let architecture = object::File::parse(&*bytes).map_err(not_elf)?.architecture();
        if architecture != Architecture::Avr {
            return Err(error(format!("was made for {architecture:?}: an ELF for AVR is needed")));
        }
        let file: ElfFile32<LittleEndian> = ElfFile32::parse(&*bytes).map_err(not_elf)?;
        let chips = CHIPS.map(|chip| chip.name).join(", ");
        let name = chip.map(str::to_owned).or_else(|| device(&file)).ok_or_else(|| {
            error(format!(
                "does not name its chip: name it with --chip or `chip = ..` in the budgets, as one of {chips}"
            ))
        })?;
        let unknown = || BoundsError(format!("the chip {name} is not known: the known ones are {chips}"));
        let chip = Chip::named(&name).ok_or_else(unknown)?;

        let (mut flash, mut data, mut data_start) = (Vec::new(), Vec::new(), 0);
        let (mut start, mut code_end) = (u32::MAX, 0);
        for header in file.elf_program_headers() {
            let content = header.data(LittleEndian, &*bytes).unwrap_or_default();
            let address = header.p_paddr(LittleEndian);
            if header.p_type(LittleEndian) != elf::PT_LOAD || content.is_empty() || address >= SRAM_ORIGIN {
                continue;
            }
            let end = address + content.len() as u32;
            if end > chip.flash_bytes {
                let Chip { name, flash_bytes, .. } = chip;
                return Err(error(format!(
                    "has {end} bytes for the flash: the {name} holds {flash_bytes}; --chip names another chip"
                )));
            }
            start = start.min(address);
            if flash.len() < end as usize {
                // Erased flash reads as 0xFF.
                flash.resize(end as usize, 0xFF);
            }
            flash[address as usize..end as usize].copy_from_slice(content);
            if (SRAM_ORIGIN..EEPROM_ORIGIN).contains(&header.p_vaddr(LittleEndian)) {
                data_start = header.p_vaddr(LittleEndian).into();
                data = content.to_vec();
            } else {
                code_end = code_end.max(end);
            }
        }
        let labels: BTreeMap<String, u32> = (file.symbols())
            .filter(|symbol| symbol.address() < u64::from(SRAM_ORIGIN))
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), symbol.address() as u32)))
            .collect();
        let tables: Vec<Range<u64>> = (file.symbols())
            .filter(|symbol| symbol.name().is_ok_and(|name| name.starts_with("_ZTV")))
            .map(|symbol| symbol.address()..symbol.address() + symbol.size())
            .collect();
        let in_data = |table: &Range<u64>| {
            let first = table.start.checked_sub(data_start)? as usize;
            let table = first..first + (table.end - table.start) as usize;
            data.get(table.clone()).map(|_| table)
        };
        let virtual_tables = tables.iter().filter_map(in_data).collect();
        // A program at a higher address than 0 is a bootloader; some have no vectors.
        let start = if start == u32::MAX { 0 } else { start };
        let has_vectors = start == 0 || labels.get("__vectors") == Some(&start);
        let records = loops::records_of(&file).map_err(not_elf)?;
        let functions = functions(&file);
        let taken = taken(&file, &functions, &labels, &tables);
        let vectors = if has_vectors { u32::from(chip.vectors) * chip.vector_bytes } else { 0 };
        Ok(Program {
            chip,
            flash,
            start,
            has_vectors,
            functions,
            taken,
            labels,
            code_start: start + vectors,
            code_end,
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

    /// Flash in front of the first function, and between functions, in which constants can lie.
    pub(crate) fn gaps(&self) -> impl Iterator<Item = Range<u32>> {
        let ends = self.functions.keys().filter_map(|&function| Some(self.extent(function)?.1));
        let begins = self.functions.keys().copied().chain([self.code_end]);
        [self.code_start].into_iter().chain(ends).zip(begins).map(|(end, begin)| end..begin)
    }

    /// The function that contains an address: its beginning and end.
    pub(crate) fn extent(&self, address: u32) -> Option<(u32, u32)> {
        let (&first, symbol) = self.functions.range(..=address).next_back()?;
        let next = self.functions.range(address + 1..).next().map_or(self.flash.len() as u32, |(&next, _)| next);
        Some((first, if symbol.bytes > 0 { (first + symbol.bytes).max(address + 2) } else { next }))
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

fn functions(file: &ElfFile32<LittleEndian>) -> BTreeMap<u32, Symbol> {
    // Symbols of libgcc have a size and no type.
    let is_code = |symbol: &ElfSymbol32<LittleEndian>| {
        let section = symbol.section_index().and_then(|index| file.section_by_index(index).ok());
        section.is_some_and(|section| section.kind() == SectionKind::Text)
    };
    let is_function = |symbol: &ElfSymbol32<LittleEndian>| match symbol.kind() {
        SymbolKind::Text => true,
        SymbolKind::Unknown => is_code(symbol) && symbol.size() > 0,
        _ => false,
    };
    let mut functions: Vec<(u32, Symbol)> = (file.symbols())
        .filter(|symbol| is_function(symbol) && symbol.address() < u64::from(SRAM_ORIGIN))
        .filter_map(|symbol| {
            let named = Symbol { name: demangled(symbol.name().ok()?), bytes: symbol.size() as u32 };
            Some((symbol.address() as u32, named))
        })
        .filter(|(_, symbol)| !symbol.name.is_empty())
        .collect();
    // Of several at one address the map keeps the last.
    functions.sort_by_cached_key(|(_, symbol)| (symbol.bytes == 0, symbol.name.clone()));
    functions.into_iter().rev().collect()
}

/// The functions whose address is taken, by the relocations that `--emit-relocs` keeps; `None` without relocations.
/// Virtual tables and the tables of constructors are left out.
fn taken(
    file: &ElfFile32<LittleEndian>,
    functions: &BTreeMap<u32, Symbol>,
    labels: &BTreeMap<String, u32>,
    tables: &[Range<u64>],
) -> Option<BTreeSet<u32>> {
    /// Word addresses: in memory, and in `ldi`, directly and by a trampoline (binutils, elf/avr.h).
    const OF_WORDS: [u32; 6] = [5, 12, 13, 14, 24, 25];

    let label = |name: &str| labels.get(name).copied().unwrap_or_default();
    let constructors =
        label("__ctors_start").min(label("__dtors_start"))..label("__ctors_end").max(label("__dtors_end"));
    let mut taken = BTreeSet::new();
    let mut is_kept = false;
    for section in file.sections().filter(|section| section.kind() != SectionKind::Other && section.size() > 0) {
        for (place, relocation) in section.relocations() {
            is_kept |= section.kind() == SectionKind::Text;
            let RelocationFlags::Elf { r_type } = relocation.flags() else { continue };
            let RelocationTarget::Symbol(symbol) = relocation.target() else { continue };
            let Ok(symbol) = file.symbol_by_index(symbol) else { continue };
            // In a linked file a relocation's place is an address.
            let is_elsewhere = tables.iter().any(|table| table.contains(&place))
                || u32::try_from(place).is_ok_and(|place| constructors.contains(&place));
            let address = symbol.address().wrapping_add_signed(relocation.addend()) as u32;
            if OF_WORDS.contains(&r_type.0) && !is_elsewhere && functions.contains_key(&address) {
                taken.insert(address);
            }
        }
    }
    is_kept.then_some(taken)
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
