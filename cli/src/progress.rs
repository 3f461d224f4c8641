//! The bar that shows how far a simulation is.

use indicatif::{ProgressBar, ProgressStyle};

/// Steps of a full bar.
const STEPS: u64 = 1000;

/// A bar on standard error; none where that is not a terminal.
pub struct Progress(ProgressBar);

impl Progress {
    /// An empty bar behind these words.
    pub fn new(words: &'static str) -> Self {
        let bar = ProgressBar::new(STEPS).with_message(words);
        if let Ok(style) = ProgressStyle::with_template("{msg} {wide_bar:.green} {percent:>3} %, {eta} to go") {
            bar.set_style(style);
        }
        Self(bar)
    }

    /// Shows the share done, from 0 to 1.
    pub fn show(&self, share: f64) {
        self.0.set_position((share * STEPS as f64) as u64);
    }

    /// Takes the bar away.
    pub fn finish(self) {
        self.0.finish_and_clear();
    }
}
