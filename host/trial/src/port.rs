//! A virtual Uno as a port of the link.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use uno::Uno;

/// Longest time that a read waits for a byte, by the Uno's clock.
const READ_MS: u64 = 20;

/// A virtual Uno as a port, without a pseudo terminal. Its clock runs while it is read, as fast as possible.
pub struct UnoPort {
    uno: Uno,
    received: VecDeque<u8>,
}

impl UnoPort {
    /// A port at which this Uno is.
    pub fn new(uno: Uno) -> Self {
        Self { uno, received: VecDeque::new() }
    }

    /// The Uno, to drive its inputs.
    pub fn uno(&mut self) -> &mut Uno {
        &mut self.uno
    }
}

impl Read for UnoPort {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        for _ in 0..READ_MS {
            if !self.received.is_empty() {
                return self.received.read(buffer);
            }
            self.uno.run_for_ms(1).map_err(io::Error::other)?;
            self.received.extend(self.uno.received_bytes().into_iter().map(|received| received.byte));
        }
        Err(io::ErrorKind::TimedOut.into())
    }
}

impl Write for UnoPort {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.uno.send(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
