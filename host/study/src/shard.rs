//! A study on several machines: which plots, points or runs each machine computes, and how their parts are joined.
//!
//! A study numbers its outcomes from 0. Each has its own random numbers, from the seed and its number. Shard I of N has
//! every Nth outcome, from the Ith on, so that quick and slow ones are distributed evenly. A part is lines of JSON: a
//! [`Header`] with everything that decides the study's result, then each outcome with its number. Numbers are written
//! so that exactly the same bits are read. [`together`] compares the parts, and [`outcomes`] sorts them. From there on
//! the result does not depend on the machines.
//!
//! This module computes nothing, opens no files and starts no programs: the user's scheduler runs the shards.

use anyhow::{Context, Error, Result, anyhow, bail, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::fmt;
use std::io::{self, BufRead, Write};
use std::str::FromStr;

/// The format version of a part. A change of the format increments it.
const FORM: u32 = 1;

/// Most shards of a study.
pub const MOST_SHARDS: u64 = 100_000;

/// The most missing parts that an error lists by number.
const MOST_NAMED: usize = 8;

/// A share of a study's plots, points or runs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Shard {
    /// Which one, from 1.
    number: u64,
    /// The number of shards.
    of: u64,
}

impl Shard {
    /// All of a study.
    pub const WHOLE: Self = Self { number: 1, of: 1 };

    /// The numbers of its plots, points or runs, ascending from 0.
    pub fn numbers(self, all: u64) -> impl Iterator<Item = u64> {
        (self.number - 1..all).step_by(self.of as usize)
    }

    fn check(self) -> Result<Self> {
        ensure!(
            (1..=self.of).contains(&self.number) && self.of <= MOST_SHARDS,
            "it has to be I/N, such as 2/4 for the second of four, with I from 1 to N and N at most {MOST_SHARDS}"
        );
        Ok(self)
    }
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let whole = |text: &str| text.trim().parse::<u64>().ok();
        let numbers = text.split_once('/').and_then(|(number, of)| Some((whole(number)?, whole(of)?)));
        let (number, of) = numbers.unwrap_or_default();
        Self { number, of }.check()
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// The program that computes. Equal programs give equal outcomes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Program {
    /// Its version.
    pub version: String,
    /// Distinguishes its builds, such as a checksum.
    pub build: String,
}

/// The first line of a part.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// The format version: [`FORM`].
    weeder_part: u32,
    /// The program that computed it.
    pub program: Program,
    /// The command, such as `trial`.
    pub command: String,
    /// The part's shard.
    pub shard: Shard,
    /// How many plots, points or runs the whole study has.
    pub all: u64,
    /// All other inputs of the study's result.
    pub settings: Value,
}

/// An outcome, and the number of the plot, point or run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Numbered<T> {
    /// Which one, from 0.
    pub number: u64,
    /// The result.
    pub outcome: T,
}

impl fmt::Display for Program {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (build {})", self.version, self.build)
    }
}

impl Header {
    /// The header of a shard of a study with `all` plots, points or runs.
    pub fn new(program: Program, command: &str, shard: Shard, all: u64, settings: Value) -> Self {
        Self { weeder_part: FORM, program, command: command.to_owned(), shard, all, settings }
    }
}

/// Writes a part, line by line: the header, and the outcomes in their order.
///
/// # Errors
/// The errors of the writer.
pub fn write<T: Serialize>(
    header: &Header,
    outcomes: impl IntoIterator<Item = Numbered<T>>,
    to: &mut dyn Write,
) -> io::Result<()> {
    serde_json::to_writer(&mut *to, header)?;
    writeln!(to)?;
    for outcome in outcomes {
        serde_json::to_writer(&mut *to, &outcome)?;
        writeln!(to)?;
    }
    Ok(())
}

/// Reads the first line of a part, called `name`.
///
/// # Errors
/// If it cannot be read, or is no part.
pub fn read_header(name: &str, from: &mut dyn BufRead) -> Result<Header> {
    let no_part = |problem: String| {
        anyhow!("{name} is no part of a study, as `weeder trial --shard 1/4 --out {name}` would write it: {problem}")
    };
    let mut line = Vec::new();
    let read = io::Read::take(from, MOST_HEADER).read_until(b'\n', &mut line);
    read.with_context(|| format!("{name} cannot be read"))?;
    if line.is_empty() {
        return Err(no_part("it is empty".to_owned()));
    }
    // The parser's position would not help a user who named the wrong file.
    let value: Value = serde_json::from_slice(&line)
        .map_err(|_| no_part("line 1 is not the head of a part, or was cut".to_owned()))?;
    match value.get("weeder_part").and_then(Value::as_u64) {
        Some(form) if form == u64::from(FORM) => {}
        Some(form) => return Err(no_part(format!("it has form {form}, and this program knows form {FORM}"))),
        None => return Err(no_part("line 1 has no `weeder_part`".to_owned())),
    }
    let header: Header = serde_json::from_value(value).map_err(|error| no_part(format!("line 1: {error}")))?;
    header.shard.check().map_err(|error| no_part(format!("line 1: shard {}: {error}", header.shard)))?;
    Ok(header)
}

