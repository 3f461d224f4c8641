//! Targets of computed calls and jumps.
//!
//! - **A constant** in the pointer: this address (`-mcall-prologues`, pointers that the compiler knows).
//! - **A compiler's jump table** (libgcc's `__tablejump2__`): every entry of the table that lies in the same function.
//!   The table's length is not needed: the words after it belong to another function, or lead to another place in this
//!   one.
//! - **Constructors and destructors** of global objects: every entry of their tables.
//! - **Listed** in the budgets' `[calls]`: these functions, and no others.
//! - **Any other call**: every address of code that the program takes. The relocations list these addresses, if the
//!   program was linked with `-Wl,--emit-relocs`. Else the analysis searches for word addresses of code, which can give
//!   too many. It searches the initial values of variables, every word of flash that is no reached instruction
//!   (`reach`), and pairs of registers that a function loads with constants. A virtual call loads its pointer from a slot
//!   behind another loaded pointer. It leads to this slot of every virtual table, and to addresses that are taken
//!   elsewhere. A pointer may also be null (`flow`).
//!
//! A jump could be a computed `goto` if its pointer comes from no virtual table and no variable at a fixed address.
//! Such a jump is refused. So is a call without any target.
//!
//! An address of code is the beginning of a function, any other symbol, the target of a direct call, or a place outside
//! all functions whose size is known. Relocations can also name a place within a function.
//!
//! Assumption: a program gets an address of code only from one of these places. A program that calculates an address
//! must list its calls.

use crate::budget::Budgets;
use crate::decode::Operation::*;
use crate::decode::{Instruction, word_at};
use crate::elf::{Program, Relocation};
use crate::proved::Found;
use crate::reach::Reach;
use crate::values::{Known, Value};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// The targets of an indirect call or jump.
#[derive(Clone, Debug)]
pub(crate) struct Where {
    pub(crate) found: Found,
    pub(crate) addresses: BTreeSet<u32>,
}

/// The data of a program that give the targets of indirect calls.
pub(crate) struct Targets {
    /// Addresses of code that are taken outside virtual tables, and whether this set is certain.
    taken: BTreeSet<u32>,
    is_exact: bool,
    virtual_tables: Vec<VirtualTable>,
    /// By the caller's name.
    listed: BTreeMap<String, BTreeSet<u32>>,
}

/// A virtual table: its words as addresses of code, if they are some.
struct VirtualTable {
    words: Vec<Option<u32>>,
    /// Whether it points to information of its type, which is data.
    has_type: bool,
}

/// The lower register of the pointer.
const Z: usize = 30;

impl Targets {
    /// The targets of a program whose code begins at `code_start`, behind its vectors.
    pub(crate) fn new(elf: &Program, budgets: &Budgets, reach: &Reach, code_start: u32) -> Targets {
        let search = Search { elf, reach, code_start };
        let virtual_tables = elf.virtual_tables.iter().map(|table| {
            let words: Vec<u16> =
                elf.data[table.clone()].chunks_exact(2).map(|word| u16::from_le_bytes([word[0], word[1]])).collect();
            // In front of its functions a table has an offset and the address of its type.
            let has_type = words.get(1).is_some_and(|word| *word != 0);
            VirtualTable { words: words.into_iter().map(|word| search.of_word(word)).collect(), has_type }
        });
        let listed = budgets.calls.iter().map(|(caller, called)| {
            (caller.clone(), called.iter().flat_map(|name| elf.functions_called(name)).collect())
        });
        let (taken, is_exact) = search.taken();
        Targets { is_exact, taken, virtual_tables: virtual_tables.collect(), listed: listed.collect() }
    }

    /// The targets of a call or jump at `at` to such a routine, and the cycles of the routine itself.
    pub(crate) fn of_table(&self, elf: &Program, at: u32, known: &Known) -> Option<(Where, u32)> {
        let call = Instruction::at(&elf.flash, at)?;
        let entry = call.target(elf.chip.flash_bytes)?;
        let mut cycles = 0;
        let mut instruction = Instruction::at(&elf.flash, entry)?;
        while !matches!(instruction.operation, Ijmp | Eijmp) {
            cycles += instruction.cycles;
            instruction = Instruction::at(&elf.flash, instruction.next())?;
            if instruction.address > entry + 64 {
                return None;
            }
        }
        cycles += instruction.cycles;
        let word = |address: u32| Some(u32::from(word_at(&elf.flash, address)?) * 2);
        for of in ["ctors", "dtors"] {
            // The start-up code calls it in a loop. Its label stands directly in front of that loop.
            let caller = elf.label(&format!("__do_global_{of}"));
            let in_loop = caller.is_some_and(|caller| (caller..caller + 32).contains(&at));
            if in_loop && matches!(call.operation, Call | Rcall) {
                let table = elf.label(&format!("__{of}_start"))?..elf.label(&format!("__{of}_end"))?;
                let addresses = table.step_by(2).map(word).collect::<Option<_>>()?;
                return Some((Where { found: Found::Table, addresses }, cycles));
            }
        }
        let base = match (known.pair(Z), known.registers[Z], known.registers[Z + 1]) {
            (Some(base), ..) => base,
            (_, Value::Less(low), Value::Less(high)) => u16::from_le_bytes([low, high]).wrapping_neg(),
            _ => return None,
        };
        let (first, end) = elf.extent(at).filter(|(_, end)| at < *end)?;
        let entries = (u32::from(base) * 2..).step_by(2).map(word);
        let addresses: BTreeSet<u32> =
            entries.map_while(|entry| entry.filter(|entry| (first..end).contains(entry))).collect();
        (!addresses.is_empty()).then_some((Where { found: Found::Table, addresses }, cycles))
    }

