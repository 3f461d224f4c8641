//! Several virtual Unos on one wheel: a machine with several rows. Each row has its own Uno, pseudo terminal and
//! plants.
//!
//! The encoder's edges come to all Unos at the same cycle, as over one cable. The Unos run in step, some milliseconds
//! at a time, in up to as many threads as there are cores. A slow PC makes all of them slower together. An Uno whose
//! firmware crashes stops, and the others run on.
//!
//! The cable itself is not simulated: it loses and delays no edge.

use super::{Live, LiveUno, Pace, SLICE_MS, Setup};
use anyhow::{Error, Result};
use rustix::time::{ClockId, clock_gettime};
use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Barrier, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use uno::Uno;

/// The least number of rows for one thread. A single thread can run this many in real time, without waiting for other
/// threads.
const ROWS_OF_A_THREAD: usize = 3;

/// Slices after which the threads wait for each other: rare enough for a busy PC, and too short for a person to notice.
const SLICES_IN_STEP: u64 = 5;

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
    unos: Vec<LiveUno>,
    mishaps: Arc<Mutex<VecDeque<(usize, Mishap)>>>,
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

impl Ran {
    /// Simulated seconds in a second of the host.
    pub fn times_real_time(&self) -> f64 {
        self.simulated.as_secs_f64() / self.took.as_secs_f64().max(f64::EPSILON)
    }

    /// Number of cores for running in real time.
    pub fn cores_in_real_time(&self) -> f64 {
        self.cores.as_secs_f64() / self.simulated.as_secs_f64().max(f64::EPSILON)
    }
}

impl LiveRows {
    /// Powers up all Unos. Their courses must be those of one machine. The first course decides whether they run in
    /// real time.
    ///
    /// # Errors
    /// As [`LiveUno::start`].
    pub fn start(setups: Vec<Setup>) -> Result<Self> {
        let fast = setups.first().is_some_and(|setup| setup.fast);
        let unos = setups.into_iter().map(LiveUno::start).collect::<Result<_, _>>()?;
        Ok(Self { unos, mishaps: Arc::default(), fast })
    }

    /// The paths under which programs open the rows' serial ports.
    pub fn paths(&self) -> Vec<&Path> {
        self.unos.iter().map(LiveUno::path).collect()
    }

    /// Runs until `stop` is set, or for this time of the Unos' clock.
    ///
    /// # Errors
    /// The first error, and its row, after all have ended.
    pub fn run(&mut self, stop: &AtomicBool, time: Option<Duration>) -> Result<Ran, (usize, Error)> {
        let cores = thread::available_parallelism().map_or(1, usize::from);
        let threads = cores.min(self.unos.len() / ROWS_OF_A_THREAD).max(1);
        let each = self.unos.len().div_ceil(threads).max(1);
        let threads = self.unos.len().div_ceil(each).max(1);
        let most_slices = time.map_or(u64::MAX, |time| time.as_millis() as u64 / SLICE_MS);
        let (began, worked) = (Instant::now(), worked());
        let (barrier, ends) = (Barrier::new(threads), AtomicBool::new(false));
        let mishaps = &self.mishaps;
        let fast = self.fast;
        let mut slices = 0;
        let failed = thread::scope(|scope| {
            let mut parts = self.unos.chunks_mut(each).enumerate();
            // This thread leads: it checks the clock and the stop flag.
            let own = parts.next();
            let others: Vec<_> = parts
                .map(|(part, unos)| {
                    let (barrier, ends) = (&barrier, &ends);
                    scope.spawn(move || {
                        let mut part = Part::new(part * each, unos);
                        while !ends.load(Ordering::Relaxed) {
                            part.step(mishaps);
                            barrier.wait();
                            // The leader decides in between.
                            barrier.wait();
                        }
                        part.end()
                    })
                })
                .collect();
            let mut part = Part::new(0, own.map_or(&mut [], |(_, unos)| unos));
            let mut pace = (!fast).then(Pace::new);
            while !ends.load(Ordering::Relaxed) {
                part.step(mishaps);
                slices += SLICES_IN_STEP;
                barrier.wait();
                if let Some(pace) = &mut pace {
                    pace.wait(SLICES_IN_STEP);
                }
                ends.store(stop.load(Ordering::Relaxed) || slices >= most_slices, Ordering::Relaxed);
                barrier.wait();
            }
            let own = part.end();
            let others = others
                .into_iter()
                .filter_map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)));
            others.fold(own, |first, next| first.or(Some(next)))
        });
        match failed {
            Some(failed) => Err(failed),
            None => Ok(Ran {
                simulated: Duration::from_millis(slices * SLICE_MS),
                took: began.elapsed(),
                cores: self::worked().saturating_sub(worked),
                threads,
            }),
        }
    }

    /// The rows' Unos, without their terminals.
    pub fn into_unos(self) -> Vec<Uno> {
        self.unos.into_iter().map(|live| live.uno).collect()
    }
}

