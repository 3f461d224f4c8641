//! A trial: the real firmware in the virtual Uno weeds a row.
//!
//! The machine's motion does not depend on the firmware, so a trial runs in one direction: motion and row give the levels
//! on the firmware's inputs, the virtual Uno plays them, and its servo pulses tell what happened to the row
//! ([`crate::verdict`]). Before that the firmware is set up over its console, as an operator would: settings, then the
//! start.

use crate::console::{ConsoleError, Status, ask};
use crate::firmware::Size;
use crate::link::settings::{Setting, name};
use crate::machine::Machine;
use crate::motion::Motion;
use crate::report::counted;
use crate::row::Row;
use crate::servo::WIDTHS_US;
use crate::signal::{CYCLES_PER_SECOND, Pin, PinChange, Pulse};
use crate::uno::{Uno, UnoError};
use crate::verdict::{Judgement, Timing, judge};
use std::path::Path;
use thiserror::Error;

/// How the firmware is put to work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Start {
    /// By the command `start`: the tool enters the row when ground that the beam has seen reaches it.
    Command,
    /// By the command `start now`: the tool enters the row at once.
    Now,
    /// By the work switch, from high to low.
    Switch,
}

/// Everything that makes a trial.
#[derive(Clone, Debug)]
pub struct Trial {
    /// What stands in the row.
    pub row: Row,
    /// The machine.
    pub machine: Machine,
    /// How it rolls.
    pub motion: Motion,
    /// Margin and leads that the firmware is set to.
    pub timing: Timing,
    /// How the firmware is put to work.
    pub start: Start,
    /// What else the firmware is told, after the settings that follow from machine and timing.
    pub settings: Vec<(Setting, u16)>,
}

/// Why a trial had no outcome.
#[derive(Debug, Error)]
pub enum TrialError {
    /// The virtual Uno stopped.
    #[error(transparent)]
    Uno(#[from] UnoError),
    /// The firmware's console did not answer as it should.
    #[error(transparent)]
    Console(#[from] ConsoleError),
    /// The firmware started anew on the way.
    #[error("the firmware restarted {} during the trial, so that its position means nothing", counted(.0, "time"))]
    Restarted(usize),
}

/// What came of a trial.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// What happened to the row.
    pub judgement: Judgement,
    /// What the firmware said at the end.
    pub status: Status,
    /// Encoder counts, net, that a perfect counter would have at the end.
    pub true_ticks: i64,
    /// Memory that the firmware takes.
    pub size: Size,
    /// The servo's pulses.
    pub pulses: Vec<Pulse>,
    /// How many of them have no width that a servo knows.
    pub stray_pulses: usize,
    /// Every level on every pin, inputs first.
    pub changes: Vec<PinChange>,
    /// The cycle at which the motion began.
    pub start_cycle: u64,
}

/// Distance that the machine rolls ahead of the row, so that it has its speed and the tool is in the row when the row
/// begins; and the time in which it has to swing in, which adds to it at speed.
const RUN_UP_MM: f64 = 200.0;
const SWING_IN_S: f64 = 0.6;

/// How fast the machine gains its speed.
const ACCELERATION_MM_S2: f64 = 1000.0;

/// How fast it brakes at the end.
const BRAKING_MM_S2: f64 = 3000.0;

/// Distance that the tool rolls on behind the row.
const RUN_OUT_MM: f64 = 100.0;

/// Longest time that the firmware takes from power-up to its first line, a bootloader's wait included.
const BOOT_CYCLES: u64 = 3 * CYCLES_PER_SECOND;

/// Time for the firmware to see that a switch has stopped bouncing.
const SWITCH_MS: u64 = 100;

/// Time between the start and the first movement, and between the last one and the final question.
const STILL_MS: u64 = 50;

/// The highest top speed that the firmware takes, 10.8 km/h. A machine is set to a quarter more than it drives, as far as its
/// beam stands ahead for that.
const TOP_SPEED_MM_S: f64 = 3000.0;

/// The lowest that it takes: nothing contradicts it.
const SLOWEST_TOP_SPEED_MM_S: f64 = 100.0;

/// Simulated time between two reports of progress.
const PROGRESS_CYCLES: u64 = CYCLES_PER_SECOND / 20;

/// Powers up the firmware with these levels on its inputs, and waits for the line by which it says that it is there.
///
/// # Errors
/// Where the ELF cannot be run, or no line comes.
pub fn power_up(elf: &Path, levels: &[PinChange]) -> Result<Uno, UnoError> {
    let mut uno = Uno::boot(elf)?;
    for level in levels {
        uno.set(level.pin, level.high);
    }
    uno.run_until_serial("\n", BOOT_CYCLES)?;
    Ok(uno)
}

/// As [`power_up`], and clears the alarm by which the firmware says that its EEPROM holds no settings yet.
///
/// # Errors
/// As [`power_up`].
pub fn boot(elf: &Path, levels: &[PinChange]) -> Result<Uno, UnoError> {
    let mut uno = power_up(elf, levels)?;
    uno.send(b"clear\n");
    uno.run_until_serial("ok\r\n", BOOT_CYCLES)?;
    Ok(uno)
}

impl Trial {
    /// The whole row at one speed, from standstill far enough ahead until the tool has passed its end.
    pub fn at_speed(row: Row, machine: Machine, timing: Timing, speed_mm_s: f64) -> Self {
        let span = row.span_mm();
        let run_up_mm = RUN_UP_MM + SWING_IN_S * speed_mm_s + speed_mm_s.powi(2) / (2.0 * ACCELERATION_MM_S2);
        let motion = Motion::steady(
            span.start - run_up_mm,
            ACCELERATION_MM_S2,
            speed_mm_s,
            span.end + machine.beam_to_tool_mm + RUN_OUT_MM,
        );
        // No machine stops dead, and one that did would look like one whose encoder has failed.
        let motion = motion.change_speed(0.0, BRAKING_MM_S2);
        Self { row, machine, motion, timing, start: Start::Command, settings: Vec::new() }
    }