    /// The targets of a call or jump by the pointer, in this function, if it is known.
    pub(crate) fn of_pointer(
        &self,
        elf: &Program,
        caller: Option<&str>,
        instruction: &Instruction,
        known: &Known,
    ) -> Option<Where> {
        if let Some(word) = known.pair(Z) {
            let address = u32::from(word) * 2 % elf.chip.flash_bytes;
            return Some(Where { found: Found::Followed, addresses: [beyond_trampoline(elf, address)].into() });
        }
        if let Some(listed) = caller.and_then(|caller| self.listed.get(caller)) {
            return Some(Where { found: Found::Listed, addresses: listed.clone() });
        }
        let (low, high) = (known.registers[Z], known.registers[Z + 1]);
        let slot = match (low, high) {
            (Value::Loaded(Some(low), true), Value::Loaded(Some(high), true)) => {
                (low.checked_add(1) == Some(high)).then_some(usize::from(low))
            }
            _ => None,
        };
        let is_variable = matches!((low, high), (Value::Loaded(None, _), Value::Loaded(None, _)));
        let is_jump = matches!(instruction.operation, Ijmp | Eijmp);
        if is_jump && slot.is_none() && !is_variable {
            return None;
        }
        let mut addresses = self.taken.clone();
        for VirtualTable { words, has_type } in self.virtual_tables.iter().filter(|_| !is_variable) {
            match slot {
                // A pointer to a table points after two words that are no functions. A type's address can look like one.
                Some(slot) => {
                    let is_start = |start: usize| start == 2 || words[start - 1].is_none() && words[start].is_some();
                    let starts = (1..words.len())
                        .filter(|&start| is_start(start) || *has_type && start > 1 && is_start(start - 1));
                    addresses.extend(starts.filter_map(|start| *words.get(start + slot / 2)?));
                }
                None => addresses.extend(words.iter().flatten()),
            }
        }
        let found = if slot.is_some() { Found::Slot } else { Found::Taken };
        // A pointer that no function can be in is never called by.
        (self.is_exact || !addresses.is_empty()).then_some(Where { found, addresses })
    }
}

/// The target of a jump in the trampolines, which stand for functions that a word address cannot reach.
fn beyond_trampoline(elf: &Program, address: u32) -> u32 {
    let trampolines = elf.label("__trampolines_start").zip(elf.label("__trampolines_end"));
    let is_trampoline = trampolines.is_some_and(|(start, end)| (start..end).contains(&address));
    let target = || Instruction::at(&elf.flash, address)?.target(elf.chip.flash_bytes);
    if is_trampoline { target().unwrap_or(address) } else { address }
}

/// The search for addresses of code that a program takes.
struct Search<'a> {
    elf: &'a Program,
    reach: &'a Reach,
    code_start: u32,
}