/// Longest header that is read, in bytes: another file may have no line end.
const MOST_HEADER: u64 = 1 << 24;

/// Reads all outcomes after a part's header, in the order of their numbers.
///
/// # Errors
/// If it cannot be read, a line is wrong, or an outcome is missing or surplus.
pub fn read_outcomes<T: DeserializeOwned>(
    name: &str,
    header: &Header,
    from: &mut dyn BufRead,
) -> Result<Vec<Numbered<T>>> {
    let shard = header.shard;
    let damaged = |line: usize, problem: String| {
        anyhow!("{name}, line {line}: {problem}; compute part {shard} again, with --force")
    };
    let mut expected = shard.numbers(header.all);
    let mut outcomes = Vec::new();
    let mut last = 1;
    for (line, text) in (2..).zip(from.lines()) {
        let text = text.with_context(|| format!("{name} cannot be read"))?;
        let outcome: Numbered<T> = serde_json::from_str(&text)
            .map_err(|_| damaged(line, "this is not an outcome of this study, or was cut".to_owned()))?;
        match expected.next() {
            Some(number) if number == outcome.number => outcomes.push(outcome),
            Some(number) => {
                return Err(damaged(line, format!("this is number {}, but has to be {number}", outcome.number)));
            }
            None => return Err(damaged(line, "this is one more than the part has".to_owned())),
        }
        last = line;
    }
    match expected.next() {
        Some(number) => Err(damaged(last + 1, format!("the part ends before number {number}"))),
        None => Ok(outcomes),
    }
}

/// Checks that parts, each with its name, make one whole study that this program computed.
///
/// # Errors
/// The first problem: a part of another program or another study, a duplicate, or the missing parts.
pub fn together(parts: &[(String, Header)], ours: &Program) -> Result<()> {
    let missing =
        |which: String| anyhow!("{which} missing: name all parts of the study, or compute the missing ones by --shard");
    let study = |header: &Header| {
        let Header { command, settings, shard, all, .. } = header.clone();
        [
            ("command", command.into()),
            ("settings", settings),
            ("number of parts", shard.of.into()),
            ("size", all.into()),
        ]
    };
    let (other, first) = parts.first().ok_or_else(|| missing("all parts are".to_owned()))?;
    for (name, header) in parts {
        let theirs = &header.program;
        ensure!(
            theirs == ours,
            "{name} is of weeder {theirs}, and this is weeder {ours}: put parts together with the very program that computed them"
        );
        let differs = study(header)
            .into_iter()
            .zip(study(first))
            .find_map(|((what, theirs), (_, ours))| difference(what, &theirs, &ours));
        if let Some((what, theirs, ours)) = differs {
            bail!("{name} belongs to another study than {other}: its {what} is {theirs}, not {ours}");
        }
    }
    let mut holders: Vec<Option<&str>> = vec![None; first.shard.of as usize];
    for (name, header) in parts {
        let holder = &mut holders[header.shard.number as usize - 1];
        if let Some(other) = holder.replace(name.as_str()) {
            bail!("{name} and {other} are both part {}: name each part once", header.shard);
        }
    }
    let absent = (1..).zip(&holders).filter(|(_, holder)| holder.is_none());
    let absent: Vec<String> = absent.map(|(number, _)| Shard { number, of: first.shard.of }.to_string()).collect();
    Err(missing(match absent.as_slice() {
        [] => return Ok(()),
        [one] => format!("part {one} is"),
        [named @ .., last] if named.len() < MOST_NAMED => format!("parts {} and {last} are", named.join(", ")),
        _ => {
            let (named, rest) = absent.split_at(MOST_NAMED);
            format!("parts {} and {} more are", named.join(", "), rest.len())
        }
    }))
}

/// All outcomes in the order of their numbers. The parts must have passed [`together`].
pub fn outcomes<T>(parts: Vec<Vec<Numbered<T>>>) -> Vec<T> {
    let mut outcomes: Vec<Numbered<T>> = parts.into_iter().flatten().collect();
    outcomes.sort_by_key(|outcome| outcome.number);
    outcomes.into_iter().map(|outcome| outcome.outcome).collect()
}

/// The first difference of two values: its path, below `place`, and both values.
fn difference(place: &str, theirs: &Value, ours: &Value) -> Option<(String, String, String)> {
    let (theirs_fields, ours_fields) = match (theirs, ours) {
        _ if theirs == ours => return None,
        (Value::Object(theirs), Value::Object(ours)) if theirs.keys().eq(ours.keys()) => (theirs, ours),
        _ => return Some((place.to_owned(), theirs.to_string(), ours.to_string())),
    };
    let mut pairs = theirs_fields.iter().zip(ours_fields.values());
    pairs.find_map(|((name, theirs), ours)| {
        // Paths within the settings need no prefix.
        let place = if place == "settings" { name.clone() } else { format!("{place}.{name}") };
        difference(&place, theirs, ours)
    })
}

#[cfg(test)]
mod tests;
