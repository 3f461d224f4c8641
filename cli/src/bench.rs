//! `weeder bench-uno`: what the firmware and its classifier cost on an Arduino Uno, in cycles and bytes.

use crate::progress::Progress;
use anyhow::Result;
use field::{bench, firmware};

/// Measures and prints the tables.
///
/// # Errors
/// Where the bench or the firmware cannot be built or run.
pub fn run() -> Result<()> {
    let bench_elf = firmware::build_bench()?;
    let firmware_elf = firmware::build()?;
    let bar = Progress::new("classifying");
    let classifier = bench::classifier(&bench_elf, |share| bar.show(share))?;
    bar.finish();
    let bar = Progress::new("weeding");
    let firmware = bench::firmware(&firmware_elf, |share| bar.show(share))?;
    bar.finish();
    println!("{}", bench::classifier_table(&classifier));
    println!("{}", bench::interrupt_table(&firmware));
    println!("{}", bench::memory_table(&classifier, &firmware));
    Ok(())
}
