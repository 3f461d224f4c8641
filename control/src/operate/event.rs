//! Events: reports that the machine sends while it works, one line each.

use crate::{
    alarm::{Alarm, Warning},
    ground::{class::Vote, keep_out::Plan},
    operate::{calibration::Outcome, state::State},
    units::{Position, Ticks, count},
};
use heapless::Vec;

/// Events in the queue. They leave it quickly: a plant gives three in half a second.
pub const CAPACITY: usize = 6;

/// An event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
// A byte of its own for the variant takes less code than the free values of another field.
#[repr(u8)]
pub enum Event {
    /// A complete detection was classified.
    Detection {
        /// The classifier's vote.
        vote: Vote,
        /// Where the beam broke.
        leading: Position,
        /// Distance from the last plant's leading edge, or from where detection began.
        spacing: Ticks,
        /// The paper's schedule for it.
        plan: Plan,
    },
    /// A plant was expected here and not seen. The ground is kept clear.
    Guarded(Position),
    /// A plant has passed both beams and gave a slip, in thousandths.
    Slip {
        /// Above 0 if the wheel turns farther than the machine rolls.
        permille: i16,
    },
    /// The tool was commanded out of the row or back.
    Swing {
        /// True for out of the row.
        out: bool,
        /// The machine's position at the command.
        position: Position,
    },
    /// The state changed.
    State(State),
    /// An alarm was latched.
    Alarm {
        /// The alarm.
        alarm: Alarm,
        /// The machine's position.
        position: Position,
    },
    /// A warning for the operator.
    Warning(Warning),
    /// The servo's timed swings ended.
    Calibrated {
        /// Their result.
        outcome: Outcome,
        /// Whether the leads were set from it. The times may be out of range, or contradict other settings.
        fits: bool,
    },
}

/// The queue of events.
#[derive(Clone, Debug)]
pub struct Events {
    /// Whether events are reported.
    on: bool,
    missed: u16,
    waiting: Vec<Event, CAPACITY, u8>,
}

impl Events {
    /// No events, with reporting off.
    pub const NONE: Self = Self { on: false, missed: 0, waiting: Vec::new() };

    /// Turns reporting on or off, and drops the waiting events.
    pub fn turn(&mut self, on: bool) {
        self.on = on;
        self.waiting.clear();
    }

    /// Queues an event, if reporting is on.
    pub fn add(&mut self, event: Event) {
        if self.on {
            self.announce(event);
        }
    }

    /// Queues an event that the operator waits for, even if reporting is off.
    pub fn announce(&mut self, event: Event) {
        if self.waiting.push(event).is_err() {
            count(&mut self.missed);
        }
    }

    /// The next event. The others move up: heapless' deque takes 116 bytes more flash, and 4 of SRAM.
    #[inline(never)]
    pub fn take(&mut self) -> Option<Event> {
        (!self.waiting.is_empty()).then(|| self.waiting.remove(0))
    }

    /// Events dropped because the queue was full.
    pub fn missed(&self) -> u16 {
        self.missed
    }
}
