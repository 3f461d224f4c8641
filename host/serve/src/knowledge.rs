//! What the sender of a command knew: a command must not be executed late, or after a HOLD that its sender did not see.
//!
//! Each message to the pages has a number. A page sends the number of the last message with each command. The server
//! knows when it made that message, and where each machine's last HOLD is in the order. A network may deliver a command
//! seconds later, or after a HOLD that was sent later. Both are then refused, and the client knows that the command was
//! not executed. HOLD itself is never refused.

use link::moment::Moment;
use link::session::Unanswered;
use std::collections::VecDeque;
use std::time::Duration;

/// Greatest age of the message that a sender has seen last.
pub const FRESH: Duration = Duration::from_secs(1);

/// The numbers of the messages.
#[derive(Clone, Debug)]
pub struct Knowledge {
    next: u64,
    /// The messages of the last second.
    recent: VecDeque<(u64, Moment)>,
    /// The message with each machine's last HOLD.
    held: Vec<u64>,
}

impl Knowledge {
    /// Before the first message, whose number is `first`. Another start of the server has other numbers, so that a
    /// message of an earlier one is unknown.
    pub fn new(first: u64, machines: usize) -> Self {
        Self { next: first, recent: VecDeque::new(), held: vec![first; machines] }
    }

    /// Numbers a message that is made now.
    pub fn number(&mut self, now: Moment) -> u64 {
        while self.recent.front().is_some_and(|&(_, at)| now.since(at) > FRESH) {
            self.recent.pop_front();
        }
        let number = self.next;
        self.next += 1;
        self.recent.push_back((number, now));
        number
    }

    /// The message with this number is about a machine's HOLD.
    pub fn hold(&mut self, machine: usize, number: u64) {
        self.held[machine] = number;
    }

    /// Until when a command to a machine may be typed, if its sender has seen this message.
    ///
    /// # Errors
    /// If a HOLD has come since, or the message is too old.
    pub fn deadline(&self, machine: usize, seen: u64, now: Moment) -> Result<Moment, Unanswered> {
        let made = self.recent.iter().find(|&&(number, _)| number == seen).map(|&(_, at)| at);
        match made {
            Some(_) if seen < self.held[machine] => Err(Unanswered::Held),
            Some(at) if now.since(at) <= FRESH => Ok(at.after(FRESH)),
            _ => Err(Unanswered::Late),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(ms: u64) -> Moment {
        Moment::default().after(Duration::from_millis(ms))
    }

    #[test]
    fn a_command_of_a_sender_that_has_seen_nothing_for_a_second_is_late() {
        let mut knowledge = Knowledge::new(5000, 1);
        let seen = knowledge.number(at(100));
        assert_eq!(knowledge.deadline(0, seen, at(1100)), Ok(at(1100)));
        assert_eq!(knowledge.deadline(0, seen, at(1101)), Err(Unanswered::Late));
        // Of the future, or of an earlier start.
        for unknown in [seen + 1, seen - 1, 0] {
            assert_eq!(knowledge.deadline(0, unknown, at(100)), Err(Unanswered::Late));
        }
        // The computer has slept for a minute, and only the calendar has gone on.
        let woken = Moment { ticking: at(100).ticking, calendar: at(60_100).calendar };
        assert_eq!(knowledge.deadline(0, seen, woken), Err(Unanswered::Late));
    }

    #[test]
    fn a_command_from_before_a_hold_is_refused_and_one_from_after_it_is_not() {
        let mut knowledge = Knowledge::new(5000, 2);
        let before = knowledge.number(at(0));
        let held = knowledge.number(at(10));
        knowledge.hold(1, held);
        assert_eq!(knowledge.deadline(1, before, at(20)), Err(Unanswered::Held));
        assert!(knowledge.deadline(0, before, at(20)).is_ok());
        assert!(knowledge.deadline(1, held, at(20)).is_ok());
    }

    #[test]
    fn the_memory_is_bounded_by_a_second() {
        let mut knowledge = Knowledge::new(0, 1);
        for ms in 0..100_000 {
            knowledge.number(at(ms));
        }
        assert!(knowledge.recent.len() <= 1001, "{}", knowledge.recent.len());
    }
}
