//! The content of a crop row, as the beam sees it: the canopies of crop plants and of tall weeds, each with its position
//! along the row and its width at the beam's height.
//!
//! A [`Row`] comes from a list, from a CSV file of measured plants, or from a seed
//! ([`Planting`](crate::planting::Planting)). Canopies in a row do not overlap: those that touch are one detection of
//! the beam, and one canopy of the row. Weeds below the beam are not in the row: they are part of the ground that the
//! tool works. Dust, clods and insects that break the beam may be added.
//!
//! All positions are millimetres along the ground, from an origin of the row's own.

use crate::conditions::Crop;
use crate::ground::union;
use files::CsvTable;
use serde::Serialize;
use std::io;
use std::ops::Range;
use std::path::Path;
use strum::{Display, EnumString};
use thiserror::Error;

pub use files::FileError;

/// The greatest width: wider than any crop plant with intra-row weeding.
pub const MAX_WIDTH_MM: f64 = 1000.0;

/// The widest canopy of a single plant, and the greatest width across the row.
const MAX_CANOPY_MM: f64 = 400.0;

/// The greatest distance from the origin, 10 km: longer than any row.
pub const MAX_POSITION_MM: f64 = 1e7;

/// The longest row, 6 km. A simulation stores every edge of the encoder.
pub const MAX_LENGTH_MM: f64 = 6e6;

/// The kinds of canopy in a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Display, EnumString, Serialize)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase")]
pub enum Kind {
    /// A crop plant: the tool has to go round it.
    Plant,
    /// A weed tall enough to break the beam: the tool should not go round it.
    Weed,
}

/// The outline of a plant or of a tall weed at the beam's height.
#[derive(Clone, Debug, PartialEq)]
pub struct Canopy {
    /// Its centre along the row.
    pub position_mm: f64,
    /// Its width at the beam's height: for a crop plant the canopy's.
    pub width_mm: f64,
    /// Its width across the row. For joined canopies it is that of the widest.
    pub across_mm: f64,
    /// Plant or weed.
    pub kind: Kind,
    /// The parts of its width where leaves break the beam, ascending positions along the row. Empty without gaps.
    pub leaves: Vec<Range<f64>>,
}

impl Canopy {
    /// A crop plant with a closed canopy.
    pub fn plant(position_mm: f64, width_mm: f64) -> Self {
        Self::new(position_mm, width_mm, Kind::Plant)
    }

    /// A tall weed.
    pub fn weed(position_mm: f64, width_mm: f64) -> Self {
        Self::new(position_mm, width_mm, Kind::Weed)
    }

    /// A plant or weed without gaps. It is as wide across the row as along it, but at most as wide as a canopy.
    pub fn new(position_mm: f64, width_mm: f64, kind: Kind) -> Self {
        Self { position_mm, width_mm, across_mm: width_mm.min(MAX_CANOPY_MM), kind, leaves: Vec::new() }
    }

    /// The stretch of ground below it.
    pub fn span_mm(&self) -> Range<f64> {
        self.position_mm - self.width_mm / 2.0..self.position_mm + self.width_mm / 2.0
    }

    /// The stretches where it breaks the beam.
    pub fn blocks_mm(&self) -> Vec<Range<f64>> {
        if self.leaves.is_empty() { vec![self.span_mm()] } else { self.leaves.clone() }
    }

    fn check(&self) -> Result<(), Problem> {
        // Rejects NaN too.
        if !(-MAX_POSITION_MM..=MAX_POSITION_MM).contains(&self.position_mm) {
            return Err(Problem::Position(self.position_mm));
        }
        if !(self.width_mm > 0.0 && self.width_mm <= MAX_WIDTH_MM) {
            return Err(Problem::Width(self.width_mm));
        }
        Ok(())
    }
}

/// A crop plant's stem, and the zone round it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stem {
    /// Its place along the row.
    pub along_mm: f64,
    /// Its place across the row.
    pub across_mm: f64,
    /// Radius of the zone that no tool may enter.
    pub protected_mm: f64,
    /// Whether its plant breaks the beam.
    pub is_seen: bool,
}

