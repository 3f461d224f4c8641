//! How often loops turn, as their sources say it.
//!
//! A loop says it by a record in the ELF's section `.loop_bounds`, which takes no flash: an address inside the loop, and how
//! often the program comes by it at most each time that the loop is come to, 4 bytes each. Assembly inside the loop writes it, in C
//! and in Rust alike:
//!
//! ```text
//! 1: .pushsection .loop_bounds, "", @progbits
//!    .long 1b, 8
//!    .popsection
//! ```
//!
//! The compiler keeps such a record in its loop, and writes it twice where it makes two loops of one. The record is taken for
//! the innermost loop around its address, and only where no turn can go round it; so a record that has come to lie elsewhere
//! bounds nothing.
//!
//! Where a source cannot write assembly, or is a library's, a table names the function, by its path without types, and says how often the
//! program comes by the beginning of a loop in it at most ([`LoopBound`]), or by each of its beginnings where it can be entered at
//! several places: of the outermost loops, of those within them, and so on. Of several loops side by side it is the one that turns most
//! that counts, since the order in which a compiler lays them out is nobody's business. A record at a loop goes before the table. A function
//! that goes over as many bytes as its third argument says is taken to do so wherever a caller gives a constant.
//!
//! That a number is right is the source's word, or the table's, which a run in the simulator can refute.

use object::read::elf::ElfFile32;
use object::{LittleEndian, Object, ObjectSection};
use serde::Deserialize;
use std::collections::BTreeMap;

/// The section.
const SECTION: &str = ".loop_bounds";

/// How often the loops of a function turn.
#[derive(Clone, Debug, PartialEq, Eq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LoopBound {
    /// How often the program comes by the beginning of a loop at most, each time that the loop is come to: of the outermost, of those
    /// within them, and so on; the last number is that of all that are deeper.
    #[serde(deserialize_with = "one_or_several")]
    pub passes: Vec<u64>,
    /// Whether it is once for each byte of the length that the caller gives, and once more: where that is a constant, it stands for `passes`.
    #[serde(default)]
    pub by_length: bool,
    /// Why it does not do so more often.
    pub because: String,
}

/// A number that holds at every depth may stand alone.
fn one_or_several<'de, D: serde::Deserializer<'de>>(deserializer: D) -> Result<Vec<u64>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged, expecting = "a number, or one for each depth, the outermost loop's first")]
    enum Passes {
        One(u64),
        Several(Vec<u64>),
    }
    match Passes::deserialize(deserializer)? {
        Passes::One(passes) => Ok(vec![passes]),
        Passes::Several(passes) => Ok(passes),
    }
}

/// Those of functions, by their paths without types.
pub type LoopBounds = BTreeMap<String, LoopBound>;

/// The records of an ELF: an address, and how often the program comes by it at most each time that it comes to the loop around it.
pub(crate) fn records_of(file: &ElfFile32<LittleEndian>) -> Result<BTreeMap<u32, u64>, object::Error> {
    let Some(section) = file.section_by_name(SECTION) else { return Ok(BTreeMap::new()) };
    let mut turns = BTreeMap::new();
    for record in section.data()?.chunks_exact(8) {
        let word = |at: usize| record[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let (address, stated) = (word(0), u64::from(word(4)));
        // Of two for the same place the larger one holds for both.
        turns.entry(address).and_modify(|turns| *turns = stated.max(*turns)).or_insert(stated);
    }
    Ok(turns)
}
