//! What comes of a replay, how near it has to be to the log, and why there may be none.

use std::fmt;
use thiserror::Error;

/// By how many ticks a detection's place and width may differ.
pub const DETECTION_TICKS: i32 = 3;

/// By how many ticks a swing's place may differ, 6 mm at the default wheel, besides [`SWING_MS`].
pub const SWING_TICKS: i32 = 12;

/// By how much of the machine's way a swing's place may differ, in milliseconds.
pub const SWING_MS: i32 = 25;

/// Why a log cannot be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// There is nothing to replay.
    #[error(
        "the log has no machine in it: `weeder record` and `weeder monitor --log` write one with its settings and status"
    )]
    Nothing,
    /// A line says what cannot be.
    #[error("line {line} of the log: {problem}")]
    Line {
        /// The line, counted from 1.
        line: u64,
        /// What is wrong with it.
        problem: String,
    },
}

/// What log and replay do not agree on.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The log's line, where it has one.
    pub line: Option<u64>,
    /// What the log says.
    pub logged: String,
    /// What the replay says.
    pub replayed: String,
}

impl fmt::Display for Difference {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { line, logged, replayed } = self;
        match line {
            Some(line) => write!(formatter, "line {line}: the log has {logged}, the replay {replayed}"),
            None => write!(formatter, "the log has {logged}, the replay {replayed}"),
        }
    }
}

/// What came of a replay.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Replayed {
    /// Objects on which both agree.
    pub objects: usize,
    /// Swings on which both agree.
    pub swings: usize,
    /// Alarms that both raised by themselves.
    pub alarms: usize,
    /// Greatest distance between a swing of the log and the replay's, in ticks.
    pub farthest_swing: i32,
    /// The first thing on which they do not.
    pub difference: Option<Difference>,
    /// What was left out, and why.
    pub notes: Vec<String>,
}
