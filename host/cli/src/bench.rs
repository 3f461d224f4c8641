//! `weeder bench-uno`: what the firmware and its classifier can take and what they cost on an Arduino Uno.

use crate::output::say;
use crate::progress::Progress;
use anyhow::Result;
use trial::bench::table::{Figures, TURNINGS};
use trial::bench::{self, encoder, servo, swings};
use trial::firmware;

/// The rows whose swings are held against their places.
const ROWS: u64 = 50;

/// Measures and prints the tables.
///
/// # Errors
/// Where the bench or the firmware cannot be built or run.
pub fn run() -> Result<()> {
    let bench_elf = firmware::build_bench()?;
    let elf = firmware::build()?;
    let bar = Progress::new("classifying");
    let classifier = bench::classifier(&bench_elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("weeding");
    let firmware = bench::weeding(&elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("turning the encoder");
    let share_each = 1.0 / TURNINGS.len() as f64;
    let mut rates = Vec::new();
    for (done, turning) in TURNINGS.into_iter().enumerate() {
        let rate = encoder::highest_rate(&elf, turning, |share| bar.show((done as f64 + share) * share_each))?;
        rates.push((turning, rate));
    }
    bar.finish();
    let bar = Progress::new("watching the servo");
    let jitter = servo::jitter(&elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("swinging");
    let lateness = swings::lateness(&elf, &swings::Rows::at_walking_speed(0..ROWS), |share| bar.show(share))?;
    bar.finish();
    for table in (Figures { classifier, firmware, rates, jitter, lateness }).tables() {
        say!("{table}")?;
    }
    Ok(())
}
