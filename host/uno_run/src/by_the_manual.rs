//! Sets up the simulated machine by the manual.
//!
//! [`Novice`] follows the steps of the manual's page on the machine of some conditions: it fits parts, sets values, and
//! measures. The firmware's own code times the servo by an end switch. The encoder measures the wheel over a stretch
//! with the field's slip, and a second beam measures the slip along a row. [`set_up`] calculates the margin.
//! Without its measurements the margin is not changed.

use anyhow::Result;
use control::operate::calibration::{Outcome, SWING_MS, SwingTimes, Swings};
use control::settings::{Setting, Settings};
use control::units::{Instant, Interval};
use field::conditions::Arm;
use field::conditions::Conditions;
use field::driving::{LEG_MM, drive};
use field::motion::{Motion, mm_s};
use field::native::{self, Sensors};
use field::stand::Stand;
use link::settings::name;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use set_up::{ManualStep, SetUp, Step, Task};
use uno::{CYCLES_PER_SECOND, Pulse};

/// Times that the manual has the servo timed and the wheel measured.
const TIMINGS: u64 = 2;
const STRETCHES: u64 = 3;

/// Speed at which stretches and rows are rolled along.
const SPEED_KM_H: f64 = 2.5;

/// Spacing of the plants along which a second beam measures the slip.
const SPACING_MM: f64 = 500.0;

/// A user who sets the simulated machine up, step by step.
#[derive(Clone, Debug)]
pub struct Novice {
    /// The machine and its settings, and the field around it.
    pub conditions: Conditions,
    measured: SetUp,
    /// Selects the random measurements.
    seed: u64,
}

impl Novice {
    /// A machine before any measurement.
    pub fn new(conditions: Conditions, seed: u64) -> Self {
        Self { conditions, measured: SetUp::default(), seed }
    }

    /// Does a step of the manual.
    ///
    /// # Errors
    /// Where the simulated field does not know what the step is about.
    pub fn follow(&mut self, step: &ManualStep) -> Result<()> {
        step.tasks.iter().try_for_each(|&task| self.follow_task(task))
    }

    fn follow_task(&mut self, task: Task) -> Result<()> {
        match task {
            Task::Fit(part, value) => self.conditions.set(part, value)?,
            Task::Set(setting, value) => self.set(setting, value)?,
            Task::TimeServo => {
                self.measured.settings = self.settings();
                for timing in 0..TIMINGS {
                    let Some(SwingTimes { out_ms, in_ms }) = self.time_servo(timing) else { continue };
                    self.measured.take_line(&format!("calibrated lead_out_ms={out_ms} lead_in_ms={in_ms} set=yes"));
                    self.set(Setting::LeadOutMs, out_ms)?;
                    self.set(Setting::LeadInMs, in_ms)?;
                }
                // The steps as the monitor shows them.
                for step in self.measured.missing(&self.settings()) {
                    if let Step::SetLead(lead, worst_ms) = step {
                        self.set(lead, worst_ms)?;
                    }
                }
            }
            Task::MeasureWheel(length_mm) => {
                for stretch in 0..STRETCHES {
                    let ticks_per_m = self.measure_wheel(length_mm, stretch);
                    self.measured.take_line(&format!("> calibrate {length_mm}"));
                    self.measured.take_line(&format!("{}={ticks_per_m}", name(Setting::TicksPerM)));
                    self.set(Setting::TicksPerM, ticks_per_m)?;
                }
            }
            Task::SetMargin => {
                for permille in self.pass_plants()? {
                    self.measured.take_line(&format!("slip permille={permille}"));
                }
                let (machine, crop) = (&self.conditions.machine, &self.conditions.crop);
                self.measured.stem_off_mm = crop.stem_off_mm + crop.sway_mm;
                self.measured.arm.blade_length_mm = machine.tool_length_mm;
                self.measured.trailing_tool_mm =
                    (machine.arm == Arm::Trailing).then_some(machine.tool_width_mm.ceil() as u16);
                if let Ok(margin) = self.measured.margin(&self.settings()) {
                    self.set(Setting::MarginMm, margin.least_mm())?;
                }
            }
        }
        Ok(())
    }

    fn set(&mut self, setting: Setting, value: u16) -> Result<()> {
        Ok(self.conditions.set(&name(setting), value.into())?)
    }

    /// The settings as they are.
    pub fn settings(&self) -> Settings {
        let mut settings = Settings::new();
        for (setting, &value) in &self.conditions.settings {
            if let Some(setting) = Setting::find(setting.as_bytes()) {
                // The conditions are within the ranges.
                let _ = settings.set(setting, value);
            }
        }
        settings
    }

    fn chance(&self, of: u64) -> ChaCha8Rng {
        let mut rng = ChaCha8Rng::seed_from_u64(self.seed);
        rng.set_stream(of);
        rng
    }

