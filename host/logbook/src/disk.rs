//! Saves a log's lines to the disk about once a second.
//!
//! A thread waits for the disk, because a slow one would delay the caller's `hold`.

use std::io::{self, ErrorKind};
use std::sync::mpsc::{SyncSender, TrySendError, sync_channel};
use std::thread::{self, Builder, JoinHandle};
use std::time::Duration;

/// Time between two saves.
const PERIOD: Duration = Duration::from_secs(1);

/// Saves the lines until it is dropped, and the last ones then.
pub(crate) struct Disk {
    unsaved: Option<SyncSender<()>>,
    saver: Option<JoinHandle<io::Result<()>>>,
}

impl Disk {
    /// Saves by `save`. Fails if the system has no thread left.
    pub(crate) fn new(mut save: impl FnMut() -> io::Result<()> + Send + 'static) -> io::Result<Self> {
        let (unsaved, lines) = sync_channel(1);
        let saver = Builder::new().spawn(move || {
            for () in lines {
                save()?;
                thread::park_timeout(PERIOD);
            }
            Ok(())
        })?;
        Ok(Self { unsaved: Some(unsaved), saver: Some(saver) })
    }

    /// Has what was written saved soon. Fails if an earlier save has failed.
    pub(crate) fn written(&mut self) -> io::Result<()> {
        match self.unsaved.as_ref().map(|unsaved| unsaved.try_send(())) {
            Some(Err(TrySendError::Disconnected(()))) | None => {
                Err(self.end().err().unwrap_or(ErrorKind::Other.into()))
            }
            _ => Ok(()),
        }
    }

    fn end(&mut self) -> io::Result<()> {
        self.unsaved = None;
        let Some(saver) = self.saver.take() else { return Ok(()) };
        saver.thread().unpark();
        saver.join().unwrap_or(Ok(()))
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        // The caller can no longer be told.
        let _ = self.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicU32, Ordering};

    #[test]
    fn many_lines_are_saved_together_and_the_last_ones_at_the_end() {
        let saves = Arc::new(AtomicU32::new(0));
        let counted = Arc::clone(&saves);
        let mut disk = Disk::new(move || {
            counted.fetch_add(1, Ordering::Relaxed);
            Ok(())
        })
        .unwrap();
        (0..1000).for_each(|_| disk.written().unwrap());
        drop(disk);
        assert!((1..100).contains(&saves.load(Ordering::Relaxed)), "{saves:?}");
    }
}
