//! Several virtual Unos on one wheel: a machine with several rows. Each row has its own Uno, pseudo terminal and
//! plants.
//!
//! The encoder's edges come to all Unos at the same cycle, as over one cable. The Unos run in step, some milliseconds
//! at a time, in up to as many threads as there are cores. A slow PC makes all of them slower together. An Uno whose
//! firmware crashes stops, and the others run on.
//!
//! The cable itself is not simulated: it loses and delays no edge.

use super::{LiveUno, SLICE_MS, Setup};
use anyhow::{Error, Result};
use cpu_time::ProcessTime;
use rayon::ThreadPoolBuilder;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};
use uno::Uno;

/// The least number of rows for one thread. A single thread can run this many in real time, without waiting for other
/// threads.
const ROWS_OF_A_THREAD: usize = 3;

/// Slices after which the threads wait for each other: rare enough for a busy PC, and too short for a person to notice.
const SLICES_IN_STEP: u64 = 5;

/// Longest delay of the PC that is made up for. After a longer one the chip would run too fast, so that is dropped.
const LATE_BY: Duration = Duration::from_millis(50);

/// A fault of one row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mishap {
    /// Its USB cable is unplugged. The board has its own power and works on.
    Unplugged,
    /// The cable is plugged in again.
    PluggedIn,
    /// The board is reset.
    Reset,
}

/// The rows of a machine.
pub struct LiveRows {
    rows: Vec<Row>,
    fast: bool,
}

/// How long they have run.
#[derive(Clone, Copy, Debug)]
pub struct Ran {
    /// By their own clock.
    pub simulated: Duration,
    /// By the host's.
    pub took: Duration,
    /// Total working time of all cores.
    pub cores: Duration,
    /// The number of threads.
    pub threads: usize,
}

impl LiveRows {
    /// Powers up all Unos, with the courses of one machine. The first course decides whether they run in real time.
    ///
    /// # Errors
    /// If there is no program or it does not fit, no terminal can be opened, or a file is wrong.
    pub fn start(setups: Vec<Setup>) -> Result<Self> {
        let fast = setups.first().is_some_and(|setup| setup.fast);
        let row = |setup| Ok(Row { uno: LiveUno::start(setup)?, failed: None });
        Ok(Self { rows: setups.into_iter().map(row).collect::<Result<_>>()?, fast })
    }

    /// The paths under which programs open the rows' serial ports.
    pub fn paths(&self) -> Vec<&Path> {
        self.rows.iter().map(|row| row.uno.path.as_path()).collect()
    }

    /// Runs until `stop` is set, or for this time of the Unos' clock.
    ///
    /// # Errors
    /// The first row that has failed, and its error, after all have ended. A row fails if its firmware crashes or
    /// halts, or if its terminal or its EEPROM's file fails.
    pub fn run(&mut self, stop: &AtomicBool, time: Option<Duration>) -> Result<Ran, (usize, Error)> {
        self.run_with(stop, time, &channel().1)
    }

