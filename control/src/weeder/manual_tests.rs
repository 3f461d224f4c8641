//! Manual tests: the servo driven directly, the servo's times, the wheel's ticks, and the swings of a row.

use super::Controller;
use crate::{
    ground::class::Classifier,
    measure::readings::Readings,
    memory::Memory,
    operate::{
        calibration::{Outcome, SwingTimes, Swings},
        command_error::CommandError,
        dry_run::DryRun,
        event::Event,
        manual_test::ManualTest,
        servo,
        state::State,
    },
    settings::Setting,
};

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Drives the servo directly. `pulse_us` is the pulse width in microseconds.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`], [`CommandError::Rolls`], and [`CommandError::OutOfRange`] for a
    /// width that no servo takes.
    #[inline(never)]
    pub fn servo_by_hand(&mut self, pulse_us: u16) -> Result<(), CommandError> {
        self.expect_rest()?;
        if !Setting::ServoOutUs.allows(pulse_us) {
            return Err(CommandError::OutOfRange);
        }
        self.manual_test = ManualTest::ByHand(servo::from_us(pulse_us));
        Ok(())
    }

    /// Drives the tool into the row.
    ///
    /// # Errors
    /// As [`servo_by_hand`](Self::servo_by_hand).
    pub fn servo_in(&mut self) -> Result<(), CommandError> {
        self.servo_by_hand(self.configuration.get(Setting::ServoInUs))
    }

    /// Ends the manual test: the tool leaves the row.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and [`CommandError::AlarmLatched`].
    pub fn servo_out(&mut self) -> Result<(), CommandError> {
        self.expect_hold()?;
        self.manual_test = ManualTest::Idle;
        Ok(())
    }

    /// Starts to time the servo. [`Event::Calibrated`] reports the result.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`] and [`CommandError::Rolls`].
    pub fn calibrate_servo(&mut self) -> Result<(), CommandError> {
        self.expect_rest()?;
        let watched = self.configuration.get(Setting::EndSwitch) != 0;
        let gap_ms = self.configuration.get(Setting::ServoGapMs);
        self.manual_test = ManualTest::Swings(Swings::new(self.sensors.readings.now, watched, gap_ms as u8));
        Ok(())
    }

    /// Starts to measure a distance from the machine's position.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`] and [`CommandError::Rolls`].
    pub fn calibrate_start(&mut self) -> Result<(), CommandError> {
        self.expect_rest()?;
        self.distance.begin(self.sensors.position);
        Ok(())
    }

    /// Sets the wheel's ticks a metre from the distance rolled since [`calibrate_start`](Self::calibrate_start).
    ///
    /// # Errors
    /// [`CommandError::Rolls`], and those of [`Distance::end`](crate::operate::calibration::Distance::end) and [`set`](Self::set).
    /// Nothing is changed then.
    pub fn calibrate(&mut self, distance_mm: u16, force: bool) -> Result<(), CommandError> {
        self.expect_standing()?;
        let nominal = self.configuration.settings().nominal_ticks_per_m();
        let counted = self.distance.end(self.sensors.position, distance_mm, nominal, force)?;
        self.set(Setting::TicksPerM, counted)
    }

    /// Swings the tool as for a row of plants, at a speed in mm/s.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`], [`CommandError::Rolls`], a
    /// [`Contradiction`](crate::settings::Contradiction), and [`CommandError::TestSpeed`] for a speed outside the machine's limits.
    pub fn test_row(&mut self, speed_mm_s: u16) -> Result<(), CommandError> {
        self.expect_rest()?;
        self.configuration.expect_no_contradiction()?;
        let fastest = self.configuration.get(Setting::TopSpeedMmS);
        if !(Setting::TopSpeedMmS.least()..=fastest).contains(&speed_mm_s) {
            return Err(CommandError::TestSpeed);
        }
        self.manual_test =
            ManualTest::Row(DryRun::new(self.sensors.readings.now, speed_mm_s, self.configuration.settings()));
        Ok(())
    }

    /// Takes the tool out and ends the loop's heartbeat, as if the loop had stopped: the watchdog resets the machine.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`] and [`CommandError::Rolls`].
    pub fn test_watchdog(&mut self) -> Result<(), CommandError> {
        self.expect_rest()?;
        (self.manual_test, self.tests_watchdog) = (ManualTest::Idle, true);
        Ok(())
    }

    /// Whether the loop has to beat. False from [`test_watchdog`](Self::test_watchdog) to the reset.
    pub const fn has_heartbeat(&self) -> bool {
        !self.tests_watchdog
    }

    /// Runs one step of the manual test. Returns whether the tool is to be out; `None` if the test does not decide that.
    pub(super) fn try_out(&mut self) -> Option<bool> {
        let Readings { now, end_switch_on, .. } = self.sensors.readings;
        let (out, outcome) = self.manual_test.carry_on(now, end_switch_on, self.tool.is_out());
        if let Some(outcome) = outcome {
            self.finish_swings(outcome);
        }
        out
    }

    /// Sets both leads from the measured times, or none if the settings do not allow one, and reports the result.
    fn finish_swings(&mut self, outcome: Outcome) {
        let fits = match outcome {
            Outcome::Measured(SwingTimes { out_ms, in_ms }) => {
                let before_ms = self.configuration.get(Setting::LeadInMs);
                let fits = self.set(Setting::LeadInMs, in_ms).is_ok() && self.set(Setting::LeadOutMs, out_ms).is_ok();
                if !fits {
                    let _ = self.set(Setting::LeadInMs, before_ms);
                }
                fits
            }
            _ => false,
        };
        self.events.announce(Event::Calibrated { outcome, fits });
    }

    /// In HOLD, tests swing the tool over ground that may have plants, and without a lead. So the machine must stand.
    #[inline(never)]
    fn expect_rest(&self) -> Result<(), CommandError> {
        self.expect_hold()?;
        self.expect_standing()
    }

    fn expect_standing(&self) -> Result<(), CommandError> {
        if self.sensors.encoder.stands() { Ok(()) } else { Err(CommandError::Rolls) }
    }

    #[inline(never)]
    fn expect_hold(&self) -> Result<(), CommandError> {
        match self.state {
            State::Hold => Ok(()),
            State::Work => Err(CommandError::NotInHold),
            State::Alarm(_) => Err(CommandError::AlarmLatched),
        }
    }
}
