//! The servo's jitter: how much its pulses and frames vary under the highest load.

use super::encoder::{Direction, Load, Turning, edges};
use super::load::{Telemetry, flicker};
use crate::run;
use anyhow::Result;
use field::wiring;
use serde::Serialize;
use std::path::Path;
use uno::CYCLES_PER_SECOND;

/// Pulses of the measurement.
pub const PULSES: usize = 500;

/// How fast the encoder turns meanwhile.
pub const COUNTS_PER_S: u64 = 20_000;

/// The greatest less the least of [`PULSES`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Jitter {
    /// Jitter of the pulses' widths, in cycles.
    pub width_cycles: u64,
    /// Jitter of the frames, from rise to rise, in cycles.
    pub frame_cycles: u64,
    /// Pulses that were compared.
    pub pulses: usize,
    /// Mean cycles of an edge of the encoder meanwhile, with the entry and exit of its interrupt.
    pub edge_cycles: f64,
}

/// The vectors of the encoder's pins (data sheet, table 12-6): INT0 and INT1.
const ENCODER_VECTORS: [u8; 2] = [1, 2];

const FRAME_CYCLES: u64 = CYCLES_PER_SECOND / 50;

/// Measures the pulses of the firmware at `elf` in HOLD, while the encoder turns, the status streams and the beam flickers.
/// `progress` gets the share of the time that has passed, from 0 to 1.
///
/// # Errors
/// If the ELF cannot be run.
pub fn jitter(elf: &Path, mut progress: impl FnMut(f64)) -> Result<Jitter> {
    let mut uno = run::boot(elf, &[])?;
    uno.send(b"events on\n");
    uno.measure_interrupts();
    let begin = uno.cycle();
    let end = begin + (PULSES as u64 + 2) * FRAME_CYCLES;
    let step_cycles = CYCLES_PER_SECOND / COUNTS_PER_S;
    let turning = Turning { load: Load::Telemetry, direction: Direction::Forward, jitter: 0.0 };
    let counts = (end - begin) / step_cycles;
    uno.drive(edges(turning, step_cycles as f64, begin).take(counts as usize));
    uno.drive(flicker(begin, end));
    let mut telemetry = Telemetry::default();
    while uno.cycle() < end {
        let next = (uno.cycle() + FRAME_CYCLES).min(end);
        telemetry.run_until(&mut uno, next)?;
        progress((uno.cycle() - begin) as f64 / (end - begin) as f64);
    }

    let mut pulses = uno.pulses(wiring::SERVO);
    pulses.retain(|pulse| pulse.rise >= begin);
    pulses.truncate(PULSES);
    let widths = pulses.iter().map(|pulse| pulse.fall - pulse.rise);
    let frames = pulses.windows(2).map(|pair| pair[1].rise - pair[0].rise);
    let handlers = uno.interrupt_statistics().map(|statistics| &statistics.handlers);
    let encoder = ENCODER_VECTORS.iter().filter_map(|vector| handlers?.get(vector));
    let (count, total) = encoder.fold((0, 0), |sum, handler| (sum.0 + handler.count, sum.1 + handler.total));
    Ok(Jitter {
        width_cycles: spread(widths),
        frame_cycles: spread(frames),
        pulses: pulses.len(),
        edge_cycles: total as f64 / count as f64,
    })
}

/// The greatest value less the least; 0 without values.
fn spread(values: impl Iterator<Item = u64> + Clone) -> u64 {
    values.clone().max().unwrap_or(0) - values.min().unwrap_or(0)
}
