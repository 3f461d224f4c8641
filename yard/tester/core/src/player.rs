//! The player of a plan: queues its pieces, and gives the lines' levels and the wait until the next event.
//!
//! A piece is an action on the lines, and the cycles since the previous event.
//! It has no clock: the caller fires each event in time, and then waits as long as the player says.

use crate::pins::{ALL_LINES, AT_REST, Line};
use heapless::Deque;
use serde::{Deserialize, Serialize};

/// Most pieces in the tester's queue.
pub const QUEUE_PIECES: usize = 64;

/// One action, once or several times. Each is an event, a number of cycles after the previous event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Piece {
    /// Cycles (16 MHz) from one event to the next.
    pub wait: u32,
    /// Repetitions, 1 to 255; 0 counts as 1.
    pub count: u8,
    /// The action.
    pub action: Action,
}

/// The action of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Action {
    /// The encoder moves one count forward.
    Forward,
    /// The encoder moves one count back.
    Backward,
    /// The encoder moves one count forward, and the lines of `mask` change.
    Flicker {
        /// The lines, without the encoder's channels.
        mask: u8,
    },
    /// The lines of `mask` take their bits of `levels`.
    Levels {
        /// The lines, as bits of [`Line::bit`](crate::pins::Line::bit).
        mask: u8,
        /// Their levels.
        levels: u8,
    },
    /// From now on, the lines of `mask` keep their present level and ignore the plan: a torn or stuck wire. 0 releases all lines,
    /// and they follow the plan again.
    Freeze {
        /// The lines.
        mask: u8,
    },
    /// No change.
    Pause,
    /// The plan ends here.
    End,
}

impl Action {
    /// A line takes this level.
    pub const fn level(line: Line, high: bool) -> Self {
        Self::Levels { mask: line.bit(), levels: if high { line.bit() } else { 0 } }
    }
}

/// The result of an event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Next {
    /// The next event comes this many cycles after this one.
    After(u32),
    /// The plan has ended.
    Ended,
    /// The next piece is missing, so the plan is invalid.
    Dry,
}

/// Plays a plan.
#[derive(Debug)]
pub struct Player {
    queue: Deque<Piece, QUEUE_PIECES>,
    /// The present piece, and its remaining events.
    piece: Option<Piece>,
    left: u8,
    /// The plan's levels.
    wanted: u8,
    /// The levels on the lines.
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
        let queue = Deque::new();
        Self { queue, piece: None, left: 0, wanted: AT_REST, shown: AT_REST, frozen: 0, position: 0 }
    }

    /// The levels for the lines now.
    pub const fn levels(&self) -> u8 {
        self.shown
    }

    /// Counts forward minus counts back in the plans.
    pub const fn position(&self) -> i32 {
        self.position
    }

    /// Whether a plan is being played.
    pub const fn is_playing(&self) -> bool {
        self.piece.is_some()
    }

    /// Free places for pieces.
    pub fn room(&self) -> usize {
        QUEUE_PIECES - self.queue.len()
    }

    /// Queues a piece; only called if there is room.
    pub fn push(&mut self, piece: Piece) {
        let _ = self.queue.push_back(piece);
    }

    /// Starts the plan with its first piece.
    pub fn start(&mut self) -> Next {
        self.piece = self.queue.pop_front();
        let Some(piece) = self.piece else { return Next::Dry };
        self.left = piece.count;
        Next::After(piece.wait)
    }

    /// Stops the plan, and drops its pieces; the lines keep their levels.
    pub fn stop(&mut self) {
        self.piece = None;
        self.queue.clear();
    }

    /// Sets lines outside a plan.
    pub const fn set(&mut self, mask: u8, levels: u8) {
        self.wanted = (self.wanted & !mask | levels & mask) & ALL_LINES;
        self.shown = self.shown & self.frozen | self.wanted & !self.frozen;
    }

    /// Fires the event that is due.
    pub fn fire(&mut self) -> Next {
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
        if self.left > 0 { Next::After(piece.wait) } else { self.start() }
    }

    /// Forward is the sequence AB = 00, 10, 11, 01.
    fn step(&mut self, forward: bool) {
        let (a, b) = (self.wanted & Line::EncoderA.bit() != 0, self.wanted & Line::EncoderB.bit() != 0);
        let line = if (a == b) == forward { Line::EncoderA } else { Line::EncoderB };
        self.set(line.bit(), !self.wanted);
        self.position = self.position.wrapping_add(if forward { 1 } else { -1 });
    }
}
