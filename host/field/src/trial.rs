//! A trial: all inputs of weeding a row, except the controller.
//!
//! The machine's motion does not depend on the firmware. So a trial is complete before it runs: row, machine, motion,
//! and the firmware's settings. The controller is the [native run](crate::native), one of its
//! [`baselines`](crate::baselines), or the real firmware, which is in another crate.

use crate::budget::Reason;
use crate::machine::Machine;
use crate::motion::Motion;
use crate::row::Row;
use crate::verdict::Timing;
use control::ground::features;
use control::settings::Setting;
use knn::Example;
use uno::Pulse;

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

/// The inputs of a trial.
#[derive(Clone, Debug)]
pub struct Trial {
    /// The row's plants and weeds.
    pub row: Row,
    /// The machine.
    pub machine: Machine,
    /// How it rolls.
    pub motion: Motion,
    /// The firmware's margin and leads.
    pub timing: Timing,
    /// How the firmware is put to work.
    pub start: Start,
    /// Further settings, applied after the settings of machine and timing.
    pub settings: Vec<(Setting, u16)>,
    /// Examples that are taught in addition to the built-in ones.
    pub examples: Vec<Example<{ features::COUNT }>>,
}

/// A controller's work on a trial's row.
#[derive(Clone, Debug, PartialEq)]
pub struct Weeded {
    /// The servo's pulses, the first of each width.
    pub pulses: Vec<Pulse>,
    /// The cycle at which the motion began.
    pub start_cycle: u64,
    /// Whether the firmware was not at work at the end.
    pub alarm: bool,
    /// Why the tool was in the row or out of it, from the beginning of the motion to its end.
    pub reasons: Vec<Reason>,
}

/// Distance that the machine rolls ahead of the row, to reach its speed and have the tool in the row.
pub(crate) fn run_up_mm(speed_mm_s: f64, acceleration_mm_s2: f64) -> f64 {
    const LEAST_MM: f64 = 200.0;
    const SWING_IN_S: f64 = 0.6;
    LEAST_MM + SWING_IN_S * speed_mm_s + speed_mm_s.powi(2) / (2.0 * acceleration_mm_s2)
}

/// How fast the machine gains its speed.
const ACCELERATION_MM_S2: f64 = 1000.0;

/// How fast it brakes at the end.
const BRAKING_MM_S2: f64 = 3000.0;

/// Distance that the tool rolls on behind the row.
const RUN_OUT_MM: f64 = 100.0;

/// The firmware's greatest top speed, 10.8 km/h. A machine is set to a quarter more than its speed, if the distance
/// from beam to tool allows it.
const TOP_SPEED_MM_S: f64 = 3000.0;

/// The firmware's least top speed. No setting contradicts it.
const SLOWEST_TOP_SPEED_MM_S: f64 = 100.0;

impl Trial {
    /// A trial of the whole row at one speed, from a standstill ahead of it until the tool has passed its end.
    pub fn at_speed(row: Row, machine: Machine, timing: Timing, speed_mm_s: f64) -> Self {
        let span = row.span_mm();
        let motion = Motion::steady(
            span.start - run_up_mm(speed_mm_s, ACCELERATION_MM_S2),
            ACCELERATION_MM_S2,
            speed_mm_s,
            span.end + machine.beam_to_tool_mm + RUN_OUT_MM,
        );
        // A real machine does not stop at once. To the firmware that would be a failed encoder.
        let motion = motion.change_speed(0.0, BRAKING_MM_S2);
        Self { row, machine, motion, timing, start: Start::Command, settings: Vec::new(), examples: Vec::new() }
    }

    /// The firmware's settings, in an order without intermediate contradictions.
    pub fn firmware_settings(&self) -> Vec<(Setting, u16)> {
        let Machine { wheel_mm, ticks_per_rev, beam_to_tool_mm, second_beam_mm, servo, .. } = self.machine;
        let Timing { margin_mm, lead_out_ms, lead_in_ms, .. } = self.timing;
        let notice_mm = beam_to_tool_mm - f64::from(margin_mm) - 2.0;
        // The firmware's own calculation: the lead, an eighth of it, and the sensor's response.
        let notice_s = f64::from(lead_out_ms) * 1.125e-3 + 0.002;
        let wanted_mm_s = (1.25 * self.motion.top_speed_mm_s()).max(SLOWEST_TOP_SPEED_MM_S);
        let top_speed_mm_s = wanted_mm_s.min(notice_mm / notice_s).min(TOP_SPEED_MM_S);
        let mut settings = vec![
            (Setting::TopSpeedMmS, SLOWEST_TOP_SPEED_MM_S as u16),
            (Setting::TicksPerRev, ticks_per_rev as u16),
            (Setting::WheelMm, wheel_mm.round() as u16),
            (Setting::BeamToToolMm, beam_to_tool_mm.round() as u16),
            (Setting::SecondBeamMm, second_beam_mm.round() as u16),
            (Setting::MarginMm, margin_mm as u16),
            (Setting::LeadOutMs, lead_out_ms as u16),
            (Setting::LeadInMs, lead_in_ms as u16),
            (Setting::ServoInUs, servo.in_us.round() as u16),
            (Setting::ServoOutUs, servo.out_us.round() as u16),
            (Setting::TopSpeedMmS, top_speed_mm_s as u16),
        ];
        settings.extend(&self.settings);
        settings
    }
}