impl Search<'_> {
    /// The address of code that a word can be, if it can be one.
    fn of_word(&self, word: u16) -> Option<u32> {
        let address = beyond_trampoline(self.elf, u32::from(word) * 2);
        self.is_entry(address).then_some(address)
    }

    /// Whether there is code at an address, behind the vectors and outside the tables of constructors.
    fn is_code(&self, address: u32) -> bool {
        let elf = self.elf;
        (self.code_start..elf.code_end).contains(&address)
            && address.is_multiple_of(2)
            && address != 0
            && !self.constructors().contains(&address)
            && Instruction::at(&elf.flash, address).is_some_and(|found| elf.chip.has(found.operation))
    }

    /// Whether code at an address can be called that the program takes.
    fn is_entry(&self, address: u32) -> bool {
        let Search { elf, reach, .. } = self;
        let is_named = elf.functions.contains_key(&address) || reach.called.contains(&address);
        let is_start_up = reach.start_up.contains(&address);
        let is_data = elf.objects.iter().any(|object| object.contains(&address));
        let is_free = || elf.marked.contains(&address) || elf.sized(address).is_none();
        self.is_code(address) && (is_named || !is_start_up && !is_data && is_free())
    }

    /// The tables of constructors, which only the start-up code calls.
    fn constructors(&self) -> Range<u32> {
        let label = |name: &str| self.elf.label(name);
        let ends = ["__ctors_start", "__ctors_end", "__dtors_start", "__dtors_end"].map(label);
        match ends {
            [Some(first), Some(end), Some(other_first), Some(other_end)] => first.min(other_first)..end.max(other_end),
            _ => 0..0,
        }
    }

    fn is_in_virtual_table(&self, place: usize) -> bool {
        self.elf.virtual_tables.iter().any(|table| table.contains(&place))
    }

    /// The addresses of code that the program takes outside virtual tables, and whether relocations list all.
    fn taken(&self) -> (BTreeSet<u32>, bool) {
        let Search { elf, reach, .. } = self;
        let mut taken: BTreeSet<u32> =
            elf.relocations.all.iter().filter_map(|found| self.of_relocation(found)).collect();
        // Calls, jumps and branches have one each, unless relocations were removed.
        let is_direct = |found: &Instruction| matches!(found.operation, Call | Jmp | Rcall | Rjmp | Brbs | Brbc);
        let direct = reach
            .instructions()
            .filter(|place| Instruction::at(&elf.flash, **place).is_some_and(|found| is_direct(&found)));
        let mut lack_one = direct.filter(|place| !elf.relocations.in_code.contains(place));
        let is_code_exact = !elf.relocations.in_code.is_empty() && lack_one.next().is_none();
        let is_data_exact = is_code_exact && (elf.relocations.in_data || elf.data.is_empty());
        if !is_data_exact {
            // Variables lie at any address.
            let variables = (0..elf.data.len()).filter(|place| !self.is_in_virtual_table(*place));
            let words = variables.filter_map(|place| word_at(&elf.data, place as u32));
            taken.extend(words.filter_map(|word| self.of_word(word)));
        }
        if !is_code_exact {
            let places = || (self.code_start..elf.code_end).step_by(2);
            let constructors = self.constructors();
            let is_constant = |place: &u32| {
                !reach.code.contains(place) && !reach.tables.contains(place) && !constructors.contains(place)
            };
            let constants = places().filter(is_constant).filter_map(|place| word_at(&elf.flash, place));
            taken.extend(constants.filter_map(|word| self.of_word(word)));
            taken.extend(self.loaded_pairs(places()));
        }
        (taken, is_data_exact)
    }

    /// The address of code that a relocation holds, if it is one that can be called.
    fn of_relocation(&self, &Relocation { place, address, is_of_bytes }: &Relocation) -> Option<u32> {
        let Search { elf, reach, .. } = self;
        let is_variable =
            place.checked_sub(elf.data_start).is_some_and(|place| self.is_in_virtual_table(place as usize));
        let is_table = is_variable || reach.tables.contains(&place) || self.constructors().contains(&place);
        let is_named = elf.functions.contains_key(&address);
        let is_start_up = reach.start_up.contains(&address) && !is_named;
        // `-mcall-prologues` puts the address behind a jump into the pointer, and the prologue jumps there.
        let behind = |back: &u32| address.checked_sub(*back).and_then(|jump| Instruction::at(&elf.flash, jump));
        let is_return = (address.saturating_sub(8)..address).contains(&place)
            && [2, 4]
                .iter()
                .filter_map(behind)
                .any(|jump| matches!(jump.operation, Jmp | Rjmp) && jump.next() == address);
        let is_data = elf.objects.iter().any(|object| object.contains(&address));
        let is_taken = self.is_code(address) && !is_table && !is_start_up && !is_return && !is_data;
        (is_taken && (is_named || !is_of_bytes)).then_some(address)
    }

    /// The addresses of code in pairs of registers that a function loads with constants, in either order. Every word is
    /// looked at, also where no path leads.
    fn loaded_pairs(&self, places: impl Iterator<Item = u32>) -> BTreeSet<u32> {
        let elf = self.elf;
        let mut loaded: BTreeMap<(u32, bool), BTreeMap<usize, BTreeSet<u8>>> = BTreeMap::new();
        for place in places {
            let Some(instruction) = Instruction::at(&elf.flash, place).filter(|found| found.operation == Ldi) else {
                continue;
            };
            let function = match (elf.sized(place), elf.extent(place)) {
                (Some(function), _) => (function.start, true),
                (None, Some((first, _))) => (first, false),
                (None, None) => (0, false),
            };
            let registers = loaded.entry(function).or_default();
            registers.entry(instruction.destination).or_default().insert(instruction.constant);
        }
        let mut taken = BTreeSet::new();
        for registers in loaded.values() {
            for lower in (16..31).step_by(2) {
                let (Some(low), Some(high)) = (registers.get(&lower), registers.get(&(lower + 1))) else { continue };
                let words = low.iter().flat_map(|low| high.iter().map(|high| u16::from_le_bytes([*low, *high])));
                taken.extend(words.filter_map(|word| self.of_word(word)));
            }
        }
        taken
    }
}
