//! `weeder sim`: the real firmware on a virtual Uno, on a simulated row or on a recording of a real encoder.

use crate::Finding;
use crate::course::CourseArguments;
use crate::progress::Progress;
use anyhow::{Context, Result};
use clap::Args;
use field::capture::{Capture, Channels};
use field::motion::mm_s;
use field::replay::replay;
use field::row::Row;
use field::trial::{Outcome, Trial};
use field::verdict::{Timing, Verdict};
use field::{firmware, picture, report, waveform};
use std::fs::{self, File};
use std::path::{Path, PathBuf};

/// What the user asks of a simulation.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder sim --speed 1 --spacing 600 --plants 30 --weeds 8    another row, at another speed
  weeder sim --row field.csv --out report                     your own plants, with tables and a picture
  weeder sim --capture logic.vcd --channel-a D2 --channel-b D3    a logic analyser's recording
The status is 1 where a plant was damaged.")]
pub struct Arguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Command the swings where they should be done, as the paper does: without leads for the servo's time.
    #[arg(long)]
    paper: bool,
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

/// Runs it and prints the result.
///
/// # Errors
/// Where an argument or a file is wrong, or the firmware cannot be run.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    match (&arguments.capture, &arguments.channel_a, &arguments.channel_b) {
        (Some(path), Some(a), Some(b)) => {
            let beam = arguments.channel_beam.as_deref();
            let capture = Capture::read(path, &Channels { a, b, beam })?;
            play(arguments, &capture)
        }
        _ => weed(arguments, arguments.course.row()?),
    }
}

impl Arguments {
    fn firmware(&self) -> Result<PathBuf> {
        match &self.elf {
            Some(path) => Ok(path.clone()),
            None => Ok(firmware::build()?),
        }
    }
}

fn weed(arguments: &Arguments, row: Row) -> Result<Finding> {
    let timing = if arguments.paper { Timing::as_in_the_paper() } else { Timing::default() };
    let trial = Trial::at_speed(row, arguments.course.machine(), timing, mm_s(arguments.course.speed));
    let elf = arguments.firmware()?;
    let manner = if arguments.paper { ", swings as in the paper" } else { "" };
    println!(
        "{} at {} km/h{manner}",
        report::introduction(&trial.row, &trial.machine, &trial.motion),
        arguments.course.speed
    );
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
    if outcome.judgement.count(Verdict::Damaged) == 0 { Ok(Finding::Good) } else { Ok(Finding::Bad) }
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
    svg::write(create("row.svg")?, &picture::draw(&trial.row, &outcome.judgement))?;
    println!("Written     row.svg, row.csv, plants.csv and weeds.csv in {}", folder.display());
    Ok(())
}

fn play(arguments: &Arguments, capture: &Capture) -> Result<Finding> {
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
    Ok(Finding::Good)
}
