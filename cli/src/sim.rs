//! `weeder sim`: the real firmware on a virtual Uno, on a simulated row or on a recording of a real encoder.

use crate::Harm;
use crate::progress::Progress;
use anyhow::{Context, Result, ensure};
use clap::{Args, builder::RangedU64ValueParser};
use field::capture::{Capture, Channels};
use field::machine::Machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::replay::replay;
use field::row::Row;
use field::trial::{Outcome, Trial};
use field::verdict::{Timing, Verdict};
use field::{firmware, picture, report, waveform};
use std::fs::{self, File};
use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

/// What the user asks of a simulation.
#[derive(Args)]
pub struct Arguments {
    /// Speed in km/h.
    #[arg(long, default_value = "2.5", value_parser = number_within(0.1..=10.0))]
    speed: f64,
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
    /// Command the swings where they should be done, as the paper does: without leads for the servo's time.
    #[arg(long)]
    paper: bool,
    /// Grow canopies with gaps through which the beam passes.
    #[arg(long)]
    ragged: bool,
    /// Take the row from a CSV file with the columns position_mm,width_mm,kind instead of growing one.
    #[arg(long, value_name = "FILE.csv", conflicts_with_all = ["spacing", "canopy", "plants", "weeds", "seed", "ragged"])]
    row: Option<PathBuf>,
    /// Write the tables as CSV and a picture of the row into this folder.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Write the levels on the virtual Uno's pins, for PulseView or GTKWave.
    #[arg(long, value_name = "FILE.vcd")]
    vcd: Option<PathBuf>,
    /// Run this firmware instead of building the one in this repository.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Play a logic analyser's recording to the encoder's pins instead of a row, and say what the firmware counts.
    #[arg(long, value_name = "FILE.vcd", requires_all = ["channel_a", "channel_b"], conflicts_with_all = ["row", "out", "paper"])]
    capture: Option<PathBuf>,
    /// The recording's channel for encoder A.
    #[arg(long, value_name = "NAME", requires = "capture")]
    channel_a: Option<String>,
    /// The recording's channel for encoder B.
    #[arg(long, value_name = "NAME", requires = "capture")]
    channel_b: Option<String>,
    /// The recording's channel for the beam, low = broken.
    #[arg(long, value_name = "NAME", requires = "capture")]
    channel_beam: Option<String>,
}

/// Scatter of a grown row, as shares of the mean spacing and the mean canopy; never more than a quarter of the gap
/// between two mean canopies each, so that the plants stay apart.
const SPACING_SCATTER: f64 = 0.08;
const CANOPY_SCATTER: f64 = 0.15;

/// A number in a range, for the command line.
fn number_within(range: RangeInclusive<f64>) -> impl Fn(&str) -> Result<f64, String> + Clone {
    move |text| {
        let (least, greatest) = (range.start(), range.end());
        text.parse()
            .ok()
            .filter(|value| range.contains(value))
            .ok_or_else(|| format!("it has to be a number from {least} to {greatest}"))
    }
}

/// Runs it and prints the result.
///
/// # Errors
/// Where an argument or a file is wrong, or the firmware cannot be run.
pub fn run(arguments: &Arguments) -> Result<Harm> {
    match (&arguments.capture, &arguments.channel_a, &arguments.channel_b) {
        (Some(path), Some(a), Some(b)) => {
            let beam = arguments.channel_beam.as_deref();
            let capture = Capture::read(path, &Channels { a, b, beam })?;
            play(arguments, &capture)
        }
        _ => weed(arguments, arguments.row()?),
    }
}

impl Arguments {
    fn row(&self) -> Result<Row> {
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

    fn firmware(&self) -> Result<PathBuf> {
        match &self.elf {
            Some(path) => Ok(path.clone()),
            None => Ok(firmware::build()?),
        }
    }
}

fn weed(arguments: &Arguments, row: Row) -> Result<Harm> {
    let machine = Machine { beam_to_tool_mm: f64::from(arguments.beam_to_tool), ..Machine::default() };
    let timing = if arguments.paper { Timing::as_in_the_paper() } else { Timing::default() };
    let trial = Trial::at_speed(row, machine, timing, mm_s(arguments.speed));
    let elf = arguments.firmware()?;
    let manner = if arguments.paper { ", swings as in the paper" } else { "" };
    println!("{} at {} km/h{manner}", report::introduction(&trial.row, &trial.machine, &trial.motion), arguments.speed);
    let bar = Progress::new("weeding");
    let outcome = trial.run(&elf, |share| bar.show(share))?;
    bar.finish();

    println!("{}\n", report::table(&outcome));
    print!("{}", report::totals(&trial, &outcome));
    if let Some(folder) = &arguments.out {
        write_folder(folder, &trial, &outcome)?;
    }
    if let Some(path) = &arguments.vcd {
        waveform::write(path, outcome.changes.iter().copied())?;
        println!("Waveform    {}", path.display());
    }
    if outcome.judgement.count(Verdict::Damaged) == 0 { Ok(Harm::None) } else { Ok(Harm::Done) }
}

fn write_folder(folder: &Path, trial: &Trial, outcome: &Outcome) -> Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("the folder {} cannot be made", folder.display()))?;
    let create = |name: &str| {
        let path = folder.join(name);
        File::create(&path).with_context(|| format!("{} cannot be written", path.display()))
    };
    trial.row.write_csv(create("row.csv")?)?;
    report::write_plants_csv(outcome, create("plants.csv")?)?;
    report::write_weeds_csv(outcome, create("weeds.csv")?)?;
    svg::write(create("row.svg")?, &picture::draw(trial, outcome))?;
    println!("Written     row.svg, row.csv, plants.csv and weeds.csv in {}", folder.display());
    Ok(())
}

fn play(arguments: &Arguments, capture: &Capture) -> Result<Harm> {
    let elf = arguments.firmware()?;
    let bar = Progress::new("playing");
    let played = replay(capture, &elf, |share| bar.show(share))?;
    bar.finish();
    let counted = played.counted;
    println!("Edges       {} in the recording", played.edges);
    println!(
        "Counted     net {}, lowest {}, highest {}; {} lost",
        counted.net_ticks, counted.lowest_ticks, counted.highest_ticks, counted.lost_ticks
    );
    if let Some(path) = &arguments.vcd {
        waveform::write(path, played.changes.iter().copied())?;
        println!("Waveform    {}", path.display());
    }
    Ok(Harm::None)
}
