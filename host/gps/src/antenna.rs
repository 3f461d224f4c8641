//! Where beam and tool stand beside the receiver's antenna, and how late its lines come: what a record says of it, and
//! what the user.

use crate::track::Offset;
use link::Values;
use std::fmt;

/// Where beam and tool stand beside the antenna, and what else is to be known of the receiver. Millimetres are to the
/// front and to the right; below 0 they are to the back and to the left.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Antenna {
    /// How far the beam stands ahead of the antenna.
    pub beam_ahead_mm: f64,
    /// How far it stands to the right of it: where it crosses the row.
    pub beam_right_mm: f64,
    /// How far the tool stands ahead of the antenna; none where it is behind the beam as the machine's settings say.
    pub tool_ahead_mm: Option<f64>,
    /// How far it stands to the right of it; none where it is as far as the beam.
    pub tool_right_mm: Option<f64>,
    /// From the moment of a fix until its first line has come, at the least.
    pub delay_ms: f64,
    /// The standard deviation of a fix; none where it is to be what is usual for the fix's quality.
    pub error_mm: Option<f64>,
}

impl Antenna {
    /// Reads what a record says; none where it says something else.
    pub fn parse(line: &str) -> Option<Self> {
        let values = Values(line);
        let number = |key| values.number::<f64>(key).filter(|value| value.is_finite());
        Some(Self {
            beam_ahead_mm: number("beam_ahead_mm")?,
            beam_right_mm: number("beam_right_mm")?,
            tool_ahead_mm: number("tool_ahead_mm"),
            tool_right_mm: number("tool_right_mm"),
            delay_ms: number("delay_ms")?,
            error_mm: number("error_mm").filter(|&error_mm| error_mm > 0.0),
        })
    }

    /// The standard deviation of a fix in metres, where it is known.
    pub fn error_m(&self) -> Option<f64> {
        self.error_mm.map(|error_mm| error_mm / 1000.0)
    }

    /// Where the beam is.
    pub fn beam(&self) -> Offset {
        Offset { ahead_m: self.beam_ahead_mm / 1000.0, right_m: self.beam_right_mm / 1000.0 }
    }

    /// Where the tool is, on a machine whose tool is so far behind its beam.
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
