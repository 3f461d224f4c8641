//! The offsets of beam and tool from the receiver's antenna, and the delay of its lines: from a log, or from the user.

use crate::track::Offset;
use link::Values;
use std::fmt;

/// The offsets of beam and tool from the antenna, and further values of the receiver. Millimetres are positive to the
/// front and to the right, and negative to the back and to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Antenna {
    /// Distance of the beam ahead of the antenna.
    pub beam_ahead_mm: f64,
    /// Distance to the right of it, where the beam crosses the row.
    pub beam_right_mm: f64,
    /// Distance of the tool ahead of the antenna. `None` if it follows from the machine's settings.
    pub tool_ahead_mm: Option<f64>,
    /// Distance of the tool to the right of it. `None` if it equals the beam's.
    pub tool_right_mm: Option<f64>,
    /// From the moment of a fix until its first line has come, at the least.
    pub delay_ms: f64,
    /// The standard deviation of a fix. `None` for the usual one of the fix's quality.
    pub error_mm: Option<f64>,
}

impl Antenna {
    /// The greatest distance from the antenna, and the greatest standard deviation, in mm.
    pub const FARTHEST_MM: f64 = 20_000.0;
    /// The greatest delay, in ms.
    pub const LATEST_MS: f64 = 2000.0;

    /// Parses a log's line. `None` if it is another line, or damaged.
    pub fn parse(line: &str) -> Option<Self> {
        let values = Values(line);
        let number = |key| values.number::<f64>(key);
        let distance_mm = |key| number(key).filter(|mm| mm.abs() <= Self::FARTHEST_MM);
        Some(Self {
            beam_ahead_mm: distance_mm("beam_ahead_mm")?,
            beam_right_mm: distance_mm("beam_right_mm")?,
            tool_ahead_mm: distance_mm("tool_ahead_mm"),
            tool_right_mm: distance_mm("tool_right_mm"),
            delay_ms: number("delay_ms").filter(|ms| (0.0..=Self::LATEST_MS).contains(ms))?,
            error_mm: distance_mm("error_mm").filter(|&error_mm| error_mm > 0.0),
        })
    }

    /// The standard deviation of a fix in metres, if it is known.
    pub fn error_m(&self) -> Option<f64> {
        self.error_mm.map(|error_mm| error_mm / 1000.0)
    }

    /// Where the beam is.
    pub fn beam(&self) -> Offset {
        Offset { ahead_m: self.beam_ahead_mm / 1000.0, right_m: self.beam_right_mm / 1000.0 }
    }

    /// The tool's offset, on a machine with this distance from beam to tool.
    pub fn tool(&self, beam_to_tool_mm: f64) -> Offset {
        Offset {
            ahead_m: self.tool_ahead_mm.unwrap_or(self.beam_ahead_mm - beam_to_tool_mm) / 1000.0,
            right_m: self.tool_right_mm.unwrap_or(self.beam_right_mm) / 1000.0,
        }
    }
}

impl fmt::Display for Antenna {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { beam_ahead_mm, beam_right_mm, delay_ms, .. } = self;
        write!(formatter, "beam_ahead_mm={beam_ahead_mm} beam_right_mm={beam_right_mm} delay_ms={delay_ms}")?;
        let others =
            [("tool_ahead_mm", self.tool_ahead_mm), ("tool_right_mm", self.tool_right_mm), ("error_mm", self.error_mm)];
        others
            .into_iter()
            .try_for_each(|(key, value)| value.map_or(Ok(()), |value| write!(formatter, " {key}={value}")))
    }
}
