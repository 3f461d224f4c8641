//! A row: the real firmware in the virtual Uno weeds it.
//!
//! The machine's motion does not depend on the firmware. So a [`Pass`] runs in one direction. Motion and row give the
//! levels on the firmware's inputs, and the virtual Uno plays them. Its servo pulses give the result for the row
//! ([`field::verdict`]). Before that, the firmware is set up over its console as by an operator: settings, then the
//! start.

use crate::console::{ConsoleError, Status, ask};
use field::counted;
use field::pass::{Pass, Start};
use field::servo::WIDTHS_US;
use field::verdict::{Judgement, judge};
use field::wiring;
use link::examples;
use link::settings::name;
use std::path::Path;
use thiserror::Error;
use uno::elf::Size;
use uno::{CYCLES_PER_SECOND, PinChange, Pulse, Uno, UnoError};

/// Why a pass had no outcome.
#[derive(Debug, Error)]
#[expect(missing_docs, reason = "the messages say what each means")]
pub enum PassError {
    #[error(transparent)]
    Uno(#[from] UnoError),
    #[error(transparent)]
    Console(#[from] ConsoleError),
    #[error("the firmware restarted {} during the pass, so its position is invalid", counted(.0, "time"))]
    Restarted(usize),
}

/// The outcome of a pass.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The result for the row.
    pub judgement: Judgement,
    /// The firmware's last status.
    pub status: Status,
    /// Net encoder counts of a perfect counter at the end.
    pub true_ticks: i64,
    /// Memory that the firmware takes.
    pub size: Size,
    /// The servo's pulses.
    pub pulses: Vec<Pulse>,
    /// Pulses with a width that no servo accepts.
    pub stray_pulses: usize,
    /// Every level on every pin, inputs first.
    pub changes: Vec<PinChange>,
    /// The cycle at which the motion began.
    pub start_cycle: u64,
}

/// Longest time that the firmware takes from power-up to its first line, a bootloader's wait included.
const BOOT_CYCLES: u64 = 3 * CYCLES_PER_SECOND;

/// Time for the firmware to see that a switch has stopped bouncing.
const SWITCH_MS: u64 = 100;

/// Time between the start and the first movement, and between the last movement and the final question.
const STILL_MS: u64 = 50;

/// Simulated time between two reports of progress.
pub(crate) const PROGRESS_CYCLES: u64 = CYCLES_PER_SECOND / 20;

/// Powers up the firmware with these levels on its inputs, and waits for its greeting.
///
/// # Errors
/// If the ELF cannot be run, or no greeting comes.
pub fn power_up(elf: &Path, levels: &[PinChange]) -> Result<Uno, UnoError> {
    let mut uno = Uno::boot(elf)?.wired(&wiring::WIRES);
    for level in levels {
        uno.set(level.pin, level.high);
    }
    uno.run_until_serial("\n", BOOT_CYCLES)?;
    Ok(uno)
}

/// As [`power_up`], and then clears the alarm for an EEPROM without settings.
///
/// # Errors
/// As [`power_up`].
pub fn boot(elf: &Path, levels: &[PinChange]) -> Result<Uno, UnoError> {
    let mut uno = power_up(elf, levels)?;
    uno.send(b"clear\n");
    uno.run_until_serial("ok\r\n", BOOT_CYCLES)?;
    Ok(uno)
}

/// Weeds a pass's row with the firmware at `elf`. `progress` gets the share of the motion done, from 0 to 1.
///
/// # Errors
/// If the firmware cannot be run or does not answer.
pub fn run(pass: &Pass, elf: &Path, mut progress: impl FnMut(f64)) -> Result<Outcome, PassError> {
    let Pass { row, machine, motion, .. } = pass;
    let mut inputs = machine.beams_before(row, motion);
    let mut uno = boot(elf, &inputs)?;
    set_up(pass, &mut uno)?;
    match pass.start {
        Start::Command => drop(ask(&mut uno, "start")?),
        Start::Now => drop(ask(&mut uno, "start now")?),
        Start::Switch => {
            let work = PinChange { cycle: uno.cycle(), pin: wiring::WORK_SWITCH, high: false };
            inputs.push(work);
            uno.drive([work]);
            uno.run_for_ms(SWITCH_MS)?;
        }
    }
    uno.run_for_ms(STILL_MS)?;

    let start_cycle = uno.cycle();
    let rolling = machine.pin_changes(row, motion, start_cycle);
    uno.drive(rolling.iter().copied());
    inputs.extend(rolling);
    let cycles = (motion.duration_s() * CYCLES_PER_SECOND as f64) as u64;
    while uno.cycle() < start_cycle + cycles {
        let next = (uno.cycle() + PROGRESS_CYCLES).min(start_cycle + cycles);
        uno.run_until(next)?;
        progress((uno.cycle() - start_cycle) as f64 / cycles as f64);
    }
    uno.run_for_ms(STILL_MS)?;
    let status = Status::ask(&mut uno)?;
    if !uno.resets().is_empty() {
        return Err(PassError::Restarted(uno.resets().len()));
    }

    let pulses = uno.pulses(wiring::SERVO);
    inputs.extend_from_slice(uno.changes());
    Ok(Outcome {
        judgement: judge(row, machine, motion, pass.timing, &pulses, start_cycle),
        status,
        true_ticks: machine.ticks(motion, motion.duration_s()),
        size: uno.size(),
        stray_pulses: pulses.iter().filter(|pulse| !WIDTHS_US.contains(&pulse.width_us())).count(),
        pulses,
        changes: inputs,
        start_cycle,
    })
}

/// Sets the firmware's settings for machine and timing, and teaches the crop's examples.
///
/// # Errors
/// If it refuses a setting or an example, or does not answer.
pub fn set_up(pass: &Pass, uno: &mut Uno) -> Result<(), ConsoleError> {
    for (setting, value) in pass.firmware_settings() {
        ask(uno, &format!("set {} {value}", name(setting)))?;
    }
    for line in pass.examples.iter().flat_map(examples::lines) {
        ask(uno, &line)?;
    }
    Ok(())
}
