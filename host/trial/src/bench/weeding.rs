//! The firmware at work: cycles of its interrupts and of its loop's turns, and its memory, while it weeds a row.

use super::error::BenchError;
use super::load::Telemetry;
use crate::console::{Status, ask};
use crate::run;
use field::machine::Machine;
use field::motion::mm_s;
use field::planting::Planting;
use field::trial::Trial;
use field::verdict::Timing;
use std::path::Path;
use uno::CYCLES_PER_SECOND;
use uno::elf::Size;
use uno::{InterruptStatistics, Turns};

/// The firmware's costs at work.
#[derive(Clone, Debug, PartialEq)]
pub struct FirmwareCosts {
    /// Its interrupts.
    pub interrupts: InterruptStatistics,
    /// Its loop's turns.
    pub turns: Turns,
    /// Share of the serial line's capacity that the firmware used meanwhile, from 0 to 1.
    pub line_share: f64,
    /// Flash and static SRAM.
    pub size: Size,
    /// Bytes of the stack at its deepest.
    pub stack: usize,
}

/// Speed of the firmware's run, the fastest of the paper's.
const SPEED_KM_H: f64 = 2.5;

/// The row: ten ragged plants and three tall weeds.
const PLANTING: Planting = Planting {
    plants: 10,
    spacing_mm: 500.0,
    spacing_scatter_mm: 40.0,
    canopy_mm: 150.0,
    canopy_scatter_mm: 20.0,
    weeds: 3,
    ragged: true,
};

/// Simulated time between two reports of progress.
const PROGRESS_CYCLES: u64 = CYCLES_PER_SECOND / 20;

/// Has the firmware at `elf` weed a row at 2.5 km/h, with its events reported and its status asked for as fast as the line
/// carries the answers. `progress` is told the share of the motion done, from 0 to 1.
///
/// # Errors
/// If the ELF cannot be run, or does not go to work.
pub fn weeding(elf: &Path, mut progress: impl FnMut(f64)) -> Result<FirmwareCosts, BenchError> {
    let trial = Trial::at_speed(PLANTING.grow(1)?, Machine::default(), Timing::default(), mm_s(SPEED_KM_H));
    let mut uno = run::boot(elf, &[trial.machine.beam_before(&trial.row, &trial.motion)])?;
    run::set_up(&trial, &mut uno)?;
    for command in ["events on", "start now"] {
        ask(&mut uno, command)?;
    }
    let status = Status::ask(&mut uno)?;
    if status.state != "work" {
        return Err(BenchError::NotAtWork(status.state));
    }
    uno.measure_interrupts();
    uno.measure_turns();
    let start = uno.cycle();
    uno.drive(trial.machine.pin_changes(&trial.row, &trial.motion, start));
    let cycles = (trial.motion.duration_s() * CYCLES_PER_SECOND as f64) as u64;
    let mut telemetry = Telemetry::default();
    while uno.cycle() < start + cycles {
        let next = (uno.cycle() + PROGRESS_CYCLES).min(start + cycles);
        telemetry.run_until(&mut uno, next)?;
        progress((uno.cycle() - start) as f64 / cycles as f64);
    }
    Ok(FirmwareCosts {
        interrupts: uno.interrupt_statistics().cloned().unwrap_or_default(),
        turns: uno.turns().copied().unwrap_or_default(),
        line_share: telemetry.line_share(cycles),
        size: Size::read(elf)?,
        stack: uno.deepest_stack(),
    })
}
