//! `weeder sim`: the real firmware on a virtual Uno, on a simulated row or on a recording of a real encoder.

use crate::{
    CourseArguments, Finding, Messages, OutFile, OutFolder, OutName, Replace, Results, source, with_bar, write_if_asked,
};
use anyhow::Result;
use clap::Args;
use field::conditions::Conditions;
use field::motion::mm_s;
use field::pass::Pass;
use field::row::Row;
use field::verdict::Verdict;
use field::wiring;
use files::in_a_line;
use serde_json::{Value, json};
use std::path::PathBuf;
use uno::elf::Size;
use uno::{PinChange, recording};
use uno_run::Outcome;
use uno_run::replay::{Counted, Replay, replay};
use uno_run::{animation, firmware, picture, report};

/// The arguments.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder sim --speed 1 --spacing 600 --plants 30 --weeds 8    another row, at another speed
  weeder sim --field from-the-box                             the machine straight from the box
  weeder sim --row field.csv --out report                     your own plants, with tables and pictures
  weeder sim --json | jq .in_row_weeded_percent               for a script
  weeder sim --capture logic.vcd --channel-a D2 --channel-b D3    a logic analyser's recording
The status is 1 if a plant was damaged.")]
pub struct Arguments {
    #[command(flatten)]
    course: CourseArguments,
    /// Command each swing without leads for the servo's time, as the paper does: `--field paper`.
    #[arg(long, conflicts_with = "field")]
    paper: bool,
    /// Write tables (CSV), a picture and an animation of the row into this folder, and create it if needed.
    #[arg(long, value_name = "FOLDER")]
    out: Option<OutName>,
    /// Write the levels on the virtual Uno's pins, for GTKWave, or for PulseView with downsampling factor 625.
    #[arg(long, value_name = "FILE.vcd")]
    vcd: Option<OutName>,
    #[command(flatten)]
    replace: Replace,
    /// Run this ELF instead of this weeder's own firmware.
    #[arg(long, value_name = "FILE.elf")]
    elf: Option<PathBuf>,
    /// Play a logic analyser's recording to the encoder's pins, and print what the firmware counts; - for standard
    /// input.
    #[arg(long, value_name = "FILE.vcd", value_parser = source::file(), requires_all = ["channel_a", "channel_b"], conflicts_with_all = ["CourseArguments", "out", "paper"])]
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
    /// Print only the totals.
    #[arg(long, conflicts_with_all = ["json", "capture"])]
    totals: bool,
    /// Print JSON instead of tables.
    #[arg(long)]
    json: bool,
}

const REPORT: [&str; 5] = ["row.svg", "weeding.svg", "row.csv", "plants.csv", "weeds.csv"];

/// Runs it and prints the result. Fails if an argument or a file is wrong, or the firmware cannot be run.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let replace = arguments.replace;
    let folder = arguments.out.as_ref().map(|out| out.folder(REPORT, replace)).transpose()?;
    let vcd = arguments.vcd.as_ref().map(|vcd| vcd.file(replace)).transpose()?;
    match (&arguments.capture, &arguments.channel_a, &arguments.channel_b) {
        (Some(path), Some(a), Some(b)) => {
            let mut channels = vec![(wiring::ENCODER_A, a.as_str()), (wiring::ENCODER_B, b.as_str())];
            channels.extend(arguments.channel_beam.iter().map(|beam| (wiring::BEAM, beam.as_str())));
            let capture = recording::read(path, &channels)?;
            play(arguments, &capture, vcd.as_ref())
        }
        _ => weed(arguments, arguments.course.nth_row(0)?, folder.as_ref(), vcd.as_ref()),
    }
}

impl Arguments {
    fn field(&self) -> &str {
        if self.paper { "paper" } else { &self.course.field }
    }
}

