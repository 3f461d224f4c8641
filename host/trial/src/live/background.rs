//! Runs something in its own thread until its handle is stopped or dropped: a live Uno, or the rows of a machine.
//!
//! The handle has the parts that other code needs meanwhile ([`Live::Outside`]): paths of ports, and ways to disturb a
//! row. The handle does not notice an early failure; [`Background::stop`] returns it.

use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// A task for a thread.
pub trait Live: Sized + Send + 'static {
    /// The parts that other code needs while it runs.
    type Outside;
    /// Its error.
    type Failure: Send;

    /// Returns the parts that other code needs while it runs.
    fn outside(&self) -> Self::Outside;

    /// Runs until `stop` is set.
    ///
    /// # Errors
    /// The failure that has ended it early.
    fn run_until(&mut self, stop: &AtomicBool) -> Result<(), Self::Failure>;

    /// Runs in a thread until the handle is dropped.
    fn run_in_background(mut self) -> Background<Self> {
        let outside = self.outside();
        let stop = Arc::new(AtomicBool::new(false));
        let stop_there = Arc::clone(&stop);
        let thread = thread::spawn(move || {
            self.run_until(&stop_there)?;
            Ok(self)
        });
        Background { outside, stop, thread: Some(thread) }
    }
}

/// A running thread. Dropping it ends the thread and removes its terminals and links.
pub struct Background<L: Live> {
    outside: L::Outside,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<L, L::Failure>>>,
}

impl<L: Live> Background<L> {
    /// Stops it, and gives it back.
    ///
    /// # Errors
    /// The error that has ended it.
    ///
    /// # Panics
    /// If its thread did.
    pub fn stop(mut self) -> Result<L, L::Failure> {
        self.stop.store(true, Ordering::Relaxed);
        let thread = self.thread.take().expect("it is taken here and by drop alone");
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

impl<L: Live> Deref for Background<L> {
    type Target = L::Outside;

    fn deref(&self) -> &L::Outside {
        &self.outside
    }
}

impl<L: Live> Drop for Background<L> {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            // The result is dropped, because the user did not call `stop`.
            let _ = thread.join();
        }
    }
}
