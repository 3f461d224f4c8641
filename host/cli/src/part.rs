//! `--shard`: writes a part of a study to a file, for `weeder merge`.
//!
//! A part names the program that computed it: the version, and a checksum of the program's file. The version alone is
//! not enough, because an unreleased build has the version of the last release.

use crate::destination::{FileName, OutFile, Replace};
use crate::output::{say, tell};
use anyhow::{Context, Result};
use experiments::shard::{self, Header, Numbered, Program, Shard};
use serde::Serialize;
use std::env;
use std::fs;
use std::path::Path;
use std::time::Instant;

/// A part, and a file that was writable when it was checked.
pub struct Part<'a> {
    shard: Shard,
    out: OutFile<'a>,
    program: Program,
    began: Instant,
}

impl<'a> Part<'a> {
    /// A shard's.
    ///
    /// # Errors
    /// If the file could not be written, or this program cannot be read.
    pub fn new(shard: Shard, out: &'a FileName, replace: Replace) -> Result<Self> {
        Ok(Self { shard, out: out.check(replace)?, program: program()?, began: Instant::now() })
    }

    /// Which one it is.
    pub fn shard(&self) -> Shard {
        self.shard
    }

    /// Writes it whole, once all is computed, and says so.
    ///
    /// # Errors
    /// If the file cannot be written.
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
        self.out.write(|to| shard::write(&header, outcomes, to))?;
        say!("Written: part {} of the {command}, {count} of {all}, to {}", self.shard, self.out.path().display())?;
        tell!("Pace: {:.1} s", self.began.elapsed().as_secs_f64());
        Ok(())
    }
}

/// This program.
///
/// # Errors
/// If its file cannot be read.
pub fn program() -> Result<Program> {
    let file = env::current_exe().context("the running program cannot be found")?;
    Ok(Program { version: env!("WEEDER_VERSION").to_owned(), build: check_sum(&file)? })
}

/// A file's check sum, CRC-32 as of zip: it tells builds apart that differ by accident.
///
/// # Errors
/// If it cannot be read.
pub fn check_sum(file: &Path) -> Result<String> {
    let bytes = fs::read(file).with_context(|| format!("{} cannot be read", file.display()))?;
    Ok(format!("{:08x}", crc32fast::hash(&bytes)))
}
