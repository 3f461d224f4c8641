//! Which words in flash are instructions, by the direct jumps and calls alone.
//!
//! Every symbol of a function is a root, and so are the reset, the vectors, and every target of a call. From a root the
//! paths are followed through branches, jumps and compilers' jump tables. A path goes on behind a call only if the
//! called function can return. All other words in flash can be constants, or code that only pointers lead to.

use crate::decode::Operation::*;
use crate::decode::{Instruction, word_at};
use crate::elf::Program;
use std::collections::{BTreeMap, BTreeSet};

/// Instructions in front of a jump through a table among which its address is searched.
const SEARCHED_WORDS: u32 = 12;

/// The lower register of the pointer.
const Z: usize = 30;

/// What the direct jumps and calls reach.
#[derive(Default)]
pub(crate) struct Reach {
    /// Every word of an instruction.
    pub(crate) code: BTreeSet<u32>,
    /// The targets of calls.
    pub(crate) called: BTreeSet<u32>,
    /// The words of jump tables.
    pub(crate) tables: BTreeSet<u32>,
    /// The instructions from the reset up to the first calls, and up to other functions.
    pub(crate) start_up: BTreeSet<u32>,
    /// For each root its instructions.
    functions: BTreeMap<u32, BTreeSet<u32>>,
}

/// The paths from one root.
#[derive(Default)]
struct Paths {
    places: BTreeSet<u32>,
    called: BTreeSet<u32>,
    tables: BTreeSet<u32>,
    returns: bool,
}

impl Reach {
    /// Follows a program whose vectors lie at this address, if it has some.
    pub(crate) fn of(elf: &Program, vectors: Option<u32>) -> Reach {
        let handlers = vectors.into_iter().flat_map(|first| {
            (0..u32::from(elf.chip.vectors)).map(move |vector| first + vector * elf.chip.vector_bytes)
        });
        let mut to_do: Vec<u32> = elf.functions.keys().copied().chain([elf.start]).chain(handlers).collect();
        let (mut all, mut returning) = (BTreeMap::<u32, Paths>::new(), BTreeSet::new());
        let mut callers: BTreeMap<u32, BTreeSet<u32>> = BTreeMap::new();
        while let Some(root) = to_do.pop() {
            let found = paths(elf, root, &elf.table_jumps, |_| false, |called| returning.contains(&called));
            for &called in &found.called {
                callers.entry(called).or_default().insert(root);
                to_do.extend((called != root && !all.contains_key(&called)).then_some(called));
            }
            // Behind a call of it, paths go on.
            if found.returns && returning.insert(root) {
                to_do.extend(callers.get(&root).into_iter().flatten());
            }
            all.insert(root, found);
        }
        let mut reach = Reach::default();
        for (root, found) in all {
            let words = found.places.iter().filter_map(|&place| Instruction::at(&elf.flash, place));
            reach.code.extend(words.flat_map(|instruction| (instruction.address..instruction.next()).step_by(2)));
            reach.called.extend(found.called);
            reach.tables.extend(found.tables);
            reach.functions.insert(root, found.places);
        }
        let is_other = |place: u32| place != elf.start && elf.functions.contains_key(&place);
        reach.start_up = paths(elf, elf.start, &BTreeSet::new(), is_other, |_| false).places;
        reach
    }

    /// Every instruction's address.
    pub(crate) fn instructions(&self) -> impl Iterator<Item = &u32> {
        self.functions.values().flatten()
    }

    /// Whether the paths from a root pass a place, without calls.
    pub(crate) fn passes(&self, root: u32, place: u32) -> bool {
        self.functions.get(&root).is_some_and(|places| places.contains(&place))
    }
}

/// The paths from a root, up to places that `is_end` names. `returns` tells whether a called function does.
fn paths(
    elf: &Program,
    root: u32,
    table_jumps: &BTreeSet<u32>,
    is_end: impl Fn(u32) -> bool,
    returns: impl Fn(u32) -> bool,
) -> Paths {
    let mut paths = Paths::default();
    let mut to_do = vec![root];
    while let Some(place) = to_do.pop() {
        let mut is_new = |_: &Instruction| !is_end(place) && paths.places.insert(place);
        let Some(instruction) = at(elf, place).filter(&mut is_new) else { continue };
        let (next, target) = (instruction.next(), instruction.target(elf.chip.flash_bytes));
        let is_table = target.is_some_and(|target| table_jumps.contains(&target));
        if is_table || matches!(instruction.operation, Ijmp | Eijmp) {
            for word in table_of(elf, place) {
                paths.tables.insert(word);
                to_do.extend(word_at(&elf.flash, word).map(|target| u32::from(target) * 2));
            }
        }
        match instruction.operation {
            Ret | Reti => paths.returns = true,
            // It may jump to a function that returns.
            Ijmp | Eijmp => paths.returns = true,
            Jmp | Rjmp => to_do.extend(target),
            Brbs | Brbc => to_do.extend(target.into_iter().chain([next])),
            Cpse | Sbrc | Sbrs | Sbic | Sbis => {
                to_do.push(next);
                to_do.extend(at(elf, next).map(|skipped| skipped.next()));
            }
            Call | Rcall => {
                let target = target.unwrap_or_default();
                if target == next || is_table || returns(target) {
                    to_do.push(next);
                }
                if target != next {
                    paths.called.insert(target);
                }
            }
            _ => to_do.push(next),
        }
    }
    paths
}

/// The instruction at an address, if the chip has it.
fn at(elf: &Program, address: u32) -> Option<Instruction> {
    Instruction::at(&elf.flash, address).filter(|found| elf.chip.has(found.operation))
}

/// The places of the words of the table that a jump goes through, by the constants that are put into its pointer in
/// front of it. The flow analysis decides where the jump leads; this finds which words are no data.
fn table_of(elf: &Program, jump: u32) -> Vec<u32> {
    let (mut low, mut high) = (None, None);
    for back in 1..=SEARCHED_WORDS {
        let Some(instruction) = jump.checked_sub(2 * back).and_then(|place| at(elf, place)) else { break };
        let byte = match instruction.operation {
            Subi | Sbci => instruction.constant,
            _ => continue,
        };
        match (instruction.operation, instruction.destination) {
            (Subi, Z) => low = low.or(Some(byte)),
            (Sbci, place) if place == Z + 1 => high = high.or(Some(byte)),
            _ => {}
        }
    }
    let (Some(low), Some(high)) = (low, high) else { return Vec::new() };
    let first = u32::from(u16::from_le_bytes([low, high]).wrapping_neg()) * 2;
    let Some((begin, end)) = elf.extent(jump).filter(|(_, end)| jump < *end) else { return Vec::new() };
    let leads_here =
        |word: &u32| word_at(&elf.flash, *word).is_some_and(|target| (begin..end).contains(&(u32::from(target) * 2)));
    (first..elf.code_end).step_by(2).take_while(leads_here).collect()
}
