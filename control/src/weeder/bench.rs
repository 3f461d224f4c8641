//! What the operator tries on the bench: the tool by hand, the servo's times, the wheel's ticks, and the swings of a row.

use super::Controller;
use crate::{
    ground::class::Classifier,
    measure::readings::Readings,
    memory::Memory,
    operate::{
        bench::Bench,
        calibration::{Outcome, SwingTimes, Swings},
        command_error::CommandError,
        dry_run::DryRun,
        event::Event,
        servo,
        state::State,
    },
    settings::Setting,
};

impl<C: Classifier, M: Memory> Controller<C, M> {
    /// Gives the servo a pulse by hand, in microseconds.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`], [`CommandError::Rolls`], and [`CommandError::OutOfRange`] for what is no servo's pulse.
    #[inline(never)]
    pub fn servo_by_hand(&mut self, pulse_us: u16) -> Result<(), CommandError> {
        self.expect_rest()?;
        if !Setting::ServoOutUs.allows(pulse_us) {
            return Err(CommandError::OutOfRange);
        }
        self.bench = Bench::ByHand(servo::from_us(pulse_us));
        Ok(())
    }

    /// Moves the tool into the row by hand.
    ///
    /// # Errors
    /// As [`servo_by_hand`](Self::servo_by_hand).
    pub fn servo_in(&mut self) -> Result<(), CommandError> {
        self.servo_by_hand(self.configuration.get(Setting::ServoInUs))
    }

    /// Ends what was tried: the tool goes out of the row.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and [`CommandError::AlarmLatched`].
    pub fn servo_out(&mut self) -> Result<(), CommandError> {
        self.expect_hold()?;
        self.bench = Bench::Idle;
        Ok(())
    }

    /// Begins to time the servo; an event tells how it ends.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`] and [`CommandError::Rolls`].
    pub fn calibrate_servo(&mut self) -> Result<(), CommandError> {
        self.expect_rest()?;
        let watched = self.configuration.get(Setting::EndSwitch) != 0;
        let gap_ms = self.configuration.get(Setting::ServoGapMs);
        self.bench = Bench::Swings(Swings::new(self.sensors.readings.now, watched, gap_ms as u8));
        Ok(())
    }

    /// Begins to measure a distance, from where the machine stands.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`] and [`CommandError::AlarmLatched`].
    pub fn calibrate_start(&mut self) -> Result<(), CommandError> {
        self.expect_hold()?;
        self.distance.begin(self.sensors.readings.position);
        Ok(())
    }

    /// Sets the wheel's ticks a metre by a distance that was rolled since [`calibrate_start`](Self::calibrate_start).
    ///
    /// # Errors
    /// Those of [`Distance::end`](crate::operate::calibration::Distance::end) and [`set`](Self::set); nothing is changed then.
    pub fn calibrate(&mut self, distance_mm: u16, force: bool) -> Result<(), CommandError> {
        let nominal = self.configuration.settings().nominal_ticks_per_m();
        let counted = self.distance.end(self.sensors.readings.position, distance_mm, nominal, force)?;
        self.set(Setting::TicksPerM, counted)
    }

    /// Swings the tool as for a row of plants, at a speed in mm/s.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`], [`CommandError::Rolls`], that of a
    /// [`Contradiction`](crate::settings::Contradiction), and [`CommandError::TestSpeed`] for what the machine would not work at.
    pub fn test_row(&mut self, speed_mm_s: u16) -> Result<(), CommandError> {
        self.expect_rest()?;
        self.configuration.expect_no_contradiction()?;
        let fastest = self.configuration.get(Setting::TopSpeedMmS);
        if !(Setting::TopSpeedMmS.least()..=fastest).contains(&speed_mm_s) {
            return Err(CommandError::TestSpeed);
        }
        self.bench = Bench::Row(DryRun::new(self.sensors.readings.now, speed_mm_s, self.configuration.settings()));
        Ok(())
    }

    /// Takes the tool out and ends the loop's heartbeat, as if the loop had stopped: the watchdog resets the machine.
    ///
    /// # Errors
    /// [`CommandError::NotInHold`], [`CommandError::AlarmLatched`] and [`CommandError::Rolls`].
    pub fn test_watchdog(&mut self) -> Result<(), CommandError> {
        self.expect_rest()?;
        (self.bench, self.tests_watchdog) = (Bench::Idle, true);
        Ok(())
    }

    /// Whether the loop is to show that it turns; not from [`test_watchdog`](Self::test_watchdog) to the reset.
    pub const fn has_heartbeat(&self) -> bool {
        !self.tests_watchdog
    }

    /// Carries on with what is being tried; whether it has the tool out, if it says.
    pub(super) fn try_out(&mut self) -> Option<bool> {
        let Readings { now, end_switch_on, .. } = self.sensors.readings;
        let (out, outcome) = self.bench.carry_on(now, end_switch_on, self.tool.is_out());
        if let Some(outcome) = outcome {
            self.finish_swings(outcome);
        }
        out
    }

    /// Sets the leads by what was measured, if they fit, and tells how it ended.
    fn finish_swings(&mut self, outcome: Outcome) {
        let fits = match outcome {
            Outcome::Measured(SwingTimes { out_ms, in_ms }) => self
                .configuration
                .change(&[(Setting::LeadOutMs, out_ms), (Setting::LeadInMs, in_ms)], self.is_working())
                .is_ok(),
            _ => false,
        };
        self.events.announce(Event::Calibrated { outcome, fits });
    }

    /// What moves the tool in hold swings it over ground that may have plants, and by no speed: it needs a machine that stands.
    #[inline(never)]
    fn expect_rest(&self) -> Result<(), CommandError> {
        self.expect_hold()?;
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
