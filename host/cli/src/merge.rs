//! `weeder merge`: joins the parts of a study into the result of an undivided study.
//!
//! It simulates nothing. The parts hold all outcomes, and the code of an undivided study shows them.

use crate::destination::Replace;
use crate::finding::Finding;
use crate::{part, soak, sweep, trial};
use anyhow::{Context, Result, bail, ensure};
use clap::{Args, builder::PossibleValuesParser};
use experiments::shard::{self, Header};
use experiments::sweep::RESULTS;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::ffi::OsString;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// The arguments.
#[derive(Args)]
#[command(after_help = "\
Examples:
  weeder trial --shard 1/2 --out 1.part
  weeder trial --shard 2/2 --out 2.part
  weeder merge 1.part 2.part --out report
  weeder merge parts/*.part --json
Output and status are those of the undivided command. Parts come from `weeder trial`, `weeder sweep`
or `weeder soak` with --shard. Compute them anywhere, in any order, with the same program.
docs/studies.md has a script for Slurm.")]
pub struct Arguments {
    /// The parts of one study, in any order.
    #[arg(required = true, value_name = "PART")]
    parts: Vec<PathBuf>,
    /// The folder for a trial's report, or the file for a sweep, as --out of that command.
    #[arg(long, value_name = "FOLDER|FILE.csv")]
    out: Option<OsString>,
    #[command(flatten)]
    replace: Replace,
    /// Print JSON instead of tables or words.
    #[arg(long)]
    json: bool,
    /// Print only the most important columns of a trial.
    #[arg(long, conflicts_with = "json")]
    brief: bool,
    /// The result to show for a sweep with two axes. Default: plant_damage.
    #[arg(long, value_parser = PossibleValuesParser::new(RESULTS))]
    result: Option<String>,
}

/// Puts them together and prints the result.
///
/// # Errors
/// If the parts are not all of one study, or the result cannot be written.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let headers = arguments.parts.iter().map(|path| Ok((name(path), header(path)?)));
    let headers: Vec<(String, Header)> = headers.collect::<Result<_>>()?;
    shard::together(&headers, &part::program()?)?;
    let (_, header) = headers.into_iter().next().context("no part is named")?;
    let Arguments { parts, out, replace, json, brief, result } = arguments;
    let (replace, json, brief, settings) = (*replace, *json, *brief, header.settings);
    let of = |what: &str| format!("these are parts of a {what}");
    ensure!(!brief || header.command == trial::COMMAND, "{}: --brief is for parts of a trial", of(&header.command));
    ensure!(
        result.is_none() || header.command == sweep::COMMAND,
        "{}: --result is for parts of a sweep",
        of(&header.command)
    );
    match header.command.as_str() {
        trial::COMMAND => {
            let shown = trial::Shown { out: out.clone().map(Into::into), replace, json, brief };
            trial::merge(read(settings)?, outcomes(parts)?, &shown)
        }
        sweep::COMMAND => {
            let result = result.clone().unwrap_or_else(|| sweep::RESULT.to_owned());
            let shown = sweep::Shown { out: out.clone().map(Into::into), replace, json, result };
            sweep::merge(&read(settings)?, &outcomes(parts)?, &shown).map(|()| Finding::Good)
        }
        soak::COMMAND => {
            ensure!(out.is_none(), "{}, which writes no file: leave --out away", of(&header.command));
            soak::merge(&read(settings)?, outcomes(parts)?, json)
        }
        other => bail!("these are parts of `weeder {other}`, which this program does not know"),
    }
}

fn name(path: &Path) -> String {
    path.display().to_string()
}

fn open(path: &Path) -> Result<BufReader<File>> {
    Ok(BufReader::new(File::open(path).with_context(|| format!("{} cannot be read", name(path)))?))
}

fn header(path: &Path) -> Result<Header> {
    shard::read_header(&name(path), &mut open(path)?)
}

/// All outcomes, in the order of an undivided study.
fn outcomes<T: DeserializeOwned>(parts: &[PathBuf]) -> Result<Vec<T>> {
    let read = |path: &PathBuf| {
        let mut file = open(path)?;
        let header = shard::read_header(&name(path), &mut file)?;
        shard::read_outcomes(&name(path), &header, &mut file)
    };
    Ok(shard::outcomes(parts.iter().map(read).collect::<Result<_>>()?))
}

fn read<T: DeserializeOwned>(settings: Value) -> Result<T> {
    serde_json::from_value(settings).context("this program did not write the parts' settings: compute them again")
}
