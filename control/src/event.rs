//! Events: what the machine has to tell while it works, one line each.

use crate::{
    alarm::{Alarm, Warning},
    calibration::Outcome,
    classifier::Vote,
    controller::State,
    ground::schedule::Plan,
    units::{Position, Ticks},
};

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// An object was seen in full and classified.
    Object {
        /// What it was taken for.
        vote: Vote,
        /// Where the beam broke.
        leading: Position,
        /// Distance since the last plant's leading edge, or since watching began.
        spacing: Ticks,
        /// The paper's schedule for it.
        plan: Plan,
    },
    /// The tool was told to leave the row or to come back.
    Swing {
        /// Out of the row, or back into it.
        out: bool,
        /// The machine's position at the command.
        position: Position,
    },
    /// The machine went from one state to another.
    State(State),
    /// A fault was latched.
    Alarm {
        /// Which.
        alarm: Alarm,
        /// The machine's position.
        position: Position,
    },
    /// Something happened that the operator should know of.
    Warning(Warning),
    /// The servo's swings are over.
    Calibrated {
        /// What they told.
        outcome: Outcome,
        /// Whether the leads are set to it: they may be out of range, or contradict other settings.
        fits: bool,
    },
}
