//! The player: takes pieces from a queue, and says which levels the lines have and when the next event is due.
//!
//! It has no clock: the caller fires each event when it is due, and then waits as long as the player says.

use crate::piece::{Action, Piece};
use crate::pins::{ALL_LINES, AT_REST, Line};

/// What comes after an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The next event, this many cycles after the one before.
    After(u32),
    /// Nothing: the plan has ended.
    Ended,
    /// Nothing: the next piece is not there yet. The plan is void.
    Dry,
}

/// Plays a plan.
#[derive(Debug)]
pub struct Player {
    /// The piece whose events come next, and how many are left.
    piece: Option<Piece>,
    left: u8,
    /// What the plan wants.
    wanted: u8,
    /// What is on the lines.
    shown: u8,
    frozen: u8,
    position: i32,
}

impl Default for Player {
    fn default() -> Self {
        Self::new()
    }
}

impl Player {
    /// A player without a plan, all lines at rest, at position 0.
    pub const fn new() -> Self {
        Self { piece: None, left: 0, wanted: AT_REST, shown: AT_REST, frozen: 0, position: 0 }
    }

    /// The levels that the lines have to have now.
    pub const fn levels(&self) -> u8 {
        self.shown
    }

    /// Counts forward less counts back that the plans have wanted.
    pub const fn position(&self) -> i32 {
        self.position
    }

    /// Whether a plan is being played.
    pub const fn is_playing(&self) -> bool {
        self.piece.is_some()
    }

    /// Starts a plan with its first piece.
    pub fn start(&mut self, take: impl FnOnce() -> Option<Piece>) -> Next {
        self.load(take())
    }

    /// Gives up the plan; the lines stay as they are.
    pub const fn stop(&mut self) {
        self.piece = None;
    }

    /// Sets lines beside a plan.
    pub const fn set(&mut self, mask: u8, levels: u8) {
        self.wanted = (self.wanted & !mask | levels & mask) & ALL_LINES;
        self.shown = self.shown & self.frozen | self.wanted & !self.frozen;
    }

    /// The event that is due. `take` takes the next piece from the queue.
    pub fn fire(&mut self, take: impl FnOnce() -> Option<Piece>) -> Next {
        let Some(piece) = self.piece else { return Next::Dry };
        match piece.action {
            Action::Forward => self.step(true),
            Action::Backward => self.step(false),
            Action::Flicker { mask } => {
                self.step(true);
                self.set(mask, !self.wanted);
            }
            Action::Levels { mask, levels } => self.set(mask, levels),
            Action::Freeze { mask } => {
                self.frozen = mask;
                self.set(0, 0);
            }
            Action::Pause => {}
            Action::End => {
                self.piece = None;
                return Next::Ended;
            }
        }
        self.left = self.left.saturating_sub(1);
        if self.left > 0 { Next::After(piece.wait) } else { self.load(take()) }
    }

    fn load(&mut self, piece: Option<Piece>) -> Next {
        self.piece = piece;
        match piece {
            Some(piece) => {
                self.left = piece.count;
                Next::After(piece.wait)
            }
            None => Next::Dry,
        }
    }

    /// Forward is the sequence AB = 00, 10, 11, 01.
    fn step(&mut self, forward: bool) {
        let (a, b) = (self.wanted & Line::EncoderA.bit() != 0, self.wanted & Line::EncoderB.bit() != 0);
        let line = if (a == b) == forward { Line::EncoderA } else { Line::EncoderB };
        self.set(line.bit(), !self.wanted);
        self.position = self.position.wrapping_add(if forward { 1 } else { -1 });
    }
}
