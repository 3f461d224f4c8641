//! Loop bounds that the source or a table states.
//!
//! A loop states its bound in a record in the ELF's section `.loop_bounds`, which takes no flash. A record has two
//! values of 4 bytes: an address inside the loop, and the most executions of this address for each entry to the loop.
//! Assembly inside the loop writes the record, in C and in Rust alike:
//!
//! ```text
//! 1: .pushsection .loop_bounds, "", @progbits
//!    .long 1b, 8
//!    .popsection
//! ```
//!
//! The compiler keeps such a record in its loop. If it splits the loop into two, it writes the record twice. The record
//! applies to the innermost loop around its address, and only if every turn passes the address. So a record that was
//! moved elsewhere bounds nothing.
//!
//! A source that cannot write assembly, such as a library's, needs a row in a table ([`LoopBound`]). The row names the
//! function by its path without types. It states the most executions of a loop's head, or of each head if the loop has
//! several entries. It has one number for the outermost loops, one for the loops within them, and so on. For loops side
//! by side it states the largest number, because the compiler chooses their order. It holds for every function of the
//! name. A loop that counts more turns by itself keeps its own number (`counted`). A record at a loop takes precedence
//! over both. For a function whose third argument is a number of bytes, a constant argument is used as its bound. After
//! a jump to the function, the larger of the constant and the stated number is used.
//!
//! The analysis does not prove that a stated number is right. A run in the simulator can disprove it.

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
    /// The most executions of a loop's head for each entry to the loop: of the outermost, of those within them, and so
    /// on. The last number is valid for all deeper loops.
    #[serde(deserialize_with = "one_or_several")]
    pub passes: Vec<u64>,
    /// Whether it turns once for each byte of the caller's length, and once more: a constant length replaces `passes`.
    #[serde(default)]
    pub by_length: bool,
    /// The reason for the bound.
    pub because: String,
}

/// A number that is valid at every depth may be written without a list.
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

/// The bounds of functions, by their paths without types.
pub type LoopBounds = BTreeMap<String, LoopBound>;

/// The records of an ELF: an address, and its most executions for each entry to the loop around it.
pub(crate) fn records_of(file: &ElfFile32<LittleEndian>) -> Result<BTreeMap<u32, u64>, object::Error> {
    let Some(section) = file.section_by_name(SECTION) else { return Ok(BTreeMap::new()) };
    let mut turns = BTreeMap::new();
    for record in section.data()?.chunks_exact(8) {
        let word = |at: usize| record[at..].first_chunk().map_or(0, |bytes| u32::from_le_bytes(*bytes));
        let (address, stated) = (word(0), u64::from(word(4)));
        // Of two records for the same place the larger one is valid for both.
        turns.entry(address).and_modify(|turns| *turns = stated.max(*turns)).or_insert(stated);
    }
    Ok(turns)
}
