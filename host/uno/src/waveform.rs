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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pins::Pin;

    #[test]
    fn a_cycle_is_a_whole_number_of_the_units() {
        assert_eq!(UNITS_PER_CYCLE * CYCLES_PER_SECOND, UNITS.1.divisor() / u64::from(UNITS.0));
    }

    #[test]
    fn the_file_says_each_pin_by_name_and_each_edge_once() {
        let mut file = Vec::new();
        let wires = [
            Wire { pin: Pin::D8, name: "button", high_at_rest: true },
            Wire { pin: Pin::D9, name: "servo", high_at_rest: false },
        ];
        let changes = [(8, true), (24_008, false)].map(|(cycle, high)| PinChange { cycle, pin: Pin::D9, high });
        write(&mut file, &wires, changes).unwrap();
        let file = String::from_utf8(file).unwrap();
        assert!(file.contains("$timescale 100 ps $end"), "{file}");
        for wire in wires {
            assert!(file.contains(&format!(" {} $end", wire.name)), "{file}");
        }
        assert!(file.ends_with("#5000\n1\"\n#15005000\n0\"\n"), "{file}");
    }
}
