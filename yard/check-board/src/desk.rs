//! Two virtual Unos, wired to each other. Each has a pseudo terminal, and both run in one thread.
//!
//! They run at full speed. Opening a port resets its board, as the modem line DTR does on a real one.

use crate::pair::{Pair, Side, Wiring};
use anyhow::{Context, Result, anyhow};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use uno::CYCLES_PER_SECOND;
use uno::pty::Pty;

/// Greatest number of bytes on their way to a board. Others stay in the terminal.
const MOST_BYTES_ON_THEIR_WAY: usize = 64;

/// The message if their thread could not be started, or panicked.
const STOPPED: &str = "the virtual Unos do not run";

/// Two virtual Unos. Dropped, they stop.
pub struct Desk {
    /// Their thread ends when this is dropped.
    alive: Arc<()>,
    thread: JoinHandle<Result<()>>,
    tester: PathBuf,
    weeder: PathBuf,
}

impl Desk {
    /// Powers both up. `second` is the program of another simulator that replaces the weeder's, if it is given.
    ///
    /// # Errors
    /// If an ELF cannot be run, or no pseudo terminal is to be had.
    pub fn start(tester_elf: &Path, weeder_elf: &Path, second: Option<&Path>) -> Result<Self> {
        let (tester_pty, weeder_pty) = (Pty::open()?, Pty::open()?);
        let (tester, weeder) = (tester_pty.path().to_owned(), weeder_pty.path().to_owned());
        let alive = Arc::new(());
        let is_alive = Arc::downgrade(&alive);
        let elves = (tester_elf.to_owned(), weeder_elf.to_owned());
        let second = second.map(Path::to_owned);
        let run = move || {
            let mut pair = Pair::power_up(&elves.0, &elves.1, second.as_deref(), Wiring::right())?;
            let mut ptys = [(Side::Tester, tester_pty), (Side::Weeder, weeder_pty)];
            while is_alive.strong_count() > 0 {
                for (side, pty) in &mut ptys {
                    take_turn(&mut pair, *side, pty)?;
                }
                pair.run_for(CYCLES_PER_SECOND / 1000)?;
            }
            Ok(())
        };
        let thread = thread::Builder::new().name("desk".to_owned()).spawn(run).context(STOPPED)?;
        Ok(Self { alive, thread, tester, weeder })
    }

    /// The tester's port.
    pub fn tester(&self) -> &Path {
        &self.tester
    }

    /// The weeder's port.
    pub fn weeder(&self) -> &Path {
        &self.weeder
    }

    /// Stops both.
    ///
    /// # Errors
    /// If one of them had stopped already.
    pub fn stop(self) -> Result<()> {
        drop(self.alive);
        self.thread.join().unwrap_or_else(|_| Err(anyhow!("{STOPPED}: the thread panicked")))
    }
}

/// Moves bytes between a board and its terminal.
fn take_turn(pair: &mut Pair, side: Side, pty: &mut Pty) -> Result<()> {
    if pty.was_opened()? {
        // Output to a closed port is dropped.
        pair.received(side).clear();
        pair.reset(side)?;
    }
    let room = MOST_BYTES_ON_THEIR_WAY.saturating_sub(pair.bytes_pending(side));
    let mut bytes = [0; MOST_BYTES_ON_THEIR_WAY];
    let count = pty.read(&mut bytes[..room])?;
    if count > 0 {
        pair.send(side, &bytes[..count]);
    }
    let received = pair.received(side);
    if !received.is_empty() {
        let written = pty.write(received.make_contiguous())?;
        received.drain(..written);
    }
    Ok(())
}
