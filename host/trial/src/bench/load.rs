//! What keeps the firmware busy while it is measured: a terminal that never stops asking, and a beam that never stands still.

use field::wiring;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use uno::{CYCLES_PER_SECOND, PinChange};
use uno::{ReceivedByte, Uno, UnoError};

/// Bits of a byte on the line: its data, a start bit and a stop bit.
const BITS_PER_BYTE: u64 = 10;

/// What the terminal asks for. Its answer is the longest line that the firmware makes on request.
const QUESTION: &[u8] = b"status\n";

/// Questions on their way at any time, so that the line is busy while one of them is being read.
const QUESTIONS_AHEAD: usize = 2;

/// Time between two looks at what has come.
const LOOK_CYCLES: u64 = CYCLES_PER_SECOND / 1000;

/// A terminal that keeps the firmware's side of the serial line as busy as it can be.
#[derive(Default)]
pub(super) struct Telemetry {
    unanswered: usize,
    /// Bytes of a question that [`Telemetry::next_byte`] has given.
    given: usize,
    line: Vec<u8>,
    bytes: u64,
}

impl Telemetry {
    /// Runs to a cycle, and asks the next question after each answer.
    pub(super) fn run_until(&mut self, uno: &mut Uno, cycle: u64) -> Result<(), UnoError> {
        while uno.cycle() < cycle {
            while self.unanswered < QUESTIONS_AHEAD {
                uno.send(QUESTION);
                self.unanswered += 1;
            }
            uno.run_until(cycle.min(uno.cycle() + LOOK_CYCLES))?;
            self.take(&uno.received_bytes());
        }
        Ok(())
    }

    /// The next byte to ask with, for who gives the firmware its bytes himself; `None` while enough questions are on their way.
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

    /// What is still to be given of a question that has begun.
    pub(super) fn rest_of_question(&self) -> &'static [u8] {
        if self.given == 0 { &[] } else { &QUESTION[self.given..] }
    }

    /// Looks at what has come.
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

    /// Share of the line's capacity that was used over so many cycles, from 0 to 1.
    pub(super) fn line_share(&self, cycles: u64) -> f64 {
        let capacity = cycles as f64 / CYCLES_PER_SECOND as f64 * (uno::BAUD / BITS_PER_BYTE) as f64;
        self.bytes as f64 / capacity
    }
}

/// Shortest time between two edges of the beam, the response time of its sensor, and by how much more it may be.
pub(super) const EDGE_CYCLES: u64 = CYCLES_PER_SECOND / 1000;
const EDGE_SCATTER_CYCLES: u64 = EDGE_CYCLES / 5;

/// A beam that flickers as fast as a sensor with a response of 1 ms can report, from `begin` to `end`; it ends clear.
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
