//! Targets of computed calls and jumps.
//!
//! - **A constant** in the pointer: this address (`-mcall-prologues`, pointers that the compiler knows).
//! - **A compiler's jump table** (libgcc's `__tablejump2__`): every entry of the table that lies in the same function.
//!   The table's length is not needed: the words after it belong to another function, or lead to another place in this
//!   one.
//! - **Constructors and destructors** of global objects: every entry of their tables.
//! - **Listed** in the budgets' `[calls]`: these functions, and no others.
//! - **Any other call**: every function whose address the program takes. The relocations list these functions, if the
//!   program was linked with `-Wl,--emit-relocs`. Else the analysis searches for word addresses of functions, which can
//!   give too many. It searches the initial values of variables, flash outside functions, and pairs of registers that a
//!   function loads with constants. A virtual call loads its pointer from a slot behind another loaded pointer. It
//!   leads to this slot of every virtual table, and to functions whose address is taken elsewhere.
//!
//! A jump could be a computed `goto` if its pointer comes from no virtual table and no variable at a fixed address.
//! Such a jump is refused. So is a call without any target.
//!
//! Assumption: a program gets a function's address only from one of these places. A program that calculates an address
//! must list its calls.

use crate::budget::Budgets;
use crate::decode::Operation::*;
use crate::decode::{Instruction, word_at};
use crate::elf::Program;
use crate::proved::Found;
use crate::values::{Known, Value};
use std::collections::{BTreeMap, BTreeSet};

/// The targets of an indirect call or jump.
#[derive(Clone, Debug)]
pub(crate) struct Where {
    pub(crate) found: Found,
    pub(crate) addresses: BTreeSet<u32>,
}

/// The data of a program that give the targets of indirect calls.
pub(crate) struct Targets {
    /// Entries of libgcc's routines that jump through a table.
    table_jumps: BTreeSet<u32>,
    /// Functions whose address is taken outside virtual tables, and whether this set is certain.
    taken: BTreeSet<u32>,
    is_exact: bool,
    /// Virtual tables: for each, its words as functions, if they are some.
    virtual_tables: Vec<Vec<Option<u32>>>,
    /// By the caller's name.
    listed: BTreeMap<String, BTreeSet<u32>>,
}

/// The lower register of the pointer.
const Z: usize = 30;

impl Targets {
    pub(crate) fn new(elf: &Program, budgets: &Budgets) -> Targets {
        let table_jumps = elf.labels.iter().filter(|(name, _)| name.starts_with("__tablejump"));
        let table_jumps = table_jumps.map(|(_, address)| *address).collect();
        let virtual_tables = elf.virtual_tables.iter().map(|table| {
            let words = elf.data[table.clone()].chunks_exact(2);
            words.map(|word| function_at(elf, u16::from_le_bytes([word[0], word[1]]))).collect()
        });
        let listed = budgets.calls.iter().map(|(caller, called)| {
            (caller.clone(), called.iter().flat_map(|name| elf.functions_called(name)).collect())
        });
        let taken = elf.taken.clone();
        Targets {
            table_jumps,
            is_exact: taken.is_some(),
            taken: taken.unwrap_or_else(|| found_taken(elf)),
            virtual_tables: virtual_tables.collect(),
            listed: listed.collect(),
        }
    }

    /// Whether a routine at this address jumps through a table.
    pub(crate) fn is_table_jump(&self, address: u32) -> bool {
        self.table_jumps.contains(&address)
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
        let (first, end) = elf.extent(at)?;
        let entries = (u32::from(base) * 2..).step_by(2).map(word);
        let addresses: BTreeSet<u32> =
            entries.map_while(|entry| entry.filter(|entry| (first..end).contains(entry))).collect();
        (!addresses.is_empty()).then_some((Where { found: Found::Table, addresses }, cycles))
    }

