//! The distance worked without a plant. If it is long, the machine may have left the row, or its beam may be blind.

use crate::units::{Position, Ticks};

/// The distance worked without a plant.
#[derive(Clone, Debug)]
pub struct PlantTimeout {
    /// Where the last detection ended, or work began.
    since: Position,
    warned: bool,
}

impl PlantTimeout {
    /// Starts at this position.
    pub const fn since(position: Position) -> Self {
        Self { since: position, warned: false }
    }

    /// True once, when the distance exceeds `longest`; 0 disables the check.
    pub fn take_warning(&mut self, position: Position, longest: Ticks) -> bool {
        if self.warned || longest == Ticks::ZERO || position - self.since <= longest {
            return false;
        }
        self.warned = true;
        true
    }

    /// Whether the operator was warned.
    pub const fn has_warned(&self) -> bool {
        self.warned
    }
}