impl Stem {
    /// A stem on the row's line, with the default field's zone.
    pub(crate) fn at(along_mm: f64) -> Self {
        let protected_mm = Crop::default().protected_mm / 2.0;
        Self { along_mm, across_mm: 0.0, protected_mm, is_seen: true }
    }

    /// Half of the zone's width across the row, at this distance from the stem along it; 0 beyond the zone.
    pub(crate) fn half_chord_mm(&self, beside_mm: f64) -> f64 {
        (self.protected_mm.powi(2) - beside_mm.powi(2)).max(0.0).sqrt()
    }

    /// The same over the length of a tool that reaches this far ahead of its middle and behind it: the widest part of the
    /// zone there.
    pub(crate) fn half_chord_beside_mm(&self, beside_mm: f64, half_length_mm: f64) -> f64 {
        self.half_chord_mm((beside_mm.abs() - half_length_mm).max(0.0))
    }
}

/// The problem of a canopy or a row, and what would be right.
#[derive(Debug, Error, PartialEq)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum Problem {
    #[error("position_mm is {0}: it has to be from -{MAX_POSITION_MM} to {MAX_POSITION_MM}, millimetres along the row")]
    Position(f64),
    #[error("width_mm is {0}: it has to be above 0 and at most {MAX_WIDTH_MM} mm")]
    Width(f64),
    #[error(
        "the {} at {} mm and the {} at {} mm overlap: \
         each has to end before the next begins (plants that have grown together are one line)",
        .0[0].kind, .0[0].position_mm, .0[1].kind, .0[1].position_mm
    )]
    Overlap(Box<[Canopy; 2]>),
    #[error(
        "the row is {} m long, with half a spacing at its ends: it has to be at most {} m",
        (.0 / 1000.0).ceil(), MAX_LENGTH_MM / 1000.0
    )]
    Length(f64),
    #[error("the row is empty: it needs at least one plant or weed")]
    Empty,
}

/// The columns of a row's CSV file.
const COLUMNS: [&str; 3] = ["position_mm", "width_mm", "kind"];

/// Plants and tall weeds in the order in which the machine meets them.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    canopies: Vec<Canopy>,
    /// The stretches over which dust breaks the beam.
    pub dust_mm: Vec<Range<f64>>,
    /// The stretches where each beam is broken, if the leaves move between the beams.
    pub(crate) swayed_mm: Option<[Vec<Range<f64>>; 2]>,
    /// The crop's stems, if they do not stand in the middle of their canopies.
    pub stems: Option<Vec<Stem>>,
    /// Its ends, if they are known.
    pub(crate) ground_mm: Option<Range<f64>>,
}

impl Row {
    /// A row of canopies, in any order.
    ///
    /// # Errors
    /// If there are none, one is malformed, two overlap, or the row is too long.
    pub fn new(canopies: Vec<Canopy>) -> Result<Self, Problem> {
        if canopies.is_empty() {
            return Err(Problem::Empty);
        }
        canopies.iter().try_for_each(Canopy::check)?;
        Self::in_order(canopies.into_iter().map(|canopy| ((), canopy)).collect()).map_err(|((), problem)| problem)
    }

    /// A row of canopies in any order. An error comes with the mark of the canopy that has the problem.
    fn in_order<T: Copy>(mut canopies: Vec<(T, Canopy)>) -> Result<Self, (T, Problem)> {
        canopies.sort_by(|(_, a), (_, b)| a.position_mm.total_cmp(&b.position_mm));
        for pair in canopies.windows(2) {
            let ((_, before), (mark, canopy)) = (&pair[0], &pair[1]);
            if before.span_mm().end >= canopy.span_mm().start {
                return Err((*mark, Problem::Overlap(Box::new([canopy.clone(), before.clone()]))));
            }
        }
        let last = canopies.last().map(|(mark, _)| *mark);
        let row = Self::of(canopies.into_iter().map(|(_, canopy)| canopy).collect(), None);
        if let Some(mark) = last {
            let Range { start, end } = row.span_mm();
            if end - start > MAX_LENGTH_MM {
                return Err((mark, Problem::Length(end - start)));
            }
        }
        Ok(row)
    }

