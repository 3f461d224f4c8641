//! What runs in a thread of its own until its handle is stopped or dropped: a live Uno, or the rows of a machine.
//!
//! The handle gives what programs outside need meanwhile, by [`Live::Outside`]: paths of ports, and what may happen to a row. It does
//! not notice when what it runs fails before; [`Background::stop`] says so.

use std::ops::Deref;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle};

/// What can run in a thread.
pub trait Live: Sized + Send + 'static {
    /// What is needed of it from outside while it runs.
    type Outside;
    /// What can end it.
    type Failure: Send;

    /// What is needed of it from outside while it runs.
    fn outside(&self) -> Self::Outside;

    /// Runs until `stop` is set.
    ///
    /// # Errors
    /// What has ended it before.
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

/// Something that runs in a thread. Dropped, it ends, its terminals and links with it.
pub struct Background<L: Live> {
    outside: L::Outside,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<Result<L, L::Failure>>>,
}

impl<L: Live> Background<L> {
    /// Stops it, and gives it back.
    ///
    /// # Errors
    /// What has ended it before.
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
            // Its user did not ask what became of it.
            let _ = thread.join();
        }
    }
}
