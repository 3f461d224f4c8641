//! Arguments that several commands share: the row, and the machine that rolls along it.

use anyhow::{Result, ensure};
use clap::{Args, builder::RangedU64ValueParser};
use field::machine::Machine;
use field::planting::Planting;
use field::row::Row;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// What the user asks of row and machine.
#[derive(Args)]
pub struct CourseArguments {
    /// Speed in km/h.
    #[arg(long, default_value = "2.5", value_parser = number_within(0.1..=10.0))]
    pub speed: f64,
    /// Mean distance from plant to plant in mm.
    #[arg(long, default_value = "500", value_parser = number_within(50.0..=5000.0))]
    spacing: f64,
    /// Mean width of a canopy in mm.
    #[arg(long, default_value = "150", value_parser = number_within(10.0..=340.0))]
    canopy: f64,
    /// Number of crop plants.
    #[arg(long, default_value = "20", value_parser = RangedU64ValueParser::<usize>::new().range(1..=1000))]
    plants: usize,
    /// Number of tall weeds between them.
    #[arg(long, default_value = "5", value_parser = RangedU64ValueParser::<usize>::new().range(0..=1000))]
    weeds: usize,
    /// Which of all the possible rows: the same seed gives the same row.
    #[arg(long, default_value = "1")]
    seed: u64,
    /// Distance from the beam back to the tool in mm.
    #[arg(long, default_value = "400", value_parser = RangedU64ValueParser::<u32>::new().range(100..=2000))]
    beam_to_tool: u32,
    /// Grow canopies with gaps through which the beam passes.
    #[arg(long)]
    ragged: bool,
    /// Take the row from a CSV file with the columns position_mm,width_mm,kind instead of growing one.
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["spacing", "canopy", "plants", "weeds", "seed", "ragged"])]
    row: Option<PathBuf>,
}

/// Scatter of a grown row, as shares of the mean spacing and the mean canopy; never more than a quarter of the gap
/// between two mean canopies each, so that the plants stay apart.
const SPACING_SCATTER: f64 = 0.08;
const CANOPY_SCATTER: f64 = 0.15;

/// A number in a range, for the command line.
pub fn number_within(range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let (least, greatest) = (range.start(), range.end());
        text.parse()
            .ok()
            .filter(|value| range.contains(value))
            .ok_or_else(|| format!("it has to be a number from {least} to {greatest}"))
    }
}

impl CourseArguments {
    /// The row, read or grown.
    ///
    /// # Errors
    /// Where the file is wrong, or the numbers make no row.
    pub fn row(&self) -> Result<Row> {
        if let Some(path) = &self.row {
            return Ok(Row::read_csv(path)?);
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
            weeds: self.weeds,
            ragged: self.ragged,
        };
        Ok(planting.grow(self.seed)?)
    }

    /// The machine.
    pub fn machine(&self) -> Machine {
        Machine { beam_to_tool_mm: f64::from(self.beam_to_tool), ..Machine::default() }
    }
}