/// For how long this process has had cores at work.
fn worked() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::try_from(time).unwrap_or_default()
}

/// The rows of one thread.
struct Part<'a> {
    first: usize,
    unos: Vec<(&'a mut LiveUno, bool)>,
    failed: Option<(usize, Error)>,
}

impl<'a> Part<'a> {
    fn new(first: usize, unos: &'a mut [LiveUno]) -> Self {
        Self { first, unos: unos.iter_mut().map(|uno| (uno, true)).collect(), failed: None }
    }

    /// Runs each until the threads wait for each other.
    fn step(&mut self, mishaps: &Mutex<VecDeque<(usize, Mishap)>>) {
        self.suffer(mishaps);
        for _ in 0..SLICES_IN_STEP {
            for place in 0..self.unos.len() {
                let (uno, runs) = &mut self.unos[place];
                if *runs && let Err(error) = uno.slice() {
                    self.stop(place, error);
                }
            }
        }
    }

    /// An Uno has stopped. At its port this looks like a pulled cable.
    fn stop(&mut self, place: usize, error: Error) {
        let (uno, runs) = &mut self.unos[place];
        uno.unplug();
        *runs = false;
        self.failed.get_or_insert((self.first + place, error));
    }

    /// Applies pending faults to these rows.
    fn suffer(&mut self, mishaps: &Mutex<VecDeque<(usize, Mishap)>>) {
        let own = self.first..self.first + self.unos.len();
        let mine: Vec<(usize, Mishap)> = {
            let mut mishaps = mishaps.lock().unwrap_or_else(PoisonError::into_inner);
            if mishaps.is_empty() {
                return;
            }
            let (mine, others): (VecDeque<_>, _) = mishaps.drain(..).partition(|(row, _)| own.contains(row));
            *mishaps = others;
            Vec::from(mine)
        };
        for (row, mishap) in mine {
            let place = row - self.first;
            let uno = &mut self.unos[place].0;
            let suffered = match mishap {
                Mishap::Unplugged => {
                    uno.unplug();
                    Ok(())
                }
                Mishap::PluggedIn => uno.plug_in(),
                Mishap::Reset => {
                    uno.uno.reset();
                    Ok(())
                }
            };
            if let Err(error) = suffered {
                self.stop(place, error);
            }
        }
    }

    /// Ends them. Returns the error that has stopped one.
    fn end(mut self) -> Option<(usize, Error)> {
        for place in 0..self.unos.len() {
            let (uno, runs) = &mut self.unos[place];
            if *runs && let Err(error) = uno.end() {
                self.stop(place, error);
            }
        }
        self.failed
    }
}

/// Access to rows that run in a thread: their ports, and their faults.
pub struct Reached {
    paths: Vec<PathBuf>,
    mishaps: Arc<Mutex<VecDeque<(usize, Mishap)>>>,
}

impl Reached {
    /// The paths under which programs open the rows' serial ports.
    pub fn paths(&self) -> &[PathBuf] {
        &self.paths
    }

    /// Applies a fault to a row, within some milliseconds.
    pub fn happen(&self, row: usize, mishap: Mishap) {
        self.mishaps.lock().unwrap_or_else(PoisonError::into_inner).push_back((row, mishap));
    }
}

impl Live for LiveRows {
    type Outside = Reached;
    /// Which row has ended, and why.
    type Failure = (usize, Error);

    fn outside(&self) -> Reached {
        let paths = self.paths().into_iter().map(Path::to_owned).collect();
        Reached { paths, mishaps: Arc::clone(&self.mishaps) }
    }

    fn run_until(&mut self, stop: &AtomicBool) -> Result<(), Self::Failure> {
        self.run(stop, None).map(|_| ())
    }
}
