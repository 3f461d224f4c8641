//! Tables of objects in CSV files, as the firmware's console and its users write them.
//!
//! The header names the five features and `label`, in any order; more columns are passed over, and so are lines that
//! begin with `#`. All features are whole numbers. A label is `plant`, `weed`, or empty where nobody said what it was.

use super::Labelled;
use crate::row::Kind;
use control::features::Features;
use csv::StringRecord;
use std::fs;
use std::io;
use std::num::IntErrorKind;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// The columns of the features, in the order of [`Features::values`].
pub const COLUMNS: [&str; 5] = ["speed_mm_s", "spacing_mm", "delay_mm", "hold_mm", "actuation_mm"];

/// The column of the label.
pub const LABEL: &str = "label";

/// An object that was recorded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recorded {
    /// What the machine measured.
    pub features: Features,
    /// What it was, where somebody said so.
    pub kind: Option<Kind>,
}

/// A table could not be read, and what would be right.
#[derive(Debug, Error)]
pub enum TableError {
    /// The file itself.
    #[error("{} cannot be read", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
    /// A line of it.
    #[error("{}, line {line}: {problem}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: u64,
        /// What is wrong with it.
        problem: String,
    },
}

/// Reads objects that may or may not have a label. At least one is there.
///
/// # Errors
/// Names the file, the line and what would be right.
pub fn read(path: &Path) -> Result<Vec<Recorded>, TableError> {
    let objects = read_with_lines(path, false)?;
    Ok(objects.into_iter().map(|(_, object)| object).collect())
}

/// Objects to learn from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Lesson {
    /// Those with a label, of both classes.
    pub objects: Vec<Labelled>,
    /// How many there were without, which teach nothing.
    pub unlabelled: usize,
}

/// Reads objects of both classes from files that together make one table.
///
/// # Errors
/// Names the file, the line and what would be right.
pub fn read_labelled(paths: &[PathBuf]) -> Result<Lesson, TableError> {
    let mut lesson = Lesson { objects: Vec::new(), unlabelled: 0 };
    let mut last = None;
    for path in paths {
        for (line, Recorded { features, kind }) in read_with_lines(path, true)? {
            match kind {
                Some(kind) => lesson.objects.push(Labelled { features, kind }),
                None => lesson.unlabelled += 1,
            }
            last = Some((path, line));
        }
    }
    let has = |kind: Kind| lesson.objects.iter().any(|object| object.kind == kind);
    let missing = [Kind::Plant, Kind::Weed].into_iter().find(|&kind| !has(kind));
    match (missing, last) {
        (Some(kind), Some((path, line))) => {
            let problem = format!("up to here there is no {LABEL} {kind}: some objects of either class are needed");
            Err(TableError::Line { path: path.clone(), line, problem })
        }
        _ => Ok(lesson),
    }
}

fn read_with_lines(path: &Path, wants_label: bool) -> Result<Vec<(u64, Recorded)>, TableError> {
    let bytes = fs::read(path).map_err(|source| TableError::File { path: path.into(), source })?;
    let at = |line: u64, problem: String| TableError::Line { path: path.into(), line, problem };
    let from_csv = |error: csv::Error| at(error.position().map_or(1, csv::Position::line), explain(&error));

    let text = String::from_utf8(bytes)
        .map_err(|_| at(1, "this is not text: a table is a CSV file in UTF-8".to_owned()))?
        // The reader counts a line that ends with both as one line less.
        .replace("\r\n", "\n");
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
    let header = reader.headers().map_err(from_csv)?.clone();
    let place = |column: &str| {
        header.iter().position(|name| name == column).ok_or_else(|| {
            let all = COLUMNS.join(",");
            at(1, format!("the column `{column}` is missing: the header has to name {all},{LABEL}"))
        })
    };
    let mut places = [0; COLUMNS.len()];
    for (index, column) in places.iter_mut().zip(COLUMNS) {
        *index = place(column)?;
    }
    let label = if wants_label { Some(place(LABEL)?) } else { place(LABEL).ok() };

    let mut objects = Vec::new();
    let mut record = StringRecord::new();
    while reader.read_record(&mut record).map_err(from_csv)? {
        let line = record.position().map_or(0, csv::Position::line);
        let object = object(&record, &places, label).map_err(|problem| at(line, problem))?;
        objects.push((line, object));
    }
    if objects.is_empty() {
        return Err(at(1, "there are no objects below the header: each is a line".to_owned()));
    }
    Ok(objects)
}

/// The object in a line.
fn object(record: &StringRecord, places: &[usize; 5], label: Option<usize>) -> Result<Recorded, String> {
    let mut values = [0; COLUMNS.len()];
    for ((value, place), column) in values.iter_mut().zip(places).zip(COLUMNS) {
        *value = whole_number(column, &record[*place])?;
    }
    let [speed_mm_s, spacing_mm, delay_mm, hold_mm, actuation_mm] = values;
    let kind = match label.map(|label| &record[label]) {
        None | Some("") => None,
        Some("plant") => Some(Kind::Plant),
        Some("weed") => Some(Kind::Weed),
        Some(other) => return Err(format!("`{other}` is not a class: {LABEL} has to be plant or weed")),
    };
    Ok(Recorded { features: Features { speed_mm_s, spacing_mm, delay_mm, hold_mm, actuation_mm }, kind })
}

fn whole_number(column: &str, text: &str) -> Result<i16, String> {
    text.parse().map_err(|error: std::num::ParseIntError| match error.kind() {
        IntErrorKind::PosOverflow | IntErrorKind::NegOverflow => {
            format!("{column} is {text}: it has to be from {} to {}", i16::MIN, i16::MAX)
        }
        _ => format!("{column} is `{text}`: it has to be a whole number, such as 250"),
    })
}

/// What a CSV error says about the line, without the record number and byte that nobody asked for.
fn explain(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("fields: {len}, where the header has {expected_len}: each line has one field a column")
        }
        _ => error.to_string(),
    }
}
