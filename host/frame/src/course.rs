//! Arguments that several commands share: the row, and the machine that rolls along it.

use crate::{Messages, number_within, source, whole_within};
use anyhow::{Result, ensure};
use clap::Args;
use field::conditions::{self, Conditions};
use field::planting::Planting;
use field::row::Row;
use files::{bounded_file, in_a_line};
use std::path::PathBuf;

/// The arguments.
#[derive(Args)]
pub struct CourseArguments {
    /// Speed in km/h, 0.1 to 10.
    #[arg(long, default_value = "2.5", value_parser = number_within(0.1..=10.0))]
    pub speed: f64,
    /// Mean distance from plant to plant in mm, 50 to 5000.
    #[arg(long, default_value = "500", value_parser = number_within(50.0..=5000.0))]
    spacing: f64,
    /// Mean width of a canopy in mm, 10 to 340.
    #[arg(long, default_value = "150", value_parser = number_within(10.0..=340.0))]
    canopy: f64,
    /// Number of crop plants, 1 to 1000.
    #[arg(long, default_value = "20", value_parser = whole_within(1..=1000_usize))]
    plants: usize,
    /// Number of tall weeds between them, 0 to 1000. Default: 5, or as many as there is room for.
    #[arg(long, value_parser = whole_within(0..=1000_usize))]
    weeds: Option<usize>,
    /// Random seed, 0 to 18446744073709551615.
    #[arg(long, default_value = "1", value_parser = whole_within(0..=u64::MAX))]
    pub seed: u64,
    /// Distance from the beam back to the tool in mm, 100 to 2000. Default: the field's, 400.
    #[arg(long, value_parser = whole_within(100..=2000_u32))]
    beam_to_tool: Option<u32>,
    /// Machine, settings, zones round stems and wheel slip. A preset such as walked, from-the-box or paper, or a TOML
    /// file as for `weeder trial`; - for standard input.
    #[arg(long, value_name = "PRESET|FILE.toml", value_parser = source::preset_or_file(), hide_possible_values = true, default_value = conditions::DEFAULT)]
    pub field: String,
    /// Grow canopies with gaps for the beam.
    #[arg(long)]
    ragged: bool,
    /// Read the row from a CSV file with the columns position_mm,width_mm,kind; - for standard input.
    #[arg(long, value_name = "FILE.csv", value_parser = source::file(), conflicts_with_all = ["spacing", "canopy", "plants", "weeds", "seed", "ragged"])]
    pub row: Option<PathBuf>,
}

/// The default number of tall weeds in a row. A row without room for them gets fewer.
const WEEDS: usize = 5;

/// Scatter of a random row, as shares of the mean spacing and the mean canopy. Each is at most a quarter of the gap
/// between two mean canopies, so that the plants do not touch.
const SPACING_SCATTER: f64 = 0.08;
const CANOPY_SCATTER: f64 = 0.15;

impl CourseArguments {
    /// The row of this number, read or grown. Each random row has other plants. Fails if the file is wrong, or the
    /// numbers make no row.
    pub fn nth_row(&self, number: u64) -> Result<Row> {
        let seed = self.seed.wrapping_add(number);
        if let Some(path) = &self.row {
            return Ok(Row::parse_csv(path, bounded_file::bytes(path)?)?);
        }
        let gap_mm = self.spacing - self.canopy;
        ensure!(
            gap_mm > 0.0,
            "a spacing of {} mm leaves nothing between canopies of {} mm: --spacing has to exceed --canopy",
            self.spacing,
            self.canopy
        );
        let planting = Planting {
            plants: self.plants,
            spacing_mm: self.spacing,
            spacing_scatter_mm: (self.spacing * SPACING_SCATTER).min(gap_mm / 4.0),
            canopy_mm: self.canopy,
            canopy_scatter_mm: (self.canopy * CANOPY_SCATTER).min(gap_mm / 4.0),
            weeds: self.weeds.unwrap_or(WEEDS),
            ragged: self.ragged,
        };
        let row = match self.weeds {
            Some(_) => planting.grow(seed),
            None => planting.grow_with_room(seed),
        };
        Ok(row?)
    }

    /// The origin of the row: its seed, or its file.
    pub fn origin(&self) -> String {
        match &self.row {
            None => format!("seed {}", self.seed),
            Some(path) => format!("row of {}", in_a_line(&path.to_string_lossy())),
        }
    }

    /// The machine and what is around it, in this field. Fails if it is no field, or its machine has no room for the
    /// distance from beam to tool.
    pub fn conditions_of(&self, field: &str) -> Result<Conditions> {
        let Some(beam_to_tool_mm) = self.beam_to_tool else { return Ok(source::field(field)?) };
        let mut conditions = Conditions::load(field)?;
        let set = |conditions: &mut Conditions| conditions.set("machine.beam_to_tool_mm", beam_to_tool_mm.into());
        // Only the second beam can contradict the distance.
        if set(&mut conditions).is_err() {
            conditions.set("machine.second_beam_mm", 0.0)?;
            set(&mut conditions)?;
            writeln!(
                Messages,
                "Warning: with --beam-to-tool {beam_to_tool_mm}, the firmware cannot use this field's second beam. \
                 The simulated machine has one beam."
            );
        }
        source::warn(&conditions);
        Ok(conditions)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(Parser)]
    struct Program {
        #[command(flatten)]
        course: CourseArguments,
    }

    #[test]
    fn the_second_beam_stays_where_the_firmware_can_use_it() {
        // It stands 200 mm behind the first.
        for (beam_to_tool, second_beam_mm) in [("271", 0.0), ("272", 200.0), ("1000", 200.0), ("1001", 0.0)] {
            let course = Program::parse_from(["sim", "--beam-to-tool", beam_to_tool]).course;
            let conditions = course.conditions_of("walked").unwrap();
            assert_eq!(conditions.machine.second_beam_mm, second_beam_mm, "{beam_to_tool}");
            assert_eq!(conditions.machine.beam_to_tool_mm.to_string(), beam_to_tool);
        }
    }
}
