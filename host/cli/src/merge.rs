//! `weeder merge`: joins the parts of a study into the result of an undivided study.
//!
//! It simulates nothing. The parts hold all outcomes, and the code of an undivided study shows them.

use crate::{part, part::Shown, soak, sweep, trial};
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use frame::Finding;
use serde::de::DeserializeOwned;
use serde_json::Value;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use study::shard::{self, Header};

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
    #[command(flatten)]
    shown: Shown,
}

/// Puts them together and prints the result.
pub fn run(arguments: &Arguments) -> Result<Finding> {
    let headers = arguments.parts.iter().map(|path| Ok((name(path), open(path)?.0)));
    let headers: Vec<(String, Header)> = headers.collect::<Result<_>>()?;
    shard::together(&headers, &part::program()?)?;
    let (_, header) = headers.into_iter().next().context("no part is named")?;
    let Arguments { parts, shown } = arguments;
    let Header { command, settings, .. } = header;
    let these = format!("these are parts of a {command}");
    ensure!(!shown.brief || command == trial::COMMAND, "{these}: --brief is for parts of a trial");
    ensure!(shown.result.is_none() || command == sweep::COMMAND, "{these}: --result is for parts of a sweep");
    match command.as_str() {
        trial::COMMAND => trial::merge(read(settings)?, outcomes(parts)?, shown),
        sweep::COMMAND => sweep::merge(&read(settings)?, &outcomes(parts)?, shown).map(|()| Finding::Good),
        soak::COMMAND => {
            ensure!(shown.out.is_none(), "{these}, which writes no file: leave --out away");
            soak::merge(&read(settings)?, outcomes(parts)?, shown.json)
        }
        other => bail!("these are parts of `weeder {other}`, which this program does not know"),
    }
}

fn name(path: &Path) -> String {
    path.display().to_string()
}

/// A part's header, and the rest of its file.
fn open(path: &Path) -> Result<(Header, BufReader<File>)> {
    let mut file = BufReader::new(File::open(path).with_context(|| format!("{} cannot be read", name(path)))?);
    Ok((shard::read_header(&name(path), &mut file)?, file))
}

/// All outcomes, in the order of an undivided study.
fn outcomes<T: DeserializeOwned>(parts: &[PathBuf]) -> Result<Vec<T>> {
    let read = |path: &PathBuf| {
        let (header, mut file) = open(path)?;
        shard::read_outcomes(&name(path), &header, &mut file)
    };
    Ok(shard::outcomes(parts.iter().map(read).collect::<Result<_>>()?))
}

fn read<T: DeserializeOwned>(settings: Value) -> Result<T> {
    serde_json::from_value(settings).context("this program did not write the parts' settings: compute them again")
}
