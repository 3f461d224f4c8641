//! The machine's state: HOLD, WORK, or a latched alarm.

use crate::alarm::Alarm;

/// The machine's state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
// `Hold` is 0, like memory before start-up.
#[repr(u8)]
pub enum State {
    /// The tool stays out.
    Hold,
    /// The tool weeds between the plants.
    Work,
    /// A fault keeps the tool out until it is cleared.
    Alarm(Alarm),
}
