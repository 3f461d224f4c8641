//! The progress bar of a simulation.
//!
//! After an interrupt of the command the terminal's line is empty, without half a bar.

use indicatif::{ProgressBar, ProgressStyle};
use std::process;
use std::sync::{Mutex, MutexGuard, PoisonError};

const STEPS: u64 = 1000;

/// How a shell knows of a command that Ctrl-C has ended.
const INTERRUPTED: i32 = 130;

static SHOWN: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Shows the share done.
pub type Show<'a> = &'a (dyn Fn(f64) + Sync);

/// Shows a bar behind a text during the work, if standard error is a terminal. The work tells the share done, 0 to 1.
pub fn with_bar<T>(words: &'static str, work: impl FnOnce(Show) -> T) -> T {
    let bar = ProgressBar::new(STEPS).with_message(words);
    if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar:.green} {percent:>3} %, {eta} to go") {
        bar.set_style(style);
    }
    if !bar.is_hidden() {
        *shown() = Some(bar.clone());
        // Catching Ctrl-C fails from the second bar on. If it fails before, Ctrl-C does not remove the bar.
        let _ = ctrlc::set_handler(|| {
            if let Some(bar) = shown().take() {
                bar.finish_and_clear();
            }
            process::exit(INTERRUPTED);
        });
    }
    let done = work(&|share| bar.set_position((share * STEPS as f64) as u64));
    *shown() = None;
    bar.finish_and_clear();
    done
}

fn shown() -> MutexGuard<'static, Option<ProgressBar>> {
    SHOWN.lock().unwrap_or_else(PoisonError::into_inner)
}
