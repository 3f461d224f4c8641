//! The next step of setting up a machine, in words.

use crate::{Margin, PLANTS, SetUp, TIMINGS};
use control::settings::Setting;
use std::fmt;

/// The next step.
#[derive(Clone, Debug, PartialEq)]
pub enum Step {
    /// Time the servo. It has been timed this many times.
    TimeServo(usize),
    /// Set a lead to the one that follows from the measured times.
    SetLead(Setting, u16),
    /// Measure the wheel. It has been measured this many times.
    MeasureWheel(usize),
    /// Drive on with the second beam. This many plants have measured the slip.
    PassPlants(usize),
    /// The margin can, or must, be changed to this one.
    SetMargin(Margin),
    /// No margin is as great as this one, in millimetres, which the measurements need; what to do.
    MeasureAgain(u16, &'static str),
    /// The margin is right.
    Ready(Margin),
}

impl Step {
    /// Its name, in two or three words.
    pub(super) fn name(&self) -> &'static str {
        match self {
            Self::TimeServo(_) => "time the servo",
            Self::SetLead(..) => "set the lead",
            Self::MeasureWheel(_) => "measure the wheel",
            Self::PassPlants(_) => "pass some plants",
            Self::MeasureAgain(..) => "measure again",
            Self::SetMargin(_) | Self::Ready(_) => "set the margin",
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::TimeServo(done) => write!(f, "time the servo: `calibrate servo` ({done} of {TIMINGS} done)"),
            Self::SetLead(lead, lead_ms) => write!(f, "take the calculated lead: `set {} {lead_ms}`", lead.text()),
            Self::MeasureWheel(done) => {
                let all = SetUp::STRETCHES;
                write!(f, "measure 10 m: `calibrate start`, roll, `calibrate 10000` ({done} of {all} done)")
            }
            Self::PassPlants(done) => {
                write!(f, "measure the slip with both beams: roll past {PLANTS} plants ({done} done)")
            }
            Self::SetMargin(margin) => {
                let word = if margin.least_mm() < margin.in_use_mm { "lower" } else { "raise" };
                write!(f, "{word} the margin: `set margin_mm {}`: {margin}", margin.least_mm())
            }
            Self::MeasureAgain(least_mm, how) => write!(f, "the measurements need {least_mm} mm: {how}"),
            Self::Ready(margin) => write!(f, "the margin pays for {margin}: `save`"),
        }
    }
}
