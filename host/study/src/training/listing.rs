//! Writes a trained table: as the Rust source for the firmware, or as CSV that can be read again.
//!
//! The source lists the examples in physical units, one a line, so that a person can check them and see changes. The
//! compiler converts them to bytes.

use super::{Labelled, Training, label_of, table};
use control::ground::class::label;
use std::fmt::Write;
use std::io;

/// The head of the table; `{how}` is the command that wrote it.
const HEAD: &str = "\
//! The trained example table: scale, radius, k and examples, in millimetres and millimetres a second.
//!
//! Written by `{how}`. Do not edit it: train it again.

use crate::ground::class::label;
use crate::ground::features::COUNT as FEATURES;
use knn::Range;
";

/// The table as `control/src/ground/examples/table.rs`, in rustfmt's form. `how` is the command that wrote it.
pub fn rust(training: &Training, how: &str) -> String {
    let Training { ranges, radius, k, kept, .. } = training;
    let mut text = HEAD.replace("{how}", how);
    // Writing to a string cannot fail.
    let _ = writeln!(text, "\n/// The values of each feature that map onto 0 and 255.");
    let _ = writeln!(text, "pub const RANGES: [Range; FEATURES] = [");
    for range in ranges {
        let _ = writeln!(text, "    Range {{ lowest: {}, highest: {} }},", range.lowest, range.highest);
    }
    let _ = writeln!(text, "];\n\n/// Squared distance beyond which no example is near enough.");
    let _ = writeln!(text, "pub const RADIUS: u32 = {radius};");
    let _ = writeln!(text, "\n/// Examples that vote.\npub const K: u8 = {k};");
    let _ = writeln!(text, "\n/// Speed, spacing, delay, hold and actuation of each example, and its label.");
    let _ = writeln!(text, "pub const TRAINED: [([i16; FEATURES], u8); {}] = [", kept.len());
    for example in in_order(kept) {
        let name = if label_of(example.kind) == label::PLANT { "PLANT" } else { "WEED" };
        let _ = writeln!(text, "    ({:?}, label::{name}),", example.features.values());
    }
    text.push_str("];\n");
    text
}

/// Writes examples as a table that [`table::read_labelled`] reads.
///
/// # Errors
/// The errors of the writer.
pub fn write_csv(examples: &[Labelled], to: impl io::Write) -> Result<(), csv::Error> {
    let mut writer = csv::Writer::from_writer(to);
    writer.write_record(table::COLUMNS.into_iter().chain([table::LABEL]))?;
    for Labelled { features, kind } in in_order(examples) {
        let values = features.values().map(|value| value.to_string());
        writer.write_record(values.into_iter().chain([kind.to_string()]))?;
    }
    writer.flush()?;
    Ok(())
}

/// The examples in an order that can be looked through: weeds and plants, slow and fast, near and far.
fn in_order(kept: &[Labelled]) -> Vec<Labelled> {
    let mut sorted = kept.to_vec();
    sorted.sort_by_key(|example| (label_of(example.kind), *example.features.values()));
    sorted
}