    fn run_with(
        &mut self,
        stop: &AtomicBool,
        time: Option<Duration>,
        mishaps: &Receiver<(usize, Mishap)>,
    ) -> Result<Ran, (usize, Error)> {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let threads = cores.min(self.rows.len() / ROWS_OF_A_THREAD).max(1);
        let each = self.rows.len().div_ceil(threads).max(1);
        let most_slices = time.map_or(u64::MAX, |time| time.as_millis() as u64 / SLICE_MS);
        let others = ThreadPoolBuilder::new().num_threads((threads - 1).max(1));
        let pool = others.build().map_err(|error| (0, error.into()))?;
        let (began, worked) = (Instant::now(), ProcessTime::now());
        let (mut due, mut slices) = (began, 0);
        while !stop.load(Ordering::Relaxed) && slices < most_slices {
            for (row, mishap) in mishaps.try_iter() {
                self.rows[row].suffer(mishap);
            }
            let step = |rows: &mut [Row]| {
                (0..SLICES_IN_STEP).for_each(|_| rows.iter_mut().for_each(|row| row.run(LiveUno::slice)));
            };
            // This thread takes the first rows. It waits for no other thread if there are few rows.
            pool.in_place_scope(|scope| {
                let mut parts = self.rows.chunks_mut(each);
                let own = parts.next();
                parts.for_each(|rows| scope.spawn(move |_| step(rows)));
                own.map(step);
            });
            slices += SLICES_IN_STEP;
            if !self.fast {
                due += Duration::from_millis(SLICES_IN_STEP * SLICE_MS);
                thread::sleep(due.saturating_duration_since(Instant::now()));
                if due.elapsed() > LATE_BY {
                    due = Instant::now();
                }
            }
        }
        self.rows.iter_mut().for_each(|row| row.run(LiveUno::end));
        let mut failures = self.rows.iter_mut().map(|row| row.failed.take()).enumerate();
        match failures.find_map(|(row, failed)| Some((row, failed?))) {
            Some(failed) => Err(failed),
            None => Ok(Ran {
                simulated: Duration::from_millis(slices * SLICE_MS),
                took: began.elapsed(),
                cores: worked.elapsed(),
                threads: self.rows.len().div_ceil(each).max(1),
            }),
        }
    }

    /// The rows' Unos, without their terminals.
    pub fn into_unos(self) -> Vec<Uno> {
        self.rows.into_iter().map(|row| row.uno.uno).collect()
    }

    /// Runs in a thread until the handle is stopped or dropped.
    pub fn run_in_background(mut self) -> Background {
        let paths = self.paths().into_iter().map(Path::to_owned).collect();
        let stop = Arc::new(AtomicBool::new(false));
        let stop_there = Arc::clone(&stop);
        let (mishaps, suffered) = channel();
        let thread = thread::spawn(move || {
            self.run_with(&stop_there, None, &suffered)?;
            Ok(self)
        });
        Background { paths, mishaps, stop, thread: Some(thread) }
    }
}

/// A row's Uno, and the error that has stopped it.
struct Row {
    uno: LiveUno,
    failed: Option<Error>,
}

impl Row {
    /// Runs a part of an Uno that has not stopped. At the port of one that stops it looks like a pulled cable.
    fn run(&mut self, part: impl FnOnce(&mut LiveUno) -> Result<()>) {
        if self.failed.is_none()
            && let Err(error) = part(&mut self.uno)
        {
            self.uno.pty = None;
            self.failed = Some(error);
        }
    }

    fn suffer(&mut self, mishap: Mishap) {
        match mishap {
            // The chip runs on: it has its own power.
            Mishap::Unplugged => self.uno.pty = None,
            Mishap::PluggedIn => self.run(LiveUno::plug_in),
            Mishap::Reset => self.uno.uno.reset(),
        }
    }
}

/// Rows that run in a thread: their ports, and their faults. The handle does not notice an early failure;
/// [`Background::stop`] returns it. Dropping it ends the thread and removes terminals and links.
pub struct Background {
    paths: Vec<PathBuf>,
    mishaps: Sender<(usize, Mishap)>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<LiveRows, (usize, Error)>>>,
}

impl Background {
    /// The paths under which programs open the rows' serial ports.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// The path of the first row's serial port.
    pub fn path(&self) -> &Path {
        &self.paths[0]
    }

    /// Applies a fault to a row, within some milliseconds.
    pub fn happen(&self, row: usize, mishap: Mishap) {
        // A thread that has ended early has no rows to disturb.
        let _ = self.mishaps.send((row, mishap));
    }

    /// Stops the rows, and gives them back.
    ///
    /// # Errors
    /// As [`LiveRows::run`].
    ///
    /// # Panics
    /// If their thread did.
    pub fn stop(mut self) -> Result<LiveRows, (usize, Error)> {
        self.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.take().expect("it is taken here and by drop alone");
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl Drop for Background {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The result is dropped, because the user did not call `stop`.
            let _ = thread.join();
        }
    }
}
