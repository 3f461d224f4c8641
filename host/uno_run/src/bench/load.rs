//! The load of a measurement: a terminal that asks all the time, and a flickering beam.

use field::wiring;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uno::{CYCLES_PER_SECOND, PinChange, ReceivedByte, Uno, UnoError};

/// Bits of a byte on the line: its data, a start bit and a stop bit.
const BITS_PER_BYTE: u64 = 10;

/// The terminal's question. Its answer is the longest line that the firmware sends on request.
const QUESTION: &[u8] = b"status\n";

/// Pending questions at any time, so that the line stays busy while the firmware reads one.
const QUESTIONS_AHEAD: usize = 2;

/// Time between two reads of the answers.
const LOOK_CYCLES: u64 = CYCLES_PER_SECOND / 1000;

/// A terminal that keeps the firmware's transmitter as busy as possible.
#[derive(Default)]
pub(super) struct Telemetry {
    unanswered: usize,
    /// Bytes of a question that [`Telemetry::next_byte`] has returned.
    given: usize,
    line: Vec<u8>,
    bytes: u64,
}

impl Telemetry {
    /// Runs to a cycle, and asks the next question after each answer.
    pub(super) fn run_until(&mut self, uno: &mut Uno, cycle: u64) -> Result<(), UnoError> {
        while uno.cycle() < cycle {
            while let Some(byte) = self.next_byte() {
                uno.send(&[byte]);
            }
            uno.run_until(cycle.min(uno.cycle() + LOOK_CYCLES))?;
            self.take(&uno.received_bytes());
        }
        Ok(())
    }

    /// The next byte of a question, for a caller that sends the bytes itself. `None` while enough are pending.
    pub(super) fn next_byte(&mut self) -> Option<u8> {
        if self.given == 0 {
            if self.unanswered == QUESTIONS_AHEAD {
                return None;
            }
            self.unanswered += 1;
        }
        let byte = QUESTION[self.given];
        self.given = (self.given + 1) % QUESTION.len();
        Some(byte)
    }

    pub(super) fn rest_of_question(&self) -> &'static [u8] {
        if self.given == 0 { &[] } else { &QUESTION[self.given..] }
    }

    pub(super) fn take(&mut self, received: &[ReceivedByte]) {
        for byte in received.iter().map(|received| received.byte) {
            self.bytes += 1;
            if byte != b'\n' {
                self.line.push(byte);
                continue;
            }
            let line = std::mem::take(&mut self.line);
            if line.trim_ascii_end() == b"ok" {
                self.unanswered = self.unanswered.saturating_sub(1);
            }
        }
    }

    /// Share of the line's capacity that was used over this number of cycles, from 0 to 1.
    pub(super) fn line_share(&self, cycles: u64) -> f64 {
        let capacity = cycles as f64 / CYCLES_PER_SECOND as f64 * (uno::BAUD / BITS_PER_BYTE) as f64;
        self.bytes as f64 / capacity
    }
}

/// Shortest time between two edges of the beam, its sensor's response time, and its greatest random addition.
pub(super) const EDGE_CYCLES: u64 = CYCLES_PER_SECOND / 1000;
const EDGE_SCATTER_CYCLES: u64 = EDGE_CYCLES / 5;

/// A beam that flickers from `begin` to `end`, as fast as a sensor with a response of 1 ms can report. It ends clear.
pub(super) fn flicker(begin: u64, end: u64) -> Vec<PinChange> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut cycle = begin;
    let mut high = true;
    let mut changes = Vec::new();
    while cycle < end || !high {
        high = !high;
        changes.push(PinChange { cycle, pin: wiring::BEAM, high });
        cycle += EDGE_CYCLES + rng.random_range(0..EDGE_SCATTER_CYCLES);
    }
    changes
}