    /// The servo's times, as the firmware measures them by an end switch, with the tool in the soil.
    fn time_servo(&self, timing: u64) -> Option<SwingTimes> {
        let servo = self.conditions.machine(self.chance(timing).random()).servo;
        let cycle = |milliseconds: u32| u64::from(milliseconds) * (CYCLES_PER_SECOND / 1000);
        let pulse = |rise: u64, width_us: f64| Pulse { rise, fall: rise + cycle(1) * width_us as u64 / 1000 };
        let swing_ms = u32::from(SWING_MS);
        // The tool is out before the first swing, so that swing leads in.
        let swings = (0..12).map(|swing| {
            let width_us = if swing % 2 == 0 { servo.in_us } else { servo.out_us };
            pulse(cycle(swing_ms * (swing + 1)), width_us)
        });
        let pulses: Vec<Pulse> = [pulse(0, servo.out_us)].into_iter().chain(swings).collect();
        let stroke = servo.stroke(&servo.commands(&pulses), 0);
        let out_degrees = servo.stroke_degrees() - self.conditions.machine(0).clear_within_degrees;
        let now = |milliseconds: u32| Instant::new(0) + Interval::from_ms(milliseconds);
        let gap_ms = self.settings().get(Setting::ServoGapMs) as u8;
        let mut decided = Swings::new(now(0), true, gap_ms);
        let outcome = (0..).find_map(|milliseconds| {
            let is_out = stroke.degrees(f64::from(milliseconds) / 1000.0) >= out_degrees;
            decided.step(now(milliseconds), is_out)
        });
        match outcome {
            Some(Outcome::Measured(times)) => Some(times),
            _ => None,
        }
    }

    /// Encoder counts a metre, over a stretch of the field.
    fn measure_wheel(&self, length_mm: u16, stretch: u64) -> u16 {
        let mut rng = self.chance(TIMINGS + stretch);
        let length_mm = f64::from(length_mm);
        let mut motion = Motion::starting_at(0.0).change_speed(mm_s(SPEED_KM_H) / 2.0, 500.0);
        while motion.end_mm() + LEG_MM.end < length_mm {
            let leg_mm = rng.random_range(LEG_MM);
            motion = motion.clone().roll_to(motion.end_mm() + leg_mm);
        }
        let ground = &self.conditions.ground;
        let slip = ground.slip_scatter_percent;
        let motion = motion
            .stop_at(length_mm, 1000.0)
            .with_slip(|| (ground.slip_percent + slip * rng.random_range(-1.0..=1.0)) / 100.0);
        let ticks = self.conditions.machine(0).ticks(&motion, motion.duration_s());
        (ticks as f64 * 1000.0 / length_mm).round() as u16
    }

    /// The slip that a second beam tells along a row, plant by plant; none without one.
    fn pass_plants(&self) -> Result<Vec<i16>> {
        let conditions = &self.conditions;
        if conditions.machine.second_beam_mm == 0.0 {
            return Ok(Vec::new());
        }
        let mut rng = self.chance(TIMINGS + STRETCHES);
        let stand = Stand::grow(conditions, SPACING_MM, &mut rng)?;
        let driven = drive(conditions, &stand.span_mm, SPEED_KM_H, &mut rng);
        let pass = conditions.pass(stand.row, driven.motion, rng.random());
        Ok(native::slips_permille(&pass, &Sensors::new(&pass, native::TURN_S))?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use set_up::steps;

    fn after(steps: impl IntoIterator<Item = ManualStep>) -> Novice {
        let walked = Conditions::load(field::conditions::DEFAULT).expect("it is right");
        let mut novice = Novice::new(walked.from_the_box(), 1);
        steps.into_iter().for_each(|step| novice.follow(&step).expect("it can be done"));
        novice
    }

    #[test]
    fn a_servo_is_timed_as_long_as_its_stroke_takes() {
        let novice = after([]);
        // 50 to 80 ms of dead time, 120 to 144 ms for the stroke, 2 ms of pulse. The firmware adds up to 11 ms.
        for timing in 0..20 {
            let SwingTimes { out_ms, in_ms } = novice.time_servo(timing).expect("it follows");
            assert!((190..=237).contains(&out_ms) && (51..=93).contains(&in_ms), "{out_ms} {in_ms}");
        }
    }

    #[test]
    fn a_wheel_is_measured_with_its_slip() {
        let novice = after([]);
        for stretch in 0..20 {
            let ticks_per_m = novice.measure_wheel(10_000, stretch);
            // 1909.86 without slip.
            assert!((1950..=2075).contains(&ticks_per_m), "{ticks_per_m}");
        }
    }

    #[test]
    fn the_margin_is_lowered_once_everything_was_measured_and_not_before() {
        let steps = steps();
        let all = after(steps.clone());
        let margin_mm = all.settings().get(Setting::MarginMm);
        assert_eq!(margin_mm, 22, "{margin_mm}: {:?}", all.conditions.settings);
        for left_out in [Task::TimeServo, Task::MeasureWheel(10_000)] {
            let novice = after(steps.iter().filter(|step| !step.tasks.contains(&left_out)).cloned());
            assert_eq!(novice.settings().get(Setting::MarginMm), 50, "{left_out:?}");
        }
    }
}
