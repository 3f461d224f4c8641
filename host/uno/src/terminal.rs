//! The terminal at the other end of the serial line: it sends bytes to the chip at the line's pace.
//!
//! Bytes are lost and counted if the chip has no room. The chip's output is in `recorder`.

use crate::core::Core;
use crate::pins::CYCLES_PER_SECOND;
use std::collections::VecDeque;

/// The terminal's bit rate, until it follows the chip.
pub const BAUD: u64 = 115_200;

/// Cycles of a byte that a terminal sends: a start bit, eight data bits and a stop bit.
pub const SENT_BYTE_CYCLES: u64 = (10 * CYCLES_PER_SECOND + BAUD / 2) / BAUD;

/// A terminal and its unsent bytes.
#[derive(Default)]
pub(crate) struct Terminal {
    /// Unsent bytes, and the time at which the first one's stop bit ends.
    to_send: VecDeque<u8>,
    next_byte_ends: u64,
    /// Whether bytes come at the chip's own baud rate, not at [`BAUD`].
    follows_baud: bool,
    lost_bytes: u64,
}

impl Terminal {
    /// Queues bytes after the unsent ones.
    pub(crate) fn send(&mut self, bytes: &[u8], to: &Core) {
        if self.to_send.is_empty() {
            self.next_byte_ends = self.next_byte_ends.max(to.cycle() + self.byte_cycles(to));
        }
        self.to_send.extend(bytes);
    }

    /// From now on bytes come at the rate that the chip's UART is set to.
    pub(crate) fn follow_baud(&mut self) {
        self.follows_baud = true;
    }

    /// Gives the chip every byte that has ended by now.
    pub(crate) fn send_due(&mut self, to: &mut Core) {
        while !self.to_send.is_empty() && self.next_byte_ends <= to.cycle() {
            if let Some(byte) = self.to_send.pop_front()
                && !to.receive(byte)
            {
                self.lost_bytes += 1;
            }
            self.next_byte_ends += self.byte_cycles(to);
        }
    }

    /// The cycle at which the next byte ends, if there is one.
    pub(crate) fn next_byte_ends(&self) -> Option<u64> {
        (!self.to_send.is_empty()).then_some(self.next_byte_ends)
    }

    /// The number of unsent bytes.
    pub(crate) fn bytes_pending(&self) -> usize {
        self.to_send.len()
    }

    /// Bytes that the chip had no room for.
    pub(crate) fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }

    fn byte_cycles(&self, to: &Core) -> u64 {
        if self.follows_baud { to.byte_cycles() } else { SENT_BYTE_CYCLES }
    }
}
