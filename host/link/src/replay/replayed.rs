//! The result of a replay, its tolerances, and its errors.

use std::fmt;
use thiserror::Error;

/// Tolerance of a detection's position and width, in ticks.
pub const DETECTION_TICKS: i32 = 3;

/// Tolerance of a swing's position, in ticks: 6 mm at the default wheel. [`SWING_MS`] adds to it.
pub const SWING_TICKS: i32 = 12;

/// Tolerance of a swing's position, as the machine's travel in this time, in milliseconds.
pub const SWING_MS: i32 = 25;

/// Why a log cannot be replayed.
#[derive(Debug, Error)]
pub enum ReplayError {
    /// The log has nothing to replay.
    #[error(
        "the log has no machine in it: `weeder record` and `weeder monitor --log` write one with its settings and status"
    )]
    Nothing,
    /// A line has impossible content.
    #[error("line {line} of the log: {problem}")]
    Line {
        /// The line, counted from 1.
        line: u64,
        /// The problem.
        problem: String,
    },
}

/// A difference between log and replay.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Difference {
    /// The log's line, if it has one.
    pub line: Option<u64>,
    /// The log's value.
    pub logged: String,
    /// The replay's value.
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

/// The result of a replay.
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
    /// The first difference.
    pub difference: Option<Difference>,
    /// Notes on skipped parts, with the reasons.
    pub notes: Vec<String>,
}
