//! Alarms: faults after which the machine no longer knows enough to have its tool in the row.
//!
//! An alarm puts the tool out, empties the schedule and stays until the operator clears it. Its code, counted from 1, is
//! what the status LED blinks; its name is what the console says.

use crate::text::words;

words! {
    /// A latched fault, in the order of the LED's codes.
    pub enum Alarm {
        /// The beam was broken over more ground than any plant covers: something hangs in it, or it is out of line.
        BeamBlocked = "beam_blocked",
        /// More plants stand between beam and tool than the schedule can hold.
        ScheduleFull = "schedule_full",
        /// Edges of the beam came faster than they could be taken: dust, or a loose wire.
        BeamEdgesLost = "beam_edges_lost",
    }
}

impl Alarm {
    /// The number of flashes with which the LED tells it.
    pub const fn code(self) -> u8 {
        self as u8 + 1
    }
}