    /// The targets of a call or jump by the pointer.
    pub(crate) fn of_pointer(
        &self,
        elf: &Program,
        caller: &str,
        instruction: &Instruction,
        known: &Known,
    ) -> Option<Where> {
        if let Some(word) = known.pair(Z) {
            let address = u32::from(word) * 2 % elf.chip.flash_bytes;
            return Some(Where { found: Found::Followed, addresses: [beyond_trampoline(elf, address)].into() });
        }
        if let Some(listed) = self.listed.get(caller) {
            return Some(Where { found: Found::Listed, addresses: listed.clone() });
        }
        let (low, high) = (known.registers[Z], known.registers[Z + 1]);
        let slot = match (low, high) {
            (Value::Loaded(Some(low), true), Value::Loaded(Some(high), true)) => {
                (high == low + 1 || (low, high) == (0, 0)).then_some(usize::from(low))
            }
            _ => None,
        };
        let is_variable = matches!((low, high), (Value::Loaded(None, _), Value::Loaded(None, _)));
        let is_jump = matches!(instruction.operation, Ijmp | Eijmp);
        if is_jump && slot.is_none() && !is_variable {
            return None;
        }
        let mut addresses = self.taken.clone();
        for table in self.virtual_tables.iter().filter(|_| !is_variable) {
            match slot {
                // A pointer to a table points after two words that are no functions.
                Some(slot) => {
                    let is_start = |&start: &usize| table[start - 1].is_none() && table[start].is_some();
                    let starts = (1..table.len()).filter(is_start);
                    addresses.extend(starts.filter_map(|start| *table.get(start + slot / 2)?));
                }
                None => addresses.extend(table.iter().flatten()),
            }
        }
        let found = if slot.is_some() { Found::Slot } else { Found::Taken };
        // A pointer that no function can be in is never called by.
        (self.is_exact || !addresses.is_empty()).then_some(Where { found, addresses })
    }
}

/// The function that begins at a word address, if there is one.
fn function_at(elf: &Program, word: u16) -> Option<u32> {
    let address = beyond_trampoline(elf, u32::from(word) * 2);
    let is_function = elf.functions.contains_key(&address) && address >= elf.code_start;
    (is_function && word != 0).then_some(address)
}

/// The target of a jump in the trampolines, which stand for functions that a word address cannot reach.
fn beyond_trampoline(elf: &Program, address: u32) -> u32 {
    let trampolines = elf.label("__trampolines_start").zip(elf.label("__trampolines_end"));
    let is_trampoline = trampolines.is_some_and(|(start, end)| (start..end).contains(&address));
    let target = || Instruction::at(&elf.flash, address)?.target(elf.chip.flash_bytes);
    if is_trampoline { target().unwrap_or(address) } else { address }
}

/// The functions whose address the program seems to take outside virtual tables. This includes all real ones, and
/// others whose address equals a number in the program.
fn found_taken(elf: &Program) -> BTreeSet<u32> {
    let mut taken = BTreeSet::new();
    let word = |bytes: &[u8], address| word_at(bytes, address).and_then(|word| function_at(elf, word));
    // Variables lie at any address.
    let variables = (0..elf.data.len()).filter(|place| !elf.virtual_tables.iter().any(|table| table.contains(place)));
    taken.extend(variables.filter_map(|place| word(&elf.data, place as u32)));
    // Constants in flash, before the code and between functions. Only start-up code calls the tables of constructors.
    let label = |name: &str| elf.label(name).unwrap_or_default();
    let constructors = label("__ctors_start")..label("__dtors_end").max(label("__ctors_end"));
    let constants = elf.gaps().flatten().filter(|address| !constructors.contains(address));
    taken.extend(constants.filter_map(|address| word(&elf.flash, address)));
    // Pairs of registers that a function loads with constants, in either order.
    for &first in elf.functions.keys() {
        let Some((_, end)) = elf.extent(first) else { continue };
        let mut loaded: BTreeMap<usize, BTreeSet<u8>> = BTreeMap::new();
        let mut address = first;
        while address < end {
            let Some(instruction) = Instruction::at(&elf.flash, address) else {
                address += 2;
                continue;
            };
            if instruction.operation == Ldi {
                loaded.entry(instruction.destination).or_default().insert(instruction.constant);
            }
            address = instruction.next();
        }
        for lower in (16..31).step_by(2) {
            let (Some(low), Some(high)) = (loaded.get(&lower), loaded.get(&(lower + 1))) else { continue };
            let words = low.iter().flat_map(|low| high.iter().map(|high| u16::from_le_bytes([*low, *high])));
            taken.extend(words.filter_map(|word| function_at(elf, word)));
        }
    }
    taken
}
