//! Plans: converts levels at cycles to the pieces that the tester plays.
//!
//! A wheel makes thousands of counts a second, and the serial line carries 11 bytes a millisecond. So evenly spaced
//! counts become one piece, each at most `TOLERANCE` away from its time. Later events are not shifted.

use field::wiring;
use tester_core::pins::Line;
use tester_core::player::{Action, Piece};
use uno::{Pin, PinChange};

/// Greatest error of a count's time, in cycles: 20 us, 0.02 mm at 4 km/h.
const TOLERANCE: f64 = 320.0;

/// The shortest time between two events, in cycles.
const SHORTEST: u64 = 200;

/// The tester's lines, each with the weeder's pin at its other end.
pub(crate) const INPUTS: [(Line, Pin); 6] = [
    (Line::EncoderA, wiring::ENCODER_A),
    (Line::EncoderB, wiring::ENCODER_B),
    (Line::Beam, wiring::BEAM),
    (Line::SecondBeam, wiring::SECOND_BEAM),
    (Line::EndSwitch, wiring::END_SWITCH),
    (Line::WorkSwitch, wiring::WORK_SWITCH),
];

/// The line of a pin of the weeder.
pub fn line(pin: Pin) -> Option<Line> {
    INPUTS.iter().find(|input| input.1 == pin).map(|input| input.0)
}

/// A plan that is being made: its pieces, and the cycle of its last event. It is empty at first and begins at cycle 0.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pieces: Vec<Piece>,
    last: u64,
}

impl Plan {
    /// Adds an event at a cycle, or as soon after the previous one as possible.
    pub fn at(&mut self, cycle: u64, action: Action) {
        self.repeat(1, cycle.saturating_sub(self.last).max(SHORTEST) as u32, action);
    }

    /// Adds counts at a rate, from the last event on.
    pub fn roll(&mut self, counts: i32, per_s: f64) {
        let action = if counts > 0 { Action::Forward } else { Action::Backward };
        let wait = (uno::CYCLES_PER_SECOND as f64 / per_s).round() as u32;
        let mut left = counts.unsigned_abs();
        while left > 0 {
            let count = left.min(255);
            self.repeat(count as u8, wait, action);
            left -= count;
        }
    }

    /// Adds the same action up to 255 times, each `wait` cycles after the one before.
    pub fn repeat(&mut self, count: u8, wait: u32, action: Action) {
        self.pieces.push(Piece { wait, count, action });
        self.last += u64::from(wait) * u64::from(count);
    }

    /// The cycle of the last event.
    pub fn end(&self) -> u64 {
        self.last
    }

    /// The pieces, with the end marker.
    pub fn finish(mut self) -> Vec<Piece> {
        self.at(self.last + SHORTEST, Action::End);
        self.pieces
    }

    /// Adds counts at these cycles, all in one direction.
    fn counts(&mut self, cycles: &[u64], action: Action) {
        let mut rest = cycles;
        while !rest.is_empty() {
            let (length, wait) = self.even(rest);
            let count = length.min(255);
            self.repeat(count as u8, wait, action);
            rest = &rest[count..];
        }
    }

    /// How many of these counts can be one piece, and its wait.
    fn even(&self, cycles: &[u64]) -> (usize, u32) {
        let since = |cycle: u64| cycle.saturating_sub(self.last) as f64;
        let (mut lowest, mut highest) = (0.0_f64, f64::INFINITY);
        let mut found = (1, since(cycles[0]).max(SHORTEST as f64));
        for (number, &cycle) in (1_usize..=255).zip(cycles) {
            lowest = lowest.max((since(cycle) - TOLERANCE) / number as f64);
            highest = highest.min((since(cycle) + TOLERANCE) / number as f64);
            let wait = since(cycle) / number as f64;
            let wait = wait.clamp(lowest, highest.max(lowest)).round();
            if lowest.ceil() > highest.floor() || wait < lowest || wait > highest {
                break;
            }
            found = (number, wait.max(SHORTEST as f64));
        }
        (found.0, found.1 as u32)
    }

    /// Adds changes of the weeder's pins, `offset` cycles later, in the order of time.
    pub fn follow(&mut self, changes: &[PinChange], offset: u64) {
        let (mut a, mut b) = (false, false);
        let mut action_of = |change: &PinChange| {
            let action = match line(change.pin)? {
                Line::EncoderA if a != change.high => {
                    a = change.high;
                    if a == b { Action::Backward } else { Action::Forward }
                }
                Line::EncoderB if b != change.high => {
                    b = change.high;
                    if a == b { Action::Forward } else { Action::Backward }
                }
                Line::EncoderA | Line::EncoderB => return None,
                line => Action::level(line, change.high),
            };
            Some((change.cycle + offset, action))
        };
        let events: Vec<_> = changes.iter().filter_map(&mut action_of).collect();
        for same in events.chunk_by(|one, next| one.1 == next.1) {
            let action = same[0].1;
            let cycles: Vec<u64> = same.iter().map(|event| event.0).collect();
            if matches!(action, Action::Forward | Action::Backward) {
                self.counts(&cycles, action);
            } else {
                cycles.into_iter().for_each(|cycle| self.at(cycle, action));
            }
        }
    }
}
