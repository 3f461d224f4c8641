//! Waveform files: the levels of the Uno's pins over time, as a VCD for PulseView or GTKWave.
//!
//! One file holds every wire by its name ([`Wire::name`]), inputs and outputs together. The time unit is 100 ps: a
//! cycle of 62.5 ns is exactly 625 units. So [`crate::capture`] reads back exactly the same cycles.

use std::io::{self, Write};

use vcd::{SimulationCommand, TimescaleUnit, Writer};

use crate::pins::{CYCLES_PER_SECOND, PinChange, Wire};

/// The file's unit of time: 100 ps.
const UNITS: (u32, TimescaleUnit) = (100, TimescaleUnit::PS);

/// Units of time a cycle.
const UNITS_PER_CYCLE: u64 = 10_000_000_000 / CYCLES_PER_SECOND;

/// Writes `changes`, in any order, as a VCD file. Each wire starts at rest. Changes on other pins are left out.
///
/// # Errors
///
/// The errors of the writer.
pub fn write(file: impl Write, wires: &[Wire], changes: impl IntoIterator<Item = PinChange>) -> io::Result<()> {
    let mut changes: Vec<PinChange> = changes.into_iter().collect();
    changes.sort_by_key(|change| change.cycle);
    let mut writer = Writer::new(file);
    writer.timescale(UNITS.0, UNITS.1)?;
    writer.add_module("uno")?;
    let mut codes = Vec::new();
    for wire in wires {
        codes.push((wire, writer.add_wire(1, wire.name)?));
    }
    writer.upscope()?;
    writer.enddefinitions()?;

    writer.timestamp(0)?;
    writer.begin(SimulationCommand::Dumpvars)?;
    for &(wire, code) in &codes {
        writer.change_scalar(code, wire.high_at_rest)?;
    }
    writer.end()?;

    let mut now = 0;
    for change in changes {
        if change.cycle != now {
            now = change.cycle;
            writer.timestamp(now * UNITS_PER_CYCLE)?;
        }
        for &(wire, code) in &codes {
            if wire.pin == change.pin {
                writer.change_scalar(code, change.high)?;
            }
        }
    }
    writer.flush()
}
