//! A port at whose other end a script answers, for tests of programs that talk to the firmware.

use crate::Rig;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
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
            match byte {
                b'\n' => {
                    let line = String::from_utf8(std::mem::take(&mut self.typed)).map_err(io::Error::other)?;
                    self.to_read.extend((self.script)(Some(&line)).unwrap_or_default());
                }
                0x08 => drop(self.typed.pop()),
                _ => self.typed.push(byte),
            }
        }
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// A board with the firmware's decisions in HOLD, which a test plugs in and out. Clones control the same board.
///
/// It does not answer `silence`. It accepts every change of its examples.
#[derive(Clone, Default)]
pub struct ScriptedBoard {
    is_there: Arc<AtomicBool>,
    /// Output that no command requests, sent at the next read.
    says: Arc<Mutex<Vec<u8>>>,
    typed: Arc<Mutex<Vec<String>>>,
}

impl ScriptedBoard {
    /// A board that is plugged in.
    pub fn plugged_in() -> Self {
        let board = Self::default();
        board.plug(true);
        board
    }

    /// Plugs it in, or out.
    pub fn plug(&self, is_there: bool) {
        self.is_there.store(is_there, Ordering::Relaxed);
    }

    /// Sends bytes that no command has requested.
    pub fn say(&self, bytes: &[u8]) {
        self.says.lock().expect("no test has panicked").extend(bytes);
    }

    /// The typed lines, except those that only ask what the board is, has and does.
    pub fn typed(&self) -> Vec<String> {
        self.typed.lock().expect("no test has panicked").clone()
    }

    /// A port to the board, which restarts at each opening; `None` while it is unplugged.
    pub fn open(&self) -> Option<impl Read + Write + use<>> {
        let is_there = |board: &Self| board.is_there.load(Ordering::Relaxed);
        let board = self.clone();
        let mut rig = Rig::new(Nearest::new(&[][..], Volatile::new()));
        let mut answer = move |line: &str| {
            // The save before it is complete.
            while !rig.carry_on() {}
            match line.split(' ').next() {
                Some("" | "silence") => Vec::new(),
                Some("label" | "teach" | "forget") => b"ok\n".to_vec(),
                _ => (rig.ask(line).join("\n") + "\n").into_bytes(),
            }
        };
        let script = move |line: Option<&str>| {
            let said = line.map_or_else(
                || std::mem::take(&mut *board.says.lock().ok()?).into(),
                |line| {
                    if !["", "version", "get", "status", "examples"].contains(&line) {
                        board.typed.lock().ok()?.push(line.to_owned());
                    }
                    Some(answer(line))
                },
            );
            said.filter(|_| is_there(&board))
        };
        is_there(self).then(|| ScriptedPort::new(script))
    }
}
