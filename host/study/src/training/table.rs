//! Reads and writes tables of detections as CSV, as the console and its users write them.
//!
//! The header names the five features and `label`, in any order. Other columns are ignored. So are lines that begin
//! with `#`, an `ok` that ends the console's answer, and the headers of further dumps. All features are whole numbers.
//! A label is `plant`, `weed`, or empty for an unlabelled detection.
//!
//! The console's `dump` takes nothing away, so dumps overlap. A detection that is saved twice would make its own
//! neighbour, and leaving one out would test nothing. So [`read_labelled`] reads equal lines once.

use super::Labelled;
use control::ground::features::Features;
use field::row::Kind;
use files::FileError;
use files::csv_table::{CsvTable, Line};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The columns of the features, in the order of [`Features::values`].
pub const COLUMNS: [&str; 5] = ["speed_mm_s", "spacing_mm", "delay_mm", "hold_mm", "actuation_mm"];

/// The column of the label.
pub const LABEL: &str = "label";

/// The column of the machine's class: plant, weed or unknown. An unknown detection counts as a plant.
const ANSWER: &str = "answer";

/// Columns that may tell where a detection was. They keep detections with equal features apart.
pub const PLACE: [&str; 2] = ["row", "position"];

/// An object that was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// What the machine measured.
    pub features: Features,
    /// Its label, if it has one.
    pub kind: Option<Kind>,
}

/// Reads detections with or without labels, at least one.
///
/// # Errors
/// Names the file, the line and what would be right.
pub fn read(path: &Path) -> Result<Vec<Recorded>, FileError> {
    let read: Vec<_> =
        detections(&CsvTable::read(path, &COLUMNS)?.with_optional(&[LABEL])?).map(object).collect::<Result<_, _>>()?;
    if read.is_empty() {
        let problem = "no line is below the header: add at least one".to_owned();
        return Err(FileError::Line { path: path.into(), line: 1, problem });
    }
    Ok(read)
}

/// Reads detections as [`read`], or none.
///
/// # Errors
/// As [`read`], but a table without lines is none.
pub fn read_or_empty(path: &Path) -> Result<Vec<Recorded>, FileError> {
    detections(&CsvTable::read_or_empty(path, &COLUMNS)?.with_optional(&[LABEL])?).map(object).collect()
}

/// Detections to learn from, and what was passed over.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ToLearn {
    /// The labelled detections, each once.
    pub labelled: Vec<Labelled>,
    /// Number of lines without a label.
    pub unlabelled: usize,
    /// Number of lines that repeat an earlier one: features, label, and place if the table has it.
    pub repeated: usize,
    /// An error for each detection that has another label in an earlier line.
    pub contradictions: Vec<String>,
    /// Number of labelled detections that the machine took for the other class. Spacings behind them are wrong.
    pub misread: usize,
}

/// Reads detections of both classes from files that together make one table.
///
/// # Errors
/// Names the file, the line and what would be right.
pub fn read_labelled(paths: &[PathBuf]) -> Result<ToLearn, FileError> {
    let columns: Vec<&str> = COLUMNS.into_iter().chain([LABEL]).collect();
    let table = |path: &PathBuf| CsvTable::read(path, &columns)?.with_optional(&PLACE);
    let tables = paths.iter().map(table).collect::<Result<Vec<_>, _>>()?;
    let (mut read, mut seen, mut last) = (ToLearn::default(), HashMap::new(), None);
    for line in tables.iter().flat_map(detections) {
        last = Some(line);
        let Recorded { features, kind } = object(line)?;
        let Some(kind) = kind else {
            read.unlabelled += 1;
            continue;
        };
        let place = PLACE.map(|column| line.text(column).to_owned());
        let labels: &mut Vec<Kind> = seen.entry((*features.values(), place)).or_default();
        if labels.contains(&kind) {
            read.repeated += 1;
            continue;
        }
        if let Some(other) = labels.first() {
            read.contradictions.push(line.error(format!("an earlier line has it as a {other}")).to_string());
        }
        labels.push(kind);
        let answer = line.text(ANSWER);
        read.misread += usize::from(!answer.is_empty() && (answer == "weed") != (kind == Kind::Weed));
        read.labelled.push(Labelled { features, kind });
    }
    let has = |kind: Kind| read.labelled.iter().any(|object: &Labelled| object.kind == kind);
    let missing = [Kind::Plant, Kind::Weed].into_iter().find(|&kind| !has(kind));
    match (missing, last) {
        (Some(kind), Some(line)) => {
            Err(line
                .error(format!("up to here there is no {LABEL} {kind}: some detections of either class are needed")))
        }
        _ => Ok(read),
    }
}

/// The lines of a table, without the headers of further dumps.
fn detections(table: &CsvTable) -> impl Iterator<Item = Line<'_>> {
    table.lines().filter(|line| COLUMNS.iter().any(|&column| line.text(column) != column))
}

fn object(line: Line) -> Result<Recorded, FileError> {
    let mut values = [0; COLUMNS.len()];
    for (value, column) in values.iter_mut().zip(COLUMNS) {
        *value = line.value(column, "a whole number from -32768 to 32767")?;
    }
    let kind = match line.text(LABEL) {
        "" => None,
        _ => Some(line.value(LABEL, "plant or weed, or empty")?),
    };
    Ok(Recorded { features: Features(values), kind })
}
