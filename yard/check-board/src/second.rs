//! Another simulator's virtual Uno that replaces the weeder's: a process that answers turn by turn.
//!
//! A turn has 6400 cycles, which limits their number. Changes of its inputs come at their cycles. Its outputs are known
//! when a turn is over. They always count as made a little more than a turn later. So widths and distances are right,
//! and delays are longer by 0.4 ms.

use anyhow::{Context, Result, anyhow, ensure};
use serde::{Deserialize, Serialize};
use serde_json::json;
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};
use uno::elf::Image;
use uno::{Pin, PinChange, hex};

/// The name of what stopped, for errors.
const SECOND: &str = "the second simulator";

/// Cycles of a turn: 0.4 ms.
const TURN: u64 = 6400;

/// The delay of its edges: a turn, and its greatest excess, since both programs run on to the end of an instruction.
const DELAY: u64 = TURN + 64;

/// The edges of a turn: cycle, number of the board's pin, level.
type Edges = Vec<(u64, usize, bool)>;

/// The inputs of a turn. `page/src/uno/lockstep.ts` reads them.
#[derive(Default, Serialize)]
struct Turn {
    until: u64,
    edges: Edges,
    typed: Vec<u8>,
    reset: bool,
}

/// The outputs of a turn.
#[derive(Deserialize)]
struct Done {
    edges: Edges,
    said: Vec<u8>,
}

/// The virtual Uno. Its methods fail if its process has ended. Dropping it ends the process.
pub struct SecondUno {
    process: Child,
    to: ChildStdin,
    from: BufReader<ChildStdout>,
    /// The next turn up to the requested end of its run, and the reached end, in cycles.
    next: Turn,
    run: u64,
    changes: Vec<PinChange>,
    said: Vec<u8>,
}

impl SecondUno {
    /// Powers it up with the firmware of an ELF. `program` is `page/build/lockstep.mjs`, which `./setup.sh page` makes.
    ///
    /// # Errors
    /// If node cannot be started, or the ELF cannot be read.
    pub fn power_up(program: &Path, elf: &Path) -> Result<Self> {
        let flash = Image::read(elf).context(SECOND)?.flash;
        let mut process = Command::new("node")
            .arg(program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .map_err(|error| anyhow!("node cannot be started ({error}): ./setup.sh page installs it"))
            .context(SECOND)?;
        let to = process.stdin.take().context(SECOND)?;
        let from = BufReader::new(process.stdout.take().context(SECOND)?);
        let mut uno = Self { process, to, from, next: Turn::default(), run: 0, changes: vec![], said: vec![] };
        uno.exchange(&json!({ "hex": hex::text(&flash) })).context(SECOND)?;
        Ok(uno)
    }

    /// The requested end of its run, in cycles.
    pub fn cycle(&self) -> u64 {
        self.next.until
    }

    /// Lets its clock run, one whole turn at a time.
    pub fn run_until(&mut self, cycle: u64) -> Result<()> {
        self.next.until = self.next.until.max(cycle);
        if self.next.until < self.run + TURN { Ok(()) } else { self.turn() }
    }

    /// Changes input pins.
    pub fn drive(&mut self, changes: impl IntoIterator<Item = PinChange>) {
        let edge = |change: PinChange| (change.cycle, change.pin.number().into(), change.high);
        self.next.edges.extend(changes.into_iter().map(edge));
    }

    /// Its new output edges.
    pub fn take_changes(&mut self) -> Vec<PinChange> {
        std::mem::take(&mut self.changes)
    }

    /// Types bytes into it.
    pub fn send(&mut self, bytes: &[u8]) {
        self.next.typed.extend(bytes);
    }

    /// Typed bytes that have not reached it.
    pub fn bytes_pending(&self) -> usize {
        self.next.typed.len()
    }

    /// Its new serial output.
    pub fn received(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.said)
    }

    /// Pulls its reset.
    pub fn reset(&mut self) -> Result<()> {
        self.turn()?;
        self.next.reset = true;
        self.turn()
    }

    fn turn(&mut self) -> Result<()> {
        self.run = self.next.until;
        let turn = std::mem::replace(&mut self.next, Turn { until: self.run, ..Turn::default() });
        let done = self.exchange(&turn).context(SECOND)?;
        let change = |(cycle, pin, high): (u64, usize, bool)| {
            Pin::ALL.get(pin).map(|&pin| PinChange { cycle: cycle + DELAY, pin, high })
        };
        self.changes.extend(done.edges.into_iter().filter_map(change));
        self.said.extend(done.said);
        Ok(())
    }

    fn exchange(&mut self, said: &impl Serialize) -> Result<Done> {
        let mut line = serde_json::to_string(said)? + "\n";
        // At once: each write to a pipe wakes the other process.
        self.to.write_all(line.as_bytes())?;
        line.clear();
        ensure!(self.from.read_line(&mut line)? > 0, "the second simulator has ended");
        Ok(serde_json::from_str(&line)?)
    }
}

impl Drop for SecondUno {
    fn drop(&mut self) {
        // It also ends when its input is closed, but that takes time.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
