//! A port at whose other end a script answers, for tests of programs that talk to the firmware.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::thread;
use std::time::Duration;

/// A port. The script gets each typed line, and `None` before each read. It returns the bytes to send, or `None` while
/// the port is unplugged.
pub struct ScriptedPort<F> {
    script: F,
    typed: Vec<u8>,
    to_read: VecDeque<u8>,
}

impl<F: FnMut(Option<&str>) -> Option<Vec<u8>>> ScriptedPort<F> {
    /// A port with this script.
    pub fn new(script: F) -> Self {
        Self { script, typed: Vec::new(), to_read: VecDeque::new() }
    }
}

impl<F: FnMut(Option<&str>) -> Option<Vec<u8>>> Read for ScriptedPort<F> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let Some(said) = (self.script)(None) else { return Ok(0) };
        self.to_read.extend(said);
        if self.to_read.is_empty() {
            thread::sleep(Duration::from_millis(1));
            return Err(io::ErrorKind::TimedOut.into());
        }
        self.to_read.read(buffer)
    }
}

impl<F: FnMut(Option<&str>) -> Option<Vec<u8>>> Write for ScriptedPort<F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        for &byte in bytes {
            if byte != b'\n' {
                self.typed.push(byte);
                continue;
            }
            let line = String::from_utf8(std::mem::take(&mut self.typed)).map_err(io::Error::other)?;
            self.to_read.extend((self.script)(Some(&line)).unwrap_or_default());
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}