    /// Runs the firmware at `elf`. `progress` is told the share of the motion done, from 0 to 1.
    ///
    /// # Errors
    /// Where the firmware cannot be run or does not answer.
    pub fn run(&self, elf: &Path, mut progress: impl FnMut(f64)) -> Result<Outcome, TrialError> {
        let mut inputs = vec![self.machine.beam_before(&self.row, &self.motion)];
        let mut uno = boot(elf, &inputs)?;
        self.set_up(&mut uno)?;
        match self.start {
            Start::Command => {
                ask(&mut uno, "start")?;
            }
            Start::Now => {
                ask(&mut uno, "start now")?;
            }
            Start::Switch => {
                let work = PinChange { cycle: uno.cycle(), pin: Pin::WorkSwitch, high: false };
                inputs.push(work);
                uno.drive([work]);
                uno.run_for_ms(SWITCH_MS)?;
            }
        }
        uno.run_for_ms(STILL_MS)?;

        let start_cycle = uno.cycle();
        let rolling = self.machine.pin_changes(&self.row, &self.motion, start_cycle);
        uno.drive(rolling.iter().copied());
        inputs.extend(rolling);
        let cycles = (self.motion.duration_s() * CYCLES_PER_SECOND as f64) as u64;
        while uno.cycle() < start_cycle + cycles {
            let next = (uno.cycle() + PROGRESS_CYCLES).min(start_cycle + cycles);
            uno.run_until(next)?;
            progress((uno.cycle() - start_cycle) as f64 / cycles as f64);
        }
        uno.run_for_ms(STILL_MS)?;
        let status = Status::ask(&mut uno)?;
        if !uno.resets().is_empty() {
            return Err(TrialError::Restarted(uno.resets().len()));
        }

        let pulses = uno.servo_pulses();
        inputs.extend_from_slice(uno.changes());
        Ok(Outcome {
            judgement: judge(&self.row, &self.machine, &self.motion, self.timing, &pulses, start_cycle),
            status,
            true_ticks: self.machine.ticks(&self.motion, self.motion.duration_s()),
            size: uno.size(),
            stray_pulses: pulses.iter().filter(|pulse| !WIDTHS_US.contains(&pulse.width_us())).count(),
            pulses,
            changes: inputs,
            start_cycle,
        })
    }

    /// Tells the firmware what it has to know of machine and timing, by its settings.
    ///
    /// # Errors
    /// Where it refuses one of them, or does not answer.
    pub fn set_up(&self, uno: &mut Uno) -> Result<(), ConsoleError> {
        for (setting, value) in self.told() {
            ask(uno, &format!("set {} {value}", name(setting)))?;
        }
        Ok(())
    }

    /// All that the firmware is told, in an order in which machine and timing do not contradict each other on the way.
    pub fn told(&self) -> Vec<(Setting, u16)> {
        let Machine { wheel_mm, ticks_per_rev, beam_to_tool_mm, servo, .. } = self.machine;
        let Timing { margin_mm, lead_out_ms, lead_in_ms } = self.timing;
        let notice_mm = beam_to_tool_mm - f64::from(margin_mm) - 2.0;
        // As the firmware counts: the lead, an eighth of it, and what the sensor may take.
        let notice_s = f64::from(lead_out_ms) * 1.125e-3 + 0.002;
        let wanted_mm_s = (1.25 * self.motion.top_speed_mm_s()).max(SLOWEST_TOP_SPEED_MM_S);
        let top_speed_mm_s = wanted_mm_s.min(notice_mm / notice_s).min(TOP_SPEED_MM_S);
        let mut told = vec![
            (Setting::TopSpeedMmS, SLOWEST_TOP_SPEED_MM_S as u16),
            (Setting::TicksPerRev, ticks_per_rev as u16),
            (Setting::WheelMm, wheel_mm.round() as u16),
            (Setting::BeamToToolMm, beam_to_tool_mm.round() as u16),
            (Setting::MarginMm, margin_mm as u16),
            (Setting::LeadOutMs, lead_out_ms as u16),
            (Setting::LeadInMs, lead_in_ms as u16),
            (Setting::ServoInUs, servo.in_us.round() as u16),
            (Setting::ServoOutUs, servo.out_us.round() as u16),
            (Setting::TopSpeedMmS, top_speed_mm_s as u16),
        ];
        told.extend(&self.settings);
        told
    }
}
