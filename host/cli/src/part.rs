//! A study's result: how `weeder merge` and the study's own command show it, and the part of it that `--shard` writes.
//!
//! A part names the program that computed it: the version, and a checksum of the program's file. The version alone is
//! not enough, because an unreleased build has the version of the last release.

use anyhow::{Context, Result};
use clap::{Args, builder::PossibleValuesParser};
use frame::{Messages, OutFile, OutFolder, OutName, Replace, Results};
use serde::Serialize;
use std::env;
use std::fs;
use std::path::Path;
use std::time::Instant;
use study::shard::{self, Header, Numbered, Program, Shard};
use study::sweep::RESULTS;

/// How to show a study's result.
#[derive(Args)]
pub struct Shown {
    /// The folder for a trial's report, or the file for a sweep, as --out of that command.
    #[arg(long, value_name = "FOLDER|FILE.csv")]
    pub out: Option<OutName>,
    #[command(flatten)]
    pub replace: Replace,
    /// Print JSON instead of tables or words.
    #[arg(long)]
    pub json: bool,
    /// Print only the most important columns of a trial.
    #[arg(long, conflicts_with = "json")]
    pub brief: bool,
    /// The result to show for a sweep with two axes. Default: plant_damage.
    #[arg(long, value_parser = PossibleValuesParser::new(RESULTS))]
    pub result: Option<String>,
}

impl Shown {
    /// The checked file for the result, if the user asks for one.
    pub fn file(&self) -> Result<Option<OutFile>> {
        self.out.as_ref().map(|out| out.file(self.replace)).transpose()
    }

    /// The checked folder for files of these names, if the user asks for one.
    pub fn folder<const COUNT: usize>(&self, names: [&str; COUNT]) -> Result<Option<OutFolder>> {
        self.out.as_ref().map(|out| out.folder(names, self.replace)).transpose()
    }
}

/// A part, and a file that was writable when it was checked.
pub struct Part {
    pub shard: Shard,
    out: OutFile,
    program: Program,
    began: Instant,
}

impl Part {
    /// The part of a shard, if the user asks for one. Fails if its file or this program cannot be used.
    pub fn asked(shard: Option<Shard>, out: Option<&OutName>, replace: Replace) -> Result<Option<Self>> {
        let Some((shard, out)) = shard.zip(out) else { return Ok(None) };
        Ok(Some(Self { shard, out: out.file(replace)?, program: program()?, began: Instant::now() }))
    }

    /// Writes it whole, once all is computed, and says so.
    pub fn write<T: Serialize>(
        self,
        command: &str,
        all: u64,
        settings: &impl Serialize,
        outcomes: Vec<Numbered<T>>,
    ) -> Result<()> {
        let settings = serde_json::to_value(settings)?;
        let header = Header::new(self.program, command, self.shard, all, settings);
        let count = outcomes.len();
        self.out.write(|to| Ok(shard::write(&header, outcomes, to)?))?;
        writeln!(
            Results,
            "Written: part {} of the {command}, {count} of {all}, to {}",
            self.shard,
            self.out.path().display()
        )?;
        writeln!(Messages, "Pace: {:.1} s", self.began.elapsed().as_secs_f64());
        Ok(())
    }
}

pub fn program() -> Result<Program> {
    let file = env::current_exe().context("the running program cannot be found")?;
    Ok(Program { version: env!("WEEDER_VERSION").to_owned(), build: check_sum(&file)? })
}

/// A file's check sum, CRC-32 as of zip: it tells builds apart that differ by accident.
pub fn check_sum(file: &Path) -> Result<String> {
    let bytes = fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    Ok(format!("{:08x}", crc32fast::hash(&bytes)))
}
