//! The swings of the tool, from the servo's commands.

use crate::machine::time_at_s;
use crate::servo::Command;

/// The time from a command out of the row to the next one into it.
pub(super) struct Swing {
    /// `None` if the tool was out at power-up.
    pub(super) out_s: Option<f64>,
    /// `None` if the tool is still out at the end.
    pub(super) in_s: Option<f64>,
}

impl Swing {
    /// The swings that these commands make, in order of time.
    pub(super) fn all(commands: &[Command], start_cycle: u64) -> Vec<Self> {
        let mut swings: Vec<Self> = Vec::new();
        for (index, command) in commands.iter().enumerate() {
            let time_s = time_at_s(start_cycle, command.rise_cycle);
            match swings.last_mut().filter(|swing| swing.in_s.is_none()) {
                Some(swing) if !command.is_out => swing.in_s = Some(time_s),
                None if command.is_out => swings.push(Self { out_s: (index > 0).then_some(time_s), in_s: None }),
                _ => {}
            }
        }
        swings
    }
}