fn weed(arguments: &Arguments, row: Row, folder: Option<&OutFolder>, vcd: Option<&OutFile>) -> Result<Finding> {
    let course = &arguments.course;
    let conditions = course.conditions_of(arguments.field())?;
    let unused = conditions.unused_by_a_row();
    // Of a preset, the help says what counts.
    if Conditions::preset(arguments.field()).is_none() && !unused.is_empty() {
        writeln!(
            Messages,
            "Warning: one row, driven evenly and seen without faults, does not use {} of {}: `weeder trial --field` does",
            unused.join(", "),
            in_a_line(arguments.field())
        );
    }
    let mut pass = conditions.pass_at_speed(row, mm_s(course.speed), course.seed);
    pass.motion = pass.motion.with_slip(|| conditions.ground.slip_percent / 100.0);
    let elf = arguments.elf.clone().map_or_else(firmware::build, Ok)?;
    // The memory is printed, and a HEX file does not tell it.
    Size::read(&elf)?;
    if !arguments.json {
        let manner = if arguments.paper { ", swings as in the paper" } else { "" };
        let introduction = report::introduction(&pass);
        writeln!(Results, "{introduction} at {} km/h{manner}", course.speed)?;
        writeln!(Results, "Field {}, {}", in_a_line(arguments.field()), course.origin())?;
    }
    let outcome = with_bar("weeding", |show| uno_run::run(&pass, &elf, show))?;

    let totals = report::totals(&pass, &conditions, &outcome);
    let printed = if arguments.json {
        writeln!(Results, "{:#}", in_json(arguments, &pass, &outcome))
    } else if arguments.totals {
        write!(Results, "{totals}")
    } else {
        write!(Results, "{}\n\n{totals}", report::table(&outcome))
    };
    if let Some(folder) = folder {
        write_folder(folder, &pass, &outcome, mm_s(arguments.course.speed))?;
        if !arguments.json {
            let [files @ .., last] = REPORT;
            writeln!(Results, "Written     {} and {last} in {}", files.join(", "), folder.path().display())?;
        }
    }
    write_waveform(arguments, vcd, &outcome.changes)?;
    printed?;
    Ok(Finding::of(outcome.judgement.count(Verdict::Damaged) == 0))
}

fn write_folder(folder: &OutFolder, pass: &Pass, outcome: &Outcome, speed_mm_s: f64) -> Result<()> {
    let [drawing, moving, row, plants, weeds] = REPORT;
    folder.write(row, |to| Ok(pass.row.write_csv(to)?))?;
    folder.write(plants, |to| Ok(report::write_csv(&report::plants(outcome), to)?))?;
    folder.write(weeds, |to| Ok(report::write_csv(&report::weeds(outcome), to)?))?;
    folder.write(drawing, |to| Ok(svg::write(to, &picture::draw(&pass.row, &outcome.judgement))?))?;
    let animation = animation::draw(&pass.row, &pass.machine, &outcome.judgement, speed_mm_s);
    folder.write(moving, |to| Ok(svg::write(to, &animation)?))
}

fn write_waveform(arguments: &Arguments, vcd: Option<&OutFile>, changes: &[PinChange]) -> Result<()> {
    let changes = changes.iter().copied();
    write_if_asked(vcd, "Waveform", arguments.json, |to| Ok(recording::write(to, &wiring::WIRES, changes)?))
}

/// The result for the row, with the names of the CSV tables.
fn in_json(arguments: &Arguments, pass: &Pass, outcome: &Outcome) -> Value {
    let judgement = &outcome.judgement;
    json!({
        "speed_km_h": arguments.course.speed,
        "as_in_the_paper": arguments.paper,
        "field": arguments.field(),
        "seed": arguments.course.row.is_none().then_some(arguments.course.seed),
        "damaged": judgement.count(Verdict::Damaged),
        "zones_reached": judgement.count(Verdict::Reached),
        "margin_cut": judgement.count(Verdict::MarginCut),
        "kept": judgement.count(Verdict::Kept),
        "idle_swings": judgement.idle_swings,
        "in_row_weeded_percent": 100.0 * judgement.weeded_share,
        "in_row_bound_with_margins_percent": 100.0 * judgement.weedable_share,
        "position_ticks": outcome.status.position_ticks,
        "true_position_ticks": outcome.true_ticks,
        "lost_ticks": outcome.status.lost_ticks,
        "state": outcome.status.state,
        "alarm": outcome.status.alarm,
        "row_mm": [pass.row.span_mm().start, pass.row.span_mm().end],
        "plants": report::plants(outcome),
        "weeds": report::weeds(outcome),
    })
}

fn play(arguments: &Arguments, capture: &[PinChange], vcd: Option<&OutFile>) -> Result<Finding> {
    let elf = arguments.elf.clone().map_or_else(firmware::build, Ok)?;
    let Replay { counted, edges, changes } = with_bar("playing", |show| replay(capture, &elf, show))?;
    let Counted { net_ticks, lowest_ticks, highest_ticks, lost_ticks } = counted;
    let printed = if arguments.json {
        let mut json = json!(counted);
        json["edges"] = edges.into();
        writeln!(Results, "{json:#}")
    } else {
        writeln!(Results, "Edges       {edges} in the recording")?;
        writeln!(
            Results,
            "Counted     net {net_ticks}, lowest {lowest_ticks}, highest {highest_ticks}; {lost_ticks} lost"
        )
    };
    write_waveform(arguments, vcd, &changes)?;
    printed?;
    Ok(Finding::Good)
}
