//! The tables and keys of a TOML file, and where they stand, so that an error can name them.

use std::ops::Range;
use toml::de::{DeTable, DeValue};

/// A table, or a key in it with its value.
pub struct Entry {
    /// `table` or `table.key`.
    pub name: String,
    /// Its bytes in the text, from the name to the value's end.
    pub span: Range<usize>,
    /// The bytes of its value.
    pub value: Range<usize>,
}

/// Returns each table, and behind it its keys; none if the text is no TOML.
fn entries(text: &str) -> Vec<Entry> {
    let mut entries = Vec::new();
    let Ok(document) = DeTable::parse(text) else { return entries };
    for (table, inner) in document.get_ref() {
        let entry = |name: String, start: usize, value: Range<usize>| Entry { name, span: start..value.end, value };
        entries.push(entry(table.get_ref().to_string(), table.span().start, inner.span()));
        let DeValue::Table(keys) = inner.get_ref() else { continue };
        let of_table = |key: &str| format!("{}.{key}", table.get_ref());
        entries.extend(keys.iter().map(|(key, value)| entry(of_table(key.get_ref()), key.span().start, value.span())));
    }
    entries
}

/// Returns the innermost entry around a byte. A table may span the keys of others, if its own are scattered.
pub fn around(text: &str, byte: usize) -> Option<Entry> {
    let around = entries(text).into_iter().filter(|entry| entry.span.contains(&byte));
    around.min_by_key(|entry| entry.span.len())
}

/// Returns the entry that is called `table.key`.
pub fn find(text: &str, name: &str) -> Option<Entry> {
    entries(text).into_iter().find(|entry| entry.name == name)
}
