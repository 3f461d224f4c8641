//! What is tried on the bench: the tool by hand, the servo's times, and the swings of a row.
//!
//! All of it needs the machine in HOLD, where it stays, and ends when the machine is told to do something else. None of it
//! touches what the machine knows of the ground.

use crate::{
    operate::{
        calibration::{Outcome, Swings},
        dry_run::DryRun,
        servo::HalfMicros,
    },
    units::Instant,
};

/// What is being tried.
#[derive(Clone, Debug)]
// Nothing is 0, as the memory is before anybody has woken up.
#[repr(u8)]
pub enum Bench {
    /// Nothing.
    Idle,
    /// The servo has this pulse.
    ByHand(HalfMicros),
    /// The servo swings to and fro, to be timed.
    Swings(Swings),
    /// The tool swings as for a row of plants.
    Row(DryRun),
}

impl Bench {
    /// The pulse that the servo has by hand.
    pub const fn pulse(&self) -> Option<HalfMicros> {
        if let Self::ByHand(pulse) = self { Some(*pulse) } else { None }
    }

    /// Whether nobody asks what the sensors say: none need be wired for the servo to be tried.
    pub const fn needs_no_sensor(&self) -> bool {
        matches!(self, Self::Row(_))
    }

    /// Whether the end switch is not held against the tool: the tool is where no order has put it, or the switch itself is timed.
    pub const fn needs_no_end_switch(&self) -> bool {
        matches!(self, Self::ByHand(_) | Self::Swings(_))
    }

    /// Whether the tool swings to and fro.
    pub const fn swings(&self) -> bool {
        matches!(self, Self::Swings(_) | Self::Row(_))
    }

    /// Carries on with what is being tried, with a tool that is `out` or not; returns whether it has the tool out, if it says, and
    /// how swings ended, if they did.
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
