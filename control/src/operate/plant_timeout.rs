//! The way that the machine has worked without seeing a plant: it may have left the row, or its beam may be blind.

use crate::units::{Position, Ticks};

/// How far the machine has worked without seeing a plant.
#[derive(Clone, Debug)]
pub struct PlantTimeout {
    /// Where the last detection ended, or work began.
    since: Position,
    warned: bool,
}

impl PlantTimeout {
    /// None since here.
    pub const fn since(position: Position) -> Self {
        Self { since: position, warned: false }
    }

    /// Whether the operator is to be warned, once, as none was seen on a way longer than this; zero never.
    pub fn warn(&mut self, position: Position, longest: Ticks) -> bool {
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
