//! Events: what the machine has to tell while it works, one line each.

use crate::{
    alarm::{Alarm, Warning},
    ground::{class::Vote, keep_out::Plan},
    operate::{calibration::Outcome, state::State},
    units::{Position, Ticks, count},
};
use heapless::Vec;

/// Events that wait to be told. They are short-lived: a plant gives three in half a second.
pub const CAPACITY: usize = 6;

/// Something that happened.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A detection was seen in full and classified.
    Detection {
        /// What it was taken for.
        vote: Vote,
        /// Where the beam broke.
        leading: Position,
        /// Distance since the last plant's leading edge, or since watching began.
        spacing: Ticks,
        /// The paper's schedule for it.
        plan: Plan,
    },
    /// A plant was due here, none was seen, and the ground is kept free all the same.
    Guarded(Position),
    /// A plant has passed both beams, and this is the slip by the last of them, in thousandths.
    Slip {
        /// Above 0 where the wheel turns farther than the machine rolls.
        permille: i16,
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

/// The events that wait to be told.
#[derive(Clone, Debug)]
pub struct Events {
    /// Whether they are told at all.
    on: bool,
    missed: u16,
    waiting: Vec<Event, CAPACITY, u8>,
}

impl Events {
    /// None, and none are told.
    pub const NONE: Self = Self { on: false, missed: 0, waiting: Vec::new() };

    /// Tells events from now on, or no longer; none of those that wait.
    pub fn turn(&mut self, on: bool) {
        self.on = on;
        self.waiting.clear();
    }

    /// Has an event wait, if events are told.
    pub fn add(&mut self, event: Event) {
        if self.on {
            self.announce(event);
        }
    }

    /// Has an event wait that the operator waits for, whether or not events are told.
    pub fn announce(&mut self, event: Event) {
        if self.waiting.push(event).is_err() {
            count(&mut self.missed);
        }
    }

    /// The next one to be told. The few behind it are moved up: a deque of heapless takes 116 bytes of flash more, and 4 of SRAM.
    #[inline(never)]
    pub fn take(&mut self) -> Option<Event> {
        (!self.waiting.is_empty()).then(|| self.waiting.remove(0))
    }

    /// Those that found no room to wait in.
    pub fn missed(&self) -> u16 {
        self.missed
    }
}
