//! Manual tests: the servo driven directly, the servo's times, and the swings of a row.
//!
//! All need HOLD, and end with any command that changes the state. They do not change the known ground.

use crate::{
    operate::{
        calibration::{Outcome, Swings},
        dry_run::DryRun,
        servo::HalfMicros,
    },
    units::Instant,
};

/// The manual test in progress.
#[derive(Clone, Debug)]
// `Idle` is 0, like memory before start-up.
#[repr(u8)]
pub enum ManualTest {
    /// None.
    Idle,
    /// The servo is driven directly with this pulse.
    ByHand(HalfMicros),
    /// The servo swings in and out, to be timed.
    Swings(Swings),
    /// The tool swings as for a row of plants.
    Row(DryRun),
}

impl ManualTest {
    /// The pulse that the operator drives the servo with.
    pub const fn pulse(&self) -> Option<HalfMicros> {
        if let Self::ByHand(pulse) = self { Some(*pulse) } else { None }
    }

    /// Whether sensor alarms are ignored: a dry run needs no sensor.
    pub const fn needs_no_sensor(&self) -> bool {
        matches!(self, Self::Row(_))
    }

    /// Whether the end switch is not compared with the tool: the operator moves the tool, or times the switch itself.
    pub const fn needs_no_end_switch(&self) -> bool {
        matches!(self, Self::ByHand(_) | Self::Swings(_))
    }

    /// Whether the tool swings in and out.
    pub const fn swings(&self) -> bool {
        matches!(self, Self::Swings(_) | Self::Row(_))
    }

    /// Runs one step; `out` is the tool's present command. Returns the next command, or `None` if the test does not decide it; and
    /// the result of timed swings.
    #[cfg_attr(not(target_arch = "avr"), inline)]
    pub fn carry_on(&mut self, now: Instant, end_switch_on: bool, out: bool) -> (Option<bool>, Option<Outcome>) {
        let (out, outcome) = match self {
            Self::Idle | Self::ByHand(_) => return (None, None),
            Self::Swings(swings) => match swings.step(now, end_switch_on) {
                None => (Some(swings.tool_out()), None),
                outcome => (None, outcome),
            },
            Self::Row(row) => (row.tool_out(now, out), None),
        };
        if out.is_none() {
            *self = Self::Idle;
        }
        (out, outcome)
    }
}