    /// A row of these canopies alone.
    fn of(canopies: Vec<Canopy>, ground_mm: Option<Range<f64>>) -> Self {
        Self { canopies, dust_mm: Vec::new(), swayed_mm: None, stems: None, ground_mm }
    }

    /// The stems of its plants. If none are known, one stands in the middle of each canopy.
    pub fn stems(&self) -> Vec<Stem> {
        self.stems.clone().unwrap_or_else(|| self.plants().map(|plant| Stem::at(plant.position_mm)).collect())
    }

    /// The stretches over which the first beam is broken, in ascending order and without overlaps.
    pub fn blocks_mm(&self) -> Vec<Range<f64>> {
        self.blocks_of_beam_mm(0)
    }

    /// The stretches over which a beam is broken: 0 is the first, 1 the second.
    pub(crate) fn blocks_of_beam_mm(&self, beam: usize) -> Vec<Range<f64>> {
        let leaves_mm = match &self.swayed_mm {
            Some(swayed_mm) => swayed_mm[beam].clone(),
            None => self.canopies.iter().flat_map(Canopy::blocks_mm).collect(),
        };
        union(leaves_mm.into_iter().chain(self.dust_mm.iter().cloned()).collect())
    }

    /// The canopies in the first `length_mm` of the row's ground. `None` if there are none.
    pub fn beginning(&self, length_mm: f64) -> Option<Self> {
        let end_mm = self.span_mm().start + length_mm;
        let canopies: Vec<Canopy> =
            self.canopies.iter().filter(|canopy| canopy.span_mm().end < end_mm).cloned().collect();
        (!canopies.is_empty()).then(|| Self::of(canopies, Some(self.span_mm().start..end_mm)))
    }

    /// Everything that stands in the row, by position.
    pub fn canopies(&self) -> &[Canopy] {
        &self.canopies
    }

    /// The crop plants, by position.
    pub fn plants(&self) -> impl Iterator<Item = &Canopy> {
        self.canopies.iter().filter(|canopy| canopy.kind == Kind::Plant)
    }

    /// The tall weeds, by position.
    pub fn weeds(&self) -> impl Iterator<Item = &Canopy> {
        self.canopies.iter().filter(|canopy| canopy.kind == Kind::Weed)
    }

    /// The stretch of ground that counts as the row. If its ends were not given, it reaches half a mean spacing beyond
    /// the outermost plants, so that every plant has the length of a spacing. It always includes every canopy of the
    /// row.
    pub fn span_mm(&self) -> Range<f64> {
        if let Some(ground_mm) = &self.ground_mm {
            return ground_mm.clone();
        }
        let (first, last) = (&self.canopies[0], &self.canopies[self.canopies.len() - 1]);
        let places: Vec<f64> = self.plants().map(|plant| plant.position_mm).collect();
        let around = match places.as_slice() {
            [only] => only - LONE_PLANT_SPACING_MM / 2.0..only + LONE_PLANT_SPACING_MM / 2.0,
            [start, .., end] => {
                let half_spacing_mm = (end - start) / (places.len() - 1) as f64 / 2.0;
                start - half_spacing_mm..end + half_spacing_mm
            }
            [] => first.position_mm..last.position_mm,
        };
        around.start.min(first.span_mm().start)..around.end.max(last.span_mm().end)
    }

    /// Parses the text of a CSV file with the columns `position_mm,width_mm,kind`, in any order of columns and lines.
    /// `kind` is `plant` or `weed`. Lines that begin with `#` are comments.
    ///
    /// # Errors
    /// Names the file, the line and what would be right.
    pub fn parse_csv(path: &Path, text: Vec<u8>) -> Result<Self, FileError> {
        let table = CsvTable::parse(path, text, &COLUMNS)?;
        let mut lines = Vec::new();
        for line in table.lines() {
            let position_mm = line.value("position_mm", "a number of millimetres along the row")?;
            let canopy = Canopy::new(
                position_mm,
                line.value("width_mm", "a number of millimetres")?,
                line.value("kind", "plant or weed")?,
            );
            canopy.check().map_err(|problem| line.error(problem.to_string()))?;
            lines.push((line, canopy));
        }
        Self::in_order(lines).map_err(|(line, problem)| line.error(problem.to_string()))
    }

