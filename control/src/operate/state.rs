//! What the machine is doing: HOLD, WORK, or an alarm that is latched.

use crate::alarm::Alarm;

/// What the machine is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
// HOLD is 0, as the memory is before anybody has woken up.
#[repr(u8)]
pub enum State {
    /// The tool stays out, whatever comes.
    Hold,
    /// The tool weeds between the plants.
    Work,
    /// A fault keeps the tool out until it is cleared.
    Alarm(Alarm),
}
