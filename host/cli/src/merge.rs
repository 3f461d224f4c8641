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
use std::io::{BufReader, Read};
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

pub fn run(arguments: &Arguments) -> Result<Finding> {
    let Arguments { parts, shown } = arguments;
    let parts = parts.iter().map(|path| open(path)).collect::<Result<Vec<_>>>()?;
    let (headers, rests): (Vec<(String, Header)>, Vec<Vec<u8>>) = parts.into_iter().unzip();
    shard::together(&headers, &part::program()?)?;
    let Header { command, settings, .. } = headers.first().context("no part is named")?.1.clone();
    let these = format!("these are parts of a {command}");
    ensure!(!shown.brief || command == trial::COMMAND, "{these}: --brief is for parts of a trial");
    ensure!(shown.result.is_none() || command == sweep::COMMAND, "{these}: --result is for parts of a sweep");
    match command.as_str() {
        trial::COMMAND => trial::merge(read(settings)?, outcomes(&headers, &rests)?, shown),
        sweep::COMMAND => sweep::merge(&read(settings)?, &outcomes(&headers, &rests)?, shown).map(|()| Finding::Good),
        soak::COMMAND => {
            ensure!(shown.out.is_none(), "{these}, which writes no file: leave --out away");
            soak::merge(&read(settings)?, outcomes(&headers, &rests)?, shown.json)
        }
        other => bail!("these are parts of `weeder {other}`, which this program does not know"),
    }
}

/// A part's name and header, and the rest of its file, which is read once because it may be a pipe.
fn open(path: &Path) -> Result<((String, Header), Vec<u8>)> {
    let name = path.display().to_string();
    let unread = || format!("{name} cannot be read");
    let mut file = BufReader::new(File::open(path).with_context(unread)?);
    let (header, mut rest) = (shard::read_header(&name, &mut file)?, Vec::new());
    file.read_to_end(&mut rest).with_context(unread)?;
    Ok(((name, header), rest))
}

/// All outcomes, in the order of an undivided study.
fn outcomes<T: DeserializeOwned>(headers: &[(String, Header)], rests: &[Vec<u8>]) -> Result<Vec<T>> {
    let parts = headers.iter().zip(rests);
    let read = parts.map(|((name, header), rest)| shard::read_outcomes(name, header, &mut &rest[..]));
    Ok(shard::outcomes(read.collect::<Result<_>>()?))
}

fn read<T: DeserializeOwned>(settings: Value) -> Result<T> {
    serde_json::from_value(settings).context("this program did not write the parts' settings: compute them again")
}