    /// Writes the row as a CSV table that [`Row::parse_csv`] reads, without gaps in canopies, dust and the row's ends.
    ///
    /// # Errors
    /// The errors of the writer.
    pub fn write_csv(&self, to: impl io::Write) -> Result<(), csv::Error> {
        let mut writer = csv::Writer::from_writer(to);
        writer.write_record(COLUMNS)?;
        for canopy in &self.canopies {
            writer.serialize((canopy.position_mm, canopy.width_mm, canopy.kind))?;
        }
        writer.flush()?;
        Ok(())
    }
}

/// The assumed spacing of a plant without neighbours, for figures per length of row.
const LONE_PLANT_SPACING_MM: f64 = 500.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::planting::Planting;

    /// Parses a text. Returns the error's message otherwise.
    fn read(text: &str) -> Result<Row, String> {
        Row::parse_csv(Path::new("row.csv"), text.into()).map_err(|error| error.to_string())
    }

    #[test]
    fn each_plant_has_a_spacing_of_row_to_itself() {
        let row =
            Row::new(vec![Canopy::plant(1000.0, 150.0), Canopy::plant(1480.0, 150.0), Canopy::plant(2000.0, 150.0)]);
        assert_eq!(row.unwrap().span_mm(), 750.0..2250.0);
    }

    #[test]
    fn a_written_row_reads_back() {
        let row = Planting { weeds: 4, ..Planting::default() }.grow(5).unwrap();
        let mut text = Vec::new();
        row.write_csv(&mut text).unwrap();
        assert_eq!(read(&String::from_utf8(text).unwrap()), Ok(row));
    }

    #[test]
    fn columns_lines_and_spaces_may_come_in_any_order() {
        let row = read("kind, position_mm, width_mm\n# measured in May\nplant, 900, 150\nweed, 500, 15\n");
        let canopies = vec![Canopy::weed(500.0, 15.0), Canopy::plant(900.0, 150.0)];
        assert_eq!(row, Ok(Row::new(canopies).unwrap()));
    }

    #[test]
    fn a_bad_line_is_named_with_its_number_and_what_would_be_right() {
        let header = "position_mm,width_mm,kind\n";
        for (text, error) in [
            ("250,150,plant\n750,-5,plant\n", "row.csv, line 3: width_mm is -5: it has to be above 0"),
            ("250,wide,plant\n", "row.csv, line 2: width_mm is `wide`: it has to be a number of millimetres"),
            ("250,150,crop\n", "row.csv, line 2: kind is `crop`: it has to be plant or weed"),
            ("250,150\n", "row.csv, line 2: fields: 2, where the header has 3"),
            ("NaN,150,plant\n", "row.csv, line 2: position_mm is NaN"),
            ("250,150,plant\n4294967296,150,plant\n", "row.csv, line 3: position_mm is 4294967296: it has to be from"),
            ("18446744073709551616,150,plant\n", "row.csv, line 2: position_mm is 18446744073709552000: it has to be"),
            (
                "-9e6,150,plant\n9e6,150,plant\n",
                "row.csv, line 3: the row is 36000 m long, with half a spacing at its ends: it has to be",
            ),
            ("0,150,plant\n4e6,150,plant\n", "row.csv, line 3: the row is 8000 m long"),
            (
                "750,150,plant\n250,150,plant\n700,20,weed\n",
                "row.csv, line 2: the plant at 750 mm and the weed at 700 mm overlap",
            ),
            ("", "row.csv, line 1: no line is below the header"),
        ] {
            for end in ["\n", "\r\n"] {
                let said = read(&format!("{header}{text}").replace('\n', end)).unwrap_err();
                assert!(said.starts_with(error), "{said}");
            }
        }
    }
}
