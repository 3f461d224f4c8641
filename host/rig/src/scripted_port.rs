//! A port at whose other end a script answers, for tests of programs that talk to the firmware.

use crate::Rig;
use control::ground::nearest::Nearest;
use control::memory::Volatile;
use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::sync::{Arc, Mutex, MutexGuard};
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
                0x08 => _ = self.typed.pop(),
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
pub struct ScriptedBoard(Arc<Mutex<State>>);

#[derive(Default)]
struct State {
    is_there: bool,
    /// Output that no command requests, sent at the next read.
    says: Vec<u8>,
    typed: Vec<String>,
}

impl ScriptedBoard {
    /// A board that is plugged in.
    pub fn plugged_in() -> Self {
        let board = Self::default();
        board.plug(true);
        board
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().expect("no test has panicked")
    }

    /// Plugs it in, or out.
    pub fn plug(&self, is_there: bool) {
        self.state().is_there = is_there;
    }

    /// Sends bytes that no command has requested.
    pub fn say(&self, bytes: &[u8]) {
        self.state().says.extend(bytes);
    }

    /// The typed lines, except those that only ask what the board is, has and does.
    pub fn typed(&self) -> Vec<String> {
        self.state().typed.clone()
    }

    /// A port to the board, which restarts at each opening; `None` while it is unplugged.
    pub fn open(&self) -> Option<impl Read + Write + use<>> {
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
            let mut state = board.state();
            let asks = |line| ["", "version", "get", "status", "examples"].contains(&line);
            state.typed.extend(line.filter(|line| !asks(line)).map(str::to_owned));
            let said = line.map_or_else(|| std::mem::take(&mut state.says), &mut answer);
            state.is_there.then_some(said)
        };
        self.state().is_there.then(|| ScriptedPort::new(script))
    }
}
